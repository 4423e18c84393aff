"""One table whatever a recording leaves out: phase, orientation, rate of sampling, sign of the force,
frame."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.steps.s3_contacts.contacts import explore

from .exploration_of_cylinder import TILTED, TIP, Frame, explore_cylinder

STEEP = Frame(
    Rotation.from_euler("xyz", [30, 0, -110], degrees=True).as_matrix(), np.array([-0.2, 0.31, 0.5])
)


def at_rate(recording: Recording, rate: float) -> Recording:
    """The same exploration sampled at another rate, its noise drawn anew where samples are added."""
    t = np.arange(recording.t[0], recording.t[-1], 1 / rate)

    def sampled(values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(t, recording.t, c) for c in values.T], axis=1)

    force = sampled(recording.force_on_tool)
    if rate > recording.sample_rate_hz:
        force = force + 0.006 * np.random.default_rng(1).standard_normal(force.shape)
    return dataclasses.replace(
        recording, t=t, position=sampled(recording.position), force_on_tool=force, sample_rate_hz=rate
    )


VARIANTS = {
    "phase not stated": lambda r: dataclasses.replace(r, boundary_phase=None),
    "500 Hz": lambda r: at_rate(r, 500.0),
    "2000 Hz, phase not stated": lambda r: at_rate(dataclasses.replace(r, boundary_phase=None), 2000.0),
    "orientation constant": lambda r: dataclasses.replace(
        r, quaternion=np.tile([1.0, 0, 0, 0], (len(r.t), 1))
    ),
}


@pytest.fixture(scope="module")
def stated():
    recording, onsets = explore_cylinder()
    return recording, explore(recording).presses, onsets


@pytest.mark.parametrize("name", VARIANTS)
def test_what_is_left_out_changes_nothing(stated, name):
    recording, whole, onsets = stated
    other = VARIANTS[name](recording)
    presses = explore(other).presses
    assert len(presses) == len(whole) == len(onsets)
    assert np.array_equal(presses.site, whole.site)
    assert np.abs(presses.onset_s - onsets).max() < 0.02
    assert np.abs(presses.end_s - whole.end_s).max() < 0.03
    assert np.linalg.norm(presses.centre - whole.centre, axis=1).max() < 2e-4
    assert presses.depth_m == pytest.approx(whole.depth_m, abs=2e-4)
    assert presses.noise.raw_n == pytest.approx(whole.noise.raw_n, rel=0.35)
    free = [table.within("free", recording.t) for table in (presses, whole)]
    assert np.mean(free[0] != free[1]) < 0.06


def test_a_frame_that_leans_by_30_degrees_changes_nothing(stated):
    _, whole, _ = stated
    presses = explore(dataclasses.replace(explore_cylinder(frame=STEEP)[0], boundary_phase=None)).presses
    here, there = STEEP.object(presses.centre), TILTED.object(whole.centre)
    assert np.linalg.norm(here - there, axis=1).max() < 4e-4
    assert np.array_equal(presses.site, whole.site)
    assert presses.tip_radius_m == TIP


def test_tracing_is_never_free_air_even_where_nobody_states_it():
    recording, _ = explore_cylinder(state_phase=False)
    presses = explore(recording).presses
    free = presses.within("free", recording.t)
    pushing = np.linalg.norm(recording.force_on_tool, axis=1) > 0.2
    assert free.sum() > 2000 and not (free & pushing).any()
    assert [s.kind for s in presses.segments].count("trace") == 1
