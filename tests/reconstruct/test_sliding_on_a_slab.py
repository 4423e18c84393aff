"""A continuous log of palpation by sliding comes in where the object is stated to lie on something: each
press is kept for what it tells, whatever the friction."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.reconstruction.geometry.stated import GeometryOptions, nowhere
from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct_fully
from palpate.reconstruction.presses_on_model import presses_on
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.reconstruction.steps.s3_contacts.sliding_presses import slid_in, straightened
from palpate.reconstruction.steps.s7_modulus.modulus import fit_modulus

from .flat_contact import pushed, recorded
from .flat_ground import MODULUS_PA, NOISE_N, TIP_M

PRESSES = 40


def sliding(
    friction: float, *, leaves: bool = False, seed: int = 0, rate_hz: float = 0.8, speed: float = 0.004
) -> Recording:
    """Presses at rate_hz by a tip that slides at speed (m/s) to and fro over a top that wanders by 2 mm;
    leaves: each ends in free air."""
    t = np.arange(int(PRESSES / rate_hz * 200)) / 200
    gone = speed * t / 0.06
    x, y = 0.06 * np.abs(np.mod(2 * gone / 2, 2) - 1), 0.008 * np.floor(gone)
    top = 0.001 * np.sin(x / 0.01) * np.cos(y / 0.012)
    depth = (0.0 if leaves else 0.002) + 0.0016 * np.sin(2 * np.pi * rate_hz * t + 1)
    position = np.column_stack([x, y, TIP_M + top - depth])
    push = pushed(depth)
    made = recorded(position, push, 200.0, NOISE_N, seed)
    moved = np.gradient(position[:, :2], axis=0)
    way = moved / np.maximum(np.linalg.norm(moved, axis=1), 1e-9)[:, None]
    force = made.force_on_tool.copy()
    force[:, :2] -= friction * push[:, None] * way
    return dataclasses.replace(made, force_on_tool=force)


@pytest.mark.slow
def test_a_continuous_log_of_sliding_gives_the_modulus():
    """It was refused, or given a third of the modulus, as a model's tip sticks."""
    geometry = GeometryOptions(half_space=True)
    made = reconstruct_fully(sliding(0.3), ReconstructOptions(geometry=geometry))
    assert len(made.model.presses) >= 0.9 * PRESSES
    assert set(made.model.presses.kinds) == {"cycle"}
    low, high = made.model.material.young_modulus_ci95_pa
    assert low < MODULUS_PA < high < 1.2 * low
    assert not made.doubt and not any(f.grave for f in made.findings)


@pytest.mark.parametrize(
    ("friction", "leaves", "rate_hz", "speed"),
    [
        (0.0, False, 0.8, 0.004),
        (0.3, True, 0.8, 0.004),
        (0.4, True, 0.69, 0.0022),
        (0.2, True, 1.16, 0.0031),
        (0.4, False, 0.82, 0.0027),
        (0.4, False, 0.64, 0.0025),
    ],
)
def test_the_interval_holds_the_modulus_however_slowly_the_tip_slides(friction, leaves, rate_hz, speed):
    """Slow slides were taken for a tip that sticks: 5 kPa for 12."""
    recording = sliding(friction, leaves=leaves, rate_hz=rate_hz, speed=speed)
    found = explore(recording, boundary=nowhere(recording), unbroken=True).presses
    count = len(found)
    assert count >= 0.9 * PRESSES
    top = np.column_stack([found.point[:, :2], np.full(count, np.median(found.point[:, 2]))])
    presses = straightened(found.on_surface(top, np.tile([0.0, 0.0, 1.0], (count, 1))))
    none = np.zeros(count)
    sites = TouchSites(presses.point, presses.normal, none, np.zeros((count, 3, 3)), 0.005, 0.49)
    fit = fit_modulus(presses, sites, NOISE_N)
    low, high = fit.ci95_pa
    assert low < MODULUS_PA < high < 1.2 * low


def test_a_press_that_goes_straight_in_stays_as_it_is(presses_straight):
    assert not slid_in(presses_straight).any()
    assert straightened(presses_straight) is presses_straight


@pytest.fixture
def presses_straight():
    from .flat_ground import raster

    recording = raster((3, 2), tilt=False)
    return explore(recording, boundary=nowhere(recording), unbroken=True).presses


@pytest.mark.parametrize("kind", ["slab", "shape"])
def test_slides_over_another_recordings_slab_are_straightened_too(kind):
    """Of compare and diagnose with a model that was made from something else."""
    box = box_mesh((16, 30, 3), (0.16, 0.30, 0.03))
    mesh = TetMesh(box.points - [0.0, 0.0, 0.03], box.tetrahedra, box.fixed, box.touchable).quadratic()
    below = Support(np.array([0.0, 0.0, -0.03]), np.array([0.0, 0.0, 1.0]))
    model = Model(mesh, ObjectMaterial(MODULUS_PA, 0.49), below, Tool(TIP_M), 0.01)
    model = model.replaced(about={"geometry": {"kind": kind}})
    recording = dataclasses.replace(sliding(0.3, leaves=True), description={"object": {"half_space": True}})
    assert slid_in(presses_on(recording, model)).any() == (kind == "shape")
