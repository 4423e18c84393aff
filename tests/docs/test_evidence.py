"""Numbers of README and pages are those of the benchmarks' files; pages of evidence show what was missed."""

from __future__ import annotations

import json
import re
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


def test_pages_of_files_that_are_gone_go_too(folder, tmp_path):
    evidence.write(tmp_path / "pages", folder)
    (folder / "modulus.json").unlink()
    evidence.write(tmp_path / "pages", folder)
    assert [p.name for p in (tmp_path / "pages").iterdir()] == ["index.md"]
