"""A touch window with a hand on its mouse and keys: real events into VTK's interactor, off-screen."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from palpate.devices.channel import PoseChannel
from palpate.devices.registry import DeviceChoice
from palpate.mechanics.model.model import Model
from palpate.scenes.scene import Scene
from palpate.window.guide import Guide
from palpate.window.session import SessionOptions, TouchSession
from palpate.window.window import TouchWindow
from palpate.window.worker import Frame

from ...support.waiting import PATIENCE_S
from .small import SIZE

FRAME_S = 0.005
HALF = SIZE[0] / 2
SIDES = [
    np.array([0.0, -1.0, 0.0]),
    np.array([1.0, 0.0, 0.0]),
    np.array([0.0, 1.0, 0.0]),
    np.array([-1.0, 0, 0]),
]
TRACING_M_PER_S = 0.03
RESTING_S = 0.02


@contextmanager
def driving(
    model: Model,
    scene: Scene,
    options: SessionOptions | None = None,
    *,
    guided: Callable[[TouchSession], Guide] | None = None,
    **window: Any,
) -> Iterator[Driven]:
    """A session of a model, begun, with a hand on the mouse of its window. guided: what guides the hand;
    window: of the window, such as its size."""
    channel = PoseChannel.create()
    channel.write(time.perf_counter(), (0.0, 0.0, 0.1))
    device = DeviceChoice("mouse", {"channel": str(channel.path)})
    options = options or SessionOptions()
    with TouchSession(model, title=scene.title, device=device, options=options) as session:
        session.start()
        session.enable()
        guide = None if guided is None else guided(session)
        shown = TouchWindow(session, scene, channel, off_screen=True, guide=guide, **window)
        yield Driven(shown)
        shown.plotter.close()
    channel.close()


class Driven:
    """Shows the window; every method is something that a person does, or waits as one does."""

    def __init__(self, window: TouchWindow) -> None:
        self.window = window
        self.session = window.session
        self._pause = threading.Event()
        window.plotter.show(interactive_update=True, auto_close=False)

    @property
    def interactor(self):
        return self.window.controls.interactor

    def mouse(self, x: float, y: float) -> None:
        """x, y: shares of the first picture."""
        width, height = self.window.plotter.window_size
        left, low, right, high = self.window.picture_renderers[0].viewport
        self.pixel((left + x * (right - left)) * width, (low + y * (high - low)) * height)

    def pixel(self, x: float, y: float) -> None:
        self.interactor.SetEventPosition(round(x), round(y))
        self.interactor.InvokeEvent("MouseMoveEvent")

    def mouse_at(self, point_m: np.ndarray) -> None:
        """Over a place of the scene, as the first picture shows it."""
        renderer = self.window.picture_renderers[0]
        renderer.SetWorldPoint([*point_m.tolist(), 1.0])
        renderer.WorldToDisplay()
        self.pixel(*renderer.GetDisplayPoint()[:2])

    def button(self, down: bool, which: str = "Left") -> None:
        self.interactor.InvokeEvent(f"{which}Button{'Press' if down else 'Release'}Event")

    def click(self, text: str) -> None:
        """On the button of this text, in whichever column it is shown; waits for what it sets off."""

        def buttons() -> list[tuple[float, float]]:
            boards = self.window.boards
            return [b.find(text) for b in boards if any(i.do and i.text == text for i, _ in b.placed)]

        self.until(lambda frame: bool(buttons()))
        self.pixel(*buttons()[0])
        self.button(True)
        self.button(False)
        self.until(lambda frame: self.session.worker.idle)
        self.frame()

    def says(self, text: str, *, says: bool = True) -> None:
        """Frames go by until this is said beside the pictures, or no longer."""
        self.until(lambda frame: any(text in board.text for board in self.window.boards) == says)

    def wheel(self, steps: int, *, ctrl: bool = False) -> None:
        self.interactor.SetControlKey(int(ctrl))
        for _ in range(abs(steps)):
            self.interactor.InvokeEvent(f"MouseWheel{'Forward' if steps > 0 else 'Backward'}Event")
        self.interactor.SetControlKey(0)

    def key(self, symbol: str, *, wait: bool = True) -> None:
        """wait: for what it sets off."""
        self.interactor.SetKeySym(symbol)
        self.interactor.InvokeEvent("KeyPressEvent")
        if wait:
            self.session.worker.wait()

    def until(self, condition: Callable[[Frame], bool]) -> Frame:
        """Frames go by until `condition(frame)`; a frame that never comes fails the test."""
        frame, end = None, time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            frame = self.window.tick()
            if frame is not None and condition(frame):
                return frame
            self._pause.wait(FRAME_S)
        raise AssertionError(f"the window never came to this; its last frame: {frame}")

    def frame(self) -> Frame:
        """The next frame."""
        return self.until(lambda frame: True)

    def wait(self, seconds: float) -> Frame:
        """Frames go by until the servo's clock has gone on by so many seconds, however long that takes."""
        end = self.frame().time_s + seconds
        return self.until(lambda frame: frame.time_s > end)

    def rests(self, seconds: float = RESTING_S) -> Frame:
        """The frame in which hand and tip have stood still in one place for so long by the servo's clock."""
        last: tuple[float, np.ndarray] = (np.inf, np.full(3, np.inf))

        def still(frame: Frame) -> bool:
            nonlocal last
            meant = self.window.pointer.tip_m
            if np.linalg.norm(meant - last[1]) > 1e-6 or np.linalg.norm(frame.tip_m - meant) > 1e-4:
                last = frame.time_s, np.array(meant)
            return frame.time_s > last[0] + seconds

        return self.until(still)

    def pressed(self, depth_m: float) -> Frame:
        """The frame in which the tip rests as deep as this: the forces have come to rest as well."""
        last: tuple[float, np.ndarray] = (0.0, np.zeros(0))

        def rests(frame: Frame) -> bool:
            nonlocal last
            forces = np.array([view.force_n for view in frame.views])
            if not (frame.touching and abs(frame.depth_m - depth_m) < 2e-6):
                return False
            if forces.shape != last[1].shape or not np.allclose(forces, last[1], rtol=1e-4, atol=1e-5):
                last = frame.time_s, forces
            return frame.time_s > last[0] + RESTING_S

        return self.until(rests)

    def inclusion_settled(self) -> None:
        """Frames go by until the inclusion is felt where it is wanted."""
        self.until(lambda frame: self.session.inclusion_felt and not self.session.worker.busy)
        assert self.session.worker.failure == ""

    def look_from(self, azimuth: float) -> None:
        """Turn the view with the right button until the eye stands at this angle about the vertical, rad."""
        width = self.window.plotter.window_size[0]

        def off() -> float:
            camera = self.window.picture_renderers[0].GetActiveCamera()
            eye = np.subtract(camera.GetPosition(), camera.GetFocalPoint())
            return float(np.angle(np.exp(1j * (azimuth - np.arctan2(eye[1], eye[0])))))

        for _ in range(20):  # the hand takes hold again before the mouse leaves the picture
            self.mouse(0.5, 0.5)
            x, y = self.interactor.GetEventPosition()
            self.button(True, "Right")
            for _ in range(15):
                x -= np.clip(60.0 * off(), -15.0, 15.0) * width / 1280.0
                self.pixel(x, y)
            self.button(False, "Right")
            if abs(off()) < 0.05:
                return
        raise AssertionError(f"the right button does not turn the view: {off():.2f} rad to go")

    def look_down(self, elevation: float) -> None:
        """Turn the view with the right button until the eye stands so high above the horizon, rad."""

        def off() -> float:
            camera = self.window.picture_renderers[0].GetActiveCamera()
            eye = np.subtract(camera.GetPosition(), camera.GetFocalPoint())
            return float(elevation - np.arcsin(eye[2] / np.linalg.norm(eye)))

        for _ in range(12):
            self.mouse(0.5, 0.5)
            x, y = self.interactor.GetEventPosition()
            self.button(True, "Right")
            for _ in range(10):
                y -= np.clip(200.0 * off(), -12.0, 12.0)
                self.pixel(x, y)
            self.button(False, "Right")
            if abs(off()) < 0.05:
                return
        raise AssertionError(f"the right button does not tilt the view: {off():.2f} rad to go")

    def picture(self) -> np.ndarray:
        self.window.plotter.render()
        return np.asarray(self.window.plotter.screenshot(return_img=True))


