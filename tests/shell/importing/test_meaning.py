"""What a solid does tells signs, blocks and units that no header says; what stays open is asked."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest

import palpate as pp
from benchmarks.foreign_files import OUTCOMES, outcome_of
from palpate import cli
from palpate.importing.headers import header_of
from palpate.importing.meaning import (
    LEAST_ODDS,
    Unclear,
    best,
    clock_of,
    force_sense,
    joined,
    press_scores,
)
from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.errors import RecordingError
from tests.support.exports import export
from tests.support.strange_exports import KINDS, strange_export

RADIUS, MODULUS = 0.003, 10e6


def press(seed: int = 0, air: float = 0.3, back: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(t s, depth m, force N) of a sphere that goes 0.6 mm into 10 MPa."""
    rng = np.random.default_rng(seed)
    way = 0.6e-3 * np.linspace(-air, 1, 300)
    depth = np.concatenate([way, way[::-1]]) if back else way
    force = np.asarray(dent_law("sphere").force(np.maximum(depth, 0), MODULUS, 0.49, RADIUS))
    force = force + 0.004 * force.max() * rng.standard_normal(len(force))
    return np.arange(len(depth)) / 50, depth, force


def write(path, columns, header):
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.9g")
    return path


@pytest.mark.parametrize("travel", [1, -1])
@pytest.mark.parametrize("load", [1, -1])
@pytest.mark.parametrize(("air", "back"), [(0.3, True), (0.0, True), (0.3, False)])
def test_both_signs_are_told_by_what_a_solid_does(travel, load, air, back):
    _, depth, force = press(air=air, back=back)
    found = best(press_scores(travel * depth + 0.2, load * force - 0.7))
    assert found.value == (travel, load) and found.odds >= LEAST_ODDS


def test_noise_tells_no_sign():
    rng = np.random.default_rng(0)
    found = best(press_scores(np.linspace(0, 1, 500), rng.standard_normal(500)))
    assert not found.sure


def test_a_falling_height_and_a_negative_compression_give_the_modulus(tmp_path):
    t, depth, force = press()
    file = write(tmp_path / "a.csv", [t, 12 - 1e3 * depth, -force], "Time (s),Height (mm),Load (N)")
    made = pp.material(file, tip_radius_m=RADIUS, progress=False)
    assert made.young_modulus_pa == pytest.approx(MODULUS, rel=0.1)
    assert "negative in compression" in str(made)


def test_blocks_with_restarting_clocks_and_a_position_that_counts_down(tmp_path):
    lines = ["<INFO>", "Probe radius: 3 mm", "<END INFO>"]
    for k in range(3):
        t, depth, force = press(k)
        lines += ["<DATA>", "Time, s\tPosition (z), mm\tFz, N"]
        lines += [f"{a:.4f}\t{-147 - 1e3 * b:.6f}\t{-c:.6f}" for a, b, c in zip(t, depth, force, strict=True)]
        lines += ["<END DATA>"]
    (tmp_path / "mach.txt").write_text("\n".join(lines))
    with pytest.warns(UserWarning, match="lack a number"):
        made = pp.material(tmp_path / "mach.txt", progress=False, fast=True)
    assert made.curves == 3
    assert made.young_modulus_pa == pytest.approx(MODULUS, rel=0.1)
    low, high = made.young_modulus_ci95_pa
    assert low <= made.young_modulus_pa <= high
    assert "3 blocks" in str(made) and "3 presses" in str(made)


def test_rows_out_of_order_are_no_blocks():
    t, depth, force = press()
    order = np.argsort(np.arange(len(t)) + np.random.default_rng(0).integers(0, 8, len(t)), kind="stable")
    assert clock_of(t[order], np.column_stack([depth, force])[order]).value == (1,)
    twice = np.concatenate([t, t])
    assert clock_of(twice, np.column_stack([depth, force] * 1)[np.r_[: len(t), : len(t)]]).value == (-1,)
    assert (np.diff(joined(twice)) > 0).all()


def test_the_force_on_an_object_is_told_from_that_on_a_tool():
    t = np.arange(2000) / 200
    depth = 0.006 * np.sin(np.pi * t) ** 2 - 0.001
    position = np.column_stack([0.01 * np.floor(t), 0 * t, -depth])
    force = np.column_stack([0 * t, 0 * t, 400 * np.maximum(depth, 0)])
    assert force_sense(position, force).value == (1,) and force_sense(position, force).sure
    assert force_sense(position, -force).value == (-1,) and force_sense(position, -force).sure
    assert not force_sense(position, np.random.default_rng(0).standard_normal(force.shape)).sure


