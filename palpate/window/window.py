"""The touch window: pictures side by side, live plots below, a mouse that is a tip, keys.

One timer drives everything: `tick` writes the mouse's pose for the servo process, reads its newest state,
moves what is drawn. The servo never waits for a picture.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyvista
import vtk

from devices.channel import PoseChannel
from palpate.window.charts import LiveCharts
from palpate.window.keys import help_text
from palpate.window.picture import ObjectPicture, local_stiffness
from palpate.window.pointer import Pointer
from palpate.window.session import MODULUS_STEP, Frame, TouchSession
from scenes.phantoms import Region
from scenes.scene import Scene

PERIOD_MS = 16
SIZE = (1280, 800)
INCLUSION_RADIUS_M = 0.008
INCLUSION_RATIO = 8.0
STEP_M = 0.002
BESIDES = ("hunt-crossley", "kelvin-voigt")


class TouchWindow:
    """Draws a started session. channel: where the mouse's pose goes, None where another device moves."""

    def __init__(
        self,
        session: TouchSession,
        scene: Scene,
        channel: PoseChannel | None,
        *,
        off_screen: bool = False,
        size: tuple[int, int] = SIZE,
    ) -> None:
        self.session = session
        self.scene = scene
        self.frames = 0
        self.closed = False
        self._ended = False
        self._channel = channel
        self._colour = scene.colour
        self._moved = False
        self._last_s = time.perf_counter()
        self._end_s = float("inf")
        self.plotter = pyvista.Plotter(
            off_screen=off_screen,
            window_size=list(size),
            shape=(2, 2),
            row_weights=[0.72, 0.28],
            groups=[(1, slice(None))] if self._sides == 2 else [(0, slice(None)), (1, slice(None))],
            title=f"Palpate: {scene.title}",
            border=False,
        )
        self.plotter.set_background("#f4f6f8", all_renderers=True)
        # smoothing edges costs more than all the rest where there is no graphics card
        self.plotter.render_window.SetMultiSamples(0)
        self._pictures = [self._picture(side) for side in range(self._sides)]
        self.plotter.subplot(1, 0)
        self._charts = LiveCharts(self.plotter, session.trace.seconds, self._names)
        self.plotter.subplot(0, 0)
        self._status = self._text("", (0.01, 0.985), "top")
        self._help = self._text(help_text(), (0.01, 0.02), "bottom", font="courier")
        self._help.SetVisibility(False)
        points, triangles = self._pictures[0].rest_surface
        model = session.model
        radius = session.servo.tip_radius_m
        self.pointer = Pointer(points, triangles, radius, model.support_point, model.support_normal)
        self._look()
        self._listen()
        if self._colour == "stiffness":
            self._show_stiffness()

    @property
    def _sides(self) -> int:
        return 2 if self.session.beside_name else 1

    @property
    def _names(self) -> tuple[str, ...]:
        beside = self.session.beside_name
        return (self.session.renderer_name, beside) if beside else (self.session.renderer_name,)

    def _text(
        self, text: str, place: tuple[float, float], anchor: str, *, size: int = 12, font: str = "arial"
    ) -> pyvista.Text:
        """Text in the active subplot; place: shares of its width and height."""
        actor = pyvista.Text(text)
        actor.prop.color, actor.prop.font_size, actor.prop.font_family = "black", size, font
        actor.GetPositionCoordinate().SetCoordinateSystemToNormalizedViewport()
        actor.SetPosition(*place)
        actor.prop.justification_vertical = anchor
        self.plotter.add_actor(actor, reset_camera=False)
        return actor

    def _picture(self, side: int) -> ObjectPicture:
        self.plotter.subplot(0, side)
        name = self._names[side]
        if self._sides == 2:
            self._text(name, (0.80, 0.985), "top", size=15)
        session = self.session
        return ObjectPicture(
            self.plotter,
            session.drawing(name),
            session.model,
            session.servo.tip_radius_m,
            place=(0, side),
            label=name if side else "",
        )

    def _look(self) -> None:
        """From the person's side, a little above; both pictures share the camera."""
        model = self.session.model
        up = model.support_normal
        away = np.cross(up, [1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.cross(up, [0.0, 1.0, 0.0])
        away /= np.linalg.norm(away)
        middle = 0.5 * (model.mesh.points.min(axis=0) + model.mesh.points.max(axis=0))
        distance = 2.1 * np.linalg.norm(np.ptp(model.mesh.points, axis=0))
        eye = middle + distance * (-0.8 * away + 0.6 * up)
        self.plotter.subplot(0, 0)
        self.plotter.camera_position = [tuple(eye), tuple(middle), tuple(up)]
        self.plotter.camera.clipping_range = (0.05 * distance, 5.0 * distance)
        if self._sides == 2:
            self.plotter.renderers[1].camera = self.plotter.renderers[0].camera

    def _listen(self) -> None:
        style = vtk.vtkInteractorStyleTrackballCamera()
        interactor = self.plotter.iren.interactor
        # two quick presses would give the mouse to a chart, and pyvista's keys change the picture
        self.plotter.iren.untrack_click_position("left")
        self.plotter.iren.clear_key_event_callbacks()
        # through pyvista, which sets what it knows of again when the window is shown
        self.plotter.iren.style = style
        self._style, self._interactor = style, interactor
        # an observer on the style replaces what the style would do with that event
        for event, action in (
            ("LeftButtonPressEvent", lambda *_: self.press(True)),
            ("LeftButtonReleaseEvent", lambda *_: self.press(False)),
            ("RightButtonPressEvent", lambda *_: self._turn(True)),
            ("RightButtonReleaseEvent", lambda *_: self._turn(False)),
            ("MouseWheelForwardEvent", lambda *_: self.wheel(1)),
            ("MouseWheelBackwardEvent", lambda *_: self.wheel(-1)),
            ("MouseMoveEvent", lambda *_: self._mouse_moved()),
            ("CharEvent", lambda *_: None),
            ("KeyPressEvent", lambda *_: self.key(interactor.GetKeySym())),
        ):
            style.AddObserver(event, action)

    def _turn(self, on: bool) -> None:
        self._style.FindPokedRenderer(*self._interactor.GetEventPosition())
        (self._style.StartRotate if on else self._style.EndRotate)()

    def _mouse_moved(self) -> None:
        self.point(*self._interactor.GetEventPosition())
        self._style.OnMouseMove()

    def point(self, x: int, y: int) -> None:
        """The mouse is over pixel (x, y), counted from the lower left."""
        for side in range(self._sides):
            renderer = self.plotter.renderers[side]
            if renderer.IsInViewport(x, y):
                self.pointer.point_along(_unproject(renderer, x, y, 0.0), _unproject(renderer, x, y, 1.0))
                self._moved = True
                return

    def press(self, on: bool) -> None:
        """The left button went down or up."""
        self.pointer.pressing = on

    def wheel(self, steps: int) -> None:
        """Depth of a press; with Ctrl held, the distance of the eye."""
        if self._interactor.GetControlKey():
            self.plotter.camera.Dolly(1.1**steps)
            return
        self.pointer.deeper(steps)

    def key(self, symbol: str) -> None:
        """A key by VTK's symbol; see palpate.window.keys."""
        session = self.session
        actions = {
            "space": session.toggle_force,
            "Tab": session.next_renderer,
            "b": self._next_beside,
            "plus": lambda: session.scale_modulus(MODULUS_STEP),
            "equal": lambda: session.scale_modulus(MODULUS_STEP),
            "KP_Add": lambda: session.scale_modulus(MODULUS_STEP),
            "minus": lambda: session.scale_modulus(1 / MODULUS_STEP),
            "KP_Subtract": lambda: session.scale_modulus(1 / MODULUS_STEP),
            "f": session.next_friction,
            "c": self._toggle_colour,
            "i": self._toggle_inclusion,
            "r": self._toggle_recording,
            "p": self._save_picture,
            "h": lambda: self._help.SetVisibility(not self._help.GetVisibility()),
            "q": self.close,
            "Escape": self.close,
        }
        moves = {
            "Left": (-1, 0, 0),
            "Right": (1, 0, 0),
            "Up": (0, 1, 0),
            "Down": (0, -1, 0),
            "Prior": (0, 0, 1),
            "Next": (0, 0, -1),
        }
        if symbol in actions:
            actions[symbol]()
        elif symbol in moves and session.inclusion is not None:
            step = STEP_M * np.array(moves[symbol], dtype=float)
            centre = tuple(np.array(session.inclusion.centre_m) + step)
            self._set_inclusion(replace(session.inclusion, centre_m=centre))

    def _next_beside(self) -> None:
        if self._sides == 2:  # the layout stays as it began
            now = self.session.beside_name
            self.session.set_beside(BESIDES[(BESIDES.index(now) + 1) % 2] if now in BESIDES else BESIDES[0])

    def _toggle_colour(self) -> None:
        self._colour = "displacement" if self._colour == "stiffness" else "stiffness"
        if self._colour == "stiffness":
            self._show_stiffness()
        else:
            for picture in self._pictures:
                picture.colour_by("displacement")

    def _show_stiffness(self) -> None:
        """Press every place of the renderers' surfaces, once; takes about a second."""
        radius = self.session.servo.tip_radius_m
        for picture, name in zip(self._pictures, self._names, strict=True):
            picture.colour_by("stiffness", local_stiffness(self.session.drawing(name), radius))

    def _toggle_inclusion(self) -> None:
        if self.session.inclusion is not None:
            self._set_inclusion(None)
            return
        target = self.pointer.target
        normal = self.session.model.support_normal if target is None else target.normal
        point = self.pointer.tip_m if target is None else target.point
        centre = point - 2.0 * INCLUSION_RADIUS_M * normal
        self._set_inclusion(
            Region("inclusion", tuple(map(float, centre)), INCLUSION_RADIUS_M, INCLUSION_RATIO)
        )

    def _set_inclusion(self, region: Region | None) -> None:
        self.session.place_inclusion(region)
        for picture in self._pictures:
            picture.show_inclusion(region)

    def _toggle_recording(self) -> None:
        session = self.session
        if session.recording:
            session.end_recording()
        else:
            name = f"touch-{time.strftime('%Y%m%d-%H%M%S')}.csv.gz"
            session.begin_recording(Path(name))

    def _save_picture(self) -> None:
        self.plotter.screenshot(f"touch-{time.strftime('%Y%m%d-%H%M%S')}.png")

    def tick(self) -> Frame | None:
        """One frame: pose out, state in, pictures moved. Returns what was drawn."""
        now = time.perf_counter()
        if self._channel is not None:
            place = self.pointer.place(min(now - self._last_s, 0.1))
            self._channel.write(now, tuple(place), int(self.pointer.pressing))
        self._last_s = now
        frame = self.session.frame()
        if frame is not None:
            for picture, view in zip(self._pictures, frame.views, strict=False):
                picture.update(frame, view)
            self._charts.update(self.session.trace)
            self._status.input = self._words(frame)
            self.frames += 1
        if now > self._end_s or not self.session.servo.alive:
            self.close()
        return frame

    def _words(self, frame: Frame) -> str:
        session = self.session
        sizes = "   ".join(f"{v.name} {np.linalg.norm(v.force_n):.2f} N" for v in frame.views)
        friction = "sticks" if session.friction in (None, float("inf")) else f"friction {session.friction:g}"
        lines = [
            f"{self.scene.title}   {session.young_modulus_pa / 1000:.1f} kPa, {friction}",
            f"{sizes}   depth {1000 * frame.depth_m:.1f} mm   {frame.stiffness_n_per_m:.0f} N/m here",
            f"press {1000 * self.pointer.press_depth_m:.1f} mm   H: keys" if self._channel else "H: keys",
        ]
        if frame.recorded_s is not None:
            around = f", base traced {100 * session.traced:.0f} %"
            lines.append(f"recording {frame.recorded_s:.0f} s{around}")
        lines += [word for word in (frame.busy, frame.reason) if word]
        return "\n".join(lines)

    def run(self, seconds: float | None = None, *, screenshot: Path | None = None) -> None:
        """Show until closed or the time is up."""
        self._end_s = time.perf_counter() + seconds if seconds else float("inf")
        interactor = self._interactor
        self.plotter.show(interactive_update=True, auto_close=False)
        interactor.AddObserver("TimerEvent", lambda *_: self._timed(screenshot))
        interactor.CreateRepeatingTimer(PERIOD_MS)
        interactor.AddObserver("ExitEvent", lambda *_: self.close())
        interactor.Start()
        self.plotter.close()

    def _timed(self, screenshot: Path | None) -> None:
        if self._ended:
            return
        self.tick()
        self.plotter.render()
        if self.closed:
            self._ended = True
            if screenshot is not None:
                self.plotter.screenshot(str(screenshot))
            self._interactor.TerminateApp()

    def close(self) -> None:
        """End `run` at the next frame."""
        self.closed = True


def _unproject(renderer: vtk.vtkRenderer, x: int, y: int, depth: float) -> np.ndarray:
    """(3,) m, the scene's point under a pixel; depth 0 at the near plane, 1 at the far one."""
    renderer.SetDisplayPoint(x, y, depth)
    renderer.DisplayToWorld()
    point = np.array(renderer.GetWorldPoint())
    return point[:3] / point[3]
