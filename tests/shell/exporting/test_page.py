"""A page that can be pressed, in a real browser: its forces are those of `palpate press`, and mouse, finger,
pen, keys and links move its tip."""

from __future__ import annotations

import copy
import dataclasses
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate.devices.codecs import spacemouse
from palpate.exporting.page.document import ONE_D, button, force_band, page_of, shown_modes
from palpate.exporting.page.tables import first_depth, modes_of
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import error_figures, force_errors, said
from palpate.render.press import Stroke, press, read_curve
from palpate.render.scene import in_the_air
from palpate.scenes.scene import FIND_M, load_scene
from palpate.words import renderer_words

from ..show import browser

needs_browser = pytest.mark.skipif(
    browser.browser_found() is None, reason="needs a browser: chromium or google-chrome on the PATH"
)
MU = 0.4
SHARE, AT_LEAST_N = 0.02, 0.005
"""What the page may differ by from the renderer."""


@pytest.fixture(scope="module")
def renderer(tmp_path_factory: pytest.TempPathFactory, block: Model) -> FemRenderer:
    """A block that was pressed at 16 places, on which a tip slides early."""
    slippery = block.replaced(path=None, effects={**block.effects, "friction_slip": {"mu": MU}})
    model = read_model(write_model(tmp_path_factory.mktemp("page") / "MODEL", slippery))
    for condensed in block.path.glob("compliance-*.bin"):  # friction changes none of it
        shutil.copy(condensed, model.path)
    return FemRenderer(model)


@pytest.fixture(scope="module")
def written(renderer: FemRenderer) -> Path:
    path = renderer.model.path.parent / "touch.html"
    notes = pp.export(renderer.model, "page", path, progress=False)
    assert len(notes) == 1 and "memory" in notes[0]
    return path


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Iterator:
    if browser.browser_found() is None:
        pytest.skip("needs a browser: chromium or google-chrome on the PATH")
    with browser.a_tab(tmp_path_factory.mktemp("profile")) as tab:
        yield tab


@pytest.fixture
def tab(shown, written: Path):
    shown.complaints.clear()
    opened(shown, written)
    yield shown
    assert shown.complaints == []


@pytest.fixture
def asked(shown, written: Path):
    """The page as it stands, for what a script asks of it: opened only where another one is."""
    shown.complaints.clear()
    if not shown.evaluate(
        f"location.href === {json.dumps(written.as_uri())} && window.palpate !== undefined"
    ):
        opened(shown, written)
    yield shown
    assert shown.complaints == []


def opened(tab, path: Path, width: int = 1200, height: int = 800, **more) -> None:
    tab.open(path, width, height, **more)
    tab.wait("window.palpate !== undefined")


def box(tab, name: str = "stage") -> list[float]:
    """Left, top, width, height."""
    tab.evaluate(f"document.getElementById('{name}').scrollIntoView({{block: 'nearest'}})")
    get = f"const b = document.getElementById('{name}').getBoundingClientRect()"
    return tab.evaluate(f"(() => {{ {get}; return [b.left, b.top, b.width, b.height]; }})()")


def on_the_object(tab) -> tuple[float, float]:
    """Where the middle of the object's top is seen."""
    left, top, width, height = box(tab)
    seen = tab.evaluate(
        "(() => { const p = palpate.page, m = p.camera.matrix(p.drawing.fit()),"
        " q = p.surface.at(p.topPlace()).point,"
        " w = [0, 1, 3].map((r) => m[r] * q[0] + m[4 + r] * q[1] + m[8 + r] * q[2] + m[12 + r]);"
        " return [w[0] / w[2], w[1] / w[2]]; })()"
    )
    return left + width * (1 + seen[0]) / 2, top + height * (1 - seen[1]) / 2


def state(tab, what: str):
    return tab.evaluate(f"palpate.page.{what}")


