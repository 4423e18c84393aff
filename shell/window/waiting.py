"""The window before there is anything to touch: scenes to choose from, and how far a job has come, while the
job runs in a thread of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

import numpy as np
import pyvista
from vtkmodules.vtkInteractionStyle import vtkInteractorStyleUser
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

from palpate.mechanics.errors import PalpateError
from palpate.mechanics.progress import Progress
from palpate.mechanics.recording.recording import read_recording
from palpate.scenes.embedded import embedded_recording
from palpate.scenes.kept import kept_surface
from palpate.scenes.phantoms import phantom
from palpate.scenes.scene import Scene
from palpate.show.colours import COLOURS, GREY, HINT, PAPER, STAGE
from palpate.show.light import lit
from palpate.window import shadow
from palpate.window.picture import SKIN, add_lights
from palpate.window.widgets import SIZE, Board, Item, fit_screen

T = TypeVar("T")
PERIOD_S = 0.05
COLUMNS = 3
SPACE, HEAD, PICTURE = 16, 76, 250
"""Between cards, above them, and the height of a card's picture, pixels of a window of full size."""
SHADE = 0.7
"""How far the shadow at an object's foot reaches from its middle, in widths of the object."""
EVERY = 15
"""Of a recording's samples one in so many is drawn."""


class ClosedError(PalpateError):
    """A person closed the window before there was anything to touch."""


class _Job(threading.Thread, Generic[T]):
    """`job(tell)` in a daemon thread; result or error are there when it has ended."""

    def __init__(self, job: Callable[[Progress], T]) -> None:
        super().__init__(name="touch preparation", daemon=True)
        self._job = job
        self.said: tuple[str, float] = ("starting", 0.0)
        self.result: T | None = None
        self.error: BaseException | None = None
        self.start()

    def run(self) -> None:
        try:
            self.result = self._job(self._tell)
        except BaseException as error:  # raised again where the job was asked for
            self.error = error

    def _tell(self, stage: str, share: float) -> None:
        self.said = stage, share


