"""Dent laws: limits, source tables, and a fresh small finite-strain solution."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.contact.dent import (
    dent_force,
    dent_law,
    dent_laws,
    effective_radius,
    ellipse_curvature,
    grid,
)
from palpate.mechanics.errors import OptionError

from .closed_forms import (
    bonded_punch_sideways_force,
    elliptic_force,
    flat_punch_force,
    hertz_force,
    plane_strain_modulus,
    sphere_force,
)

E, NU, R = 29e3, 0.49, 5e-3


@pytest.mark.parametrize("name", dent_laws())
def test_every_law_is_hertz_when_shallow(name):
    depth = np.array([1e-6])
    assert dent_law(name).force(depth, E, NU, R) == pytest.approx(hertz_force(depth, R, E, NU), rel=5e-3)


def test_sphere_table_is_sneddon():
    a = np.linspace(0.3e-3, 4.8e-3, 12)
    force, depth = sphere_force(a, R, E, NU)
    law = dent_law("sphere")
    assert law.force(depth, E, NU, R) == pytest.approx(force, rel=2e-4)
    x = depth / R
    assert R * np.sqrt(x) * np.interp(x, grid(), law.table[:, 1]) == pytest.approx(a, rel=2e-4)


@pytest.mark.parametrize("bend", [-0.2, 0.0, 0.3])
@pytest.mark.parametrize("name", dent_laws())
def test_stiffness_is_the_slope_of_the_force(name, bend):
    table = dent_law(name).table
    for depth in (0.13e-3, 1.02e-3, 6.31e-3, 16e-3):  # between rows: at one the slope turns
        step = 1e-9
        up, down = (dent_force(table, depth + s, R, bend, E)[0] for s in (step, -step))
        assert dent_force(table, depth, R, bend, E)[1] == pytest.approx((up - down) / (2 * step), rel=1e-4)


def test_nothing_without_a_dent():
    assert dent_force(dent_law("sphere").table, -1e-3, R, 0.0, E) == (0.0,) * 5
    assert dent_force(dent_law("sphere").table, 0.0, R, 0.0, E) == (0.0,) * 5


def test_a_bump_answers_a_deep_dent_harder_than_its_effective_radius_says_and_a_hollow_softer():
    table = dent_law("neo-hookean").table
    flat, bump, hollow = (dent_force(table, 6e-3, R, bend, E)[0] for bend in (0.0, 0.1, -0.1))
    # 1.7 % at 1.2 radii on a bump of a tenth of the tip's curvature (axisymmetric finite strain)
    assert 1.01 < bump / flat < 1.03 and 0.97 < hollow / flat < 0.99
    assert dent_force(table, 1e-5, R, 0.1, E)[0] == pytest.approx(
        dent_force(table, 1e-5, R, 0.0, E)[0], rel=1e-3
    )
    assert dent_force(dent_law("hertz").table, 6e-3, R, 0.1, E) == dent_force(
        dent_law("hertz").table, 6e-3, R, 0, E
    )


def test_finite_strain_is_softer_down_and_stiffer_sideways():
    linear, finite = dent_law("linear"), dent_law("neo-hookean")
    depth = np.array([5e-3])
    assert 0.94 < (finite.force(depth, E, NU, R) / linear.force(depth, E, NU, R))[0] < 0.98
    sideways = [np.prod(dent_force(law.table, 5e-3, R, 0.0, E)[2:4]) for law in (linear, finite)]
    assert 1.15 < sideways[1] / sideways[0] < 1.3


@pytest.mark.parametrize("name", ["linear", "neo-hookean"])
def test_a_compressible_solid_is_gripped_the_harder_the_deeper(name):
    """What sticks cannot slide aside: beyond E / (1 - nu^2) the dent is stiffer, more so at a lower ratio."""
    usual, lower, low = (dent_law(name, nu).table[:, 0] for nu in (0.49, 0.445, 0.40))
    at = np.searchsorted(grid(), [0.2, 0.6, 1.2, 1.8])
    over = (low / usual)[at] - 1
    assert np.all(np.diff(over) > 0)
    assert 0.04 < over[-1] < 0.09
    assert np.all((lower > usual)[at] & (lower < low)[at])


def test_unknown_law_lists_what_is_allowed():
    with pytest.raises(OptionError, match="hertz, sphere, linear, neo-hookean"):
        dent_law("rubber")


def test_curvature_shrinks_or_widens_the_sphere():
    assert effective_radius(5e-3, 0.0) == pytest.approx(5e-3)
    assert effective_radius(5e-3, 200.0) == pytest.approx(2.5e-3)
    assert effective_radius(5e-3, -1e4) == pytest.approx(20e-3)


@pytest.mark.slow
def test_axisymmetric_solution_meets_punches_and_the_tables():
    """The tables' own solver, coarse: flat punches in closed form, then one short press of each law."""
    pytest.importorskip("pypardiso")
    from tools.dent_half_space import HalfSpace
    from tools.dent_table import press_curve

    body = HalfSpace(0.08, NU, "linear", 0.4)
    stuck = body.top[:21]
    inside, outside = body.points[body.top[20], 0], body.points[body.top[21], 0]
    radius = 0.5 * (inside + outside)  # the edge of a held disc lies between its last ring and the next
    sideways = body.tangential_stiffness(np.zeros_like(body.points), stuck)
    assert sideways == pytest.approx(bonded_punch_sideways_force(1.0, radius, 1.0, NU), rel=0.02)
    assert flat_punch_force(1.0, radius, 1.0, NU) == pytest.approx(2 * radius / (1 - NU**2))
    for law, nu in (("linear", NU), ("neo-hookean", NU), ("linear", 0.35)):
        rows = press_curve(law, nu, 0.15, 0.3)
        x, force = rows[5, :2]
        known = dent_force(dent_law(law, nu).table, x, 1.0, 0.0, 1.0)[0]
        assert force == pytest.approx(known, rel=0.02)
        assert plane_strain_modulus(1.0, NU) > 1


