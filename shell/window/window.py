"""The touch window: force, next step and buttons on the left, pictures, live plots below them, settings or
help on the right; palpate.window.mouse_and_keys moves the tip.

One timer drives everything: `tick` writes the mouse's pose for the servo process, reads its newest state,
moves what is drawn. The servo never waits for a picture.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyvista
from vtkmodules.vtkRenderingCore import vtkRenderer

from palpate.child import loaded_whole
from palpate.devices.channel import PoseChannel
from palpate.mechanics.disk.writing import PNG, atomic_file
from palpate.scenes.phantoms import Region
from palpate.scenes.scene import Scene
from palpate.show.colours import PAPER, STAGE
from palpate.window.charts import AxesGizmo, LiveCharts
from palpate.window.game import PRESS_M, Game
from palpate.window.guide import GhostTip, Guide
from palpate.window.keys import Orbit
from palpate.window.known import KnownSoFar
from palpate.window.mouse_and_keys import Controls
from palpate.window.panel import NextStep, aside_rows, main_rows
from palpate.window.picture import ObjectPicture, add_lights
from palpate.window.pointer import Pointer
from palpate.window.session import TouchSession
from palpate.window.stiffness import StiffnessMap, common_limits
from palpate.window.widgets import SIZE, Board, Item, fit_screen
from palpate.window.worker import Frame, Pace, RendererView, level
from palpate.words import begun, renderer_words, sentence

PERIOD_MS = 16
COLUMN, CHARTS = 280, 190
"""Width of the columns beside the pictures and height of the plots, pixels of a window of full size."""
BY_SOFTWARE, SAMPLES = ("llvmpipe", "softpipe", "SwiftShader", "GDI Generic", "Basic Render"), 4
"""What OpenGL calls itself where no graphics card draws; of each pixel of an edge where one does."""
LEAST_SCALE, MOST_SCALE = 0.55, 2.5


class TouchWindow:
    """Draws a started session. channel: where the mouse's pose goes, None where another device moves. guide:
    of an exploration, whose suggestions are shown.

    aside: what is open on the right: 's' settings, 'h' help, '' nothing. another: whether it was closed to
    choose another scene.
    """

    def __init__(
        self,
        session: TouchSession,
        scene: Scene,
        channel: PoseChannel | None,
        *,
        off_screen: bool = False,
        size: tuple[int, int] = SIZE,
        guide: Guide | None = None,
    ) -> None:
        self.session = session
        self.scene = scene
        self.guide = guide
        self.frames = 0
        self.closed = self.another = self._ended = False
        self.notice = self.aside = ""
        self.more = False
        self.moved_by_mouse = channel is not None
        self._channel = channel
        self._last_s = time.perf_counter()
        self._felt_at: np.ndarray | None = None
        self._end_s = float("inf")
        self._map = StiffnessMap(session.worker, session.servo.tip_radius_m)
        nodules = tuple(session.model.material.inclusions.values())
        up = session.model.support.normal
        self.game = Game(nodules, up) if scene.find and nodules and guide is None else None
        self.coloured = scene.colour == "stiffness" and guide is None
        self.plotter = self._plotter(off_screen, size)
        self._first, self._second, self._plots, self._column, self._aside = self.plotter.renderers
        self.boards = [Board(self._column, fill=PAPER), Board(self._aside, fill=PAPER)]
        self._headings = [Board(self._first), Board(self._second)]
        self._laid_out: object = None
        self._scale = 1.0
        self._pace = Pace()
        self._names: tuple[str, ...] = ()
        self.pictures = [self._picture(0, session.renderer_name)]
        self._ghost = GhostTip(self.plotter, session.servo.tip_radius_m) if guide else None
        self._known = KnownSoFar(self.plotter)
        self._axes = AxesGizmo(self._first)
        self.plotter.subplot(0, 2)
        self._charts = LiveCharts(self.plotter, session.trace.SECONDS)
        points, triangles = session.drawing(session.renderer_name).surface
        support, radius = session.model.support, session.servo.tip_radius_m
        self.pointer = Pointer(points, triangles, radius, support.point, support.normal)
        self.orbit = self._look()
        if self.game is not None:
            self.pointer.press_depth_m = PRESS_M
        self._next = NextStep(self, mouse=self.moved_by_mouse)
        self._lay_out()
        self.controls = Controls(self)

    def _plotter(self, off_screen: bool, size: tuple[int, int]) -> pyvista.Plotter:
        plotter = pyvista.Plotter(
            off_screen=off_screen,
            window_size=list(size),
            shape=(1, 5),
            title=f"{self.scene.title} - Palpate",
            border=False,
            lighting="none",
        )
        fit_screen(plotter)
        for renderer in plotter.renderers:
            renderer.set_background(STAGE)
            # blending in any order takes several passes over the whole picture; a shadow needs one
            renderer.UseOITOff()
        window = plotter.render_window
        assert window is not None, "a plotter has one until it is closed"
        window.SetMultiSamples(0)
        return plotter

    @property
    def guided(self) -> bool:
        """Whether an exploration is guided."""
        return self.guide is not None

    @property
    def sides(self) -> int:
        """How many pictures there are to be seen."""
        return max(1, len(self._names))

    @property
    def picture_renderers(self) -> list[vtkRenderer]:
        """Where an object is drawn."""
        return [self._first, self._second][: self.sides]

    def _picture(self, side: int, name: str) -> ObjectPicture:
        self.plotter.subplot(0, side)
        add_lights(self.plotter)
        session = self.session
        drawing, radius = session.drawing(name), session.servo.tip_radius_m
        return ObjectPicture(self.plotter, drawing, session.model, radius, place=(0, side))

    def _look(self) -> Orbit:
        """From the person's side, a little above; both pictures share the camera."""
        model = self.session.model
        up = model.support.normal
        middle = 0.5 * (model.mesh.points.min(axis=0) + model.mesh.points.max(axis=0))
        distance = 2.1 * np.linalg.norm(np.ptp(model.mesh.points, axis=0))
        eye = middle + distance * (-0.8 * level(up) + 0.6 * up)
        self.plotter.subplot(0, 0)
        camera = self.plotter.camera
        self._second.camera = camera
        return Orbit(camera, middle, up, eye)

    def _follow_views(self, views: tuple[RendererView, ...]) -> None:
        """As many pictures as there are views, each under its renderer's name."""
        names = tuple(view.name for view in views)
        if names == self._names:
            return
        if len(names) > len(self.pictures):
            self.pictures.append(self._picture(1, names[1]))
            self._second.camera = self.plotter.renderers[0].camera
        if self.coloured:
            self._map.forget()
        self._names = names
        self._charts.tell(names)
        for picture, name in zip(self.pictures, names, strict=False):
            picture.is_of(name)

    def _lay_out(self) -> None:
        """Everything in its place, where the window, or what is open in it, has changed."""
        width, height = self.plotter.window_size
        state = (width, height, self.sides, self.aside)
        if state == self._laid_out:
            return
        self._laid_out = state
        self._pace.forget()
        self._scale = scale = float(np.clip(min(width / SIZE[0], height / SIZE[1]), LEAST_SCALE, MOST_SCALE))
        left, low = COLUMN * scale / width, CHARTS * scale / height
        right = 1.0 - (left if self.aside else 0.0)
        middle = 0.5 * (left + right) if self.sides == 2 else right
        for renderer, viewport in (
            (self._first, (left, low, middle, 1.0)),
            (self._second, (middle, low, right, 1.0) if self.sides == 2 else (0.0, 0.0, 0.01, 0.01)),
            (self._plots, (left, 0.0, right, low)),
            (self._column, (0.0, 0.0, left, 1.0)),
            (self._aside, (right, 0.0, 1.0, 1.0) if self.aside else (0.0, 0.0, 0.01, 0.01)),
        ):
            renderer.viewport = viewport
        self._charts.scale(scale)
        for picture in self.pictures:
            picture.scale(scale)
        for board in self.boards:
            board.changed = True
        column, aside = self.boards
        column.place(0, 0, left * width, height, scale)
        aside.place(right * width, 0, width if self.aside else right * width - 1, height, scale)
        for board, renderer in zip(self._headings, (self._first, self._second), strict=True):
            x0, _, x1, _ = renderer.viewport
            board.place(x0 * width, height - 60 * scale, x1 * width, height, scale)

    @property
    def stiffness_drawn(self) -> bool:
        """Whether colours are stiffness now, and not only wanted so."""
        return self.pictures[0].by_stiffness

    def toggle_colour(self) -> None:
        """Colour by displacement, or by local stiffness as soon as that is computed."""
        self.coloured = not self.coloured
        self._map.forget()
        if not self.coloured:
            for picture in self.pictures:
                picture.colour_by_displacement()

    def show_aside(self, which: str) -> None:
        """Settings ('s') or help ('h') beside the pictures; those that are open close."""
        self.aside = "" if which == self.aside else which

    def answer(self) -> None:
        """The game's: the nodule is where the tip pressed last; it is shown until the next touch."""
        if self.game is not None and self.game.answer(time.perf_counter(), self.session.renderer_name):
            self._map.forget()

    def _play(self, frame: Frame) -> None:
        """The clock runs from a touch, which hides the nodule again."""
        if self.game is None:
            return
        answered = self.game.answered
        self.game.follow(frame.depth_m, frame.tip_m, time.perf_counter())
        if answered and not self.game.answered and self.coloured:
            for picture in self.pictures:
                picture.colour_by_displacement()

    @property
    def _inside(self) -> Region | None:
        """What is drawn inside the object now."""
        if self.game is None or not self.game.answered:
            return self.session.inclusion
        ball = self.game.hidden[0]
        return Region("nodule", ball.centre_m, ball.radius_m, ball.modulus_ratio)

    def tick(self) -> Frame | None:
        """One frame: pose out, state in, pictures moved. Returns what was drawn."""
        now = time.perf_counter()
        if self._channel is not None:
            place = self.pointer.place(min(now - self._last_s, 0.1), self._felt_at)
            self._channel.write(now, tuple(place), int(self.pointer.pressing))
        self._last_s = now
        frame = self.session.frame()
        if frame is not None:
            self._felt_at = frame.tip_m
            self._draw(frame)
        if now > self._end_s or not self.session.servo.alive:
            self.close()
        return frame

    def _draw(self, frame: Frame) -> None:
        self._follow_views(frame.views)
        self._lay_out()
        beside, words = self._pace.next(time.perf_counter())
        self._play(frame)
        below = self.pointer.below(frame.tip_m)
        for picture, view in zip(self.pictures if beside else self.pictures[:1], frame.views, strict=False):
            picture.update(frame, view, below)
        for picture in self.pictures:
            picture.show_inclusion(self._inside)
        if self.coloured and self.session.inclusion_felt and (self.game is None or self.game.answered):
            depth_m = self.pointer.press_depth_m
            maps = self._map.of(tuple(self.session.drawing(name) for name in self._names), depth_m)
            limits = common_limits(maps)
            for picture, stiffness in zip(self.pictures, maps, strict=False):
                picture.colour_by_stiffness(stiffness, limits, depth_m)
        if self.guide is not None and self._ghost is not None:
            self.guide.follow()
            self._ghost.show(self.guide.ghost)
            self._known.show(self.guide)
        self._axes.update(self._scale)
        if words:
            self._write(frame)
        self._second.SetDraw(beside and self.sides == 2)
        self._plots.SetDraw(words)
        column, aside = self.boards
        self._column.SetDraw(column.changed)  # else it stands there as it is
        self._aside.SetDraw(aside.changed and bool(self.aside))
        self.frames += 1

    def _write(self, frame: Frame) -> None:
        self._charts.update(self.session.trace)
        column, aside = self.boards
        column.show(main_rows(self, frame))
        aside.show(aside_rows(self) if self.aside else [])
        for side, (board, name) in enumerate(zip(self._headings, self._names, strict=False)):
            what = "for comparison" if side else "what is felt"
            board.show([(Item(f"{begun(renderer_words(name))}: {what}", bold=True),)])

    def next_words(self, frame: Frame) -> str:
        """What to do next: one thing at a time, and under it, until it was done, how."""
        lines, how = [], self._next.line(frame)
        stopped = self.guide is not None and self.guide.suggestion.kind == "stop"
        if self.game is not None and (self.guide is None or stopped):
            lines = self.game.lines(time.perf_counter())
        elif self.guide is not None:
            lines = [sentence(self.guide.lines()[0])]
        return "\n".join(filter(None, [*lines, "" if stopped else how]))

    @property
    def known_words(self) -> str:
        """What a guided exploration knows so far, '' without one."""
        return "" if self.guide is None else self.guide.lines()[1]

    def run(
        self,
        seconds: float | None = None,
        *,
        screenshot: Path | None = None,
        shown: Callable[[], object] = lambda: None,
    ) -> None:
        """Show until closed or the time is up; shown: called once it is to be seen."""
        self._end_s = time.perf_counter() + seconds if seconds else float("inf")
        interactor = self.controls.interactor
        self.plotter.show(interactive_update=True, auto_close=False)
        self.smooth_edges()
        shown()
        interactor.AddObserver("TimerEvent", lambda *_: self._timed(screenshot))
        interactor.CreateRepeatingTimer(PERIOD_MS)
        interactor.AddObserver("ExitEvent", lambda *_: self.close())
        with loaded_whole(self.close):
            interactor.Start()
            self.plotter.close()

    def smooth_edges(self) -> None:
        """Of a shown window that a graphics card draws: without one that costs more than all the rest."""
        window = self.plotter.render_window
        if window is not None and not any(name in window.ReportCapabilities() for name in BY_SOFTWARE):
            window.SetMultiSamples(SAMPLES)

    def _timed(self, screenshot: Path | None) -> None:
        if self._ended:
            return
        self.tick()
        self.plotter.render()
        if self.closed:
            self._ended = True
            if screenshot is not None:
                with atomic_file(screenshot, PNG) as temporary:
                    self.plotter.screenshot(str(temporary))
            self.controls.interactor.TerminateApp()

    def close(self, *, scenes: bool = False) -> None:
        """End `run` at the next frame; scenes: to choose another."""
        self.closed, self.another = True, self.another or scenes
