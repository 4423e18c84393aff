"""An exploration is whole at any time: its recording says what each segment was; one can go on with it."""

import dataclasses

import numpy as np
import pytest

from palpate.diagnosis.explore.explorer import Explorer
from palpate.diagnosis.explore.segments import Instrument, Segment, join, split
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.recording.recording import read_recording, write_recording
from palpate.mechanics.recording.segments import TimeSegment as Stretch
from palpate.reconstruction.checks.registry import check

from ...reconstruct.exploration_of_cylinder import HEIGHT, RADIUS, Frame, explore_cylinder


def _rows(kind, n=400, at=0.0):
    t = np.arange(n) / 1000
    position = np.column_stack([np.full(n, at), np.zeros(n), 0.05 + 0.01 * np.cos(20 * t)])
    return Segment(kind, t, position, np.zeros((n, 3)) + [0, 0, at])


@pytest.fixture
def explored():
    about = {"force_noise_std_n": 0.01, "poisson_ratio": 0.45, "object_name": "thing"}
    segments = [
        _rows("trace", 700),
        _rows("press", 400, 0.1),
        _rows("rigid", 300, 0.2),
        _rows("press", 500, 0.3),
    ]
    return join(Instrument(0.004, 1000.0, about), segments), segments


def test_what_was_joined_comes_apart_again_also_from_its_file(explored, tmp_path):
    recording, segments = explored
    again = read_recording(write_recording(tmp_path / "so-far.csv.gz", recording))
    assert [s.kind for s in again.segments] == ["trace", "press", "rigid", "press"]
    for source in (recording, again):
        instrument, parts = split(source)
        assert instrument.tip_radius_m == 0.004 and instrument.about["poisson_ratio"] == 0.45
        assert [s.kind for s in parts] == [s.kind for s in segments]
        for made, given in zip(parts, segments, strict=True):
            np.testing.assert_allclose(made.position, given.position, atol=1e-9)
    # and joined once more, it is the same recording
    np.testing.assert_allclose(join(instrument, parts).t, recording.t, atol=1e-3)


def test_a_recording_says_what_is_wrong_with_its_segments(explored):
    recording, _ = explored
    with pytest.raises(RecordingError, match="must be one of"):
        dataclasses.replace(recording, segments=(Stretch("poke", 0.0, 1.0),))
    with pytest.raises(RecordingError, match="start must come before"):
        dataclasses.replace(recording, segments=(Stretch("press", 2.0, 1.0),))
    with pytest.raises(RecordingError, match="order of time"):
        split(dataclasses.replace(recording, segments=recording.segments[::-1]))


def test_a_foot_traced_in_two_sessions_is_one_tracing_and_its_file_says_how_to_go_on(tmp_path):
    """A session that was closed meanwhile was lost; its file was called drifting."""
    recording, _ = explore_cylinder()
    start, end = recording.boundary_phase
    first, last = np.searchsorted(recording.t, [max(start - 0.3, 0.0), end + 0.3])
    middle = int(first + 0.6 * (last - first))

    def piece(a, b):
        return Segment("trace", recording.t[a:b], recording.position[a:b], recording.force_on_tool[a:b])

    explorer = Explorer(Instrument(recording.tip_radius_m, recording.sample_rate_hz))
    explorer.add(piece(first, middle))
    assert explorer.suggest().kind == "trace"
    path = explorer.save(tmp_path / "part.csv.gz")
    (finding,) = check(read_recording(path))
    assert finding.grave and f"palpate explore --device mouse --continue {path}" in finding.todo
    explorer = Explorer.going_on(read_recording(path))
    explorer.add(piece(middle - 100, last))
    assert explorer.suggest().kind == "press"


@pytest.mark.slow
def test_an_untraced_object_of_a_stated_shape_is_explored_on(tmp_path, monkeypatch):
    """It ended in "no boundary phase found", whatever [object] said, and what it wrote forgot the shape."""
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    body = trimesh.creation.cylinder(1e3 * RADIUS, 1e3 * HEIGHT, sections=90)
    body.apply_translation((0, 0, 500 * HEIGHT)).export("part.stl")
    upright = Frame(np.eye(3), np.array([0.08, -0.05, 0.03]))  # it has no other sign of which end is up
    felt, onsets = explore_cylinder(frame=upright, without_phase=True, state_phase=False)
    felt = dataclasses.replace(felt, description={"object": {"shape": "part.stl", "shape_unit": "mm"}})
    explorer = Explorer.going_on(read_recording(felt.save("felt.csv.gz")))
    assert explorer.state.trouble == "" and explorer.state.presses == len(onsets)
    assert explorer.state.surface == "known shape"
    assert explorer.state.modulus_pa == pytest.approx(16e3, rel=0.1), "of the law that it was pressed by"
    assert explorer.suggest().kind in ("press", "stop"), "no tracing is asked for of what is known"
    (tmp_path / "more").mkdir()
    again = Explorer.going_on(read_recording(explorer.save("more/more.csv.gz")))
    assert again.state.surface == "known shape" and again.state.presses == len(onsets)


def test_a_recording_that_names_what_lies_beside_its_presses_is_no_exploration_without_one(tmp_path):
    """Two tracings and presses, only the tracings named: 'it ended before anything was pressed' was said."""
    recording, _ = explore_cylinder()
    beside = (Stretch("trace", *recording.boundary_phase),)
    path = write_recording(tmp_path / "two.csv", dataclasses.replace(recording, segments=beside))
    assert all(finding.name != "no presses" for finding in check(read_recording(path)))
