"""The instrument's zero is among the candidates: a bias and a late contact are said, each with the modulus
with and without; intervals of few curves hold what curves differ in."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest

import palpate.show  # noqa: F401  who says results
from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.material import material_of
from palpate.diagnosis.specimen.result import MachineTests, Material
from palpate.diagnosis.specimen.zero import late_contact
from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.contact.tip import Tip

RADIUS, MODULUS = 0.005, 3e4
TIP = Tip("sphere", RADIUS)
ANSWERS: dict[tuple, Material] = {}


@cache
def curve(seed: int, *, begins: float, zero: float = 0.0, modulus: float = MODULUS) -> MachineCycle:
    """In and out of a sphere; begins: travel of the first row over the deepest; zero: N that free air
    reads."""
    rng = np.random.default_rng(seed)
    deepest = RADIUS * rng.uniform(0.25, 0.35)
    way = deepest * np.linspace(begins, 1, 500)
    travel = np.concatenate([way, way[::-1]])
    force = np.asarray(dent_law("sphere").force(np.maximum(travel, 0), modulus, 0.49, RADIUS))
    read = force + zero + 0.003 * force.max() * rng.standard_normal(len(force))
    return MachineCycle(np.arange(len(travel)) / 100, travel + 0.01, read, f"curve {seed}")


def material(*curves: MachineCycle) -> Material:
    """The answer to some curves; tests that ask the same share it."""
    names = tuple((id(c), c.name) for c in curves)
    if names not in ANSWERS:
        tests = MachineTests("indentation", curves=curves, tip=TIP)
        ANSWERS[names] = material_of(tests, [c.name for c in curves], fast=True)
    return ANSWERS[names]


@pytest.mark.parametrize("count", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_a_late_contact_is_said_and_the_modulus_is_right(count):
    made = material(*[curve(k, begins=0.25) for k in range(count)])
    said = "\n".join(made.lines())
    assert "before the first row" in said and "the modulus would be" in said
    assert made.young_modulus_pa == pytest.approx(MODULUS, rel=0.06)
    low, high = made.young_modulus_ci95_pa
    assert low <= made.young_modulus_pa <= high


@pytest.mark.parametrize("begins", [-0.2, 0.0])
def test_a_wrong_zero_is_no_late_contact(begins):
    given = [curve(k, begins=begins, zero=0.2) for k in range(3)]
    assert late_contact(given, 0.49, TIP) == (given, None)


def test_a_bias_is_said_with_the_modulus_that_it_would_make():
    made = material(*[curve(k, begins=-0.2, zero=0.2) for k in range(3)])
    said = "\n".join(made.lines())
    assert "0.2 N in free air" in said
    assert made.young_modulus_pa == pytest.approx(MODULUS, rel=0.06)
    assert "free air" not in "\n".join(material(*[curve(k, begins=-0.2) for k in range(3)]).lines())


def test_an_interval_of_few_curves_holds_what_they_differ_in_beside_the_fits_own_error():
    alike = material(*[curve(k, begins=-0.2) for k in range(3)])
    apart = material(*[curve(k, begins=-0.2, modulus=MODULUS * (1 + 0.2 * k)) for k in range(3)])
    one = material(curve(0, begins=-0.2))

    def width(made) -> float:
        low, high = made.young_modulus_ci95_pa
        assert low <= made.young_modulus_pa <= high
        return float(np.log(high / low))

    assert 0 < width(one) < 0.3
    assert width(apart) > 3 * width(alike)
    assert width(apart) > 2 * 4.3 * 0.15 / np.sqrt(3)


def test_what_stands_at_its_bound_is_in_the_first_line_and_fails_only_where_it_carries_the_modulus():
    made = material(curve(0, begins=-0.2))
    bound = dataclasses.replace(made, at_bound=("friction slip: mu",))
    assert bound.predicts and "friction slip: mu stands at the end of its range" in bound.lines()[0]
    carried = dataclasses.replace(bound, bound_carries=True)
    assert not carried.predicts and "NO ANSWER" in carried.lines()[0]
    error = {made.law: 0.2, "kelvin-voigt": 0.1, "hunt-crossley": 0.15, "constant": 1.0}
    beaten = dataclasses.replace(made, error=error)
    assert beaten.predicts and "kelvin-voigt predicts held-out data better" in beaten.lines()[0]
    closed = dataclasses.replace(made, closed=1.02, closed_ci95=(0.9, 1.1))
    assert "100 % of the gap (95 % sure: 90 to 100 %)" in "\n".join(closed.lines())
