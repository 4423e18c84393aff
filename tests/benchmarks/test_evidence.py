"""Figures are kept whole, and read back only where they are what INTERFACE promises."""

from __future__ import annotations

import json
import math
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.evidence import Evidence, Figure, measured, processor, read, spent, write
from palpate.mechanics.errors import FileError

CLONE = Path(__file__).resolve().parents[2]
KEPT = sorted((CLONE / "docs" / "evidence").glob("*.json"))


@pytest.fixture
def evidence() -> Evidence:
    figures = (
        Figure("reading, wall", 0.2, (0.15, 0.4), "s").at_most(10.0, "the paper's"),
        Figure("ratio to the peer", 0.5).at_least(1.0),
        Figure("nodes", 1000, unit="1"),
    )
    return measured("palpate bench contacts", figures, CLONE)


def test_what_is_written_is_read_back(tmp_path, evidence):
    assert read(write(tmp_path / "new" / "contacts.json", evidence)) == evidence
    held = json.loads((tmp_path / "new" / "contacts.json").read_text())
    assert list(held) == ["command", "commit", "date", "processor", "figures"]
    assert [list(f) for f in held["figures"]] == 3 * [["what", "value", "spread", "unit", "target", "met"]]
    assert [f["met"] for f in held["figures"]] == [True, False, None]
    assert held["figures"][0]["target"] == "at most 10 s (the paper's)"
    assert held["figures"][2]["spread"] == [1000.0, 1000.0]


def test_what_a_command_took_grows_with_what_it_does():
    before = [figure.value for figure in spent()]
    held = bytearray(b"x" * 300_000_000)
    after = [figure.value for figure in spent()]
    assert after[0] > before[0] > 0 and after[1] >= max(before[1], len(held) / 1e6)
    assert [figure.unit for figure in spent()] == ["s", "MB"]


def test_numbers_that_are_not_finite_and_half_a_target_are_refused():
    with pytest.raises(ValueError, match="finite"):
        Figure("x", math.nan)
    with pytest.raises(ValueError, match="finite"):
        Figure("x", 1.0, (0.0, math.inf))
    with pytest.raises(ValueError, match="target"):
        Figure("x", 1.0, target="at most 2")
    with pytest.raises(ValueError, match="no figures"):
        measured("palpate bench contacts", [], CLONE)


@pytest.mark.parametrize(
    "harm",
    [
        lambda held: held.pop("date"),
        lambda held: held.update(host="somewhere"),
        lambda held: held.update(date="today"),
        lambda held: held.update(figures={}),
        lambda held: held["figures"][0].update(value="0.2"),
        lambda held: held["figures"][0].update(value=True),
        lambda held: held["figures"][0].update(value=math.nan),
        lambda held: held["figures"][0].update(spread=[0.3, 0.4]),
        lambda held: held["figures"][0].update(spread=[0.3]),
        lambda held: held["figures"][0].update(met="yes"),
        lambda held: held["figures"][0].update(met=None),
        lambda held: held["figures"][0].pop("unit"),
    ],
)
def test_another_shape_is_refused_in_a_line(tmp_path, evidence, harm):
    path = write(tmp_path / "contacts.json", evidence)
    held = json.loads(path.read_text())
    harm(held)
    path.write_text(json.dumps(held))
    with pytest.raises(FileError, match="is no evidence file") as error:
        read(path)
    assert "\n" not in str(error.value)


def test_a_failed_write_leaves_the_old_file(tmp_path, evidence):
    path = write(tmp_path / "contacts.json", evidence)
    with pytest.raises(TypeError):
        write(path, replace(evidence, commit=object()))
    assert read(path) == evidence


def test_a_commit_with_changes_says_so_and_evidence_is_no_change(tmp_path):
    def git(*words: str) -> None:
        subprocess.run(["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b", *words],
                       check=True, capture_output=True)  # fmt: skip

    def commit() -> str:
        return measured("x", [Figure("y", 1.0)], tmp_path).commit

    assert commit() == "unknown" or len(commit()) >= 7  # the temporary folder may lie in a clone
    git("init")
    (tmp_path / "a").write_text("a")
    git("add", "a")
    git("commit", "-m", "a")
    assert len(commit()) == 7
    (tmp_path / "docs" / "evidence").mkdir(parents=True)
    (tmp_path / "docs" / "evidence" / "new.json").write_text("{}")
    assert len(commit()) == 7
    (tmp_path / "a").write_text("b")
    assert commit().endswith("-dirty")


def test_the_processor_is_named_and_the_host_is_not():
    import socket

    assert "core" in processor() and socket.gethostname() not in processor()


@pytest.mark.parametrize("path", KEPT, ids=lambda path: path.stem)
def test_every_file_that_is_kept_can_be_read(path):
    found = read(path)
    assert found.command.startswith("palpate bench ")
    assert found.figures
