"""What free air tells: a bias, and a tared tool's weight that shows where the tool turns."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.diagnosis.apply import corrected
from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.instrument.free_air import free_air_of
from palpate.diagnosis.instrument.instrument_effects import find_instrument_offsets
from palpate.diagnosis.options import DiagnoseOptions
from palpate.diagnosis.pipeline import diagnose
from palpate.reconstruction.steps.s3_contacts.contacts import explore

from ..reconstruct.exploration_of_cylinder import explore_cylinder


@pytest.fixture(scope="module")
def heavy(bench):
    """(recording, model) whose 60 g tool turns by some 20 degrees and was tared as it began."""
    recording, model = bench.record()
    t = recording.t
    turn = Rotation.from_euler("xy", np.column_stack([0.35 * np.sin(t / 3), 0.3 * np.sin(t / 5)]))
    weight = np.array([0.0, 0.0, -0.06 * 9.80665])
    force = recording.force_on_tool + weight - turn.apply(turn[0].inv().apply(weight)) + [0.0, 0.04, 0.0]
    quaternion = turn.as_quat(scalar_first=True)
    recording = dataclasses.replace(recording, quaternion=quaternion, force_on_tool=force)
    return recording, model.replaced(presses=bench.table(recording))


def test_a_weight_that_turns_is_told_from_a_bias(heavy):
    free = free_air_of(heavy[0], heavy[1].presses)
    assert np.linalg.norm(free.turning.tool_n) == pytest.approx(0.588, rel=0.05)
    np.testing.assert_allclose(free.turning.first @ free.turning.tool_n, [0, 0, 0.588], atol=0.03)


@pytest.mark.slow
def test_it_is_named_and_taken_off(heavy):
    recording, model = heavy
    result = diagnose(recording, model, DiagnoseOptions(fast=True, bootstrap=100))
    assert set(result.effects) == {"tool_gravity_inertia", "force_bias"}
    keys = {e.name: e.parameters for e in result.entries}
    assert keys["tool_gravity_inertia"]["mass_kg"] == pytest.approx(0.06, rel=0.05)
    np.testing.assert_allclose(keys["force_bias"]["bias_n"], [0, 0.04, 0], atol=0.005)
    clean = corrected(recording, result)
    free = free_air_of(clean, model.presses)
    assert np.abs(free.bias_n).max() < 0.01 and np.linalg.norm(free.turning.tool_n) < 0.03


@pytest.mark.parametrize(("bias_n", "named"), [(0.005, ()), (0.05, ("force_bias",))])
def test_what_is_sure_is_taken_off_and_what_matters_is_named(bench, bias_n, named):
    """Five millinewtons are told by half a minute of free air, and less than half of the noise."""
    _, model = bench.record()
    recording, _ = bench.record(lambda t, x, f: (x, f + [0.0, bias_n, 0.0]))
    free = free_air_of(recording, model.presses)
    assert np.linalg.norm(free.bias_n) > 5 * free.bias_se_n
    forward = build_forward(touches_of(bench.table(recording)), model)
    read = forward.touches.force
    offsets = find_instrument_offsets(forward, free, None, set())
    assert offsets.names == named
    off = (read - forward.touches.force).mean(axis=0)
    np.testing.assert_allclose(off, [0.0, bias_n, 0.0], atol=0.001)
    # what is not named counts as no gap
    assert np.allclose(offsets.residual, 0.0) == (not named)


@pytest.mark.parametrize(("mass_kg", "named"), [(0.5, ("tool_gravity_inertia",)), (-0.5, ())])
def test_no_tool_has_less_mass_than_none(bench, mass_kg, named):
    """A force that came 40 ms late once read as -7 g of tool, named beside it."""
    _, model = bench.record()

    def swung(t, x, f):
        return x, f - mass_kg * np.gradient(np.gradient(x, t, axis=0), t, axis=0)

    recording, _ = bench.record(swung)
    free = free_air_of(recording, model.presses)
    assert abs(free.mass_kg) > 5 * free.mass_se_kg and free.mass_kg * mass_kg > 0
    forward = build_forward(touches_of(bench.table(recording)), model)
    assert find_instrument_offsets(forward, free, None, {"force_bias"}).names == named


@pytest.mark.parametrize("stated", [True, False])
def test_the_tracing_of_the_base_is_no_bias(stated):
    """Phase I left unstated once read as 1.4 N in free air."""
    recording, _ = explore_cylinder(state_phase=stated)
    free = free_air_of(recording, explore(recording).presses)
    assert np.abs(free.bias_n).max() < 0.005
    assert np.abs(free.rate_n_per_s).max() * np.ptp(recording.t) < 0.01


def test_what_wanders_is_no_drift_and_what_drifts_is(bench):
    """A force in free air that goes to and fro ends elsewhere than it began, as a zero that drifts does."""
    recording, model = bench.record()
    t = recording.t
    free = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        knots = np.linspace(t[0], t[-1], 9)
        walk = np.column_stack([np.interp(t, knots, rng.normal(size=9)) for _ in range(3)])
        wandering = dataclasses.replace(recording, force_on_tool=recording.force_on_tool + 0.05 * walk)
        free.append(free_air_of(wandering, bench.table(wandering)))
    assert max(np.abs(f.rate_n_per_s).max() / f.rate_se_n_per_s for f in free) < 6
    drifting = dataclasses.replace(
        recording, force_on_tool=recording.force_on_tool + np.outer(t, [0.002, 0.0, 0.0])
    )
    seen = free_air_of(drifting, bench.table(drifting))
    assert seen.rate_n_per_s[0] == pytest.approx(0.002, rel=0.05)
    assert np.abs(seen.rate_n_per_s).max() > 6 * seen.rate_se_n_per_s