@pytest.mark.parametrize("travel", [1, -1])
@pytest.mark.parametrize("load", [1, -1])
def test_a_machine_of_one_axis_is_imported_with_z_out_of_the_sample(tmp_path, travel, load):
    t, depth, force = press()
    columns = [t, 5 + travel * 1e3 * depth, load * force]
    file = write(tmp_path / "a.csv", columns, "Time (s),Position (mm),Load (N)")
    read = pp.read_table(file, tip_radius_m=RADIUS)
    top = int(np.argmax(read.force_on_tool[:, 2]))
    assert read.force_on_tool[top, 2] == pytest.approx(force.max())
    assert read.position[top, 2] == pytest.approx(read.position[:, 2].min(), abs=1e-5)


def test_what_stays_open_is_one_line_that_names_the_flag(tmp_path, capsys):
    t, depth, _ = press()
    noise = np.random.default_rng(0).standard_normal(len(t))
    file = write(tmp_path / "noise.csv", [t, 1e3 * depth, noise], "t (s),Position (mm),Load (N)")
    assert cli.main(["material", str(file), "--tip-radius", "0.003"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and "--compression positive or --compression negative" in said[0]
    assert "--column load=NAME" in said[0]


def test_on_a_terminal_one_question_is_asked(tmp_path, capsys, monkeypatch):
    t, depth, force = press()
    file = write(tmp_path / "a.csv", [t, 1e3 * depth, force], "t (s),Depth (mm),Load (N)")

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setattr("sys.stdin", Terminal("0.003\n"))
    monkeypatch.setattr("sys.stderr", Terminal())
    assert cli.main(["material", str(file), "--json", str(tmp_path / "out.json")]) == 0
    held = json.loads((tmp_path / "out.json").read_text())
    assert held["young_modulus_pa"] == pytest.approx(MODULUS, rel=0.1)


def test_a_ramp_and_a_named_load_are_read(tmp_path):
    t, depth, force = press(air=0.0, back=False)
    held = np.arange(200) / 50
    file = write(
        tmp_path / "ramp.csv",
        [
            np.concatenate([t, t[-1] + 0.02 + held]),
            np.concatenate([depth, np.full(200, depth[-1])]) * 1e3,
            -np.concatenate([force, force[-1] * (0.8 + 0.2 * np.exp(-held))]),
        ],
        "clock,travel of it (mm),cell (N)",
    )
    made = pp.material(
        file, tip_radius_m=RADIUS, columns={"t": "clock", "depth": "travel of it (mm)", "load": "cell (N)"},
        progress=False,
    )  # fmt: skip
    assert made.young_modulus_pa == pytest.approx(MODULUS, rel=0.15)


def test_a_unit_that_is_said_nowhere_is_taken_only_where_it_is_sure(tmp_path):
    t, depth, force = press()
    file = write(tmp_path / "bare.csv", [t, 1e3 * depth, 1e-3 * force], "t,depth,load")
    made = pp.material(file, tip_radius_m=RADIUS, progress=False)
    assert made.young_modulus_pa == pytest.approx(MODULUS / 1e3, rel=0.1) and "taken as mm" in str(made)
    file = write(tmp_path / "hard.csv", [t, 1e3 * depth, force], "t,depth,load")
    with pytest.raises(Unclear, match="--units force=mN or --units force=N"):
        pp.material(file, tip_radius_m=RADIUS, progress=False)


@pytest.mark.parametrize(
    ("text", "radius"),
    [
        ("Probe radius: 3 mm", 0.003),
        ("Tip diameter (mm);6", 0.003),
        ("Indenter radius = 2,5 mm", 0.0025),
        ("Sphere diameter [um]: 500", 250e-6),
        ("radius of the sample: 3 mm", None),
    ],
)
def test_the_probes_radius_is_read_from_the_files_own_text(tmp_path, text, radius):
    (tmp_path / "a.txt").write_text(f"Operator: x\n{text}\nt;z;f\n1;2;3\n")
    assert header_of(tmp_path / "a.txt").radius_m == (None if radius is None else pytest.approx(radius))


def test_arrays_get_the_checks_of_files():
    t = np.arange(2000) / 200
    depth = 0.006 * np.sin(np.pi * t) ** 2 - 0.001
    position = np.column_stack([0.01 * np.floor(t), 0 * t, -depth])
    force = np.column_stack([0 * t, 0 * t, 400 * np.maximum(depth, 0)])
    right = pp.recording(t, position, -force, tip_radius=0.004)
    assert np.allclose(right.force_on_tool, force) and right.tip_radius_m == 0.004
    with pytest.raises(RecordingError, match="--units position=mm"):
        pp.recording(t, 1e3 * position, force, tip_radius=0.004)
    with pytest.raises(RecordingError, match="--units time=ms"):
        pp.recording(1e3 * t, position, force, tip_radius=0.004)
    again = pp.recording(
        1e3 * t, 1e3 * position, force, tip_radius=0.004, units={"time": "ms", "position": "mm"}
    )
    assert np.allclose(again.position, position) and np.allclose(again.t, t)
    with pytest.raises(RecordingError, match="--tip-radius"):
        pp.recording(t, position, force)
    with pytest.raises(RecordingError, match=r"allowed are \(n,\), \(n, 3\)"):
        pp.recording(t, position[:, :2], force, tip_radius=0.004)


@pytest.mark.parametrize(
    ("units", "words"),
    [
        ((1.0, 1e3), "tip's path is .* these look like .*millimetres"),
        ((1e3, 1.0), "these look like millisec"),
    ],
)
def test_a_recording_that_was_built_in_other_units_is_refused_where_it_is_used(units, words):
    t, x = np.arange(2000) / 200, np.linspace(0.0, 0.05, 2000)
    position, force = np.column_stack([x, 0 * t, 0 * t]), np.column_stack([0 * t, 0 * t, np.sin(t)])
    right = pp.Recording(t, position, force, 200.0, 0.004)
    assert pp.read_recording(right) is right
    strange = pp.Recording(units[0] * t, units[1] * position, force, 200.0, 0.004)
    with pytest.raises(RecordingError, match=f"{words}.*pp.recording"):
        pp.read_recording(strange)


@pytest.mark.parametrize("seed", range(1, 7))
def test_files_as_people_export_them_are_right_or_asked(tmp_path, seed):
    made = export(tmp_path, seed)
    try:
        if made.kind == "curves":
            found = pp.material(made.path, tip_radius_m=made.tip_radius_m, fast=True, progress=False)
            assert found.young_modulus_pa == pytest.approx(made.young_modulus_pa, rel=0.4)
        else:
            read = pp.read_table(made.path, tip_radius_m=made.tip_radius_m)
            assert np.allclose(read.force_on_tool, made.force_on_tool, atol=1e-4)
            assert np.allclose(read.position, made.position, atol=1e-6)
    except RecordingError as refused:
        assert "--" in str(refused)


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(seed, id=kind, marks=[pytest.mark.slow] if kind in ("parts", "log") else [])
        for seed, kind in enumerate(KINDS)
    ],
)
def test_what_nobody_had_tried_is_right_or_asked(tmp_path, seed):
    outcome = outcome_of(strange_export(tmp_path, seed))
    assert outcome in OUTCOMES[:3]


