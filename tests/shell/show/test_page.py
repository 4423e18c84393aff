"""What a page makes of numbers and pictures, before a browser sees it."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from palpate.scenes.embedded import embedded_recording
from palpate.show.glossary import WORDS
from palpate.show.page import Page, file_words
from palpate.show.quantities import readable

REPOSITORY = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize(
    ("label", "values", "told", "shown"),
    [
        ("speed in the air [m/s]", [0.0436, 0.06], "speed in the air [mm/s]", [43.6, 60.0]),
        ("duration [s]", [109.5, 100.0], "duration [s]", [109.5, 100.0]),
        ("modulus by Hertz [Pa]", [20530.0, 5e4], "modulus by Hertz [kPa]", [20.53, 50.0]),
        ("the force reads late [s]", [4e-16, 0.0], "the force reads late [s]", [0.0, 0.0]),
        ("touches after the trace", [38.0, np.nan], "touches after the trace", [38.0, np.nan]),
    ],
)
def test_si_values_are_told_in_units_that_people_read(label, values, told, shown):
    name, found = readable(label, values)
    assert name == told and found == pytest.approx(shown, nan_ok=True)


def test_a_picture_says_how_narrow_it_may_become_before_its_letters_cannot_be_read():
    page = Page("Two pictures")
    page.figure(np.zeros((20, 1400, 3), dtype=np.uint8), "A wide one.")
    page.figure(np.zeros((20, 300, 3), dtype=np.uint8), "A narrow one.")
    assert re.findall(r"--legible:(\d+)px", page.html()) == ["840", "180"]


def test_a_page_brings_its_numbers_its_drawings_and_what_copies_them():
    page = Page("Kept <all>")
    figure = Figure(figsize=(3, 2))
    figure.subplots().plot([0, 1], [0, 1])
    page.figure(figure, "A line.")
    page.next_steps(["try `palpate check REC`, not `this`", "go on"])
    page.result({"a_n": np.array([1.0, np.nan]), "words": "</script>"})
    text = page.html()
    packed = re.search(r'<script type="text/plain" class="svg">([^<]+)</script>', text)
    assert b"<svg" in gzip.decompress(base64.b64decode(packed[1]))
    assert '<code class="command">palpate check REC</code>' in text and "<li>go on</li>" in text
    held = re.search(r'<script type="application/json" class="result">(.*?)</script>', text, re.DOTALL)
    assert json.loads(held[1]) == {"a_n": [1.0, None], "words": "</script>"}
    assert "navigator.clipboard" in text and "@media print" in text


def test_the_same_picture_is_the_same_page():
    def made():
        page = Page("One")
        figure = Figure(figsize=(3, 2))
        figure.subplots().plot([0, 1], [0, 1])
        page.figure(figure, "A line.")
        return page.html()

    assert made() == made()


def test_a_word_is_linked_where_it_is_first_used_and_explained_at_the_end():
    page = Page("Words")
    page.paragraph(
        "Young's modulus, and once more Young's modulus; `noise` is code, denoise is another word."
    )
    text = page.html()
    assert text.count('href="#word-young-s-modulus"') == 1 and text.count('id="word-young-s-modulus"') == 1
    assert "#word-noise" not in text
    page.paragraph("Two 1D models.")
    assert '<a class="term" href="#word-1d-model">1D models</a>' in page.html()


def test_pages_and_docs_have_one_glossary():
    rows = (REPOSITORY / "docs" / "reading" / "glossary.md").read_text(encoding="utf-8")
    told = dict(re.findall(r"^\| (.+?) \| (.+?) \|$", rows, re.MULTILINE))
    for word, meant in WORDS.items():
        assert any(word in names and meant == words for names, words in told.items()), word


def test_a_file_is_named_as_one_would_type_it(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert file_words(None, "REC") == "REC"
    assert file_words(tmp_path / "a" / "mine.csv", "REC") == str(Path("a") / "mine.csv")
    assert file_words(tmp_path / "a b.csv", "REC") == "'a b.csv'"  # a command is pasted into a shell
    assert file_words(embedded_recording("silicone-1-cylinder"), "REC") == "silicone-1-cylinder"


@pytest.mark.parametrize("said", ["lead", "paragraph"])
def test_no_line_breaks_between_a_number_and_its_unit(said: str) -> None:
    """A phone showed '(21' at the end of a line and 'mN)' on the next."""
    page = Page("x")
    getattr(page, said)(
        "It errs by 1.02 N or 5 %, 95 % sure, 3 mm deep, as `palpate press M --depth 3 mm` says"
    )
    text = page.html()
    assert "1.02\u00a0N or 5\u00a0%" in text and "3\u00a0mm deep" in text and "95\u00a0%</a>" in text
    assert "--depth 3 mm</code>" in text


def test_a_column_that_says_nothing_is_left_out():
    """'fitted values' stood over eight empty cells."""
    page = Page("x")
    page.table(["effect", "left [mN]", "fitted values"], [["creep", 22, ""], ["skin", 0, ""]])
    text = page.html()
    assert "fitted values" not in text and "<td>0</td>" in text.replace(' data-of="left [mN]"', "")
    page.table(["at [s]", "why"], [])
    assert "why</th>" in page.html()
