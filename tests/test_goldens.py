"""What the program says and does is what `tests/goldens` holds: words, keys, exit codes, numbers to three
digits."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from tools.goldens.__main__ import case_differences
from tools.goldens.cases import CASES
from tools.goldens.difference import Tolerance, differences, words_alone
from tools.goldens.measure import Measured
from tools.goldens.plain import Plain

FOLDER = Path(__file__).parent / "goldens"
ROUNDED = Tolerance(rel=0.01, abs=1e-6, digit=True)
KEPT = [case for case in CASES if case.light or case.quick]
AGAIN = "where that is meant, write them anew: python -m tools.goldens write tests/goldens --quick --words"


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    return Measured(Path(sys.executable), tmp_path_factory.mktemp("goldens") / "work")


@pytest.mark.parametrize(
    "case",
    [pytest.param(c, id=c.name, marks=[] if c.light else pytest.mark.slow) for c in KEPT],
)
def test_the_program_does_what_is_written(measured, case):
    if case.name == "help" and sys.version_info >= (3, 13):
        pytest.skip("argparse lays help out in another way since Python 3.13")
    written = json.loads((FOLDER / f"{case.name}.json").read_text(encoding="utf-8"))
    found = case_differences(written, words_alone(measured.record(case)), ROUNDED)
    assert not found, "\n".join([*found[:40], AGAIN])


def test_every_file_is_of_a_case():
    assert {path.stem for path in FOLDER.iterdir()} == {case.name for case in KEPT}


def test_a_number_may_differ_by_rounding_and_a_word_not_at_all():
    exact = Tolerance()
    assert not list(differences({"a": [1.0, "3.2 mm"]}, {"a": [1.0 + 1e-9, "3.2 mm"]}, exact))
    assert list(differences({"a": 1.0}, {"a": 1.001}, exact)) == ["a: 1.0 -> 1.001"]
    assert list(differences({"a": 1.0, "b": 2}, {"a": 1.0}, exact)) == ["b: gone: 2"]
    assert list(differences("3.2 mm", "3.3 mm", exact)) and not list(differences("3.2 mm", "3.3 mm", ROUNDED))
    assert list(differences("3.2 mm", "3.2 cm", ROUNDED))
    assert list(differences("100 mN", "102 mN", ROUNDED))
    assert list(differences(["a", "b"], ["a", "c", "b"], exact))
    assert list(differences(True, False, exact)) and list(differences(None, 1.0, exact))


def test_of_a_case_that_is_not_the_same_twice_only_what_it_names_is_compared():
    near = Tolerance(near={"young_modulus_pa": 0.01})
    old = {"young_modulus_pa": 28e3, "nodes": 6288, "said": "6288 nodes"}
    assert not list(differences(old, {"young_modulus_pa": 28.2e3, "nodes": 6310, "said": "6310 nodes"}, near))
    assert list(differences(old, {**old, "young_modulus_pa": 29e3}, near))
    assert list(differences(old, {**old, "said": "6288 cells"}, near))


def test_exact_bytes_count_where_they_are_asked_for():
    old, new = {"rms": 1.0, "bits": "a"}, {"rms": 1.0, "bits": "b"}
    assert not list(differences(old, new, Tolerance()))
    assert list(differences(old, new, Tolerance(bits=True)))


def test_a_page_is_its_words_and_tags_and_its_pictures_are_blobs():
    plain = Plain({"/somewhere/work": "WORK"}, "1.2.0")
    page = '<p class="a">In /somewhere/work\n by 1.2.0</p><svg><path d="M 0"/></svg><img src="x.png"><b>1</b>'
    lines = plain.page(page)
    assert lines[:2] == ['<p class="a">', " In WORK by VERSION"]
    assert lines[2].startswith("[svg ") and lines[3:] == ['<img src="x.png">', "<b>", " 1"]
    assert words_alone(lines)[2] == "[svg]"
    other = plain.page(page.replace("M 0", "M 1"))
    assert list(differences(lines, other, Tolerance())) and words_alone(other) == words_alone(lines)
    data = plain.page('<script type="application/json">{"seconds": 1.5, "a": 2}</script>')
    assert data == plain.page('<script type="application/json">{"seconds": 2.5, "a": 2}</script>')