class WaitingWindow:
    """Open from its making until `close`; `choose` returns one of `scenes`, `run` what the job returns."""

    def __init__(
        self, scenes: Sequence[Scene] = (), *, size: tuple[int, int] = SIZE, off_screen: bool = False
    ):
        self._closed = False
        self._chosen: Scene | None = None
        self.scenes = tuple(scenes)
        self.plotter = pyvista.Plotter(
            off_screen=off_screen,
            window_size=list(size),
            shape=(1, 1 + len(scenes)),
            border=False,
            lighting="none",
            title="Palpate",
        )
        self.plotter.enable_anti_aliasing("msaa")
        fit_screen(self.plotter)
        base, *self._views = self.plotter.renderers
        base.set_background(STAGE)
        base.viewport = (0.0, 0.0, 1.0, 1.0)
        self.head = Board(base)
        self.cards = [Board(base, fill=PAPER) for _ in scenes]
        for place, (scene, view) in enumerate(zip(self.scenes, self._views, strict=True)):
            self.plotter.subplot(0, 1 + place)
            _draw(self.plotter, scene)
            view.set_background(PAPER)
            view.UseOITOff()  # else edges beside a shadow are not smooth
        self._lay_out()
        iren = self.plotter.iren
        assert iren is not None, "pyvista makes an interactor with its plotter"
        iren.clear_key_event_callbacks()
        iren.style = vtkInteractorStyleUser()
        self.interactor = iren.interactor
        for event, action in (
            ("ExitEvent", self._gone),
            ("MouseMoveEvent", self._hover),
            ("LeftButtonPressEvent", self._press),
            ("KeyPressEvent", self._key),
        ):
            self.interactor.AddObserver(event, lambda *_, action=action: action())
        self.plotter.show(interactive_update=True, auto_close=False)

    def _lay_out(self) -> None:
        width, height = self.plotter.window_size
        scale = min(width / SIZE[0], height / SIZE[1])
        self.head.place(0, 0, width, height, scale)
        words = [(Item("What do you want to touch?", size=22, bold=True),)]
        self.head.show([*words, (Item("Click a scene.", colour=GREY),)] if self.scenes else [])
        rows = -(-len(self.scenes) // COLUMNS)
        space = SPACE * scale
        for place, (board, view) in enumerate(zip(self.cards, self._views, strict=True)):
            row, column = divmod(place, COLUMNS)
            wide = (width - (COLUMNS + 1) * space) / COLUMNS
            high = (height - HEAD * scale - rows * space) / rows
            left, top = space + column * (wide + space), height - HEAD * scale - row * (high + space)
            board.place(left, top - high, left + wide, top, scale)
            inset = 3.0
            low = top - PICTURE * scale
            x0, x1 = (left + inset) / width, (left + wide - inset) / width
            view.viewport = (x0, low / height, x1, (top - inset) / height)
            view.reset_camera()
            view.camera.zoom(1.3)
        self._hover()

    def _hover(self) -> None:
        at = self.plotter.iren.interactor.GetEventPosition() if self.plotter.iren else (-1, -1)
        for board, scene in zip(self.cards, self.scenes, strict=True):
            board.fill = HINT if board.holds(*at) else PAPER
            board.show(
                [
                    (Item("", size=PICTURE),),
                    (Item(scene.title, size=15, bold=True),),
                    (Item(scene.about, size=12, colour=GREY),),
                ]
            )

    def _press(self) -> None:
        at = self.interactor.GetEventPosition()
        held = (scene for board, scene in zip(self.cards, self.scenes, strict=True) if board.holds(*at))
        self._chosen = next(held, self._chosen)

    def _key(self) -> None:
        if self.interactor.GetKeySym() == "q":
            self._gone()

    def _gone(self) -> None:
        self._closed = True

    def choose(self) -> Scene:
        """The scene that a person clicks; raises ClosedError where he closes the window instead."""
        size = self.plotter.window_size
        while self._chosen is None and not self._closed:
            if self.plotter.window_size != size:
                size = self.plotter.window_size
                self._lay_out()
            self._go_on()
            time.sleep(PERIOD_S)
        if self._chosen is None:
            raise ClosedError("the window was closed before a scene was chosen")
        for board, view in zip(self.cards, self._views, strict=True):
            board.fill = ""
            board.show([])
            view.SetDraw(False)
        self.scenes, self.cards, self._views = (), [], []
        return self._chosen

    def run(self, title: str, job: Callable[[Progress], T]) -> T:
        """What `job(tell)` returns or raises, told under a title; raises ClosedError where the window is
        closed meanwhile."""
        running = _Job(job)
        began = time.perf_counter()
        while running.is_alive() and not self._closed:
            self._tell(title, *running.said, time.perf_counter() - began)
            self._go_on()
            running.join(PERIOD_S)
        if running.error is not None:
            raise running.error
        if running.is_alive():
            raise ClosedError("the window was closed before there was anything to touch")
        return running.result  # type: ignore[return-value]  # of a job that has ended without an error

    def _go_on(self) -> None:
        """Take mouse and keys; draw only what looks otherwise: the job, too, needs the processor."""
        self.interactor.ProcessEvents()
        if any(board.changed for board in (self.head, *self.cards)):
            self.plotter.render()

    def _tell(self, title: str, stage: str, share: float, seconds: float) -> None:
        width, height = self.plotter.window_size
        self.head.place(
            0.25 * width, 0.4 * height, 0.75 * width, 0.6 * height, min(width / SIZE[0], height / SIZE[1])
        )
        self.head.show(
            [
                (Item(title, size=20, bold=True),),
                (Item("", share=share),),
                (Item(f"{stage}   {100 * share:.0f} %   {seconds:.0f} s", colour=GREY),),
            ]
        )

    def close(self) -> None:
        """No longer needed."""
        self._closed = True
        self.plotter.close()


def _draw(plotter: pyvista.Plotter, scene: Scene) -> None:
    """A scene's object as it is touched; of a recording without a model so far, where the tip went."""
    surface = _surface_of(scene)
    if surface is None:
        path = read_recording(embedded_recording(scene.source)).position[::EVERY]
        plotter.add_points(path, color=COLOURS["object"], point_size=2.0)
    else:
        add_lights(plotter)
        (x0, x1, y0, y1, foot, _), blot = surface.bounds, shadow.blot(SHADE)
        blot.points = blot.points * [x1 - x0, y1 - y0, 1.0] + [(x0 + x1) / 2, (y0 + y1) / 2, foot]
        plotter.add_mesh(blot, scalars="shade", rgba=True, opacity=0.6, lighting=False, show_scalar_bar=False)
        plotter.add_mesh(surface, color=COLOURS["object"], smooth_shading=True, **SKIN)
    plotter.camera_position = "xz"
    plotter.camera.elevation = 30.0


def _surface_of(scene: Scene) -> pyvista.PolyData | None:
    """With the normals by which it is lit."""
    if scene.kind == "phantom":
        shape = phantom(scene.source)
        exact = pyvista.PolyData.from_regular_faces(shape.vertices, shape.faces)
        return exact.compute_normals(cell_normals=False, split_vertices=True)
    kept = kept_surface(scene)
    if kept is None:
        return None
    reader = vtkXMLPolyDataReader()
    reader.ReadFromInputStringOn()
    reader.SetInputString(kept.decode("latin-1"))
    reader.Update()
    read: Any = pyvista.wrap(reader.GetOutput())
    points = np.asarray(read.points)
    smooth = lit(points, read.regular_faces)
    drawn = pyvista.PolyData.from_regular_faces(points[smooth.at], smooth.triangles)
    drawn.point_data.active_normals = smooth.normals
    return drawn