def drawn_presses(
    renderer: FemRenderer, count: int, seed: int = 0
) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """(place, direction, depth) of straight and slanting presses all over the sides and the top."""
    rng, arrays = np.random.default_rng(seed), renderer.contact.arrays
    triangles = arrays.triangles[arrays.free > 0]
    found: list[tuple[np.ndarray, np.ndarray, float]] = []
    while len(found) < count:
        weights, corners = rng.dirichlet([1.0, 1.0, 1.0]), triangles[rng.integers(len(triangles))]
        at, normal = weights @ arrays.vertices[corners], weights @ arrays.normals[corners]
        if at[2] < 0.006:  # lower down a tip meets the support, which a page has not
            continue
        aside = np.cross(normal, rng.normal(size=3))
        tilt = 0.0 if len(found) % 2 == 0 else np.tan(np.radians(rng.uniform(5, 45)))
        way = -normal + tilt * aside / np.linalg.norm(aside)
        found.append((at, way, float(rng.uniform(5e-4, 8e-3))))
    return found


def test_far_field_modes_and_tables_lose_little(renderer):
    compliance = renderer.compliance
    modes = shown_modes(compliance)
    corner, force = len(modes) // 2, np.array([0.3, -0.2, 1.0])
    exact, shown = compliance.displacement(corner, force), modes @ (force @ modes[corner])
    # right under the tip a dent is drawn over it
    away = np.linalg.norm(compliance.points - compliance.points[corner], axis=1) > 0.015
    assert np.abs(shown - exact)[away].max() < 0.05 * np.abs(exact).max()
    table = np.outer(np.arange(1.0, 50.0), np.arange(1.0, 9.0)) + 0.5 * np.cos(np.arange(49.0))[:, None]
    kept = modes_of(table, table.mean(axis=0), 1e-6)
    assert kept.weights.shape[1] <= 3
    assert np.abs(kept.weights @ kept.basis - table).max() < 1e-4


def test_the_band_is_wider_for_a_modulus_that_is_less_known(renderer):
    model, depths = renderer.model, np.array([1e-3, 2e-3])
    bands = []
    for share in (0.2, 0.02):
        known = copy.copy(renderer)
        known.model = model.with_material(young_modulus_ci95_pa=(20e3 * (1 - share), 20e3 * (1 + share)))
        bands.append(force_band(known, depths))
    wide, narrow = bands
    assert (
        wide.shape == (len(renderer.contact.arrays.vertices), 2)
        and (wide > 0.2).all()
        and (narrow < wide).all()
        and (narrow > 0).all()
    )


def test_the_band_is_what_a_press_there_may_be_off_by(renderer):
    """One press had two numbers: the page's held the modulus's interval, the command's did not."""
    known, depth = copy.copy(renderer), 2e-3
    known.model = renderer.model.with_material(young_modulus_ci95_pa=(18e3, 22e3))
    surface, radius = renderer.contact.arrays, renderer.model.tool.tip_radius_m
    row = int(np.argmax(surface.vertices[:, 2]))
    centre = surface.vertices[row] + (radius - depth) * surface.normals[row]
    figures = error_figures(force_errors(known, centre[None], np.array([[0.0, 0.0, 1.0]]), radius))
    off = np.hypot(figures["force_error_n"], figures["modulus_error_n"])
    assert force_band(known, np.array([depth]))[row, 0] == pytest.approx(off, rel=1e-6)
    assert f"{1e3 * off:.3g} mN for the law and the modulus" in said(figures, from_touch=True)


def test_the_file_is_one_page_that_fetches_nothing(written):
    text = written.read_text(encoding="utf-8")
    assert text.startswith("<!doctype html>") and text.endswith("</body></html>")
    assert len(text) < 3e6 and "{{" not in text
    assert "http://" not in text and "https://" not in text


