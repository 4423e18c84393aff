"""Mouse and keys of the touch window: what they do to the tip, the inclusion, the session and the view."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from vtkmodules.vtkInteractionStyle import vtkInteractorStyleTrackballCamera
from vtkmodules.vtkRenderingCore import vtkRenderer

from palpate.scenes.phantoms import Region
from palpate.window.keys import KEYS
from palpate.window.session import MODULUS_STEP

if TYPE_CHECKING:
    from palpate.window.window import TouchWindow

INCLUSION_RADIUS_M = 0.008
INCLUSION_RATIO = 8.0
STEP_M = 0.002
MOVES = {
    "Left": (-1, 0, 0),
    "Right": (1, 0, 0),
    "Up": (0, 1, 0),
    "Down": (0, -1, 0),
    "Prior": (0, 0, 1),
    "Next": (0, 0, -1),
}
"""Key symbols that move the inclusion, in steps along the scene's axes."""
NAMES = {
    "equal": "plus",
    "KP_Add": "plus",
    "KP_Subtract": "minus",
    "Home": "v",
    "question": "h",
    "KP_Enter": "Return",
}
"""Key symbols that do what another does."""


class Controls:
    """Listens to a window's interactor; every method may also be called by a script."""

    def __init__(self, window: TouchWindow) -> None:
        self._window = window
        self._session = window.session
        self._dragged: tuple[np.ndarray, np.ndarray] | None = None
        self._viewed: tuple[Callable[[float, float], None], int, int] | None = None
        plotter = window.plotter
        iren = plotter.iren
        assert iren is not None, "pyvista makes an interactor with its plotter"
        self.interactor = iren.interactor
        self._style = vtkInteractorStyleTrackballCamera()
        # two quick presses would give the mouse to a chart, and pyvista's keys change the picture
        iren.untrack_click_position("left")
        iren.clear_key_event_callbacks()
        # through pyvista, which sets what it knows of again when the window is shown
        iren.style = self._style
        # an observer on the style replaces what the style would do with that event
        for event, action in (
            ("LeftButtonPressEvent", lambda *_: self._left(True)),
            ("LeftButtonReleaseEvent", lambda *_: self._left(False)),
            ("MiddleButtonPressEvent", lambda *_: self.grab()),
            ("MiddleButtonReleaseEvent", lambda *_: self.let_go()),
            ("RightButtonPressEvent", lambda *_: self._view(True)),
            ("RightButtonReleaseEvent", lambda *_: self._view(False)),
            ("MouseWheelForwardEvent", lambda *_: self.wheel(1)),
            ("MouseWheelBackwardEvent", lambda *_: self.wheel(-1)),
            ("MouseMoveEvent", lambda *_: self._moved()),
            ("CharEvent", lambda *_: None),
            ("KeyPressEvent", lambda *_: self.key(self.interactor.GetKeySym())),
        ):
            self._style.AddObserver(event, action)

    def _left(self, down: bool) -> None:
        boards, at = self._window.boards, self.interactor.GetEventPosition()
        if any(board.press(*at) if down else board.release() for board in boards):
            return
        if down and self.interactor.GetShiftKey():
            self.grab()
        elif not down and self._dragged is not None:
            self.let_go()
        else:
            self.press(down)

    def press(self, on: bool) -> None:
        """The tip goes in, or comes out again."""
        self._window.pointer.pressing = on

    def _view(self, on: bool) -> None:
        """The right button turns the view, with Shift it moves it."""
        orbit = self._window.orbit
        move = orbit.pan if self.interactor.GetShiftKey() else orbit.turn
        self._viewed = (move, *self.interactor.GetEventPosition()) if on else None

    def _moved(self) -> None:
        x, y = self.interactor.GetEventPosition()
        for board in self._window.boards:
            if board.drag(x):
                return
            board.hover(x, y)
        if self._dragged is not None:
            self._drag(x, y)
        elif self._viewed is not None:
            move, last_x, last_y = self._viewed
            height = self._window.plotter.window_size[1]
            move((x - last_x) / height, (y - last_y) / height)
            self._viewed = move, x, y
        else:
            self.point(x, y)

    def point(self, x: int, y: int) -> None:
        """The mouse is over pixel (x, y), counted from the lower left."""
        renderer = self._under(x, y)
        if renderer is not None:
            eye = np.array(renderer.GetActiveCamera().GetPosition())
            self._window.pointer.point_along(eye, unproject(renderer, x, y, 1.0))

    def _under(self, x: int, y: int) -> vtkRenderer | None:
        pictures = self._window.picture_renderers
        return next((renderer for renderer in pictures if renderer.IsInViewport(x, y)), None)

    def wheel(self, steps: int) -> None:
        """Nearer or farther; with Ctrl or while pressing: how deep; with a ball in hand: its distance."""
        if self.interactor.GetControlKey() or self._window.pointer.pressing:
            self._window.pointer.deeper(steps)
        elif self._dragged is not None:
            away = np.array(self._window.plotter.camera.direction)
            centre, start = self._dragged
            self._dragged = centre + steps * STEP_M * away, start
            self._drag(*self.interactor.GetEventPosition())
        else:
            self._window.orbit.zoom(steps)

    def grab(self) -> None:
        """Take the inclusion in hand: the mouse drags it in a plane parallel to the picture."""
        region = self._session.inclusion
        renderer = self._under(*self.interactor.GetEventPosition())
        if region is None or renderer is None:
            return
        centre = np.array(region.centre_m)
        self._dragged = centre, self._in_plane(renderer, centre, *self.interactor.GetEventPosition())

    def let_go(self) -> None:
        """Leave the inclusion where it is."""
        self._dragged = None

    def _in_plane(self, renderer: vtkRenderer, centre: np.ndarray, x: int, y: int) -> np.ndarray:
        """(3,) m, the point under a pixel as far from the eye as `centre`."""
        renderer.SetWorldPoint(*_triple(centre), 1.0)
        renderer.WorldToDisplay()
        return unproject(renderer, x, y, renderer.GetDisplayPoint()[2])

    def _drag(self, x: int, y: int) -> None:
        renderer = self._under(x, y)
        region = self._session.inclusion
        if renderer is None or region is None or self._dragged is None:
            return
        centre, start = self._dragged
        self._move_to(centre + self._in_plane(renderer, centre, x, y) - start)

    def key(self, symbol: str) -> None:
        """A key by VTK's symbol; see palpate.window.keys."""
        if symbol in MOVES:
            region = self._session.inclusion
            if region is not None and "arrows" in self.offered:
                self._move_to(np.array(region.centre_m) + STEP_M * np.array(MOVES[symbol]))
        else:
            self.do(NAMES.get(symbol, symbol))

    def do(self, name: str) -> None:
        """What a key of palpate.window.keys does, where it does something now."""
        if name in self.offered:
            self._actions()[name]()

    def _move_to(self, centre: np.ndarray) -> None:
        """The ball, but never out of the object, where nobody would see or feel it."""
        region = self._session.inclusion
        if region is not None:
            inside = self._window.pointer.inside(centre, 0.5 * region.radius_m)
            self._session.place_inclusion(replace(region, centre_m=_triple(inside)))

    @property
    def offered(self) -> frozenset[str]:
        """Which of palpate.window.keys do something now."""
        session = self._session
        missing = {
            "space": session.has_force,
            "f": session.feels_inside,
            "i": session.feels_inside and self._window.game is None and not self._window.guided,
            "arrows": session.inclusion is not None and self._window.game is None,
            "Return": self._window.game is not None and not self._window.guided,
            "Escape": bool(self._window.aside),
            "c": self._window.game is None or self._window.game.answered,  # a map would show the nodule
        }
        return frozenset(key for key in KEYS if missing.get(key, True))

    def _actions(self) -> dict[str, Callable[[], object]]:
        session, window = self._session, self._window
        return {
            "space": session.toggle_force,
            "Tab": session.next_renderer,
            "b": session.toggle_beside,
            "plus": lambda: session.scale_modulus(MODULUS_STEP),
            "minus": lambda: session.scale_modulus(1.0 / MODULUS_STEP),
            "bracketleft": lambda: window.pointer.deeper(-1),
            "bracketright": lambda: window.pointer.deeper(1),
            "v": window.orbit.reset,
            "Return": window.answer,
            "f": session.next_friction,
            "c": window.toggle_colour,
            "i": self._toggle_inclusion,
            "r": self._toggle_recording,
            "p": self._save_picture,
            "Escape": lambda: window.show_aside(window.aside),
            "h": lambda: window.show_aside("h"),
            "m": self._toggle_more,
            "s": lambda: window.show_aside("s"),
            "g": lambda: window.close(scenes=True),
            "q": window.close,
        }

    def _toggle_inclusion(self) -> None:
        if self._session.inclusion is not None:
            self._dragged = None
            self._session.place_inclusion(None)
            return
        centre, radius = self._window.pointer.under(INCLUSION_RADIUS_M)
        self._session.place_inclusion(Region("inclusion", _triple(centre), radius, INCLUSION_RATIO))

    def _toggle_recording(self) -> None:
        if self._session.recording is not None:
            self._window.notice = f"wrote {self._session.end_recording()}"
        else:
            self._session.begin_recording(Path(f"{_stamp()}.csv.gz"))

    def _toggle_more(self) -> None:
        self._window.more = not self._window.more

    def _save_picture(self) -> None:
        path = f"{_stamp()}.png"
        self._window.plotter.screenshot(path)
        self._window.notice = f"saved {path}"


def _stamp() -> str:
    return f"touch-{time.strftime('%Y%m%d-%H%M%S')}"


def unproject(renderer: vtkRenderer, x: int, y: int, depth: float) -> np.ndarray:
    """(3,) m, the scene's point under a pixel; depth 0 at the near plane, 1 at the far one."""
    renderer.SetDisplayPoint(x, y, depth)
    renderer.DisplayToWorld()
    point = np.array(renderer.GetWorldPoint())
    return point[:3] / point[3]


def _triple(point: np.ndarray) -> tuple[float, float, float]:
    x, y, z = map(float, point)
    return x, y, z
