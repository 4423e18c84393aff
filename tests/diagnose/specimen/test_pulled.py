"""The interval of a modulus under a tip that the sample pulls at holds the truth."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.material import material_of
from palpate.diagnosis.specimen.result import MachineTests
from palpate.mechanics.contact.tip import Tip

RADIUS, NU = 1e-3, 0.49


def jkr_cycle(modulus: float, work: float, seed: int) -> MachineCycle:
    """In, jumping into contact at the surface, and out to the greatest pull; N/m^2 and J/m^2."""
    plane = modulus / (1 - NU**2)
    a = np.linspace(1e-6, 0.8e-3, 20_000)
    depth = a**2 / RADIUS - np.sqrt(2 * np.pi * work * a / plane)
    force = 4 / 3 * plane * a**3 / RADIUS - np.sqrt(8 * np.pi * work * plane * a**3)
    stable = slice(int(np.argmin(force)), None)
    depth, force = depth[stable], force[stable]
    way = np.linspace(-0.3e-3, 0.3e-3, 120)
    go = np.where(way > 0, np.interp(way, depth, force), 0.0)
    back = np.interp(way[::-1], depth, force, left=0.0)
    push = np.concatenate([go, back])
    noise = 2e-3 * push.max() * np.random.default_rng(seed).standard_normal(len(push))
    travel = np.concatenate([way, way[::-1]])
    return MachineCycle(0.05 * np.arange(len(push)), travel, push + noise, "a curve")


@pytest.mark.parametrize(("modulus", "work"), [(10e3, 0.05), (10e3, 0.01), (50e3, 0.1), (5e3, 0.03)])
def test_the_interval_under_a_pull_holds_the_modulus(modulus, work):
    given = MachineTests("indentation", curves=(jkr_cycle(modulus, work, 1),), tip=Tip("sphere", RADIUS))
    made = material_of(given, ["a"], fast=True, poisson_ratio=NU)
    low, high = made.young_modulus_ci95_pa
    assert low <= modulus <= high, (modulus, low, high)
    assert made.law == "jkr" and high < 1.06 * low
    assert "JKR" in " ".join(made.notes) and "slopes" not in " ".join(made.notes)