@needs_browser
def test_forces_are_those_of_palpate_press_stick_and_slide(asked, renderer):
    scene, misses, slid = in_the_air(renderer), [], 0
    for at, way, depth in drawn_presses(renderer, 60):
        try:
            curve = press(scene, at, way, Stroke(depth, 0.01))
        except pp.OptionError:
            continue
        force = curve.force_at(depth)
        pressed = (
            f"palpate.page.presser.press({json.dumps(at.tolist())}, {depth}, {json.dumps(way.tolist())})"
        )
        # all of an answer is a megabyte: the touch knows the whole surface
        answer = asked.evaluate(
            f"(({{ force_n, error_n, touch: {{ force, normal, normalForce }} }}) =>"
            f" ({{ force_n, error_n, touch: {{ force, normal, normalForce }} }}))({pressed})"
        )
        touch = answer["touch"]
        assert np.dot(touch["force"], touch["normal"]) == pytest.approx(touch["normalForce"], rel=1e-6), (
            "what holds the tip sideways turns with the surface that it slides over"
        )
        off = float(np.linalg.norm(np.array(answer["force_n"]) - force))
        along = float(force @ curve.normal)
        slid += np.linalg.norm(force - along * curve.normal) > 0.98 * MU * along
        misses.append(off / (SHARE * float(np.linalg.norm(force)) + AT_LEAST_N))
        assert answer["error_n"] > 0
    assert len(misses) > 50 and slid > 5
    assert np.quantile(misses, 0.95) < 1 and max(misses) < 1.5, sorted(misses)[-6:]


@needs_browser
def test_a_press_without_direction_is_straight_along_the_stated_normal(asked, renderer):
    presses = renderer.model.presses
    for i in (0, 7, 15):
        at, depth = presses.point[i], 0.003
        curve = press(in_the_air(renderer), at, -presses.normal[i], Stroke(depth, 0.01))
        force = asked.evaluate(f"palpate.press({json.dumps(at.tolist())}, {depth})")["force_n"]
        assert np.allclose(force, curve.force_at(depth), rtol=SHARE, atol=AT_LEAST_N)


@needs_browser
def test_the_mouse_presses_slides_and_lets_go(tab):
    x, y = on_the_object(tab)
    tab.mouse("mouseMoved", x, y)
    tab.mouse("mousePressed", x, y, button="left", clickCount=1)
    tab.wait("palpate.page.depth === palpate.page.goal && palpate.page.touch.normalForce > 0.1")
    assert state(tab, "touch.slipping") is False
    before = state(tab, "touch.point")
    lowest = tab.evaluate(
        "(() => { const p = palpate.page, rest = p.surface.vertices;"
        " return Math.min(...p.shape.points.map((v, i) => v - rest[i])); })()"
    )
    assert lowest < -1e-3, "the surface dents"
    tab.mouse("mouseMoved", x + 60, y, button="left", buttons=1)
    tab.wait("palpate.page.touch.slipping")
    force, normal, push = (
        state(tab, "touch.force"),
        state(tab, "touch.normal"),
        state(tab, "touch.normalForce"),
    )
    sideways = np.array(force) - np.dot(force, normal) * np.array(normal)
    assert np.linalg.norm(sideways) == pytest.approx(MU * push, rel=0.01)
    assert np.linalg.norm(np.array(state(tab, "touch.point")) - before) > 1e-3, (
        "what holds the tip walked after it"
    )
    wanted = state(tab, "wanted")
    tab.mouse("mouseWheel", x + 60, y, deltaX=0, deltaY=-100)
    tab.wait(f"palpate.page.wanted > {wanted}")
    tab.mouse("mouseReleased", x + 60, y, button="left", clickCount=1)
    tab.wait("!palpate.page.touch.touching")
    assert "greatest of the last press" in tab.evaluate("document.getElementById('parts').textContent")


@needs_browser
def test_a_rim_is_sharp_to_the_light(tab):
    """It was lit by the normals that are felt, which round a rim over a tip's radius."""
    points, normals = (
        np.reshape(tab.evaluate(f"Array.from(palpate.page.shape.{name})"), (-1, 3))
        for name in ("drawn", "normals")
    )
    corners = np.reshape(tab.evaluate("Array.from(palpate.page.shape.triangles)"), (-1, 3))
    a, b, c = points[corners].transpose(1, 0, 2)
    facing = np.cross(b - a, c - a)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    off = np.degrees(np.arccos(np.clip(np.einsum("kx,kcx->kc", facing, normals[corners]), -1, 1)))
    assert (np.percentile(off, [95, 99]) < [20, 30]).all(), "27 and 90 by the normals that are felt"


