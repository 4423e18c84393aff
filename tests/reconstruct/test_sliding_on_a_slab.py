"""A continuous log of palpation by sliding comes in where the object is stated to lie on something: each
press is kept for what it tells, whatever the friction."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mechanics.recording import Recording
from reconstruct.geometry.stated import GeometryOptions
from reconstruct.pipeline import ReconstructOptions, reconstruct_fully
from reconstruct.steps.s3_contacts.straightened import slid_in, straightened

from .flat_contact import pushed, recorded
from .flat_ground import MODULUS_PA, NOISE_N, TIP_M

PRESSES = 40


def sliding(friction: float, *, leaves: bool = False, seed: int = 0) -> Recording:
    """Presses at 0.8 Hz by a tip that slides at 4 mm/s to and fro over a top that wanders by 2 mm; leaves:
    each ends in free air."""
    t = np.arange(int(PRESSES / 0.8 * 200)) / 200
    gone = 0.004 * t / 0.06
    x, y = 0.06 * np.abs(np.mod(2 * gone / 2, 2) - 1), 0.008 * np.floor(gone)
    top = 0.001 * np.sin(x / 0.01) * np.cos(y / 0.012)
    depth = (0.0 if leaves else 0.002) + 0.0016 * np.sin(2 * np.pi * 0.8 * t + 1)
    position = np.column_stack([x, y, TIP_M + top - depth])
    push = pushed(depth)
    made = recorded(position, push, 200.0, NOISE_N, seed)
    moved = np.gradient(position[:, :2], axis=0)
    way = moved / np.maximum(np.linalg.norm(moved, axis=1), 1e-9)[:, None]
    force = made.force_on_tool.copy()
    force[:, :2] -= friction * push[:, None] * way
    return dataclasses.replace(made, force_on_tool=force)


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "leaves"), [(0.0, False), (0.3, False), (0.3, True)])
def test_a_continuous_log_of_sliding_gives_the_modulus(friction, leaves):
    """It was refused, or given a third of the modulus, as a model's tip sticks."""
    geometry = GeometryOptions(half_space=True)
    made = reconstruct_fully(sliding(friction, leaves=leaves), ReconstructOptions(geometry=geometry))
    assert len(made.model.presses) >= 0.9 * PRESSES
    assert set(made.model.presses.kinds) == {"press" if leaves else "cycle"}
    assert made.young_modulus_pa == pytest.approx(MODULUS_PA, rel=0.05)
    low, high = made.model.material.young_modulus_ci95_pa
    assert low < MODULUS_PA < high
    assert not made.doubt and not any(f.grave for f in made.findings)


def test_a_press_that_goes_straight_in_stays_as_it_is(presses_straight):
    assert not slid_in(presses_straight).any()
    assert straightened(presses_straight) is presses_straight


@pytest.fixture
def presses_straight():
    from reconstruct.geometry.placed import nowhere
    from reconstruct.steps.s3_contacts.contacts import explore

    from .flat_ground import raster

    recording = raster((3, 2), tilt=False)
    return explore(recording, boundary=nowhere(recording), unbroken=True).presses
