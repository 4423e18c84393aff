"""The touch window off-screen: events in, the servo's answer and a picture out."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista

from palpate.mechanics.errors import ModelError
from palpate.mechanics.model.material import Ball
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import read_recording
from palpate.operations.touch import ServoRun
from palpate.scenes.phantoms import Region
from palpate.scenes.scene import Scene, load_scene
from palpate.show.colours import ACCENT, BUTTON, COLOURS, PAPER
from palpate.window.charts import LEAST_MM, LEAST_N, ROOM, LiveCharts
from palpate.window.game import Game
from palpate.window.keys import KEYS
from palpate.window.panel import DEPTH, NextStep, main_rows
from palpate.window.session import SessionOptions
from palpate.window.widgets import BODY, fitted
from palpate.window.widgets import SIZE as FULL
from palpate.window.window import COLUMN, TouchWindow

from ...support.waiting import PATIENCE_S, eventually
from ..show.test_colours import contrast
from .driven import HALF, Driven, driving

SIZE = (640, 480)
NODULE, UP = Ball((0.0, 0.0, 0.02), 0.005, 8.0), np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def driven(block: Model, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driven]:
    """One session for all tests of this file: they leave it hovering, as it was."""
    scene = Scene("block", "model", str(block.path), title="Block", beside="hunt-crossley")
    with driving(block, scene, SessionOptions(beside=scene.beside), size=SIZE) as hand:
        yield hand


def sizes(frame) -> list[float]:
    return [float(np.linalg.norm(view.force_n)) for view in frame.views]


def press(driven: Driven):
    driven.mouse(0.5, 0.55)
    driven.button(True)
    return driven.pressed(driven.window.pointer.press_depth_m)


def seen_through(driven: Driven) -> bool:
    """Whether the object lets what is inside be seen; then the ball is there as well."""
    picture = driven.window.pictures[0]
    assert (picture._actor.prop.opacity < 1.0) == bool(picture._ball.GetVisibility())
    return picture._actor.prop.opacity < 1.0


def release(driven: Driven):
    driven.button(False)
    return driven.until(lambda f: not f.touching and not any(sizes(f)))


def test_hover_press_release(driven: Driven) -> None:
    driven.mouse(0.5, 0.55)
    hovering = driven.until(lambda f: f.tip_m[2] < 0.06)
    assert not hovering.touching and not any(sizes(hovering))
    pressed = press(driven)
    fem, one_d = pressed.views
    assert (fem.name, one_d.name) == ("fem", "hunt-crossley")
    assert fem.force_n[2] > 0.1 and one_d.force_n[2] > 0.1, "the tool is pushed out"
    assert sizes(pressed)[1] == pytest.approx(sizes(pressed)[0], rel=0.35), "one tip drives both"
    sunk = fem.displacement_m[:, 2].min()
    assert sunk == pytest.approx(-pressed.depth_m, rel=0.15)
    assert np.abs(fem.displacement_m).sum() > 2 * np.abs(one_d.displacement_m).sum(), "1D only dents"
    released = release(driven)
    assert np.abs(released.views[0].displacement_m).max() < 1e-9


def test_the_picture_shows_tip_arrow_and_plot(driven: Driven) -> None:
    def like(colour: tuple[int, int, int]) -> int:
        return int((np.abs(driven.picture().astype(int) - colour).sum(axis=2) < 90).sum())

    arrow, tip = (pyvista.Color(COLOURS[thing]).int_rgb for thing in ("fem", "tip"))
    before, hovering = like(arrow), like(tip)
    press(driven)
    driven.until(lambda f: like(arrow) > before + 30)  # an arrow appears
    assert hovering > 50, "the tip is drawn"
    driven.until(lambda f: len(driven.session.trace.curves()) > 100)
    assert driven.session.trace.curves()[:, 1].max() > 0.1
    release(driven)


def test_wheel_presses_deeper(driven: Driven) -> None:
    before = press(driven)
    driven.wheel(4)
    deeper = driven.until(lambda f: f.depth_m > before.depth_m + 0.0019)
    assert sizes(deeper)[0] > 1.3 * sizes(before)[0]
    driven.wheel(-4)
    release(driven)


def test_the_slider_sets_the_depth_and_presses_nothing(driven: Driven) -> None:
    pointer, column = driven.window.pointer, driven.window.boards[0]
    driven.frame()
    before = pointer.press_depth_m
    x, y = column.find(DEPTH)
    driven.pixel(x, y)
    driven.button(True)
    driven.pixel(x + 0.2 * COLUMN * column.scale, y)
    assert not pointer.pressing
    driven.button(False)
    assert pointer.press_depth_m > before + 0.002
    driven.pixel(x, y)
    assert pointer.press_depth_m > before + 0.002, "the slider was let go"
    pointer.go_deep(1e3 * before)
    driven.says(f"{1e3 * before:.1f} mm deep")  # the slider follows the wheel and the keys
    driven.mouse(0.5, 0.55)


def test_keys_change_modulus_and_friction(driven: Driven) -> None:
    soft = press(driven)
    driven.key("plus")
    stiff = driven.until(lambda f: sizes(f)[0] > 1.2 * sizes(soft)[0])
    stiff = driven.pressed(stiff.depth_m)
    assert sizes(stiff)[0] == pytest.approx(1.25 * sizes(soft)[0], rel=0.01)
    driven.key("minus")
    driven.until(lambda f: sizes(f)[0] == pytest.approx(sizes(soft)[0], rel=0.01))
    assert driven.session.friction == 1.0  # what a renderer has by itself
    driven.key("f")
    assert driven.session.friction == 0.5
    while driven.session.friction != float("inf"):
        driven.key("f")
    release(driven)


def test_tab_changes_the_renderer_that_is_felt(driven: Driven) -> None:
    driven.key("Tab")
    assert driven.session.renderer_name == "kelvin-voigt"
    pressed = press(driven)
    assert pressed.views[0].name == "kelvin-voigt" and sizes(pressed)[0] > 0.1
    release(driven)
    driven.session.set_renderer("fem")
    driven.session.worker.wait()
    assert driven.session.renderer_name == "fem"


def test_colour_by_stiffness(driven: Driven) -> None:
    driven.until(lambda f: not any(sizes(f)) and f.tip_m[2] > 0.0529)
    low, beside = round(0.7 * SIZE[1]), round(COLUMN * driven.window.boards[0].scale) + 1

    def pictures() -> np.ndarray:
        """Without the columns and plots beside them, which run on."""
        return driven.picture()[:low, beside:].astype(int)

    seen: list[np.ndarray] = []

    def rests(frame) -> bool:
        """Four pictures in a row are alike: the tip rests, and what is drawn by turns was drawn twice."""
        seen[:] = [*seen[-3:], pictures()]
        return len(seen) == 4 and all(np.abs(each - seen[-1]).mean() < 0.02 for each in seen)

    driven.until(rests)
    before = seen[-1]
    driven.key("c")
    surface = driven.window.pictures[0]._surface
    driven.until(lambda f: driven.window.stiffness_drawn)
    (name,) = [
        name for name in surface.array_names if f"{1e3 * driven.window.pointer.press_depth_m:g} mm" in name
    ]
    values = surface[name]
    assert 20 < np.median(values) < 300
    changed = np.abs(pictures() - before).mean()
    assert changed > 5
    driven.key("c")
    # what is not felt is drawn by turns where drawing is slow
    driven.until(lambda f: np.abs(pictures() - before).mean() < 0.1 * changed)


def test_escape_closes_what_is_open_and_never_the_session(driven: Driven) -> None:
    for aside in ("h", "s", ""):
        driven.key(aside) if aside else None
        driven.key("Escape")
        driven.says("Close", says=False)
        driven.until(lambda f: True)
        assert not driven.window.closed and driven.window.aside == ""


def test_an_inclusion_is_dragged_and_felt(driven: Driven) -> None:
    plain = press(driven)
    release(driven)
    driven.key("i")
    driven.inclusion_settled()
    under = press(driven)
    assert sizes(under)[0] > 1.05 * sizes(plain)[0]
    assert sizes(under)[1] == pytest.approx(sizes(plain)[1], rel=0.02), "a 1D model knows of no inside"
    release(driven)
    start = np.array(driven.session.inclusion.centre_m)
    camera = driven.window.plotter.camera
    sideways = np.cross(camera.direction, camera.up)
    driven.mouse_at(start)
    driven.button(True, "Middle")
    for share in np.linspace(0.0, 1.0, 12):
        driven.mouse_at(start + 0.024 * share * sideways)
        driven.window.tick()
    driven.button(False, "Middle")
    moved = np.array(driven.session.inclusion.centre_m)
    assert moved == pytest.approx(start + 0.024 * sideways, abs=5e-4), "it follows the mouse"
    driven.inclusion_settled()
    away = press(driven)
    assert sizes(away)[0] < sizes(plain)[0] + 0.5 * (sizes(under)[0] - sizes(plain)[0])
    for _ in range(3):
        driven.key("Left")
    assert driven.session.inclusion.centre_m[0] == pytest.approx(moved[0] - 0.006)
    driven.inclusion_settled()
    nearer = driven.until(lambda f: sizes(f)[0] > sizes(away)[0] + 1e-3)
    assert nearer.touching, "the press went on meanwhile"
    driven.key("i")
    driven.inclusion_settled()
    release(driven)  # what stuck to the tip while the ball moved stays until it leaves
    assert sizes(press(driven))[0] == pytest.approx(sizes(plain)[0], rel=1e-3)
    release(driven)


class Held:
    """What a job calls is held up until `go_on` is set; it tells half of its work before."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> None:
        self.reached, self.go_on = threading.Event(), threading.Event()
        inner = getattr(owner, name)

        def held(*args, **keywords):
            tell = next((each for each in args if getattr(each, "__name__", "") == "tell"), None)
            if tell is not None:
                tell("half of it", 0.5)
            self.reached.set()
            assert self.go_on.wait(PATIENCE_S)
            return inner(*args, **keywords)

        monkeypatch.setattr(owner, name, held)