def test_a_page_presses_first_as_deep_as_the_game_asks_and_less_into_what_is_thin(block):
    """It began at 5 mm, where the game says 4, and a quarter into an object of 20 mm."""
    assert first_depth(block) == pytest.approx(min(FIND_M, 0.15 * np.ptp(block.mesh.points[:, 2])))
    flat = block.mesh.points * [1.0, 1.0, 0.2]
    thin = block.replaced(mesh=dataclasses.replace(block.mesh, points=flat))
    assert first_depth(thin) == pytest.approx(0.15 * np.ptp(flat[:, 2])) and first_depth(thin) < FIND_M


@needs_browser
def test_a_press_of_the_table_is_seen_wherever_it_lies(tab):
    """Of a place on the far side the tip stayed behind the object, and the picture above the screen."""
    rows = tab.evaluate("document.querySelectorAll('[data-at]').length")
    for row in range(rows):
        tab.evaluate(f"document.querySelectorAll('[data-at]')[{row}].click()")
        towards = "palpate.page.first.normal.reduce((sum, n, i) => sum + n * palpate.page.camera.back[i], 0)"
        assert tab.evaluate(towards) > 0.1
        stage = "document.getElementById('stage').getBoundingClientRect()"
        assert tab.evaluate(f"{stage}.bottom > 0 && {stage}.top < innerHeight")


@needs_browser
def test_the_forces_arrow_is_long_enough_to_be_seen(tab):
    """Its scale was that of the stiffest corner, at the foot: of a usual press it was a dot."""
    tab.evaluate("palpate.page.begin(palpate.page.topPlace(), true)")
    tab.wait("palpate.page.depth === palpate.page.goal && palpate.page.touch.normalForce > 0.05")
    assert tab.evaluate("0.5 * palpate.page.touch.normalForce / palpate.page.strongest") > 0.08


@needs_browser
def test_the_slider_stands_at_the_first_depth(tab, renderer):
    assert state(tab, "wanted") == pytest.approx(first_depth(renderer.model))


@needs_browser
def test_the_tip_shows_once_what_it_does_unless_less_motion_is_liked(tab, written):
    assert tab.evaluate("palpate.page.greeting") is None and state(tab, "touch.touching") is False
    opened(tab, written, lively=True)
    tab.wait("palpate.page.touch.normalForce > 0.1")
    tab.wait("palpate.page.greeting === null && !palpate.page.touch.touching")
    assert (
        tab.evaluate("document.getElementById('parts').textContent") == "not pressed yet curves: at its top"
    )
    assert tab.evaluate("document.getElementById('copy').disabled"), "nobody pressed"
    opened(tab, written, lively=True)
    tab.wait("palpate.page.touch.normalForce > 0.1")
    tab.evaluate("document.getElementById('stage').focus()")
    tab.key("n", 78)
    assert state(tab, "held") and state(tab, "touch.touching"), "what a person does comes first"


@needs_browser
def test_stiffness_is_coloured_at_the_depth_that_one_presses_to(tab):
    """It was that of 1 mm, whatever was pressed: a nodule that a deep press feels was never to be seen."""

    def painted(depth_m: float) -> list[float]:
        tab.evaluate(f"palpate.page.setDepth({depth_m})")
        return tab.evaluate("[...palpate.page.drawing.values]")

    tab.evaluate("document.getElementById('colour').click()")
    shallow, deep = painted(0.001), painted(0.008)
    assert len(shallow) == len(deep) and np.abs(np.subtract(shallow, deep)).max() > 0.02
    assert "8.0 mm" in tab.evaluate("document.getElementById('scale').textContent")
    # most of the object lies within the colours, however stiff its rim
    assert 0.2 < np.percentile(deep, 75) - np.percentile(deep, 25)
    (_, scale, _, tall), (_, hint, _, _) = box(tab, "scale"), box(tab, "hint")
    assert scale + tall <= hint, "one lies over the other"