def _logged(times: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns of a log in m and N at 200 Hz, its times as given."""
    t = np.arange(2000) / 200
    depth = 0.006 * np.sin(np.pi * t) ** 2 - 0.001
    place = {"pose.x": 0.01 * np.floor(t), "pose.y": 0 * t, "pose.z": -depth}
    return {**times, **place, "force.x": 0 * t, "force.y": 0 * t, "force.z": 400 * np.maximum(depth, 0)}


def _written(path, columns):
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(f"{v:.9g}" if v % 1 else f"{v:.0f}" for v in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "times",
    [
        {"header.stamp": 1732794000 * 10**9 + 5 * 10**6 * np.arange(2000)},
        {"%time": 1732794000 * 10**3 + 5 * np.arange(2000)},
        {
            "stamp.secs": 1732794000 + np.arange(2000) // 200,
            "stamp.nsecs": 5 * 10**6 * (np.arange(2000) % 200),
        },
        {"sec": 1732794000 + np.arange(2000) // 200, "nanosec": 5 * 10**6 * (np.arange(2000) % 200)},
    ],
    ids=["nanoseconds", "milliseconds", "seconds and nanoseconds", "ROS 2"],
)
def test_stamps_since_1970_are_read_as_the_robot_writes_them(times, tmp_path):
    read = pp.import_table(_written(tmp_path / "log.csv", _logged(times)), tip_radius_m=0.004).recording
    assert read.t[-1] == pytest.approx(1999 / 200, abs=1e-5)
    assert read.sample_rate_hz == pytest.approx(200, rel=1e-6)


def test_whole_seconds_alone_are_no_time(tmp_path):
    log = _written(tmp_path / "log.csv", _logged({"sec": 1732794000 + np.arange(2000) // 200}))
    with pytest.raises(RecordingError, match="whole seconds.*--column t=NAME"):
        pp.import_table(log, tip_radius_m=0.004)


def test_one_time_for_all_rows_is_no_clock(tmp_path):
    log = _written(tmp_path / "log.csv", _logged({"t": np.full(2000, 0.5)}))
    with pytest.raises(RecordingError, match="one moment.*--column t=NAME"):
        pp.import_table(log, tip_radius_m=0.004)
