"""The touch window: pictures side by side, live plots below; palpate.window.controls moves the tip.

One timer drives everything: `tick` writes the mouse's pose for the servo process, reads its newest state,
moves what is drawn. The servo never waits for a picture.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista
import vtk

from devices.channel import PoseChannel
from mechanics.files import PNG, atomic_file
from palpate.window.charts import LiveCharts
from palpate.window.controls import Controls
from palpate.window.frames import Frame, level
from palpate.window.game import Game
from palpate.window.ghost import GhostTip
from palpate.window.keys import help_text
from palpate.window.orbit import Orbit
from palpate.window.pace import Pace
from palpate.window.picture import ObjectPicture
from palpate.window.pointer import LEAST_PRESS_M, MOST_PRESS_M, Pointer
from palpate.window.session import TouchSession
from palpate.window.stiffness import StiffnessMap, common_limits
from palpate.window.words import heading, hint, status
from render.base import Renderer
from scenes.phantoms import Region
from scenes.scene import Scene

if TYPE_CHECKING:
    from palpate.window.guide import Guide

PERIOD_MS = 16
SIZE = (1280, 800)
CHARTS_SHARE = 0.28
SLIDER_AT = 0.36
"""Of the panel's height."""
PANEL_SHARE = 0.42
"""Of the charts' row: the panel of words, which covers nothing."""
LEAST_TYPE = 9
LIGHTS = (((-0.4, 0.55, 1.0), 0.9), ((0.9, -0.1, 0.6), 0.45))
"""Two that turn with the eye, (place, strength): each more is paid for at every pixel."""
LETTER = 0.62
"""Mean width of a letter over its type's size."""


