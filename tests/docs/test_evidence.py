"""Numbers of README and pages are those of the benchmarks' files; pages of evidence show what was missed."""

from __future__ import annotations

import dataclasses
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / "docs"))
import _evidence as evidence  # noqa: E402

PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
FILE = {
    "command": "palpate bench modulus REC",
    "commit": "0" * 40,
    "date": "2026-11-24",
    "processor": "2 cores",
    "figures": [
        {"what": "modulus of the cylinder", "value": 28.91, "spread": [27.9, 30.0], "unit": "kPa",
         "target": "within 5 %", "met": True},
        {"what": "time of a tick", "value": 0.31, "spread": [], "unit": "ms",
         "target": "< 0.3 ms", "met": False},
        {"what": "nodes", "value": 6276, "unit": ""},
    ],
}  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "modulus.json").write_text(json.dumps(FILE))
    return tmp_path


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_marked_numbers_are_the_files(page):
    text = page.read_text(encoding="utf-8")
    if "```" in text:  # what is shown as an example is no claim
        parts = text.split("```")
        text = "".join(part for k, part in enumerate(parts) if k % 2 == 0)
    text = re.sub(r"`[^`]*`", "", text)
    assert evidence.filled(text) == text, "run 'python docs/_evidence.py PAGE'"


@pytest.mark.parametrize("path", sorted(evidence.EVIDENCE.glob("*.json")), ids=lambda path: path.stem)
def test_every_file_can_be_read(path):
    read = evidence.read(path)
    assert read.figures and all(isinstance(f["value"], int | float) for f in read.figures)
    assert all(f["met"] is not None for f in read.figures if f["target"])


@pytest.mark.parametrize("page", sorted(evidence.EVIDENCE.glob("*.md")), ids=lambda page: page.stem)
def test_no_measured_number_of_an_evidence_page_was_typed(page):
    typed = evidence.unmarked(page.read_text(encoding="utf-8"))
    assert not typed, (
        "write it by 'palpate bench NAME --evidence', between <!-- evidence: NAME what --> marks"
    )


def test_a_typed_number_is_seen():
    page = (
        "It takes 12.3 ms, closes 96 % and holds 0.022 N (0.021 to 0.026 N) at 1,250 Hz, 3.5 times less; "
        "<!-- evidence: modulus nodes -->5,000 kPa<!-- end --> `7 s` 2026-11-23 seeds 70,000 size 2 "
        "<!-- setting -->60 presses<!-- end --> of order 10\n```\n8 mN\n```\n"
    )
    seen = [re.sub(r"\s", " ", number) for number in evidence.unmarked(page)]
    assert seen == ["12.3 ms", "96 %", "0.022 N", "0.021 to 0.026 N", "1,250 Hz", "3.5 times"]


def test_a_page_says_how_often_what_it_measures_has_changed_since(tmp_path):
    def git(*words):
        identity = ("-c", "user.name=x", "-c", "user.email=x@x", "-c", "commit.gpgsign=false")
        subprocess.run(["git", "-C", str(tmp_path), *identity, *words], check=True, capture_output=True)

    def state(version, code, other=""):
        rooms = "".join(f'{room} = "palpate.{room}"\n' for room in ("mechanics", "scenes"))
        (tmp_path / "pyproject.toml").write_text(
            f'[project]\nname = "p"\nversion = "{version}"\n[tool.palpate.rooms]\nshell = "palpate"\n{rooms}'
        )
        for folder, words in (("mechanics", code), ("scenes", other), ("benchmarks", "")):
            (tmp_path / folder).mkdir(exist_ok=True)
            (tmp_path / folder / "__init__.py").write_text(words)
        (tmp_path / "benchmarks" / "speed.py").write_text("from benchmarks._deep import run\n")
        (tmp_path / "benchmarks" / "_deep.py").write_text("from palpate.mechanics import a\n")
        git("add", "-A")
        git("commit", "-q", "--allow-empty", "-m", version)
        said = subprocess.run(
            ["git", "-C", str(tmp_path), "rev-parse", "HEAD"], capture_output=True, text=True
        )
        return said.stdout.strip()

    git("init", "-q")
    first = state("0.1.0", "a = 1")
    made = evidence.Evidence("speed", "palpate bench speed", first, "2026-11-24", "2 cores", ())
    assert evidence.age(made, tmp_path) == ""
    state("0.1.0", "a = 2")
    assert "1 commit has changed" in evidence.age(made, tmp_path), "within a version too"
    state("0.2.0", "a = 3")
    assert evidence.changes(made, tmp_path) == 2
    assert "(folders `mechanics`; version 0.1.0 then, 0.2.0 now)" in evidence.age(made, tmp_path)
    fresh = dataclasses.replace(made, commit=state("0.2.0", "a = 3") + "-dirty")
    state("0.3.0", "a = 3", "other = 1")
    assert evidence.age(fresh, tmp_path) == "", "a new version alone makes nothing older"
    assert evidence.changes(made, tmp_path) == 2
    assert "does not have" in evidence.age(dataclasses.replace(made, commit="f" * 40), tmp_path)


def test_a_number_is_filled_with_its_own_decimals(folder):
    marked = "E is <!-- evidence: modulus modulus of the cylinder -->27.0<!-- end --> kPa"
    assert "-->28.9<!--" in evidence.filled(marked, folder)
    assert "-->29<!--" in evidence.filled(marked.replace("27.0", "27"), folder)
    nodes = "<!-- evidence: modulus nodes -->5,000<!-- end -->"
    assert "-->6,276<!--" in evidence.filled(nodes, folder)


@pytest.mark.parametrize(
    ("marked", "words"),
    [
        ("<!-- evidence: speed nodes -->1<!-- end -->", "speed.json is missing"),
        (
            "<!-- evidence: modulus edges -->1<!-- end -->",
            "no figure 'edges'; it has modulus of the cylinder",
        ),
    ],
)
def test_a_number_without_a_source_is_refused(folder, marked, words):
    with pytest.raises(evidence.EvidenceError, match=words):
        evidence.filled(marked, folder)


def test_a_file_that_lacks_a_key_is_refused(folder):
    (folder / "modulus.json").write_text(json.dumps({k: v for k, v in FILE.items() if k != "commit"}))
    with pytest.raises(evidence.EvidenceError, match="lacks commit"):
        evidence.read(folder / "modulus.json")


def test_a_page_shows_missed_targets_beside_met_ones(folder, tmp_path):
    evidence.write(tmp_path / "pages", folder)
    page = (tmp_path / "pages" / "modulus.md").read_text()
    assert "1 of 2 targets met" in page and "**missed**" in page and "27.9 to 30" in page
    assert FILE["command"] in page and "2026-11-24" in page
    index = (tmp_path / "pages" / "index.md").read_text()
    assert "time of a tick" in index and "modulus of the cylinder" not in index


def test_a_page_begins_with_what_its_benchmark_says_of_itself(folder, tmp_path):
    (tmp_path / "benchmarks").mkdir()
    (tmp_path / "benchmarks" / "first_touch.py").write_text('"""How soon one\nfeels. \n\nMore."""\n')
    assert evidence.about("first-touch", tmp_path) == "How soon one feels."
    assert evidence.about("gone", tmp_path) == ""
    assert evidence.about("modulus") in evidence.page(evidence.read(folder / "modulus.json"))


def test_pages_of_files_that_are_gone_go_too(folder, tmp_path):
    evidence.write(tmp_path / "pages", folder)
    (folder / "modulus.json").unlink()
    evidence.write(tmp_path / "pages", folder)
    assert [p.name for p in (tmp_path / "pages").iterdir()] == ["index.md"]
