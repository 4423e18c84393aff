"""The view of an object in a real browser: it turns, it answers hover, click and keys, and logs no error."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
from matplotlib.figure import Figure

from palpate.show.model import facing
from palpate.show.page import Page
from palpate.show.quantities import DEPTH, ERROR, MODULUS, ORDER, UNCERTAINTY
from palpate.show.view3d import Colouring, Line, Thing, Traces, View, scripts

from . import browser
from .frames import page_in

needs_browser = pytest.mark.skipif(
    browser.browser_found() is None, reason="needs a browser: chromium or google-chrome on the PATH"
)
RADIUS, SAMPLES = 0.03, 60


def a_view() -> View:
    """Half a ball on a table, touched at its top and at four sides; forces of 1 to 5 N a press."""
    ball = trimesh.creation.icosphere(3, RADIUS)
    out = np.array([[0, 0, 1.0], [1, 0, 0.2], [0, 1, 0.2], [-1, 0, 0.2], [0, -1, 0.2]])
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    depth = np.tile(np.sin(np.linspace(0, np.pi, SAMPLES)), 5) * 0.004
    force = np.repeat(np.arange(1.0, 6.0), SAMPLES) * depth / 0.004
    measured = force[:, None] * [1.0, 0.0, 0.4]
    lines = [
        Line("measured", measured, "measured"),
        Line("rendered", 0.9 * measured),
        Line("with viscoelasticity", 0.5 * measured, "effect", shown=False),
    ]
    thing = Thing(
        ball.vertices, ball.faces, ball.vertices[:, 2] > -0.02,
        np.array([0, 0, -RADIUS]), np.array([0, 0, 1.0]),
    )  # fmt: skip
    colourings = [
        Colouring(ORDER, None, np.arange(1.0, 6.0), "in order"),
        Colouring(ERROR, None, np.array([0.01, 0.02, 0.03, 0.04, 0.05])),
        Colouring(ERROR, None, np.array([0.01, 0.02, 0.03, 0.04, 0.09]), name="error of another"),
        Colouring(MODULUS, None, np.array([20e3, np.nan, 21e3, 22e3, 23e3])),
        Colouring(UNCERTAINTY, 1e-3 * np.abs(ball.vertices[:, 2]) / RADIUS),
        Colouring(DEPTH, None, np.full(5, 0.004)),
    ]
    times = np.tile(np.linspace(0, 0.6, SAMPLES), 5)
    return View(thing, RADIUS * out, colourings, Traces(np.arange(6) * SAMPLES, depth, times, lines))


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    page = Page("A ball")
    page.lead("A ball that was pressed five times.")
    figure = Figure(figsize=(3, 2))
    figure.subplots().plot([0, 1])
    page.view(a_view(), figure, "The picture.")
    return page.write(tmp_path_factory.mktemp("view") / "ball.html")


@pytest.fixture(scope="module")
def shown(written: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator:
    if browser.browser_found() is None:
        pytest.skip("needs a browser: chromium or google-chrome on the PATH")
    with browser.a_tab(tmp_path_factory.mktemp("profile")) as tab:
        yield tab


@pytest.fixture
def tab(shown, written: Path):
    shown.complaints.clear()
    shown.open(written)
    shown.wait("document.querySelector('section.view3d').dataset.state === 'live'")
    shown.wait("document.querySelector('.stage').dataset.azimuth")
    yield shown
    assert shown.complaints == []


@needs_browser
def test_an_object_whose_presses_have_no_curves_is_turned_too(shown, tmp_path):
    """It stayed a picture, since the empty place of the curves was drawn into."""
    page, seen = Page("A ball"), a_view()
    page.view(View(seen.thing, seen.places, seen.colourings), Figure(figsize=(3, 2)), "The picture.")
    shown.complaints.clear()
    shown.open(page.write(tmp_path / "plain.html"), 1366, 768)
    shown.wait("document.querySelector('section.view3d').dataset.state === 'live'")
    assert shown.complaints == []
    # half of the screen stayed empty, where the curve of a press would be
    wide = shown.evaluate("document.querySelector('section.view3d').getBoundingClientRect().width")
    assert stage(shown)[2] > 0.95 * wide


def stage(tab) -> tuple[float, float, float, float]:
    """Left, top, width, height of the view."""
    tab.evaluate("document.querySelector('.stage').scrollIntoView({block: 'center'})")
    box = tab.evaluate("JSON.stringify(document.querySelector('.stage').getBoundingClientRect())")
    return tuple(float(re.search(rf'"{k}":([-\d.]+)', box)[1]) for k in ("left", "top", "width", "height"))


def look(tab, what: str) -> float:
    tab.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return float(tab.evaluate(f"document.querySelector('.stage').dataset.{what}"))


def text(tab, selector: str) -> str:
    return tab.evaluate(f"document.querySelector('{selector}').innerText")


def pixels(tab, left: float, top: float, width: float, height: float) -> np.ndarray:
    """(h, w, 3) of a part of what is in sight."""
    import base64
    import io

    from PIL import Image

    clip = {"x": left, "y": top, "width": width, "height": height, "scale": 1}
    data = tab.call("Page.captureScreenshot", format="png", clip=clip)["data"]
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")).astype(float)


def test_a_page_is_small_and_holds_its_script_with_the_licence(written):
    text = written.read_text(encoding="utf-8")
    assert len(text) < 5e6
    assert "Three.js Authors" in scripts() and "http" not in text.split("<script>")[0]
    assert "<img alt=" in text.split('class="live"')[0], "the picture is there without scripts"
    assert text.count("<tr>") == 6, "the table of five presses is there without scripts"


@needs_browser
def test_dots_have_their_colours_from_the_first_picture_on(tab):
    picture = pixels(tab, *stage(tab))
    vivid = np.ptp(picture, axis=2) > 110  # the object is beige, the floor grey
    assert vivid.sum() > 30


@needs_browser
def test_the_view_turns_zooms_and_comes_back(tab):
    x, y, w, h = stage(tab)
    azimuth, elevation, distance = (look(tab, k) for k in ("azimuth", "elevation", "distance"))
    before = pixels(tab, x, y, w, h)
    assert before.std() > 5, "something is drawn"
    tab.drag(x + 0.6 * w, y + 0.5 * h, -120, 40)
    assert look(tab, "azimuth") > azimuth + 30 and look(tab, "elevation") > elevation + 5
    assert np.abs(pixels(tab, x, y, w, h) - before).max() > 30, "the picture is another one"
    tab.evaluate("document.querySelector('.nearer').click()")
    assert look(tab, "distance") < 0.9 * distance
    tab.evaluate("document.querySelector('.reset').click()")
    assert look(tab, "azimuth") == azimuth and look(tab, "distance") == distance
    tab.drag(x + 0.6 * w, y + 0.3 * h, 0, -2000)
    assert look(tab, "elevation") >= -5, "the view does not go under the floor"


@needs_browser
def test_hover_tells_numbers_and_click_selects_the_press(tab):
    x, y, w, h = stage(tab)
    for _ in range(12):  # from above, where the first touch is in the middle
        tab.evaluate("document.querySelector('.stage').focus()")
        tab.key("ArrowUp", 38)
    look(tab, "elevation")
    tab.mouse("mouseMoved", x + 0.5 * w, y + 0.5 * h)
    tab.wait("!document.querySelector('.tip').hidden")
    assert "press 1 at (0, 0, 30) mm" in text(tab, ".tip")
    assert "modulus: 20 kPa" in text(tab, ".tip") and "force error: 10 mN" in text(tab, ".tip")
    tab.key("n", 78)
    assert tab.evaluate("document.querySelector('section.view3d').dataset.selected") == "2"
    tab.click(x + 0.5 * w, y + 0.5 * h)
    assert tab.evaluate("document.querySelector('section.view3d').dataset.selected") == "1"
    assert text(tab, ".press-name") == "Press 1"
    tab.mouse("mouseMoved", x + 2, y + 2)
    assert tab.evaluate("document.querySelector('.tip').hidden")


@needs_browser
def test_an_effects_prediction_is_switched_on(tab):
    assert tab.evaluate("document.querySelectorAll('path.line').length") == 2
    assert "measured up to 1 N, rendered up to 0.9 N" in tab.evaluate(
        "document.querySelector('.curve').getAttribute('aria-label')"
    )
    tab.evaluate("document.querySelectorAll('.line-of input')[2].click()")
    assert tab.evaluate("document.querySelectorAll('path.line').length") == 3
    tab.evaluate("document.querySelectorAll('details.presses tbody tr')[4].click()")
    label = tab.evaluate("document.querySelector('.curve').getAttribute('aria-label')")
    assert label.startswith("Force of press 5: measured up to 5") and "viscoelasticity up to 2.5 N" in label


@needs_browser
@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("sideways", "measured up to 0.4 N, rendered up to 0.36 N"),
        ("into less", "Force of press 1: rendered up to 0 N"),
    ],
)
def test_the_curve_shows_the_sideways_force_and_what_is_left(tab, what, said):
    tab.evaluate(
        f"document.querySelector('.what').value = '{what}'; "
        "document.querySelector('.what').dispatchEvent(new Event('change'))"
    )
    assert said in tab.evaluate("document.querySelector('.curve').getAttribute('aria-label')")


@needs_browser
def test_colours_of_one_quantity_have_the_same_limits_and_legends_say_them(tab):
    told = []
    for k in range(6):
        tab.evaluate(
            f"document.querySelector('.by').selectedIndex = {k}; "
            "document.querySelector('.by').dispatchEvent(new Event('change'))"
        )
        told.append((text(tab, ".low"), text(tab, ".high")))
    assert told[1][0] == told[2][0] == "0 mN" and told[1][1].split()[-2:] == told[2][1].split()[-2:]
    assert told[0] == ("1", "5") and told[4][1].endswith(" mm") and told[3][1].endswith(" kPa")


@needs_browser
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, False), (390, True)])
def test_it_fits_a_phone_and_the_dark(tab, written, width, dark):
    tab.open(written, width, 844, dark=dark)
    tab.wait("document.querySelector('section.view3d').dataset.state === 'live'")
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    paper = tab.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(255, 255, 255)") != dark
    x, y, w, h = stage(tab)
    assert w > 0.4 * width and pixels(tab, x, y, w, h).std() > 5


@needs_browser
def test_the_table_of_presses_fits_a_phone(shown, tmp_path):
    """Its last column was cut off, and a place took three lines."""
    view, page = a_view(), Page("A ball")
    of = [view.colourings[k] for k in (0, 1, 3, 5)]
    page.view(View(view.thing, view.places, of, view.traces), Figure(figsize=(3, 2)), "The picture.")
    shown.open(page.write(tmp_path / "table.html"), 390, 844)
    shown.wait("document.querySelector('section.view3d').dataset.state === 'live'")
    shown.evaluate("document.querySelector('details.presses').open = true")
    assert shown.evaluate("(e => e.scrollWidth <= e.clientWidth)(document.querySelector('.presses .scroll'))")
    high = shown.evaluate("document.querySelector('.presses tbody tr').getBoundingClientRect().height")
    assert high < 40, "a line a press"
    said = shown.evaluate("document.querySelector('.numbers').textContent")
    assert not re.search(r"\d (mm|mN|kPa)", said), "a number and its unit stay in one line"


@needs_browser
def test_a_phone_is_told_of_fingers_and_what_is_drawn_takes_one_line(shown, written):
    """It was told of a wheel and of keys, and the choice of the axis stood in a line of its own."""
    shown.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
    try:
        shown.open(written, 390, 844)
        shown.wait("document.querySelector('section.view3d').dataset.state === 'live'")
        said = shown.evaluate("document.querySelector('.stage').parentElement.innerText")
    finally:
        shown.call("Emulation.setTouchEmulationEnabled", enabled=False)
    assert "two fingers" in said and "tap" in said and "Keys" not in said and "wheel" not in said
    tops = shown.evaluate(
        "['what', 'axis'].map(name => document.querySelector('.' + name).getBoundingClientRect().top)"
    )
    assert abs(tops[0] - tops[1]) < 1


@needs_browser
def test_a_wall_is_lit_without_a_band(shown, tmp_path):
    """The lamp at the eye ended on it, and left a dark stripe."""
    wall = trimesh.creation.cylinder(RADIUS, 0.06, sections=200)
    object_drawn(shown, tmp_path, wall, 0.5)
    left, top, width, height = stage(shown)
    row = pixels(shown, left, top + 0.6 * height, width, 1)[0].astype(float)
    light = row[row[:, 0] - row[:, 2] > 15].mean(axis=1)[8:-8]  # the floor is grey
    fall = np.diff(np.convolve(light, np.ones(15) / 15, "valid"))
    assert len(light) > 100 and fall.max() < 0.0, "darker from left to right, all the way"
    assert (fall - np.minimum.accumulate(fall)).max() < 0.15, "ever faster, as a wall turns away"


@needs_browser
def test_a_screen_of_4k_is_used_and_read_from_as_far(tab, written):
    tab.open(written, 3840, 2160)
    tab.wait("document.querySelector('section.view3d').dataset.state === 'live'")
    wide = tab.evaluate("document.body.getBoundingClientRect().width")
    assert wide > 0.4 * 3840 and tab.evaluate("document.documentElement.scrollWidth") <= 3840
    letters = tab.evaluate("getComputedStyle(document.querySelector('p.lead + *')).fontSize")
    assert float(letters.removesuffix("px")) >= 20


def object_drawn(shown, tmp_path, solid, across, wide=1, **view):
    """(h, 3) colours down a column of the view, wide px and averaged, and the rows in which a solid that
    stands on z = 0 is seen. across: where in the view's width."""
    solid.apply_translation([0, 0, -solid.bounds[0, 2]])
    seen = View(
        Thing(solid.vertices, solid.faces, solid.vertices[:, 2] > 1e-6, np.zeros(3), np.array([0, 0, 1.0])),
        np.array([[0, 0, solid.bounds[1, 2]]]),
        [Colouring(ORDER, None, np.array([1.0]), "in order")],
        **view,
    )
    page = Page("A solid")
    page.view(seen, Figure(figsize=(3, 2)), "The picture.")
    shown.open(page.write(tmp_path / "solid.html"))
    shown.wait("document.querySelector('section.view3d').dataset.state === 'live'")
    shown.wait("document.querySelector('.stage').dataset.azimuth")
    left, top, width, height = stage(shown)
    column = pixels(shown, left + across * width - wide // 2, top, wide, height).mean(axis=1)
    return column, np.flatnonzero(column[:, 0] - column[:, 2] > 15)  # the floor is grey


@needs_browser
def test_the_rim_of_a_foot_is_lit_as_the_side_is(shown, tmp_path):
    """The bottom's triangles, which are uneven at the rim, darkened it in teeth."""
    wall = trimesh.creation.cylinder(RADIUS, 0.04, sections=64).subdivide().subdivide()
    column, beige = object_drawn(shown, tmp_path, wall, 0.5, wide=2)
    foot, above = column[beige[-1] - 4], column[beige[-1] - 60]
    assert foot.mean() > 0.97 * above.mean()


@needs_browser
def test_the_edges_of_a_block_are_sharp(shown, tmp_path):
    """A pale band ran along them, as wide as the triangles beside them."""
    block = trimesh.creation.box((0.06, 0.06, 0.03)).subdivide().subdivide()
    column, beige = object_drawn(shown, tmp_path, block, 0.45, azimuth_deg=0.0)
    light = column[beige].mean(axis=1)
    of_faces = np.abs(light[:, None] - [light[10], light[-10]]).min(axis=1)
    assert abs(light[10] - light[-10]) > 10, "the top and a side are seen"
    assert (of_faces > 6).sum() < 6


@needs_browser
def test_without_scripts_the_picture_stays(shown, written):
    shown.call("Emulation.setScriptExecutionDisabled", value=True)
    try:
        shown.open(written)
        picture, live = (
            shown.evaluate(f"getComputedStyle(document.querySelector('{k}')).display")
            for k in (".still", ".live")
        )
    finally:
        shown.call("Emulation.setScriptExecutionDisabled", value=False)
    assert picture == "block" and live == "none"


def test_the_eye_stands_before_what_faces_aside():
    up = np.array([0, 0, 1.0])
    right = facing(up, np.array([1.0, 0, 0]))
    assert abs((facing(up, np.array([0, 1.0, 0])) - right) % 360 - 90) < 1e-9
    assert facing(up, up) == pytest.approx(35.0)


def test_a_notebook_shows_a_model_to_be_turned(monkeypatch, tmp_path):
    import sys
    from types import ModuleType

    from palpate.mechanics.model.material import ObjectMaterial
    from palpate.mechanics.model.model import Model, Support, Tool
    from palpate.mechanics.shape.tetmesh import box_mesh

    class ZMQInteractiveShell:
        pass

    shown = []
    kernel = ModuleType("IPython")
    kernel.get_ipython = ZMQInteractiveShell
    kernel.display = ModuleType("IPython.display")
    kernel.display.HTML, kernel.display.display = str, shown.append
    monkeypatch.setitem(sys.modules, "IPython", kernel)
    monkeypatch.setitem(sys.modules, "IPython.display", kernel.display)
    mesh = box_mesh((4, 4, 2), (0.06, 0.06, 0.03)).quadratic()
    support = Support(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    model = Model(mesh, ObjectMaterial(20e3, 0.49), support, Tool(0.005), mesh_size_m=0.015)
    assert model.show() is None
    assert len(shown) == 1 and shown[0].startswith("<div><iframe srcdoc=")
    assert 'class="view3d"' in page_in(shown[0])