@pytest.mark.slow
def test_the_table_is_a_half_spaces_and_not_a_clamped_bodys():
    """Solved on a body of 400 tip radii, it stood 0.28 % higher two thirds of a radius deep."""
    pytest.importorskip("pypardiso")
    from tools.dent_half_space import Grading
    from tools.dent_table import press_curve

    x, force = press_curve("neo-hookean", NU, 0.2, 0.6, grading=Grading(10_000.0, 1.4, 1.3))[7, :2]
    known = dent_force(dent_law("neo-hookean").table, x, 1.0, 0.0, 1.0)[0]
    assert force == pytest.approx(known, rel=2.5e-3)


@pytest.mark.parametrize("friction", [0.0, 0.02, 0.1, 0.3])
@pytest.mark.parametrize("nu", [0.1, 0.3, 0.4, 0.49])
@pytest.mark.parametrize("law", ["linear", "neo-hookean"])
def test_the_force_of_a_tip_that_slips_grows_smoothly(law, nu, friction):
    """A jump of 4 % stood at a quarter of the radius where nu was 0.1 and friction 0.02."""
    c = dent_law(law, nu, friction).table[1:, 0]
    assert (np.diff(c * grid()[1:] ** 1.5) > 0).all()
    assert np.abs(np.diff(c) / c[1:]).max() < 0.01


def test_a_tip_that_slips_is_pushed_back_less_the_deeper_it_goes():
    deep = R * np.array([0.25, 1.0, 2.0])
    for name in ("linear", "neo-hookean"):
        held, *slips = (dent_law(name, NU, mu).force(deep, E, NU, R) for mu in (np.inf, 0.7, 0.3, 0.1, 0.0))
        shares = np.array(slips) / held
        assert (np.diff(shares, axis=0) <= 0).all() and (np.diff(shares, axis=1) <= 0).all()
        assert shares[0] == pytest.approx(1.0)
    assert shares[2, 2] == pytest.approx(0.90, abs=0.02)


def test_without_friction_and_strain_the_dent_is_sneddons():
    depth = R * np.array([0.2, 0.6, 1.4])
    for nu in (0.40, NU):
        free = dent_law("linear", nu, 0.0).force(depth, E, nu, R)
        assert free == pytest.approx(dent_law("sphere").force(depth, E, nu, R), rel=2e-3)


@pytest.mark.parametrize("ratio", [1.001, 1.5, 3.0, 8.0])
def test_an_elliptic_contact_is_hertzs(ratio):
    low = 1 / R - 40.0
    principal = np.array([[ratio * low - 1 / R, low - 1 / R]])
    round_one = effective_radius(R, ellipse_curvature(principal, R))
    depth = np.array([1e-5])
    exact = elliptic_force(depth, ratio * low, low, E, NU)
    assert hertz_force(depth, round_one, E, NU) == pytest.approx(exact, rel=2e-3)
