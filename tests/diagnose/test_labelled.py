"""The labelled recordings are diagnosed right with default options."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.diagnosis.pipeline import diagnose
from palpate.mechanics.recording.recording import read_recording

EXPECTED = {
    "silicone-1-cylinder": "finite_strain",
    "silicone-2-block": "finite_strain",
    "silicone-3-halfsphere": "finite_strain",
    "example-inclusion": "inclusion",
    "example-time-delay": "time_delay",
    "example-viscoelasticity": "viscoelasticity",
}
ALIKE = ("silicone-2-block", "silicone-3-halfsphere")
"""Other shapes of what the cylinder shows."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.release if name in ALIKE else pytest.mark.slow)
        for name in EXPECTED
    ],
)
def test_labelled(shared_recordings, reconstructed, name):
    """With the tracing to be found; where it is stated, the object is the same."""
    from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct

    stated = read_recording(shared_recordings / f"{name}.toml")
    left_out = dataclasses.replace(stated, boundary_phase=None)
    model = reconstruct(left_out, ReconstructOptions())
    result = diagnose(left_out, model)
    assert list(result.effects) == [EXPECTED[name]], result.lines()
    assert result.gap_after_n < result.gap_before_n or EXPECTED[name] == "inclusion"
    if EXPECTED[name] == "inclusion":
        # a place above the ball that is left out is not told by the others: what they all say stands beside
        assert any(reason.startswith("fitted to all places it is") for reason in result.reasons)
    other = reconstructed(name)
    np.testing.assert_allclose(other.presses.onset_s, model.presses.onset_s, atol=0.005)
    np.testing.assert_allclose(other.presses.point, model.presses.point, atol=1e-4)
    low, high = model.material.young_modulus_ci95_pa
    assert abs(other.material.young_modulus_pa - model.material.young_modulus_pa) < 0.1 * (high - low)
