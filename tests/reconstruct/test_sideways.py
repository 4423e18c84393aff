"""A tip that slides down a slope tells the modulus by what goes along the normal."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.presses.making import PathErrors, of_paths
from palpate.reconstruction.steps.s7_modulus.modulus import fit_modulus
from palpate.reconstruction.steps.s7_modulus.sideways import SLIDES, along_the_normal, sideways_share

E, TIP, NOISE = 25e3, 0.006, 0.005
SLOPE = np.tan(np.radians(30))


def pressed(slope: float, *, slides: bool):
    """(presses, sites): six places of a deep, flat body, the tip going aside by `slope` of the depth."""
    points = np.array([[x, y, 0.0] for x in (0.0, 0.03, 0.06) for y in (0.0, 0.03)])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    sites = TouchSites(points, up, np.zeros(len(points)), np.zeros((len(points), 3, 3)), 0.005, 0.49)
    travel = np.concatenate([np.linspace(-0.3, 1, 400), np.linspace(1, -0.3, 400)]) * 0.004
    into = -travel[:, None] * np.array([0, 0, 1.0])
    path = into + travel[:, None] * np.array([slope, 0, 0])
    starts = np.arange(len(points) + 1) * len(travel)
    felt = np.tile(into if slides else path, (len(points), 1))
    force = forces_at(sites, felt, starts, young_modulus_pa=E, tip_radius_m=TIP, law="linear")
    force = force + NOISE * np.random.default_rng(0).standard_normal(force.shape)
    position = (points[:, None] + TIP * up[:, None] + path).reshape(-1, 3)
    presses = of_paths(
        starts, position, force, points + TIP * up, up, tip_radius_m=TIP, sample_rate_hz=1000.0,
        errors=PathErrors(1e-5, NOISE),
    )  # fmt: skip
    return dataclasses.replace(presses, site=np.arange(len(points))), sites


def test_a_tip_that_sticks_has_all_of_its_sideways_force():
    assert sideways_share(*pressed(SLOPE, slides=False), "linear") == pytest.approx(1, abs=0.05)


def test_a_tip_that_slides_has_none_and_tells_the_modulus_along_the_normal():
    presses, sites = pressed(SLOPE, slides=True)
    assert abs(sideways_share(presses, sites, "linear")) < 0.1 < SLIDES
    stuck = fit_modulus(presses, sites, NOISE).modulus_pa
    assert abs(np.log(stuck / E)) > 0.1, "as if it stuck the modulus is wrong"
    assert fit_modulus(along_the_normal(presses), sites, NOISE).modulus_pa == pytest.approx(E, rel=0.02)


def test_wrong_normals_are_no_slide():
    """An ellipsoid through the touches of a box: its force lay aside of the normals, in no direction that the
    tip went."""
    presses, sites = pressed(SLOPE, slides=False)
    around = np.linspace(0, 2 * np.pi, len(presses), endpoint=False)
    lean = np.tan(np.radians(25))
    leant = np.column_stack([lean * np.cos(around), lean * np.sin(around), np.ones(len(presses))])
    leant /= np.linalg.norm(leant, axis=1, keepdims=True)
    sites = dataclasses.replace(sites, normals=leant)
    share = sideways_share(dataclasses.replace(presses, normal=leant), sites, "linear")
    assert not share < SLIDES


def test_straight_presses_do_not_tell_whether_the_tip_slides():
    assert np.isnan(sideways_share(*pressed(0.0, slides=True), "linear"))
