"""What a refusal names mends it: the words are taken out of what is said, typed after the command, and it
gets to its work."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate.cli import main
from palpate.operations._written import reconstruct_words, with_geometry_of
from palpate.reconstruction.geometry.stated import GeometryOptions, stated_geometry

from ...reconstruct.flat_ground import raster
from ..importing.test_meaning import press, write


def a_part(folder: Path) -> None:
    """In mm, as parts come."""
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((60, 60, 30)).apply_translation((0, 0, 15)).export(folder / "part.stl")


def a_recording(folder: Path) -> None:
    pp.read_recording("silicone-1-cylinder").save(folder / "REC.csv")


def a_log(folder: Path) -> None:
    """Of another program, which says nothing of its tip."""
    seen = pp.read_recording("silicone-1-cylinder")
    rows = [seen.t, 1e3 * seen.position, -seen.force_on_tool]
    write(folder / "robot.csv", [each[::4] for each in rows], "time,x_mm,y_mm,z_mm,Fx,Fy,Fz")


def two_logs(folder: Path) -> None:
    """Position and force by two programs, whose clocks began an hour apart."""
    seen = pp.read_recording("silicone-1-cylinder")
    write(folder / "where.csv", [seen.t, 1e3 * seen.position], "time,x_mm,y_mm,z_mm")
    write(folder / "load.csv", [3600 + seen.t, -seen.force_on_tool], "time,Fx,Fy,Fz")


def a_curve(folder: Path) -> None:
    """With names that nobody knows, two of a unit."""
    t, depth, force = press()
    write(
        folder / "curve.csv",
        [t, 1e3 * depth, depth, force, 0.1 * force],
        "t (s),aa (mm),cc (mm),bb (N),dd (N)",
    )


def a_wild_log(folder: Path) -> None:
    """In which force and way have nothing to do with one another."""
    seen = pp.read_recording("silicone-1-cylinder")
    rows = [seen.t, 1e3 * seen.position, -np.roll(seen.force_on_tool, len(seen.t) // 3, axis=0)]
    write(folder / "robot.csv", [each[::4] for each in rows], "time,x_mm,y_mm,z_mm,Fx,Fy,Fz")


def a_cone(folder: Path) -> None:
    """On its point."""
    trimesh = pytest.importorskip("trimesh")
    cone = trimesh.creation.cone(0.03, 0.05, sections=40)
    cone.apply_transform(np.diag([1.0, -1.0, -1.0, 1.0]))
    cone.export(folder / "cone.stl")


@dataclass(frozen=True)
class Refused:
    """A command that is refused. cure: what its refusal names; filled: its capitals; work: where the command
    that takes it comes to its work, '' for one that is run to its end."""

    files: object
    words: str
    cure: str
    filled: dict[str, str] = field(default_factory=dict)
    work: str = ""


CONTACTS = "palpate.reconstruction.steps.s3_contacts.contacts.explore"
LABORATORY = "palpate.scenes.laboratory.simulate.simulate"
MESHED = "palpate.scenes.build.meshed"
OF_DIAGNOSE = "palpate.operations.diagnose.reconstruct"
OF_EXPLORE = "palpate.operations.explore.LaboratoryRobot"
OF_TOUCH = "palpate.operations.touch._without"
SIMULATOR = {"--renderer": "--renderer mujoco"}
REFUSED = {
    "a model's unit": Refused(a_part, "model part.stl --modulus 12000 -o M", "--unit mm", work=MESHED),
    "a phantom's unit": Refused(a_part, "simulate part.stl -o r.csv.gz", "--unit mm", work=LABORATORY),
    "where the truth goes": Refused(
        None, "simulate dome -o r.csv.gz --seal", "--truth PATH", {"PATH": "kept/truth.json"}, LABORATORY
    ),
    "who touches": Refused(None, "explore -o r.csv.gz", "--phantom NAME", {"NAME": "dome"}, OF_EXPLORE),
    "a plate": Refused(a_recording, "calibrate REC.csv -o t.toml", "--rigid", work=CONTACTS),
    "a block": Refused(
        a_recording, "calibrate REC.csv -o t.toml", "--modulus PA", {"PA": "12e3"},
        "palpate.operations.calibrate.reconstruct",
    ),
    "whose presses": Refused(
        a_recording, "diagnose REC.csv --presses 6", "--renderer", SIMULATOR, OF_DIAGNOSE
    ),
    "what is mended": Refused(
        a_recording, "diagnose REC.csv --mended best", "--renderer", SIMULATOR, OF_DIAGNOSE
    ),
    "who was told": Refused(
        a_recording, "diagnose REC.csv --stated friction=1", "--renderer", SIMULATOR, OF_DIAGNOSE
    ),
    "what the baseline is of": Refused(
        a_recording, "diagnose REC.csv --baseline documented", "--renderer", SIMULATOR, OF_DIAGNOSE
    ),
    "what is played": Refused(
        a_recording, "touch --headless --device replay", "--replay REC", {"REC": "REC.csv"}, OF_TOUCH
    ),
    "a hand without a window": Refused(
        None, "touch --headless --device mouse", "--device simulated", work=OF_TOUCH
    ),
    "where it goes": Refused(a_log, "import robot.csv --tip-radius 0.005", "--dry-run"),
    "the tip": Refused(
        a_log, "import robot.csv -o r.csv.gz", "--tip-radius", {"--tip-radius": "--tip-radius 0.005"}
    ),
    "two clocks": Refused(
        two_logs, "import where.csv load.csv -o r.csv.gz --tip-radius 0.005", "--offset S", {"S": "-3600"},
    ),
    "on what it acts": Refused(
        a_wild_log, "import robot.csv -o r.csv.gz --tip-radius 0.005", "--force-on tool or --force-on object",
        {"--force-on tool or ": ""},
    ),
    "how it lies": Refused(
        a_cone, "simulate cone.stl -o r.csv.gz", "--up -z", {"--up -z": "--up=-z"}, LABORATORY
    ),
    "columns": Refused(
        a_curve, "material curve.csv --fast --tip-radius 0.004", "--column depth=NAME and --column load=NAME",
        {"depth=NAME and": "depth='aa (mm)'", "load=NAME": "load='bb (N)'"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_a_refused_command_gets_to_its_work_with_what_is_named(name, tmp_path, monkeypatch, capsys):
    class Reached(Exception):
        pass

    def work(*_: object, **__: object) -> None:
        raise Reached

    each = REFUSED[name]
    monkeypatch.chdir(tmp_path)
    if each.files is not None:
        each.files(tmp_path)
    assert main(shlex.split(each.words)) == 2
    said = capsys.readouterr().err
    assert re.search(rf"(?<!\w){re.escape(each.cure)}(?!\w)", said), said
    cure = each.cure
    for capitals, meant in each.filled.items():
        cure = cure.replace(capitals, meant)
    if each.work:
        monkeypatch.setattr(each.work, work)
        with pytest.raises(Reached):
            main(shlex.split(f"{each.words} {cure}"))
    else:
        assert main(shlex.split(f"{each.words} {cure}")) == 0, capsys.readouterr().err


def test_a_table_of_another_program_is_brought_in_by_the_commands_that_its_refusal_names(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    a_log(tmp_path)
    assert main(["check", "robot.csv"]) == 2
    (bring, look) = re.findall(r"'palpate ([^']*)'", capsys.readouterr().err)
    assert main(shlex.split(f"{bring.replace('REC', 'r.csv.gz')} --tip-radius 0.005")) == 0
    assert main(["check", "r.csv.gz"]) == 0 and look == "open robot.csv"


def test_a_corrected_recording_is_reconstructed_by_the_geometry_that_is_known():
    """The next step named no shape, and ended in "no boundary phase found"."""
    model = pp.load("demo")
    assert reconstruct_words("CLEAN.csv.gz", model) == "palpate reconstruct CLEAN.csv.gz -o MODEL"
    made = {
        "options": {"geometry": {"shape": "my part.stl", "unit": "mm", "pose": "auto", "half_space": False}}
    }
    words = reconstruct_words("CLEAN.csv.gz", model.replaced(provenance=made))
    assert words == "palpate reconstruct CLEAN.csv.gz --shape 'my part.stl' --unit mm -o MODEL"


def test_a_corrected_recording_states_the_geometry_that_is_known(tmp_path, monkeypatch):
    """Its check-up was grave again, "no base", and a diagnosis of it was refused."""
    monkeypatch.chdir(tmp_path)
    made = {"options": {"geometry": {"shape": "part.stl", "unit": "mm", "pose": "auto"}}}
    model = pp.load("demo").replaced(provenance=made)
    (tmp_path / "kept").mkdir()
    with_geometry_of(model, raster((2, 2))).save("kept/CLEAN.csv.gz")
    said = stated_geometry(pp.read_recording("kept/CLEAN.csv.gz"), GeometryOptions())
    assert Path(said.shape).resolve() == (tmp_path / "part.stl").resolve() and said.unit == "mm"
