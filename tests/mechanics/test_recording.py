"""Recordings: what is written reads back, and each kind of bad input gives one clear error."""

from __future__ import annotations

import gzip
import pickle
import tomllib
from pathlib import Path

import numpy as np
import pytest

from palpate.mechanics.disk.toml_text import dump_toml
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.recording.recording import Recording, read_recording, write_recording
from palpate.mechanics.recording.segments import TimeSegment

TOML = """[recording]
sample_rate_hz = 1000.0
force_on = "{force_on}"
[tool]
tip_radius_m = 0.005
"""
HEADER = "t,x,y,z,fx,fy,fz"
ROWS = ["0.000,0.01,0.02,0.03,0.1,0.2,0.3", "0.001,0.01,0.02,0.03,0.1,0.2,0.4"]


def written(folder, header=HEADER, rows=ROWS, force_on="tool", toml=None):
    (folder / "rec.csv").write_text("\n".join([header, *rows]) + "\n")
    (folder / "rec.toml").write_text(TOML.format(force_on=force_on) if toml is None else toml)
    return folder / "rec.csv"


def test_round_trip_keeps_samples_and_description(tmp_path):
    t = np.arange(50) / 1000
    wave = np.column_stack([np.sin(t), np.cos(t), t])
    quaternion = np.tile([1.0, 0, 0, 0], (50, 1))
    first = Recording(
        t, wave, -wave, 1000.0, 0.004, quaternion=quaternion, boundary_phase=(0.0, 0.02),
        force_noise_std_n=0.01, poisson_ratio=0.49, object_name="x", truth={"effects": ["adhesion"]},
    )  # fmt: skip
    again = read_recording(write_recording(tmp_path / "a.csv.gz", first))
    assert np.abs(again.position - first.position).max() < 1e-9
    assert np.abs(again.force_on_tool - first.force_on_tool).max() < 1e-6
    assert again.quaternion is not None and again.boundary_phase == (0.0, 0.02)
    assert again.truth["effects"] == ["adhesion"] and again.tip_radius_m == 0.004
    assert not again.position.flags.writeable


def test_a_recording_with_segments_is_written_over_itself(tmp_path):
    t = np.arange(50) / 1000
    wave = np.column_stack([np.sin(t), np.cos(t), t])
    parts = (TimeSegment("trace", 0.0, 0.02), TimeSegment("rigid", 0.02, 0.04))
    recording = Recording(t, wave, -wave, 1000.0, 0.004, segments=parts)
    for _ in range(2):
        write_recording(tmp_path / "rec.csv", recording)
    assert read_recording(tmp_path / "rec.toml").segments == recording.segments
    assert "[[segment]]" in (tmp_path / "rec.toml").read_text()


def test_any_of_the_files_names_the_recording_and_a_byte_order_mark_is_read(tmp_path):
    path = written(tmp_path, header="\ufeff" + HEADER)
    assert read_recording(path).sha256 == read_recording(tmp_path / "rec.toml").sha256


def test_force_on_the_object_is_turned_into_force_on_the_tool(tmp_path):
    tool = read_recording(written(tmp_path)).force_on_tool
    turned = read_recording(written(tmp_path, force_on="object")).force_on_tool
    assert np.array_equal(tool, -turned)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"header": "t,x,y,fx,fy,fz,extra"}, "lacks the columns z"),
        ({"rows": [ROWS[0], "0.001,nan,0.02,0.03,0,0,0"]}, "data row 2"),
        ({"rows": [ROWS[1], ROWS[0]]}, "time goes from"),
        ({"rows": [ROWS[0], ROWS[0]]}, "increase strictly"),
        ({"rows": [ROWS[0], "0.001,abc,0,0,0,0,0"]}, "decimal numbers"),
        ({"rows": [ROWS[0]]}, "at least 2 samples"),
        ({"rows": [ROWS[0], "0.001,11,0,0,0,0,0"]}, "metres"),
        ({"force_on": "table"}, "force_on"),
        ({"toml": "[recording]\nforce_on = 'tool'\n"}, "tip_radius_m"),
        ({"toml": "[recording\n"}, "TOML"),
    ],
)
def test_bad_input_is_named(tmp_path, change, words):
    with pytest.raises(RecordingError, match=words):
        read_recording(written(tmp_path, **change))


