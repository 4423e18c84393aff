"""What the instrument shows of itself is read once, and says which presses a diagnosis weighs."""

from __future__ import annotations

import dataclasses

import numpy as np

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import REACH_M
from palpate.diagnosis.instrument.instrument_effects import taken_off
from palpate.diagnosis.instrument.readings import readings_of

UP = np.array([0.0, 0.0, 1.0])


def test_a_surface_that_was_fitted_to_the_presses_leaves_out_those_that_it_passes_by(bench):
    recording, _ = bench.record()
    table = bench.table(recording)
    point = table.point.copy()
    point[3] -= 2 * REACH_M * table.normal[3]
    passed = dataclasses.replace(table, point=point)
    fitted = readings_of(recording, passed, UP, fitted=True)
    assert (~fitted.met).nonzero()[0].tolist() == [3] and len(fitted.touches) == len(table) - 1
    assert len(fitted.not_weighed) == 1 and fitted.not_weighed[0].endswith(": 1")
    other = readings_of(recording, passed, UP, fitted=False)  # there the object may have moved
    assert other.met.all() and len(other.touches) == len(table) and not other.not_weighed
    assert other.move is None


def test_what_free_air_shows_is_in_the_readings_and_taken_off(bench):
    """A bias of 0.1 N along x, of a sensor with a noise of 0.01 N."""
    recording, model = bench.record(lambda t, x, f: (x, f + [0.1, 0.0, 0.0]))
    table = bench.table(recording)
    readings = readings_of(recording, table, model.support.normal, fitted=True)
    assert readings.rigid is None and readings.move is None and not readings.one_by_one
    assert readings.free is not None and abs(readings.free.bias_n[0] - 0.1) < 0.005
    forward = build_forward(readings.touches, model)
    offsets = taken_off(readings, forward, ())
    assert "force_bias" in offsets.names
    off = (readings.touches.force - forward.touches.force).mean(axis=0)
    np.testing.assert_allclose(off, readings.free.bias_n, atol=1e-9)
    assert taken_off(readings, build_forward(readings.touches, model), ("force_bias",)).names == ()
