"""Files that nobody here had tried, with the right answer in their notes: each is right or asks the right
question, and no library speaks."""

from __future__ import annotations

import csv
import re
import warnings

import numpy as np
import pytest

import palpate as pp
from palpate.mechanics.errors import PalpateError, PalpateWarning, SurfaceError

PUNCH = {"tip": "punch", "tip_radius_m": 0.005}
CONE = {"tip": "cone", "tip_angle_deg": 35.0}
BALL = {"tip_radius_m": 0.001}
HALF_MM = {"tip_radius_m": 0.0005}
ROBOT = {"tip_radius_m": 0.004, "half_space": True}


@pytest.fixture
def opened(strangers, tmp_path, monkeypatch):
    """Opens files of the folder, or made of them, by name; only Palpate's own warnings may come."""
    monkeypatch.chdir(tmp_path)

    def call(*names: str, **said):
        paths = [MADE[n](strangers, tmp_path / n) if n in MADE else strangers / n for n in names]
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            found = pp.open(*paths, progress=False, **said)
        assert all(issubclass(each.category, PalpateWarning) for each in heard), [str(w) for w in heard]
        return found

    return call


def _side_by_side(folder, path):
    """Three tests of the punch beside one another, as a texture analyser writes them."""
    t, mm, newton = np.genfromtxt(folder / "flat_punch.csv", delimiter=",", skip_header=1).T
    one = np.column_stack([newton / 9.80665e-3, mm, t])
    rows = [[f"{v:.5g}" for v in row] for row in np.hstack([one] * 3)]
    head = [["Force", "Distance", "Time"] * 3, ["g", "mm", "sec"] * 3]
    path.write_text("".join("\t".join(row) + "\n" for row in head + rows))
    return path


def _latin(folder, path):
    path.write_text((folder / "bioindenter_500kPa.TXT").read_text("utf-8"), encoding="latin-1")
    return path


def _booleans(folder, path):
    head, *rows = csv.reader((folder / "words_none.csv").open())
    rows = [[*row, str(abs(float(row[7])) > 0.01)] for row in rows]
    path.write_text("".join(",".join(row) + "\n" for row in [[*head, "contact"], *rows]))
    return path


def _franka(folder, path):
    """The robot's rows with the whole pose, column by column, as another arm's state."""
    rows = [line.split() for line in (folder / "ur_rtde.csv").read_text().splitlines()[1:]]
    turned = "1 0 0 0 0 -1 0 0 0 0 -1 0".split()
    head = ["time", *(f"O_T_EE_{k}" for k in range(16)), *(f"O_F_ext_hat_K_{k}" for k in range(6))]
    lines = [[r[0], *turned, *r[1:4], "1", *r[7:10], "0", "0", "0"] for r in rows]
    path.write_text("".join(",".join(row) + "\n" for row in [head, *lines]))
    return path


def _labels(folder, path):
    """A block of 60 x 60 x 30 mm in six cells a side of which the inner eight are labelled otherwise."""
    import pyvista

    grid = pyvista.ImageData(dimensions=(7, 7, 5), spacing=(10, 10, 7.5)).cast_to_unstructured_grid()
    centre = grid.cell_centers().points
    grid.cell_data["label"] = 1 + (np.abs(centre - [30, 30, 15]) < [10, 10, 7.5]).all(axis=1).astype(int)
    grid.save(path)
    return path


MADE = {
    "taxt.txt": _side_by_side,
    "latin.TXT": _latin,
    "bools_last.csv": _booleans,
    "franka_state.csv": _franka,
    "two_labels_mm.vtk": _labels,
}
SIX = tuple(f"flat_punch6/fp{k}.csv" for k in range(6))


@pytest.mark.parametrize(
    ("names", "said", "modulus_pa"),
    [
        (SIX, PUNCH, 20e3),
        (("flat_punch.csv",), PUNCH, 20e3),
        (("bluehill.csv",), PUNCH, 20e3),
        (("taxt.txt",), PUNCH, 20e3),
        (("cone_10kPa.csv",), CONE, 10e3),
        (("tilt_none.csv",), BALL, 10e3),
        (("tilt_slope.csv",), BALL, 10e3),
        (("jkr_10kPa.csv",), BALL, 10e3),
        (("bioindenter_500kPa.TXT",), HALF_MM, 500e3),
        (("latin.TXT",), HALF_MM, 500e3),
        (("piuma_1800Pa.txt",), {}, 1800.0),
    ],
)
def test_a_machines_curves_hold_their_modulus(opened, names, said, modulus_pa):
    found = opened(*names, **said)
    low, high = found.result.young_modulus_ci95_pa
    assert found.kind == "curves" and found.good and low <= modulus_pa <= high < 1.1 * low
    assert found.result.curves == (3 if names == ("taxt.txt",) else len(names))
    lost = float(found.result.verdict.split(" % of the work")[0].split()[-1])
    assert abs(lost) <= 2