def along_the_foot(driven: Driven, side: np.ndarray) -> None:
    """Button down on the support before a side of the block, mouse along its foot, button up."""
    right = np.array([-side[1], side[0], 0.0])
    reach = HALF + 0.008
    driven.mouse_at(HALF * side + 0.006 * side - reach * right)
    driven.rests(0.3)
    driven.button(True)
    start, duration = driven.wait(0.6).time_s, 2 * reach / TRACING_M_PER_S
    share = 0.0
    while share < 1.0:
        driven.mouse_at(HALF * side + 0.004 * side + (2 * share - 1) * reach * right)
        share = (driven.wait(0.01).time_s - start) / duration
    driven.button(False)
    driven.wait(0.4)


def as_the_ghost_says(driven: Driven, guide: Guide) -> None:
    """One press where and as deep as it is suggested, seen from outside; waits for the next suggestion."""
    s, made = guide.suggestion, guide.state.made
    assert s.point is not None and s.normal is not None
    if np.hypot(*s.normal[:2]) > 0.15:
        driven.look_from(float(np.arctan2(s.normal[1], s.normal[0])))
    driven.look_down(float(np.arcsin(np.clip(s.normal[2], np.sin(0.3), np.sin(1.2)))))
    driven.window.pointer.go_deep(1e3 * s.depth_m)
    driven.mouse_at(s.point)
    driven.rests(0.3)
    driven.button(True)
    driven.rests(0.5)
    driven.button(False)
    driven.until(lambda frame: guide.state.made > made and not driven.session.worker.busy)