@needs_browser
def test_a_drag_beside_the_object_turns_it_and_the_wheel_zooms(tab):
    left, top, width, height = box(tab)
    azimuth, zoom = state(tab, "camera.azimuth"), state(tab, "camera.zoom")
    tab.drag(left + 0.95 * width, top + 0.9 * height, -80, 0)
    tab.wait(f"palpate.page.camera.azimuth !== {azimuth}")
    assert state(tab, "touch.touching") is False
    tab.mouse("mouseWheel", left + 0.9 * width, top + 0.9 * height, deltaX=0, deltaY=-200)
    tab.wait(f"palpate.page.camera.zoom > {zoom}")


@needs_browser
def test_a_pointer_that_comes_before_the_first_frame_finds_the_object(asked):
    x, y = on_the_object(asked)
    early = f"palpate.page.under({{clientX: {x}, clientY: {y}}}) !== null"
    assert asked.evaluate(f"(() => {{ delete palpate.page.camera.eye; return {early}; }})()")


@needs_browser
def test_a_pen_presses_as_hard_as_it_is_pressed(tab):
    x, y = on_the_object(tab)
    pen = {"pointerType": "pen", "button": "left", "buttons": 1}
    tab.mouse("mousePressed", x, y, clickCount=1, force=0.3, **pen)
    tab.wait("palpate.page.depth > 0 && palpate.page.depth === palpate.page.goal")
    light = state(tab, "depth")
    tab.mouse("mouseMoved", x + 1, y, force=0.6, **pen)
    tab.wait(f"palpate.page.depth > 1.5 * {light}")
    tab.mouse("mouseReleased", x, y, clickCount=1, pointerType="pen", button="left")
    tab.wait("!palpate.page.touch.touching")


@needs_browser
def test_keys_move_the_tip_press_and_turn(tab):
    tab.evaluate("document.getElementById('stage').focus()")
    tab.key(" ", 32)
    tab.wait("palpate.page.touch.normalForce > 0.1 && palpate.page.depth === palpate.page.goal")
    at, depth = state(tab, "touch.tip"), state(tab, "depth")
    tab.key("+", 187)
    tab.wait(f"palpate.page.depth > {depth}")
    for _ in range(3):
        tab.key("ArrowRight", 39)
    tab.wait(f"Math.hypot(...palpate.page.touch.tip.map((v, i) => v - {json.dumps(at)}[i])) > 0.002")
    tab.key("Escape", 27)
    tab.wait("!palpate.page.touch.touching")
    tab.key("n", 78)
    tab.wait("palpate.page.touch.touching && palpate.page.beside.index === 0")


@needs_browser
def test_fingers_on_a_phone(shown, written):
    shown.complaints.clear()
    opened(shown, written, 390, 844)
    shown.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
    try:
        assert shown.evaluate("document.documentElement.scrollWidth <= innerWidth"), "nothing is cut off"
        shown.evaluate("document.getElementById('colour').click()")
        (_, scale, _, tall), (_, reading, _, high) = (box(shown, name) for name in ("scale", "parts"))
        assert tall and (scale >= reading + high or scale + tall <= reading), "one lies over the other"
        shown.evaluate("document.getElementById('colour').click()")
        x, y = on_the_object(shown)

        def touch(kind: str, *places: tuple[float, float]) -> None:
            points = [{"x": a, "y": b, "id": i} for i, (a, b) in enumerate(places)]
            shown.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

        touch("touchStart", (x, y))
        shown.wait("palpate.page.touch.normalForce > 0.1")
        touch("touchEnd")
        shown.wait("!palpate.page.touch.touching")
        azimuth, zoom = state(shown, "camera.azimuth"), state(shown, "camera.zoom")
        touch("touchStart", (x, y))
        touch("touchStart", (x, y), (x + 60, y))
        touch("touchMove", (x - 40, y), (x + 100, y))
        shown.wait(f"palpate.page.camera.zoom > 1.2 * {zoom}")
        touch("touchMove", (x - 10, y), (x + 130, y))
        shown.wait(f"palpate.page.camera.azimuth !== {azimuth}")
        touch("touchEnd")
        shown.wait("!palpate.page.touch.touching")
    finally:
        shown.call("Emulation.setTouchEmulationEnabled", enabled=False)
    assert shown.complaints == []


