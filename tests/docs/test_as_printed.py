"""What the how-to prints for another simulator runs as printed: an object that lies tilted and far from the
device's origin, forces that are too small by three tenths."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate import cli

from ..reconstruct.exploration_of_cylinder import TILTED, explore_cylinder
from .test_blocks_run import DOCS, lines_of

LEFT = 0.7
"""Share of our own law's force that the simulator gives."""


@pytest.fixture(scope="module")
def beside(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with REC.csv, a coarse MODEL and FORCES.csv."""
    folder = tmp_path_factory.mktemp("as printed")
    recording, _ = explore_cylinder(frame=TILTED)
    recording.save(folder / "REC.csv")
    made = pp.reconstruct(recording, mesh_size_m=0.02, save=folder / "MODEL", progress=False)
    replayed = pp.replay(made.model, recording)
    rows = np.column_stack([replayed.t, LEFT * replayed.force_n])
    np.savetxt(folder / "FORCES.csv", rows, "%.6g", ",", header="t,fx,fy,fz", comments="")
    return folder


def printed() -> list[str]:
    """The words of the page's command with FORCES.csv."""
    page = DOCS / "howto" / "wrong-simulation.md"
    (line,) = [line for line in lines_of(page) if "FORCES.csv" in line]
    return [{"REC": "REC.csv"}.get(word, word) for word in shlex.split(line)[1:]]


@pytest.mark.parametrize(
    "beside_it",
    [
        pytest.param(["--fast"], id="coarse", marks=pytest.mark.slow),
        pytest.param([], id="as printed", marks=pytest.mark.release),
    ],
)
def test_the_gap_of_forces_in_a_file_is_told_by_the_command_that_the_page_prints(
    beside_it, beside, monkeypatch, capsys
):
    monkeypatch.chdir(beside)
    assert cli.main([*printed(), *beside_it, "--json", "gap.json"]) == 0
    told = json.loads((beside / "gap.json").read_text())
    assert 0 < told["gap_after_n"] < told["gap_before_n"]
    assert "force_law" not in told["verdict"]["effects"]  # a factor is no other power
    page = (beside / "why.html").read_text(encoding="utf-8")
    assert re.search(r'<p class="lead">It is off by', page) and '<details class="chapter"' in page