def test_missing_and_truncated_files_are_named(tmp_path):
    with pytest.raises(RecordingError, match="does not exist"):
        read_recording(tmp_path / "none.csv")
    written(tmp_path)
    whole = gzip.compress("\n".join([HEADER, *ROWS * 500]).encode())
    (tmp_path / "rec.csv.gz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RecordingError, match="truncated"):
        read_recording(tmp_path / "rec.csv.gz")


def test_unit_quaternions_are_demanded(tmp_path):
    rows = [row + ",2,0,0,0" for row in ROWS]
    with pytest.raises(RecordingError, match="unit quaternions"):
        read_recording(written(tmp_path, header=HEADER + ",qw,qx,qy,qz", rows=rows))


def test_a_pickled_recording_comes_back_whole_and_read_only():
    t = np.arange(50) / 1000
    wave = np.column_stack([np.sin(t), np.cos(t), t])
    first = Recording(
        t, wave, -wave, 1000.0, 0.004, boundary_phase=(0.0, 0.02), truth={"sizes": {"adhesion": 1.0}}
    )
    again = pickle.loads(pickle.dumps(first))
    assert np.array_equal(again.position, first.position) and not again.position.flags.writeable
    assert again.truth == first.truth and again.boundary_phase == first.boundary_phase
    with pytest.raises(TypeError):
        again.truth["sizes"] = {}


def test_toml_text_comes_back_as_it_was() -> None:
    table = {
        "plain": {"a": 1, "b": 0.1, "c": True, "d": 'quoted "\\" tab\t line\n and [', "e": 1e-9, "f": np.inf},
        "numpy": {
            "v": np.array([0.0, 1e-3, -2.5]),
            "n": np.int64(3),
            "y": np.bool_(False),
        },
        "nested": {
            "m": np.eye(2),
            "words": ["a, b", "[", "]"],
            "none": None,
            "empty": [],
            "p": Path("x/y"),
        },
        "deep": {"er": {"key with space": (1, 2)}, "tables": [{"at": [1.0, 2.0]}, {"at": [3.0, 4.0]}]},
    }
    text = dump_toml(table)
    read = tomllib.loads(text)
    assert read["plain"] == table["plain"]
    assert read["numpy"] == {"v": [0.0, 1e-3, -2.5], "n": 3, "y": False}
    assert read["nested"] == {
        "m": [[1, 0], [0, 1]], "words": ["a, b", "[", "]"], "empty": [], "p": "x/y"
    }  # fmt: skip
    assert read["deep"] == {"er": {"key with space": [1, 2]}, "tables": [{"at": [1, 2]}, {"at": [3, 4]}]}
    assert "m = [\n    [1.0, 0.0],\n    [0.0, 1.0],\n]\n" in text
    assert "v = [0.0, 0.001, -2.5]\n" in text  # a vector is one line to those who read it or cut it out


@pytest.mark.parametrize("form", ["punch", "cone", "pyramid"])
def test_a_tip_of_another_form_is_refused_with_the_command_that_reads_it(tmp_path, form):
    toml = TOML.format(force_on="tool")
    with pytest.raises(RecordingError, match=f"palpate material .*rec.csv --tip {form} --tip-"):
        read_recording(written(tmp_path, toml=f'{toml}tip = "{form}"\n'))
    assert read_recording(written(tmp_path, toml=f'{toml}tip = "sphere"\n')).tip_radius_m == 0.005
    with pytest.raises(RecordingError, match="sphere, punch, cone, pyramid"):
        read_recording(written(tmp_path, toml=f'{toml}tip = "ball"\n'))