@needs_browser
def test_a_link_opens_on_its_press_and_the_curve_is_one_of_palpate_press(shown, written, renderer, tmp_path):
    at, depth = renderer.model.presses.point[3], 0.004
    place = ",".join(f"{v:.6f}" for v in at)
    linked = tmp_path / "linked.html"
    linked.write_text(
        written.read_text(encoding="utf-8").replace('"opens":null', f'"opens":[{place},{depth}]'),
        encoding="utf-8",
    )
    opened(shown, linked)
    asked = shown.evaluate(f"palpate.press([{place}], {depth})")["force_n"]
    assert np.allclose(state(shown, "touch.force"), asked)
    assert state(shown, "link") == f"#press={','.join(f'{float(v):g}' for v in place.split(','))},{depth:g}"
    shown.evaluate(f"location.hash = '#press={place},0.002'")
    shown.wait("Math.abs(palpate.page.touch.depth - 0.002) < 1e-6")
    shown.evaluate("location.hash = '#press=1,2'")
    shown.wait("document.getElementById('say').textContent.includes('four numbers')")
    shown.evaluate(f"location.hash = '#press={place},0.5'")
    shown.wait("document.getElementById('say').textContent.includes('this page presses 0 to')")
    shown.evaluate("document.getElementById('stage').focus()")
    shown.key("Escape", 27)
    shown.wait("!palpate.page.touch.touching")
    shown.key(" ", 32)
    shown.wait("palpate.page.depth === palpate.page.goal && palpate.page.trail.length > 5")
    (tmp_path / "curve.csv").write_text(state(shown, "csv"))
    curve = read_curve(tmp_path / "curve.csv")
    assert (np.diff(curve.t) > 0).all() and curve.depth[-1] == pytest.approx(
        state(shown, "touch.depth"), abs=1e-6
    )
    assert curve.force[-1] @ np.array(state(shown, "touch.normal")) > 0.1


@needs_browser
def test_without_scripts_the_picture_and_the_table_stay(shown, written):
    shown.call("Emulation.setScriptExecutionDisabled", value=True)
    try:
        shown.call("Page.navigate", url=written.as_uri())
        shown.wait(
            "document.readyState === 'complete' && document.querySelector('.still').naturalWidth > 100"
        )
        assert shown.evaluate("document.querySelector('.still').clientHeight > 100")
        assert shown.evaluate("document.querySelectorAll('tbody tr').length") >= 12
        assert shown.evaluate("document.querySelector('noscript').innerText").startswith("Scripts are off")
    finally:
        shown.call("Emulation.setScriptExecutionDisabled", value=False)


@needs_browser
def test_without_webgl_one_line_says_so_and_forces_stay(shown, written):
    hide = (
        "HTMLCanvasElement.prototype.getContext = new Proxy(HTMLCanvasElement.prototype.getContext, { apply: "
        "(get, canvas, asked) => asked[0].startsWith('webgl') ? null : Reflect.apply(get, canvas, asked) });"
    )
    script = shown.call("Page.addScriptToEvaluateOnNewDocument", source=hide)["identifier"]
    try:
        opened(shown, written)
        assert "no WebGL 2" in shown.evaluate("document.getElementById('say').textContent")
        assert shown.evaluate("document.querySelector('.still').clientHeight > 100")
        shown.evaluate("document.querySelector('[data-at]').click()")
        shown.wait("palpate.page.touch.normalForce > 0.05")
        shown.wait("document.getElementById('parts').textContent.includes('mm deep')")
    finally:
        shown.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)