def test_a_ball_says_what_it_waits_for_and_is_felt_under_the_tip_that_holds_on(
    driven: Driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = press(driven)
    held = Held(monkeypatch, driven.session._inclusion, "follow")
    driven.key("i", wait=False)
    driven.until(lambda f: seen_through(driven) and held.reached.is_set())  # the ball is there at once
    driven.says("Computing the ball: half of it")
    meanwhile = driven.frame()
    assert meanwhile.busy == "computing the ball: half of it" and not driven.session.inclusion_felt
    assert sizes(meanwhile)[0] == pytest.approx(sizes(before)[0], rel=0.01), "what was felt is felt on"
    assert "busy" in driven.window.boards[0].text, "how much of it is done is shown"
    held.go_on.set()
    driven.inclusion_settled()
    driven.until(lambda f: sizes(f)[0] > 1.05 * sizes(before)[0])  # nobody pressed anew
    driven.says("Computing the ball", says=False)
    driven.key("i")
    driven.until(lambda f: not seen_through(driven))
    driven.inclusion_settled()
    release(driven)


def test_tab_says_what_it_loads_and_the_old_renderer_is_felt_until_then(
    driven: Driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = press(driven)
    held = Held(monkeypatch, driven.session.servo, "set_renderer")
    driven.key("Tab", wait=False)
    driven.until(lambda f: held.reached.is_set())
    driven.says("Loading the next renderer: half of it")
    meanwhile = driven.wait(0.05)
    assert meanwhile.views[0].name == "fem" == driven.session.renderer_name
    assert sizes(meanwhile)[0] == pytest.approx(sizes(before)[0], rel=0.01)
    held.go_on.set()
    driven.until(lambda f: f.views[0].name == "kelvin-voigt" and sizes(f)[0] > 0.1)
    driven.says("Loading", says=False)
    release(driven)
    driven.session.set_renderer("fem")
    driven.session.worker.wait()


def test_a_session_is_recorded(driven: Driven, block: Model, tmp_path: Path) -> None:
    path = tmp_path / "touched.csv.gz"
    driven.session.begin_recording(path)
    press(driven)
    frame = release(driven)
    assert frame.recorded_s > 0
    driven.session.end_recording()
    recording = read_recording(path)
    assert recording.base_model == block.path and recording.poisson_ratio == 0.49
    assert recording.truth["young_modulus_pa"] == pytest.approx(20e3)
    assert recording.truth["renderer"] == "fem"
    assert np.median(np.diff(recording.t)) == pytest.approx(0.001)
    assert recording.force_on_tool[:, 2].max() > 0.1
    deepest = recording.position[:, 2].min()
    assert deepest == pytest.approx(0.045 - driven.window.pointer.press_depth_m, abs=3e-4)


def test_the_view_keeps_up_with_drags_zooms_and_comes_home(driven: Driven) -> None:
    camera = driven.window.plotter.camera
    home = np.array(camera.GetPosition())
    for _ in range(3):
        driven.mouse(0.5, 0.5)
        driven.button(True, "Right")
        for x in np.linspace(0.5, 0.9, 9):
            driven.mouse(x, 0.5)
        driven.button(False, "Right")
    turned = np.array(camera.GetPosition())
    assert np.linalg.norm(turned - home) > 0.05 and turned[2] == pytest.approx(home[2])
    driven.wheel(3)
    assert camera.GetDistance() == pytest.approx(np.linalg.norm(home - camera.GetFocalPoint()) / 1.12**3)
    driven.key("v")
    assert np.array(camera.GetPosition()) == pytest.approx(home)


def test_keys_pressed_while_the_worker_is_busy_are_done_after(driven: Driven) -> None:
    gate = threading.Event()
    before = driven.session.young_modulus_pa
    driven.session.worker.run("waiting", lambda: gate.wait(PATIENCE_S) and None)
    for _ in range(3):
        driven.window.controls.key("plus")
    gate.set()
    driven.session.worker.wait()
    assert driven.session.young_modulus_pa == pytest.approx(before * 1.25**3)
    for _ in range(3):
        driven.key("minus")


def test_only_what_does_something_is_offered(driven: Driven) -> None:
    offered = driven.window.controls.offered
    assert {"f", "i", "b", "v"} <= offered and not {"space", "Return", "arrows"} & offered
    driven.session.set_renderer("kelvin-voigt")
    driven.session.worker.wait()
    assert not {"f", "i"} & driven.window.controls.offered, "a 1D model knows neither friction nor a ball"
    driven.session.set_renderer("fem")
    driven.session.worker.wait()


def test_a_guided_person_is_asked_for_one_thing_at_a_time(driven: Driven, monkeypatch) -> None:
    window = driven.window
    guide = SimpleNamespace(
        suggestion=SimpleNamespace(kind="press"), lines=lambda: ["press at the ghost", "nothing"]
    )
    monkeypatch.setattr(window, "game", Game([NODULE], UP))
    driven.says("A nodule is hidden")
    monkeypatch.setattr(window, "guide", guide)
    driven.says("Press at the ghost.")
    driven.says("A nodule is hidden", says=False)
    guide.suggestion.kind = "stop"
    driven.says("A nodule is hidden")


def test_enter_while_pressing_keeps_the_answer(driven: Driven, monkeypatch) -> None:
    game = Game([NODULE], UP)
    monkeypatch.setattr(driven.window, "game", game)
    press(driven)
    driven.says("It is here")
    driven.says("Move the mouse", says=False)
    driven.key("Return")
    driven.wait(0.05)
    assert game.answered and len(game.answers) == 1, "the press that goes on begins no round"
    assert seen_through(driven)
    driven.says("points")
    release(driven)
    assert game.answered and seen_through(driven)
    press(driven)
    assert not game.answered and not seen_through(driven), "the next touch does"
    release(driven)


def test_the_button_of_the_answer_means_the_last_press(driven: Driven, monkeypatch) -> None:
    """The mouse's way to the button leads over the table, and the tip hovers after it."""
    game = Game([NODULE], UP)
    monkeypatch.setattr(driven.window, "game", game)
    pressed = press(driven).tip_m
    release(driven)
    driven.mouse(0.01, 0.3)
    driven.rests()
    driven.click("It is here")
    assert game.answers[0].off_m == pytest.approx(np.hypot(*(pressed - NODULE.centre_m)[:2]), abs=1e-3)
    driven.frame()


def test_a_button_that_is_held_on_the_support_is_asked_for_no_more(driven: Driven) -> None:
    """Along the whole foot, which is traced with it, it was."""
    said = NextStep(driven.window, mouse=True)
    driven.mouse_at(np.array([0.0, -HALF - 0.02, 0.0]))
    driven.rests()
    driven.button(True)
    leaning = driven.until(lambda frame: not frame.touching and any(sizes(frame)))
    assert "left button" not in said.line(leaning)
    release(driven)


def test_a_view_that_was_tilted_was_turned(driven: Driven) -> None:
    """It was turned straight up, and to turn it was asked for still."""
    orbit, frame = driven.window.orbit, driven.frame()
    said = NextStep(driven.window, mouse=True)
    said._steps = [(words, done) for words, done in said._steps if "view turns" in words]
    assert "view turns" in said.line(frame)
    orbit.turn(0.0, -0.1)
    assert "view turns" not in said.line(frame)
    orbit.reset()


def test_the_arrow_of_a_great_force_stays_in_the_picture(driven: Driven) -> None:
    """From 1.5 N on it was cut off, and crossed the titles."""
    picture, frame = driven.window.pictures[0], driven.frame()
    size_m = np.linalg.norm(np.ptp(driven.session.model.mesh.points, axis=0))
    lengths = []
    for newtons in (0.2, 0.4, 5.0, 50.0):
        picture.update(frame, replace(frame.views[0], force_n=np.array([0.0, 0.0, newtons])))
        matrix = picture._arrow.GetUserMatrix()
        lengths.append(np.linalg.norm([matrix.GetElement(k, 0) for k in range(3)]))
    assert lengths[1] == pytest.approx(2 * lengths[0]) and max(lengths) < 0.3 * size_m
    driven.frame()


def test_a_question_mark_opens_help(driven: Driven) -> None:
    driven.key("question")
    assert driven.window.aside == "h"
    driven.key("question")
    assert driven.window.aside == ""


def test_a_force_high_over_the_support_is_not_the_supports(driven: Driven) -> None:
    """Of a tip that had just left the dome it said 'on the support'."""
    frame = driven.frame()
    pushed = (replace(frame.views[0], force_n=np.array([0.0, 0.0, 0.3])),)
    for height_m, low in ((0.005, True), (0.05, False)):
        there = replace(frame, views=pushed, depth_m=0.0, tip_m=np.array([0.0, -0.06, height_m]))
        assert ("on the support" in str(main_rows(driven.window, there))) == low


def test_everything_stands_beside_everything_else(driven: Driven) -> None:
    """Columns, pictures and plots share the window out; buttons lie in their column and not on another."""
    for aside in ("s", "h", ""):
        driven.window.show_aside(aside or driven.window.aside)
        driven.says("Close", says=bool(aside))
        areas = [(v[2] - v[0]) * (v[3] - v[1]) for v in (r.viewport for r in driven.window.plotter.renderers)]
        assert sum(area for area in areas if area > 1e-3) == pytest.approx(1.0)
        for board in driven.window.boards[: 2 if aside else 1]:
            boxes = [at for item, at in board.placed if item.text]
            assert all(board.holds(*at[:2]) and board.holds(*at[2:]) for at in boxes)
            for k, (left, low, right, high) in enumerate(boxes):
                assert not any(
                    left < r and x < right and low < t and y < high for x, y, r, t in boxes[k + 1 :]
                ), "nothing lies on another"


def test_a_button_says_what_it_does_and_its_key(driven: Driven) -> None:
    column = driven.window.boards[0]
    driven.frame()
    before = driven.picture()
    driven.pixel(*column.find("Stiff ball"))
    driven.frame()
    shown = np.abs(driven.picture().astype(int) - before).sum(axis=2) > 0
    assert shown[:, : round(COLUMN * column.scale)].mean() > 0.02, "a tip is drawn"
    tips = {item.text: item.tip for item, _ in column.placed if item.do}
    assert tips["Stiff ball"].endswith("(I)") and tips["Quit"].endswith("(Q)")
    assert all(tips.values())
    driven.mouse(0.5, 0.55)


def test_the_force_is_large_and_the_next_step_is_said(driven: Driven) -> None:
    column = driven.window.boards[0]
    driven.says(f"{sizes(press(driven))[0]:.2f} N")
    assert max(item.size for item, _ in column.placed if item.text.endswith(" N")) > 3 * BODY
    release(driven)


def test_every_word_stands_out_from_what_is_behind_it(driven: Driven) -> None:
    """The hint was green on green, 4.4 to 1."""
    driven.window.show_aside("s")
    driven.says("Close")
    for board in driven.window.boards:
        for item, _ in board.placed:
            behind = item.fill or (BUTTON if item.do else board.fill)
            colours = (PAPER, ACCENT) if item.on else (item.colour, behind)
            assert not item.text or contrast(*colours) >= 4.5, item.text
    told = " ".join(board.text for board in driven.window.boards)
    assert told.count("A press goes") == 1, "once is enough"
    driven.window.show_aside("s")
    driven.says("Close", says=False)


def test_pictures_of_one_scale_have_one_bar(driven: Driven) -> None:
    driven.frame()
    assert driven.window.sides == 2 and len(driven.window.plotter.scalar_bars) == 1


@pytest.mark.parametrize(("by", "samples"), [("llvmpipe (LLVM 15)", 0), ("NVIDIA GeForce RTX 3060", 4)])
def test_a_graphics_card_smooths_edges(driven: Driven, by: str, samples: int) -> None:
    """They were stairs on every machine."""
    window = driven.window.plotter.render_window
    card = SimpleNamespace(ReportCapabilities=lambda: by, SetMultiSamples=window.SetMultiSamples)
    seen = SimpleNamespace(plotter=SimpleNamespace(render_window=card))
    TouchWindow.smooth_edges(seen)
    assert window.GetMultiSamples() == samples
    window.SetMultiSamples(0)


def test_an_empty_plot_shows_newtons_and_millimetres() -> None:
    plotter = pyvista.Plotter(off_screen=True)
    charts = LiveCharts(plotter, 6.0)
    ranges = [list(chart.y_range) for chart in (charts._force, charts._depth)]
    plotter.close()
    assert ranges == [[0.0, LEAST_N], [0.0, LEAST_MM]] and LEAST_N > 0.1


def test_times_on_a_wide_plot_do_not_touch_each_other() -> None:
    plotter = pyvista.Plotter(off_screen=True, window_size=[3120, 570])
    charts = LiveCharts(plotter, 6.0)
    charts.scale(2.5)
    plotter.show(auto_close=False)
    told = list(charts._force.x_axis.tick_labels)
    plotter.close()
    assert told == [str(second) for second in range(-6, 1)]


def test_every_letter_grows_with_the_window(driven: Driven) -> None:
    """At 4k those of charts, bar and directions were as small as on a laptop."""
    window = driven.window

    def sizes_of_type() -> np.ndarray:
        driven.frame()
        bar = window.plotter.scalar_bars[window.pictures[0]._bar]
        axes = [axis for c in (window._charts._force, window._charts._depth) for axis in (c.x_axis, c.y_axis)]
        kinds = [bar.GetTitleTextProperty(), bar.GetLabelTextProperty()]
        kinds += [kind for axis in axes for kind in (axis.GetTitleProperties(), axis.GetLabelProperties())]
        return np.array(
            [kind.GetFontSize() for kind in kinds + [a.GetTextProperty() for a in window._axes.letters]]
        )

    small, size = sizes_of_type(), window.plotter.window_size
    window.plotter.window_size = [3840, 2160]
    large = sizes_of_type()
    window.plotter.window_size = size
    assert large.min() >= 25 and (large > 3 * small).all()
    assert (sizes_of_type() == small).all()


def test_no_letter_of_the_axes_lies_on_another(driven: Driven) -> None:
    axes, orbit = driven.window._axes, driven.window.orbit
    seen = set()
    for _ in range(12):
        orbit.turn(0.17, 0.03)
        axes.update(1.0)
        shown = [letter for letter in axes.letters if letter.GetVisibility()]
        places = np.array([letter.GetPosition() for letter in shown])
        gaps = np.linalg.norm(places[:, None] - places[None], axis=2) + 100.0 * np.eye(len(places))
        assert gaps.min() > ROOM
        seen.add(len(shown))
    assert seen == {2, 3}, "and all are shown where there is room"
    orbit.reset()


def test_a_rim_shows_no_triangles(driven: Driven) -> None:
    """Along a rim of the block the light is the same everywhere: teeth showed there."""
    surface = driven.window.pictures[0]._surface
    points, normals = np.asarray(surface.points), np.asarray(surface.point_data["normals"])
    high = points[:, 2].max()
    rim = (points[:, 2] > high - 0.006) & (normals[:, 0] > 0.2) & (np.abs(points[:, 1]) < 0.02)
    assert rim.sum() > 20 and np.degrees(np.abs(normals[rim, 1])).max() < 3.0


def test_the_window_is_called_by_its_object(driven: Driven, tmp_path: Path) -> None:
    assert driven.window.plotter.title.startswith("Block")
    folder = tmp_path / "model"
    folder.mkdir()
    (folder / "model.toml").write_text('[provenance]\nrecording = "liver"\n')
    assert load_scene(folder).title == "liver (model)"


def test_a_mouse_is_not_told_of_forces_sent_to_it(driven: Driven) -> None:
    press(driven)
    report = driven.session.report()
    lines = {
        device: "\n".join(ServoRun(driven.window.scene, device, "fem", report, None, "").lines())
        for device in ("mouse", "simulated")
    }
    assert "N rendered, none sent" in lines["mouse"]
    assert "N sent" in lines["simulated"]
    release(driven)


def test_two_pictures_by_one_button(driven: Driven) -> None:
    window = driven.window
    assert window.sides == 2
    driven.click("Side by side")
    assert window.sides == 1 and len(press(driven).views) == 1
    left, _, right, _ = window.picture_renderers[0].viewport
    assert right == 1.0, "what is felt has all the room"
    driven.click("Side by side")
    assert window.sides == 2
    both = press(driven)
    assert both.views[1].name == "hunt-crossley"
    driven.says("N  Hunt–Crossley spring")
    release(driven)


def test_settings_change_what_is_felt(driven: Driven) -> None:
    session = driven.session
    driven.click("Settings")
    driven.click("0.2")
    assert session.friction == 0.2
    driven.click("1")
    driven.click("stiffer")
    assert session.young_modulus_pa == pytest.approx(25e3)
    driven.click("25.0 kPa")
    assert session.young_modulus_pa == pytest.approx(20e3)
    driven.click("Hunt–Crossley spring")
    assert session.renderer_name == "hunt-crossley"
    driven.says("Friction", says=False)
    driven.click("this model")
    assert session.renderer_name == "fem"
    driven.says("finite strain")
    driven.click("off")
    assert not session.effects and driven.session.servo.alive
    driven.click("on")
    assert session.effects and session.worker.failure == ""
    driven.click("Close")
    driven.says("Friction", says=False)


def test_a_ball_never_leaves_the_object(driven: Driven) -> None:
    pointer = driven.window.pointer
    driven.mouse_at(np.array([0.0, -0.05, 0.0]))  # on the support
    assert pointer.target.on_support
    centre, radius = pointer.under(0.008)
    assert np.abs(centre[:2]).max() < 0.04 and radius < centre[2] < 0.04
    thin = pointer.inside(np.array([0.0, 0.0, -0.02]), 0.004)
    assert thin == pytest.approx([0.0, 0.0, 0.004], abs=1e-4)
    assert pointer.inside(np.array([0.01, 0.0, 0.02]), 0.004) == pytest.approx([0.01, 0.0, 0.02])
    driven.mouse(0.5, 0.55)


def test_a_ball_that_cannot_be_computed_is_not_left_half_shown(driven: Driven, monkeypatch) -> None:
    def fails(*_: object) -> None:
        raise ModelError("no memory for it")

    monkeypatch.setattr(driven.session._inclusion, "follow", fails)
    driven.session.place_inclusion(Region("ball", (0.0, 0.0, 0.02), 0.008, 8.0))
    driven.until(lambda f: driven.session.worker.failure)
    assert "no memory for it" in driven.until(lambda f: driven.session.worker.failure).busy
    driven.session.place_inclusion(None)
    driven.frame()
    assert not seen_through(driven)
    driven.session.worker.run("going on", lambda: None)
    driven.session.worker.wait()


def test_help_and_screenshot(driven: Driven, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    driven.click("Help")
    driven.says("Press less deep")
    driven.key("h")
    driven.says("Press less deep", says=False)
    driven.click("More")
    driven.click("Save picture")
    driven.click("More")
    driven.says("Save picture", says=False)
    assert len(list(tmp_path.glob("touch-*.png"))) == 1


def test_the_servo_never_waits_for_the_window(driven: Driven) -> None:
    """While the window draws nothing, the loop in the other process runs on."""
    before, drawn = driven.session.report().ticks, driven.window.frames
    assert eventually(lambda: driven.session.report().ticks > before + 500)
    assert driven.window.frames == drawn
    assert driven.session.servo.alive


def test_buttons_stand_in_three_groups_and_the_rare_ones_are_folded_away(driven: Driven) -> None:
    column = driven.window.boards[0]
    driven.frame()
    words = column.text.split("\n")
    groups = [word for word in words if word in ("Touch", "Look", "Session")]
    assert groups == ["Touch", "Look", "Session"]
    buttons = {item.text for item, _ in column.placed if item.do}
    rare = {key.button for key in KEYS.values() if key.rare}
    assert rare and not rare & buttons
    driven.click("More")
    driven.says("Save picture")
    assert rare <= {item.text for item, _ in column.placed if item.do}
    driven.click("More")


def test_a_renderer_has_a_name_for_people_and_says_the_technical_one(driven: Driven) -> None:
    driven.click("Settings")
    driven.says("Close")
    column, aside = driven.window.boards
    tips = {item.text: item.tip for item, _ in aside.placed if item.do}
    assert tips["this model"] == "fem" and tips["Kelvin–Voigt spring"] == "kelvin-voigt"
    assert "fem" not in column.text and any("friction coefficient" in item.tip for item, _ in column.placed)
    driven.click("Close")


@pytest.mark.parametrize("screen", [(1366, 768), (1024, 600), (1920, 1080), (3840, 2160)])
def test_a_window_fits_its_screen(screen):
    """Of 800 pixels on a laptop of 768 the time axes of the plots could not be seen."""
    width, height = fitted(FULL, screen)
    assert width <= min(FULL[0], screen[0]) and height <= min(FULL[1], screen[1] - 60)
    assert (width, height) == FULL or screen[1] < 900


class Forgetful:
    """An interactor as VTK's is: what a callback raises is printed and forgotten."""

    def __init__(self) -> None:
        self.calls, self.on = {}, True

    def AddObserver(self, event: str, call) -> None:
        self.calls[event] = call

    def CreateRepeatingTimer(self, period_ms: int) -> None:
        pass

    def Start(self) -> None:
        for _ in range(9):
            with suppress(BaseException):
                self.calls["TimerEvent"]()

    def TerminateApp(self) -> None:
        self.on = False


def test_ctrl_c_ends_a_session_whatever_it_is_drawing():
    """Raised inside a picture's callback it was printed and forgotten: the window stayed."""
    plotter, window = pyvista.Plotter(off_screen=True, window_size=[64, 48]), TouchWindow.__new__(TouchWindow)
    window.plotter, window.closed, window.another, window._ended = plotter, False, False, False
    window.controls = SimpleNamespace(interactor=Forgetful())
    window.tick = lambda: signal.raise_signal(signal.SIGINT)
    before = signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # ignored where tests run in the background
    try:
        with pytest.raises(KeyboardInterrupt):
            window.run()
    finally:
        signal.signal(signal.SIGINT, before)
    assert not window.controls.interactor.on