@pytest.mark.parametrize(
    ("names", "said", "question"),
    [
        (SIX, {"tip_radius_m": 0.005}, "--tip punch or --tip sphere"),
        (("flat_punch.csv",), {"tip_radius_m": 0.005}, "--tip punch or --tip sphere"),
        (("bluehill.csv",), {"tip_radius_m": 0.005}, "--tip punch or --tip sphere"),
        (("taxt.txt",), {"tip_radius_m": 0.005}, "--tip punch or --tip sphere"),
        (("cone_10kPa.csv",), BALL, "--tip cone"),
        (("bioindenter_500kPa.TXT",), {}, "--tip-radius"),
    ],
)
def test_what_no_file_says_of_a_tip_is_asked(opened, names, said, question):
    with pytest.raises(PalpateError, match=question):
        opened(*names, **said)


def test_a_line_under_a_sphere_is_no_answer(opened):
    assert not opened("flat_punch.csv", tip="sphere", tip_radius_m=0.005).good


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "presses"),
    [
        ("slow_log_12kPa.csv", 9),
        ("stamp_first.csv", 6),
        ("words_none.csv", 6),
        ("words_third.csv", 6),
        ("bools_last.csv", 6),
        ("ur_rtde.csv", 6),
        ("franka_state.csv", 6),
    ],
)
def test_a_robots_log_holds_its_presses_and_modulus(opened, name, presses, tmp_path):
    found = opened(name, **ROBOT)
    low, high = found.result.young_modulus_ci95_pa
    assert low <= 12e3 <= high and len(found.result.model.presses) == presses
    assert found.report(tmp_path / "page.html").is_file()


@pytest.mark.parametrize(
    ("name", "volumes_cm3"),
    [
        ("block_with_tumour_mm.obj", [108.0, 0.7903]),
        ("two_blocks_mm.obj", [32.0, 32.0]),
        ("two_labels_mm.vtk", [102.0, 6.0]),
    ],
)
def test_parts_of_a_mesh_are_listed_and_asked_for(opened, name, volumes_cm3):
    with pytest.raises(PalpateError, match="--modulus") as asked:
        opened(name, unit="mm")
    said = [float(word) for word in re.findall(r"([\d.]+) cm³", str(asked.value))]
    assert said == pytest.approx(volumes_cm3, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "unit", "volume_cm3"),
    [
        pytest.param("overlapping_blocks_mm.obj", "mm", 76.0, marks=pytest.mark.slow),
        ("inverted_block_mm.obj", "mm", 72.0),
        ("mixed_winding_mm.obj", "mm", 72.0),
        pytest.param("box_gmsh1.msh", "cm", 72.0, marks=pytest.mark.slow),
    ],
)
def test_a_sound_mesh_has_its_volume(opened, name, unit, volume_cm3):
    found = opened(name, unit=unit, young_modulus_pa=4e3)
    assert 1e6 * found.result.mesh.volumes.sum() == pytest.approx(volume_cm3, rel=2e-3)


def test_a_block_that_crosses_itself_is_refused(opened):
    with pytest.raises(SurfaceError, match="crosses itself"):
        opened("twisted_block_mm.obj", unit="mm", young_modulus_pa=4e3)


@pytest.mark.slow
def test_a_simulators_frame_unit_and_force_law_are_told_before_its_numerics(shared_recordings, reconstructed):
    """Our own forces along a labelled recording, right but for that."""
    recording = pp.read_recording(shared_recordings / "silicone-1-cylinder.toml")
    model = reconstructed("silicone-1-cylinder")
    right = pp.replay(model, recording, progress=False)
    size = np.linalg.norm(right.force_n, axis=1, keepdims=True)
    usual = np.percentile(size[size > 0.05], 95)
    for force, axes, unit, effects in (
        (right.force_n[:, [0, 2, 1]] * [1, 1, -1], "x,z,-y", "N", ()),
        (1e3 * right.force_n, "x,y,z", "mN", ()),
        (right.force_n * (size / usual) ** (1 / 3), "x,y,z", "N", ("force_law",)),
    ):
        found = pp.diagnose(recording, model, fast=True, simulated=(right.t, force), progress=False)
        assert found.effects == effects
        assert (found.simulator.axes, found.simulator.unit) == (axes, unit)
