"""Commands that take files of one's own run as their pages print them: on an object that lies tilted and far
from the device's origin, with a file in millimetres, with forces that are too small by three tenths."""

from __future__ import annotations

import dataclasses
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import palpate as pp
from palpate import cli
from palpate.mechanics.recording.recording import Recording

from ..reconstruct.exploration_of_cylinder import TILTED, Frame, explore_cylinder
from ..reconstruct.flat_ground import MODULUS_PA, raster
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


def as_typed(line: str) -> list[str]:
    """The words of a page's command after `palpate`, with REC a file of that name."""
    return [{"REC": "REC.csv"}.get(word, word) for word in shlex.split(line)[1:]]


def printed() -> list[str]:
    """The words of the page's command with FORCES.csv."""
    page = DOCS / "howto" / "wrong-simulation.md"
    (line,) = [line for line in lines_of(page) if "FORCES.csv" in line]
    return as_typed(line)


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


SHAPES = DOCS / "howto" / "cad-or-scan.md"
LEANS = Frame(Rotation.from_euler("xyz", [6, -8, 70], degrees=True).as_matrix(), TILTED.shift)
"""As a robot's frame lies to a table, within what a file's tilted foot is stood on."""
ASIDE = Frame(Rotation.from_euler("z", 0.5).as_matrix(), np.array([0.12, -0.08, 0.035]))
"""As a part lies in a file."""


def turned(recording: Recording, frame: Frame) -> Recording:
    """The same touches in another device's frame."""
    return dataclasses.replace(
        recording,
        position=frame.device(recording.position),
        force_on_tool=recording.force_on_tool @ frame.rotation.T,
    )


def liver(folder: Path, frame: Frame) -> None:
    """The embedded recording's cylinder as a file in mm."""
    solid = trimesh.creation.cylinder(0.040, 0.080, sections=96).apply_translation((0, 0, 0.040))
    placed = np.eye(4)
    placed[:3, :3], placed[:3, 3] = frame.rotation, frame.shift
    solid.apply_transform(placed).apply_scale(1e3).export(folder / "liver.stl")


@pytest.mark.release
@pytest.mark.parametrize("way", ["--unit mm -o", "--pose given", "--slab"])
def test_each_way_to_state_a_shape_runs_as_the_page_prints_it(way, tmp_path, monkeypatch, capsys):
    """On an object that lies turned and elsewhere; the file of the second way, too, is in mm: as printed it
    was read in metres."""
    monkeypatch.chdir(tmp_path)
    (line,) = [line for line in lines_of(SHAPES) if "reconstruct REC" in line and way in line]
    if way == "--slab":
        raster((5, 5)).save("REC.csv")
    else:
        turned(pp.read_recording("silicone-1-cylinder"), LEANS).save("REC.csv")
        liver(tmp_path, LEANS if "given" in way else ASIDE)
    assert cli.main(as_typed(line)) == 0, capsys.readouterr()
    made = pp.load("MODEL")
    found_pa = made.material.young_modulus_pa
    if way == "--slab":  # the touches are of a half-space: a layer on a table needs less for the same force
        assert 0.8 * MODULUS_PA < found_pa < MODULUS_PA
    else:
        assert found_pa == pytest.approx(29e3, rel=0.05)
    assert np.linalg.norm(made.mesh.points.mean(axis=0)) > 0.05, "it lies where the device touched it"


@pytest.mark.release
def test_the_two_minutes_without_hardware_run_as_printed(tmp_path, monkeypatch, capsys):
    """Simulate, reconstruct, diagnose: what was planted is named."""
    monkeypatch.chdir(tmp_path)
    for line in lines_of(DOCS / "tutorials" / "two-minutes.md"):
        assert cli.main(as_typed(line)) == 0, line
    said = capsys.readouterr().out
    assert "leaves out tool compliance and surface offset" in said


@pytest.mark.release
def test_a_simulator_is_tuned_as_printed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (line,) = lines_of(DOCS / "howto" / "tune-simulator.md")
    assert cli.main([*as_typed(line), "--json", "tuned.json"]) == 0
    tuned = json.loads(Path("tuned.json").read_text())
    assert tuned["gap_after_n"] < 0.25 * tuned["gap_before_n"]  # no machine makes the same mesh
    compile(Path("settings.py").read_text(), "settings.py", "exec")
