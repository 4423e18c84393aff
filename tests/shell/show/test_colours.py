"""One colour a thing: on every page, in every picture and in the window."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import rgb_to_hsv, to_hex, to_rgb

from palpate.show import story as say
from palpate.show import story_of
from palpate.show.colours import COLOURS, ON_BLACK, UNNAMED, colour_of, style_sheet
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


def test_each_colour_is_that_of_one_thing():
    every = [*COLOURS.values(), *UNNAMED]
    assert len(set(every)) == len(every) and ON_BLACK.keys() <= COLOURS.keys()
    assert colour_of("hunt-crossley-kh") == COLOURS["hunt-crossley"]
    assert colour_of("mujoco") == COLOURS["other-simulator"] and colour_of("fem") == COLOURS["fem"]


@pytest.mark.parametrize("table", [COLOURS, ON_BLACK])
def test_what_is_drawn_in_one_curve_differs_in_hue(table):
    """Another simulator's force and the one with what was found were both green."""
    drawn = ("other-simulator", "simplest", "fem"), ("found", "measured")
    hues = [[rgb_to_hsv(to_rgb(table[thing]))[0] for thing in side] for side in drawn]
    apart = np.abs(np.subtract.outer(*hues))
    assert np.minimum(apart, 1 - apart).min() > 0.1


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
