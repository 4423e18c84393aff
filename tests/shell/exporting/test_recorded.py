"""A recording in other programs' formats, opened by their own libraries; MCAP without ROS."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import palpate as pp
from palpate.exporting.recorded import Recorded
from palpate.exporting.registry import RECORDED, write_recorded
from palpate.mechanics.errors import OptionError

N = 400


@pytest.fixture(scope="module")
def pressed() -> pp.Recording:
    """A press of 5 mm into 300 N/m at z = 50 mm, the tip turned about z."""
    t = np.arange(N) / 200
    z = 0.055 + 0.003 - 0.008 * np.sin(np.pi * t / t[-1]) ** 2
    force = np.zeros((N, 3))
    force[:, 2] = 300 * np.maximum(0.055 - z, 0)
    turn = np.column_stack([np.cos(t / 4), 0 * t, 0 * t, np.sin(t / 4)])
    position = np.column_stack([0.01 * np.sin(t), 0 * t, z])
    made = pp.recording(t, position, force, tip_radius=0.005, force_on="tool")
    return dataclasses.replace(made, quaternion=turn)


def told(recording: pp.Recording) -> Recorded:
    """With a model's force that is a fifth too small, of which only touches count."""
    force = recording.force_on_tool
    return dataclasses.replace(Recorded(recording), rendered_n=0.8 * force, contact=force[:, 2] > 0)


def test_mcap_is_read_by_mcap_and_its_messages_by_their_own_definitions(pressed, tmp_path):
    reader = pytest.importorskip("mcap.reader")
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    path = tmp_path / "press.mcap"
    assert write_recorded(told(pressed), "mcap", path)
    store, found = get_typestore(Stores.EMPTY), {}
    with path.open("rb") as file:
        opened = reader.make_reader(file)
        assert opened.get_header().profile == "ros2"
        (about,) = [m.metadata for m in opened.iter_metadata() if m.name == "palpate"]
        for schema, channel, message in opened.iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            if schema.name not in store.fielddefs:
                store.register(get_types_from_msg(schema.data.decode(), schema.name))
            read = store.deserialize_cdr(message.data, schema.name)
            found.setdefault(channel.topic, []).append((message.log_time, read))
    assert set(found) == {"/tip/pose", "/tip/wrench"} and float(about["tip_radius_m"]) == 0.005
    stamps, poses = zip(*found["/tip/pose"], strict=True)
    assert np.allclose(stamps, 1e9 * pressed.t)
    assert all(p.header.stamp.sec * 10**9 + p.header.stamp.nanosec == s for s, p in found["/tip/pose"])
    assert {p.header.frame_id for p in poses} == {"device"}
    places = [(p.pose.position.x, p.pose.position.y, p.pose.position.z) for p in poses]
    turns = [[getattr(p.pose.orientation, k) for k in "wxyz"] for p in poses]
    forces = [[getattr(w.wrench.force, k) for k in "xyz"] for _, w in found["/tip/wrench"]]
    assert np.allclose(places, pressed.position) and np.allclose(turns, pressed.quaternion)
    assert np.allclose(forces, pressed.force_on_tool)


def test_what_is_written_as_mcap_is_read_back(pressed, tmp_path):
    pytest.importorskip("mcap")
    write_recorded(Recorded(pressed), "mcap", tmp_path / "press.mcap")
    again = pp.read_table(tmp_path / "press.mcap", tip_radius_m=0.005, force_on="tool")
    at = np.searchsorted(again.t - again.t[0], pressed.t - pressed.t[0] - 1e-6)
    assert np.abs(again.position[at] - pressed.position).max() < 1e-6
    assert np.abs(again.force_on_tool[at] - pressed.force_on_tool).max() < 1e-4


def test_depth_is_the_travel_against_the_normal(reconstructed_cylinder):
    recording, model = reconstructed_cylinder
    depth, presses = Recorded(recording, model).depth_m, model.presses
    peaks = depth[np.searchsorted(recording.t, presses.peak_s)]
    assert np.abs(peaks - presses.depth_m).max() < 2e-4
    assert depth[recording.t < presses.onset_s[0]].max() == 0
    other = dataclasses.replace(recording, force_on_tool=2 * recording.force_on_tool)
    assert Recorded(other, model).depth_m is None


@pytest.fixture(scope="module")
def reconstructed_cylinder():
    return pp.read_recording("silicone-1-cylinder"), pp.load("demo")


def test_rerun_opens_what_is_written(pressed, tmp_path):
    chunk = pytest.importorskip("rerun.chunk")
    path = tmp_path / "press.rrd"
    write_recorded(told(pressed), "rerun", path)
    curves: dict[str, list] = {}
    for each in chunk.RrdReader(path).stream():
        table = each.to_record_batch()
        for name in table.schema.names:
            if name.startswith(("Scalars:", "Points3D:positions", "Arrows3D:vectors")):
                t = table.column("t").cast("int64").to_pylist()
                values = table.column(name).to_pylist()
                curves.setdefault(str(each.entity_path), []).extend(zip(t, values, strict=True))
    times = [1e-9 * t for t, _ in sorted(curves["/force/measured"])]
    assert np.allclose(times, pressed.t, atol=1e-9)
    read = {entity: np.array([v for _, v in sorted(rows)]) for entity, rows in curves.items()}
    force = pressed.force_on_tool
    assert np.allclose(read["/force/measured"], force) and np.allclose(read["/force/rendered"], 0.8 * force)
    touching = force[:, 2] > 0
    assert np.allclose(read["/residual"][touching], 0.2 * force[touching])
    assert np.isnan(read["/residual"][~touching]).all()
    assert np.allclose(read["/tip"].reshape(-1, 3), pressed.position[::2], atol=1e-6)
    assert np.allclose(read["/tip/measured"].reshape(-1, 3), 0.01 * force[::2], atol=1e-6)


@pytest.mark.parametrize("to", RECORDED)
def test_another_suffix_is_refused(pressed, to, tmp_path):
    with pytest.raises(OptionError):
        pp.export(pressed, to, tmp_path / "x.csv")


def test_a_model_is_no_recording_and_a_recording_needs_no_second_model(tmp_path):
    with pytest.raises(pp.PalpateError):
        pp.export(pp.load("demo"), "mcap", tmp_path / "x.mcap")
    with pytest.raises(OptionError):
        pp.export("demo", "stl", tmp_path / "x.stl", against="demo")