@needs_browser
@pytest.mark.parametrize(
    "report",
    [
        "01000000000000",
        "020000e2ff0000",
        "015e01a2fe000000000000005e01",
        "01af0000000000",
        "01ff7f01800000",
        "0102",
    ],
)
def test_a_spacemouse_is_read_as_the_program_reads_it(asked, report):
    """The codec's own documented reports."""
    data = bytes.fromhex(report)
    told = spacemouse.decode(data, spacemouse.Deflection())
    rest = f"new DataView(new Uint8Array({json.dumps(list(data[1:]))}).buffer)"
    asked.evaluate("palpate.page.mouse.translation = [0, 0, 0]; palpate.page.mouse.rotation = [0, 0, 0]")
    asked.evaluate(f"palpate.page.mouse.report({data[0]}, {rest})")
    assert state(asked, "mouse.translation") == pytest.approx(list(told.translation))
    assert state(asked, "mouse.rotation") == pytest.approx(list(told.rotation))


@needs_browser
def test_a_spacemouse_moves_the_tip_and_presses(tab):
    full = int(spacemouse.FULL_SCALE)
    down = [0, 0, 0, 0, *full.to_bytes(2, "little")]
    push = f"new DataView(new Uint8Array({json.dumps(down)}).buffer)"
    tab.evaluate(f"window.pushing = setInterval(() => palpate.page.mouse.report(1, {push}), 8)")
    tab.wait("palpate.page.touch.normalForce > 0.1")
    tab.evaluate("clearInterval(window.pushing)")


@pytest.fixture(scope="module")
def carried(renderer: FemRenderer) -> str:
    return button(renderer.model)


@pytest.mark.slow
def test_a_report_carries_the_page_or_names_the_command(carried, renderer):
    assert "press it</button>" in carried and len(carried) > 100_000
    elsewhere = button(renderer.model.replaced(path=None))
    assert "palpate export MODEL --to page" in elsewhere and len(elsewhere) < 1000


@needs_browser
def test_the_button_unpacks_the_page(shown, carried, tmp_path):
    report = tmp_path / "report.html"
    report.write_text(f"<!doctype html><meta charset=utf-8>{carried}", encoding="utf-8")
    shown.open(report)
    shown.wait("!document.querySelector('.press-it').hidden")
    shown.evaluate("window.open = () => null")  # a browser that blocks new tabs goes there in this one
    shown.evaluate("document.querySelector('.press-it button').click()")
    shown.wait("location.protocol === 'blob:' && window.palpate !== undefined")
    assert len(shown.evaluate("palpate.press(palpate.page.dots[0], 0.002)")["force_n"]) == 3


def test_friction_of_a_diagnosis_is_in_the_page(renderer):
    assert effect("friction_slip").in_material is False
    assert float(renderer.parameters.friction[0]) == MU


@pytest.mark.slow
def test_a_page_of_a_hidden_nodule_names_the_task(renderer, monkeypatch, tmp_path):
    """It was headed "dome", without a word of a nodule."""
    bound = {}

    def written(model, to, path, *, scene=None, **_):
        bound["scene"] = scene
        return ()

    monkeypatch.setattr("palpate.exporting.registry.write", written)
    pp.export("nodule", "page", tmp_path / "nodule.html")
    scene = bound["scene"]
    page = page_of(renderer, title=scene.title, task=scene.task)
    head = page.partition("<h1>")[2].partition("<canvas")[0]
    assert "nodule" in head.partition("</h1>")[0] and f"{1e3 * FIND_M:g} mm" in head
    assert not load_scene("demo").task


def test_whatever_is_drawn_on_the_page_is_named_on_it_as_the_window_names_it(written):
    """Red dots had no name; one model was 'finite elements' here and 'this model' in the window."""
    page = written.read_text(encoding="utf-8")
    legend = re.search(r'<ul class="legend">.*?</ul>', page, re.DOTALL)[0]
    assert '<i class="place"></i>places of' in legend
    for name in ("fem", ONE_D):
        assert renderer_words(name) in legend and f"{renderer_words(name)} [N]</th>" in page
    assert "finite elements" not in legend and "1D model" not in legend