class TouchWindow:
    """Draws a started session. channel: where the mouse's pose goes, None where another device moves. guide:
    of an exploration, whose suggestions are shown."""

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
        self.frames = 0
        self.closed = False
        self.notice = ""
        self._ended = False
        self._channel = channel
        self._last_s = time.perf_counter()
        self._end_s = float("inf")
        self._map = StiffnessMap(session.worker, session.servo.tip_radius_m)
        nodules = tuple(session.model.material.inclusions.values())
        up = session.model.support.normal
        self.game = Game(nodules, up) if scene.find and nodules else None
        self.guide = guide
        self._coloured = scene.colour == "stiffness"
        halves = [(0, slice(None)), (1, slice(None))]
        self.plotter = pyvista.Plotter(
            off_screen=off_screen,
            window_size=list(size),
            shape=(2, 2),
            row_weights=[100 - round(100 * CHARTS_SHARE), round(100 * CHARTS_SHARE)],
            groups=halves[1:] if self.sides == 2 else halves,  # type: ignore[arg-type]  # it takes slices too
            title=f"Palpate: {scene.title}",
            border=False,
            lighting="none",
        )
        for renderer in self.plotter.renderers:
            renderer.set_background("#f4f6f8")
            # blending in any order takes several passes over the whole picture; a shadow needs one
            renderer.UseOITOff()
        # smoothing edges costs more than all the rest where there is no graphics card
        window = self.plotter.render_window
        assert window is not None, "a plotter has one until it is closed"
        window.SetMultiSamples(0)
        self._headings: list[pyvista.Text] = []
        self._texts: list[tuple[pyvista.Text, int]] = []
        self._scaled_for = (0, 0)
        self._pace = Pace()
        self.pictures = [self._picture(side) for side in range(self.sides)]
        self._ghost = GhostTip(self.plotter, session.servo.tip_radius_m) if guide else None
        self.plotter.subplot(1, 0)
        self._charts = LiveCharts(self.plotter, session.trace.seconds, self._names, left=PANEL_SHARE)
        self._status = self._text("", (0.008, 0.95), "top", size=15)
        self._hint = self._text(hint(mouse=channel is not None), (0.008, 0.04), "bottom", size=11)
        self.plotter.subplot(0, 0)
        self._help = self._text("", (0.01, 0.98), "top", font="courier")
        self._help.prop.background_color, self._help.prop.background_opacity = "white", 0.9
        self._help.SetVisibility(False)
        plotter: Any = self.plotter  # its widgets' types are lost in PyVista's wrappers
        plotter.add_axes(interactive=False, color="black", line_width=2, viewport=(0.0, 0.0, 0.14, 0.2))
        points, triangles = self.pictures[0].rest_surface
        model = session.model
        radius = session.servo.tip_radius_m
        self.pointer = Pointer(points, triangles, radius, model.support.point, model.support.normal)
        self._slider = None if channel is None else self._depth_slider()
        self.orbit = self._look()
        self.controls = Controls(self)

    @property
    def sides(self) -> int:
        """How many pictures there are."""
        return 2 if self.session.beside_name else 1

    @property
    def picture_renderers(self) -> list[vtk.vtkRenderer]:
        """Where an object is drawn."""
        return [self.plotter.renderers[side] for side in range(self.sides)]

    @property
    def _names(self) -> tuple[str, ...]:
        beside = self.session.beside_name
        return (self.session.renderer_name, beside) if beside else (self.session.renderer_name,)

    def _drawing(self) -> tuple[Renderer, ...]:
        return tuple(self.session.drawing(name) for name in self._names)

    def _text(
        self, text: str, place: tuple[float, float], anchor: str, *, size: int = 12, font: str = "arial"
    ) -> pyvista.Text:
        """Text in the active subplot; place: shares of its width and height."""
        actor = pyvista.Text(text)
        actor.prop.color, actor.prop.font_size, actor.prop.font_family = "black", size, font
        actor.GetPositionCoordinate().SetCoordinateSystemToNormalizedViewport()
        actor.SetPosition(*place)
        actor.prop.justification_vertical = anchor
        self._texts.append((actor, size))
        self.plotter.add_actor(actor, reset_camera=False)
        return actor

    def _depth_slider(self) -> vtk.vtkSliderWidget:
        """How deep a press goes, in the panel; a drag on it is none on the object."""
        self.plotter.subplot(1, 0)
        plotter: Any = self.plotter
        pointer = self.pointer
        slider: vtk.vtkSliderWidget = plotter.add_slider_widget(
            pointer.go_deep,
            (1e3 * LEAST_PRESS_M, 1e3 * MOST_PRESS_M),
            value=1e3 * pointer.press_depth_m,
            title="press depth [mm]",
            pointa=(0.012, SLIDER_AT),
            pointb=(0.012 + 0.5 * PANEL_SHARE, SLIDER_AT),
            interaction_event="always",
            title_height=0.05,
            title_color="black",
            color="#1b4f9c",
            fmt="%.1f",
            slider_width=0.035,
            tube_width=0.008,
        )
        look: Any = slider.GetSliderRepresentation()
        look.SetSliderLength(0.012)
        look.SetEndCapLength(0.0)
        look.SetLabelHeight(0.05)
        look.GetTubeProperty().SetColor(*pyvista.Color("#b8c0cc").float_rgb)
        for words in (look.GetLabelProperty(), look.GetTitleProperty()):
            words.SetColor(0.0, 0.0, 0.0)
            words.SetBold(False)
            words.SetShadow(False)
        return slider

    def _picture(self, side: int) -> ObjectPicture:
        self.plotter.subplot(0, side)
        for place, strength in LIGHTS:
            light = pyvista.Light(position=place, light_type="camera light", intensity=strength)
            self.plotter.add_light(light, only_active=True)
        name = self._names[side]
        over = self._text(heading(name, felt=side == 0), (0.98, 0.985), "top", size=14)
        over.prop.justification_horizontal = "right"
        self._headings.append(over)
        session = self.session
        return ObjectPicture(
            self.plotter,
            session.drawing(name),
            session.model,
            session.servo.tip_radius_m,
            place=(0, side),
            label=name if side else "",
        )

    def _look(self) -> Orbit:
        """From the person's side, a little above; both pictures share the camera."""
        model = self.session.model
        up = model.support.normal
        middle = 0.5 * (model.mesh.points.min(axis=0) + model.mesh.points.max(axis=0))
        distance = 2.1 * np.linalg.norm(np.ptp(model.mesh.points, axis=0))
        eye = middle + distance * (-0.8 * level(up) + 0.6 * up)
        self.plotter.subplot(0, 0)
        camera = self.plotter.camera
        for renderer in self.picture_renderers[1:]:
            renderer.camera = camera
        return Orbit(camera, middle, up, eye)

    def toggle_colour(self) -> None:
        """Colour by displacement, or by local stiffness as soon as that is computed."""
        self._coloured = not self._coloured
        self._map.forget()
        if not self._coloured:
            for picture in self.pictures:
                picture.colour_by_displacement()

    def toggle_help(self) -> None:
        """Show every key that does something now, or not."""
        self._help.input = help_text(self.controls.offered)
        self._help.SetVisibility(not self._help.GetVisibility())

    def answer(self) -> None:
        """The game's: the nodule is where the mouse points; it is shown until the next touch."""
        target = self.pointer.target
        point = self.pointer.tip_m if target is None else target.point
        if self.game is not None and self.game.answer(point, time.perf_counter(), self.session.renderer_name):
            self._reveal(True)

    def _reveal(self, on: bool) -> None:
        assert self.game is not None
        region = None
        if on:
            ball = self.game.hidden[0]
            region = Region("nodule", ball.centre_m, ball.radius_m, ball.modulus_ratio)
        for picture in self.pictures:
            picture.show_inclusion(region)
        self._map.forget()
        if not on and self._coloured:
            for picture in self.pictures:
                picture.colour_by_displacement()

    def _play(self, frame: Frame) -> None:
        """The clock runs from a touch, which hides the nodule again."""
        if self.game is not None and frame.touching:
            if self.game.answered:
                self._reveal(False)
            self.game.touched(time.perf_counter())

    def set_inclusion(self, region: Region | None) -> None:
        """Draw it there, and let it be felt there as soon as that is computed."""
        self.session.place_inclusion(region)
        for picture in self.pictures:
            picture.show_inclusion(region)

    def tick(self) -> Frame | None:
        """One frame: pose out, state in, pictures moved. Returns what was drawn."""
        now = time.perf_counter()
        if self._channel is not None:
            place = self.pointer.place(min(now - self._last_s, 0.1))
            self._channel.write(now, tuple(place), int(self.pointer.pressing))
        self._last_s = now
        frame = self.session.frame()
        if frame is not None:
            self._draw(frame)
        if now > self._end_s or not self.session.servo.alive:
            self.close()
        return frame

    def _draw(self, frame: Frame) -> None:
        beside, words = self._pace.next(time.perf_counter())
        self._thin_out(beside, words)
        below = self.pointer.below(frame.tip_m)
        for picture, view in zip(self.pictures if beside else self.pictures[:1], frame.views, strict=False):
            picture.update(frame, view, below)
        self._play(frame)
        if self._coloured and self.session.inclusion_felt and (self.game is None or self.game.answered):
            maps = self._map.of(self._drawing())
            limits = common_limits(maps)
            for picture, stiffness in zip(self.pictures, maps, strict=False):
                picture.colour_by_stiffness(stiffness, limits)
        lines = status(self.session, self.scene, self.pointer, frame, self.notice)
        if self.game is not None and (self.game.answered or not self._guiding):
            lines += self.game.lines(time.perf_counter())
        if self.guide is not None and self._ghost is not None:
            self.guide.follow()
            self._ghost.show(self.guide.ghost)
            lines += self.guide.lines()
        if self._slider is not None:
            self._slider.GetSliderRepresentation().SetValue(1e3 * self.pointer.press_depth_m)
        self._scale_type()
        width, _ = self.plotter.window_size
        letters = int(PANEL_SHARE * width / (LETTER * self._status.prop.font_size))
        self._status.input = "\n".join(part for line in lines for part in wrap(line, max(letters, 20)))
        for side, (over, name) in enumerate(zip(self._headings, self._names, strict=True)):
            over.input = heading(name, felt=side == 0)
        self.frames += 1

    @property
    def _guiding(self) -> bool:
        """Whether a next touch is suggested: one thing is asked for at a time."""
        return self.guide is not None and self.guide.suggestion.kind != "stop"

    def _thin_out(self, beside: bool, words: bool) -> None:
        """Draw what is felt; the second picture, and words and plots, only where the pace allows them."""
        if words:
            self._charts.update(self.session.trace)
        *pictures, panel = self.plotter.renderers
        for renderer in pictures[1:]:
            renderer.SetDraw(beside)
        panel.SetDraw(words)

    def _scale_type(self) -> None:
        """Type grows and shrinks with the window."""
        width, height = self.plotter.window_size
        if (width, height) != self._scaled_for:
            self._scaled_for = width, height
            self._pace.forget()
            share = min(width / SIZE[0], height / SIZE[1])
            for text, points in self._texts:
                text.prop.font_size = max(LEAST_TYPE, round(points * share))

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
        shown()
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
                with atomic_file(screenshot, PNG) as temporary:
                    self.plotter.screenshot(str(temporary))
            self.controls.interactor.TerminateApp()

    def close(self) -> None:
        """End `run` at the next frame."""
        self.closed = True
