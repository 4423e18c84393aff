"""The labelled recordings are diagnosed right with default options."""

from __future__ import annotations

import dataclasses

import pytest

from diagnose.pipeline import diagnose
from mechanics.recording.recording import read_recording

EXPECTED = {
    "silicone-1-cylinder": "finite_strain",
    "silicone-2-block": "finite_strain",
    "silicone-3-halfsphere": "finite_strain",
    "example-inclusion": "inclusion",
    "example-time-delay": "time_delay",
    "example-viscoelasticity": "viscoelasticity",
}


@pytest.mark.slow
@pytest.mark.parametrize("stated", [True, False], ids=["phase stated", "phase left out"])
@pytest.mark.parametrize("name", EXPECTED)
def test_labelled(shared_recordings, name, stated):
    from reconstruct.pipeline import ReconstructOptions, reconstruct

    recording = read_recording(shared_recordings / f"{name}.toml")
    if not stated:
        recording = dataclasses.replace(recording, boundary_phase=None)
    result = diagnose(recording, reconstruct(recording, ReconstructOptions()))
    assert list(result.effects) == [EXPECTED[name]], result.lines()
    assert result.gap_after_n < result.gap_before_n or EXPECTED[name] == "inclusion"
    if EXPECTED[name] == "inclusion":
        # a place above the ball that is left out is not told by the others: what they all say stands beside
        assert any(reason.startswith("fitted to all places it is") for reason in result.reasons)
