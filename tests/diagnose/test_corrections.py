"""A correction that is smaller than twice its own error is not made, whatever it corrects."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from palpate.diagnosis.apply import corrected, unsure
from palpate.mechanics.recording.recording import Recording


def verdict(**intervals):
    """A diagnosis that asserts these effects: name -> {key: (value, half width)}."""
    entries = [
        SimpleNamespace(
            name=name,
            parameters={key: np.asarray(value).tolist() for key, (value, _) in keys.items()},
            intervals={key: [np.asarray(v) - half, np.asarray(v) + half] for key, (v, half) in keys.items()},
        )
        for name, keys in intervals.items()
    ]
    return SimpleNamespace(effects=tuple(intervals), entries=entries)


def recording() -> Recording:
    t = np.arange(200) / 100
    force = np.column_stack([0 * t, 0 * t, np.sin(t)])
    return Recording(t=t, position=0 * force, force_on_tool=force, sample_rate_hz=100.0, tip_radius_m=0.005)


def test_a_bias_within_its_error_stays_and_one_beyond_it_is_taken_off():
    bias = [0.0, 0.0, 0.05]
    small, great = (verdict(force_bias={"bias_n": (bias, half)}) for half in (0.06, 0.01))
    assert unsure(small) == ("force_bias",) and unsure(great) == ()
    given = recording()
    assert np.array_equal(corrected(given, small).force_on_tool, given.force_on_tool)
    np.testing.assert_allclose(corrected(given, great).force_on_tool, given.force_on_tool - bias)


def test_a_gain_that_may_be_one_stays():
    near = np.eye(3) + 0.01
    assert unsure(verdict(force_gain={"matrix": (near, 0.02)})) == ("force_gain",)
    assert unsure(verdict(force_gain={"matrix": (near, 0.001)})) == ()


def test_a_delay_of_45_ms_that_is_known_to_239_stays():
    found = verdict(time_delay={"delay_s": (-0.045, 0.239)}, force_bias={"bias_n": ([0.1, 0.0, 0.0], 0.01)})
    assert unsure(found) == ("time_delay",)
