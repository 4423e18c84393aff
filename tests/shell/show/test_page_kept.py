"""What a reader can do with a page: keep pictures, tables, numbers, copy commands, look words up."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

from palpate.show.page import Page

from .browser import a_tab, browser_found

pytestmark = pytest.mark.skipif(browser_found() is None, reason="needs a browser")
KEPT = """
window.kept = [];
URL.createObjectURL = (blob) => { blob.text().then((text) => window.kept.push(text)); return 'data:,'; };
HTMLAnchorElement.prototype.click = function () { window.names = [...(window.names || []), this.download]; };
"""


@pytest.fixture(scope="module")
def tab(tmp_path_factory):
    with a_tab(tmp_path_factory.mktemp("browser")) as opened:
        yield opened


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    page = Page("A result, to be kept")
    page.lead("Young's modulus 28.9 kPa.")
    page.next_steps(["`palpate touch MODEL`"])
    figure = Figure(figsize=(13, 3))
    figure.subplots().plot([0, 1], [0, 1])
    page.figure(figure, "A wide one.")
    page.table(
        ["effect", "at x, y, z [mm]", "b", "c", "d, e"], [["creep", "1, -2, 3", 2.0, 3.0, 'said "so"']] * 3
    )
    page.result({"young_modulus_pa": 28900.0})
    return page.write(tmp_path_factory.mktemp("page") / "page.html")


def press(tab, words):
    buttons = "[...document.querySelectorAll('button.keep')]"
    tab.evaluate(f"{buttons}.find((b) => b.textContent === '{words}').click()")


def test_pictures_tables_and_numbers_can_be_kept(tab, written):
    tab.open(written)
    tab.evaluate(KEPT)
    for words in ("PNG", "SVG", "CSV", "all numbers (JSON)"):
        press(tab, words)
    tab.wait("window.kept.length === 3")
    kept = tab.evaluate("window.kept.join('|')")
    assert (
        "<svg" in kept and 'creep,1,-2,3,2,3,"said ""so"""' in kept and '"young_modulus_pa": 28900.0' in kept
    )
    names = tab.evaluate("window.names")
    assert sorted(name.rpartition(".")[2] for name in names) == ["csv", "json", "png", "svg"]
    assert all(name.startswith("a-result-to-be-kept") for name in names)
    assert not tab.complaints


def test_a_command_is_copied(tab, written):
    tab.open(written)
    tab.evaluate("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    press(tab, "copy")
    tab.wait("window.copied === 'palpate touch MODEL'")
    tab.wait("[...document.querySelectorAll('button.keep')].some((b) => b.textContent === 'copied')")


@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_is_cut_off_at_its_side(tab, written, width):
    tab.open(written, width, 844)
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    inner = "[...document.querySelectorAll('figure .scroll, .scroll > table')]"
    assert tab.evaluate(f"{inner}.every((e) => e.scrollWidth <= {width})")
    tab.evaluate("document.querySelector('figure img').click()")
    wide = tab.evaluate("document.querySelector('figure img').getBoundingClientRect().width")
    assert wide > width or width > 500, "a tap shows a wide picture large enough to read"
    assert tab.evaluate("document.documentElement.scrollWidth") <= width


def test_a_word_leads_to_its_meaning(tab, written):
    tab.open(written)
    target = tab.evaluate("document.querySelector('a.term').getAttribute('href').slice(1)")
    meaning = tab.evaluate(f"document.getElementById('{target}').nextElementSibling.textContent")
    assert meaning.startswith("how stiff the material is")


def test_it_prints_without_buttons(tab, written):
    tab.open(written)
    tab.call("Emulation.setEmulatedMedia", media="print")
    shown = tab.evaluate("[...document.querySelectorAll('button.keep')].filter((b) => b.offsetParent).length")
    tab.call("Emulation.setEmulatedMedia", media="")
    assert shown == 0
