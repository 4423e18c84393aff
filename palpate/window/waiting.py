"""A window that shows how far a job has come, while the job runs in a thread of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
import pyvista
import vtk

from mechanics.errors import PalpateError
from mechanics.progress import Progress

T = TypeVar("T")
PERIOD_S = 0.05
BACKGROUND, FULL, EMPTY = "#f4f6f8", "#1b4f9c", "#d9dee5"
LEFT, RIGHT, LOW, HIGH = 0.25, 0.75, 0.46, 0.475
"""Of the bar, in shares of the window."""


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
    """Open from its making until `close`; `run` returns what the job returns."""

    def __init__(self, title: str, size: tuple[int, int], *, off_screen: bool = False) -> None:
        self._closed = False
        self.plotter = pyvista.Plotter(off_screen=off_screen, window_size=list(size), title=title)
        self.plotter.renderer.set_background(BACKGROUND)
        self._text(title, 0.56, 16)
        self._stage = self._text("", 0.38, 12)
        self._bar(EMPTY, RIGHT)
        self._full = self._bar(FULL, LEFT)
        self.plotter.show(interactive_update=True, auto_close=False)
        iren = self.plotter.iren
        if iren is not None:
            iren.interactor.AddObserver("ExitEvent", lambda *_: self._gone())

    def _gone(self) -> None:
        self._closed = True

    def _text(self, text: str, height: float, size: int) -> pyvista.Text:
        actor = pyvista.Text(text)
        actor.prop.color, actor.prop.font_size, actor.prop.justification_horizontal = "black", size, "center"
        actor.GetPositionCoordinate().SetCoordinateSystemToNormalizedViewport()
        actor.SetPosition(0.5, height)
        self.plotter.add_actor(actor, reset_camera=False)
        return actor

    def _bar(self, colour: str, right: float) -> pyvista.PolyData:
        bar = pyvista.PolyData.from_regular_faces(_corners(right), np.array([[0, 1, 2], [0, 2, 3]]))
        mapper, place = vtk.vtkPolyDataMapper2D(), vtk.vtkCoordinate()
        place.SetCoordinateSystemToNormalizedViewport()
        mapper.SetTransformCoordinate(place)
        mapper.SetInputData(bar)
        actor = vtk.vtkActor2D()
        actor.SetMapper(mapper)
        actor.GetProperty().SetColor(*pyvista.Color(colour).float_rgb)
        self.plotter.add_actor(actor, reset_camera=False)
        return bar

    def run(self, job: Callable[[Progress], T]) -> T:
        """What `job(tell)` returns or raises; raises ClosedError where the window is closed meanwhile."""
        running = _Job(job)
        began = time.perf_counter()
        while running.is_alive() and not self._closed:
            stage, share = running.said
            self._stage.input = f"{stage}   {100 * share:.0f} %   {time.perf_counter() - began:.0f} s"
            self._full.points = _corners(LEFT + min(max(share, 0.0), 1.0) * (RIGHT - LEFT))
            self.plotter.update()
            running.join(PERIOD_S)
        if running.error is not None:
            raise running.error
        if running.is_alive():
            raise ClosedError("the window was closed before there was anything to touch")
        return running.result  # type: ignore[return-value]  # of a job that has ended without an error

    def close(self) -> None:
        """No longer needed."""
        self._closed = True
        self.plotter.close()


def _corners(right: float) -> np.ndarray:
    return np.array([[LEFT, LOW, 0.0], [right, LOW, 0.0], [right, HIGH, 0.0], [LEFT, HIGH, 0.0]])
