"""One colour a thing: on every page, in every picture and in the window."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_hex, to_rgb

from palpate.render.registry import names, simulator_names
from palpate.show import quantities, story_of
from palpate.show import story as say
from palpate.show.colours import COLOURS, GREY, ON_BLACK, PAPER, STAGE, UNNAMED, colour_of, style_sheet
from palpate.words import MOST_WORDS, headline

SHELL = Path(__file__).resolve().parents[3] / "shell"
_HEX = re.compile(r"[\"'](#[0-9a-fA-F]{3,8})[\"']")
THINGS = {  # label in a picture -> thing
    "measured": "measured", "rendered": "fem", "FEM": "fem", "FEM, one modulus": "fem-homogeneous",
    "Kelvin–Voigt spring": "kelvin-voigt", "Hunt–Crossley spring": "hunt-crossley", "simulated": "simplest",
    "with what was found": "found", "first touch": "touch", "first touches": "touch",
    "peak": "peak", "tracing the foot": "base-tracing", "sensor's noise": "noise",
    "measured, left out": "measured", "measured, fitted": "measured", "fixed base": "base",
}  # fmt: skip

CURVES = (
    "measured", "fem", "fem-homogeneous", "kelvin-voigt", "hunt-crossley", "other-simulator",
    "simplest", "found",
)  # fmt: skip
RGB_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def test_each_colour_is_that_of_one_thing():
    every = [*COLOURS.values(), *UNNAMED]
    assert len(set(every)) == len(every) and ON_BLACK.keys() <= COLOURS.keys()
    assert colour_of("hunt-crossley-kh") == COLOURS["hunt-crossley"]
    assert colour_of("mujoco") == COLOURS["other-simulator"] and colour_of("fem") == COLOURS["fem"]


def _luminance(colour: str) -> float:
    """Relative, by WCAG 2."""
    shares = np.array(to_rgb(colour))
    return float(
        [0.2126, 0.7152, 0.0722]
        @ np.where(shares <= 0.03928, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    )


def contrast(colour: str, behind: str) -> float:
    """Ratio of a word to what stands behind it, by WCAG 2: 4.5 is what small words need."""
    low, high = sorted((_luminance(colour), _luminance(behind)))
    return (high + 0.05) / (low + 0.05)


def test_a_force_in_its_models_colour_can_be_read():
    """Hunt-Crossley's blue stood out by 4.1 to 1 from the column that it was written on."""
    for name in (*names(), *simulator_names()):
        assert contrast(colour_of(name), PAPER) >= 4.5, name
    assert min(contrast(GREY, behind) for behind in (PAPER, STAGE)) >= 4.5


def _lab(colour: str) -> np.ndarray:
    """CIE L*a*b*, in which equal steps look about equally large."""
    shares = np.array(to_rgb(colour))
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    x, y, z = np.cbrt(RGB_TO_XYZ @ linear / [0.9505, 1.0, 1.089])
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("table", [COLOURS, ON_BLACK], ids=["light", "dark"])
def test_curves_of_one_chart_can_be_told_apart(table):
    """Another simulator's curve and that of what was found were both green."""
    for one, other in combinations(CURVES, 2):
        assert np.linalg.norm(_lab(table[one]) - _lab(table[other])) > 25, (one, other)


def test_no_quantity_is_shown_by_black():
    """Where the error was greatest an object was black: neither its shape nor a dot was to be seen there."""
    for shown in (q for q in vars(quantities).values() if isinstance(q, quantities.ShownQuantity)):
        darkest = min(_luminance(to_hex(c)) for c in colormaps[shown.colour_map](np.linspace(0.0, 1.0, 32)))
        assert darkest > 0.01, shown.name


def test_nothing_but_the_table_names_a_colour():
    files = [path for room in ("show", "window", "exporting/page") for path in (SHELL / room).rglob("*.*")]
    for path in files:
        if path.suffix in (".py", ".js") and path.name != "colours.py":
            assert not _HEX.findall(path.read_text(encoding="utf-8")), path
        if path.suffix == ".css":
            own = set(re.findall(r"--([\w-]+):", path.read_text(encoding="utf-8")))
            assert not own & COLOURS.keys(), path
    assert set(re.findall(r"--([\w-]+):", style_sheet())) >= COLOURS.keys()


def pictures(story: say.Story):
    """Each picture that a page draws, and each line of its view in 3D."""
    for block in story:
        match block:
            case say.Picture():
                yield block.draw()
            case say.Pictures(pictures=each):
                yield from (one.draw() for one in each)
            case say.Turned(still=still):
                yield still.draw()
                yield block.view()
            case say.Section(blocks=blocks):
                yield from pictures(blocks)


@pytest.mark.slow
def test_pages_draw_each_thing_in_its_own_colour_under_a_headline_of_few_words(results):
    for result in results:
        story = list(story_of(result))
        for block in story:
            if isinstance(block, say.Headline) and block.on != say.TEXT:
                assert len(headline(block.text)[0].split()) <= MOST_WORDS, block.text
                assert "--" not in headline(block.text)[0]
        seen = 0
        for picture in pictures(story):
            if picture is None:
                continue
            if not hasattr(picture, "axes"):
                assert all(line.kind in COLOURS or line.kind == "effect" for line in picture.traces.lines)
                continue
            for ax in picture.axes:
                for artist, label in zip(*ax.get_legend_handles_labels(), strict=True):
                    if label in THINGS:
                        face = hasattr(artist, "get_facecolor")
                        colour = np.ravel(artist.get_facecolor())[:4] if face else artist.get_color()
                        seen += 1
                        assert to_hex(colour) == COLOURS[THINGS[label]], (type(result).__name__, label)
        assert seen, type(result).__name__


@pytest.fixture(scope="module")
def results(shared_recordings):
    """A reconstruction, a comparison and a diagnosis of one recording."""
    import palpate as pp

    recording = pp.read_recording("silicone-1-cylinder")
    made = pp.reconstruct(recording, mesh_size_m=0.01)
    return [
        made,
        pp.compare(recording, model=made.model),
        pp.diagnose(recording, model=made.model, fast=True),
    ]
