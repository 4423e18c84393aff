"""The family of solids that stiffen or soften: its law, its dent, and a fresh solution beside the table."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.contact.dent import dent_law, grid
from palpate.mechanics.effects.strain_stiffening import GREATEST, LEAST, hardening, stiffening

RATIOS = (LEAST, -0.3, -0.1, -0.02, 0.0, 0.02, 0.1, 0.35, 1.0, 2.5, GREATEST)


@pytest.mark.parametrize("ratio", RATIOS)
def test_the_slope_of_the_law_is_its_derivative(ratio):
    excess, small = np.linspace(0.01, 1.0, 50), 1e-6
    up, down = (hardening(excess + s, ratio)[0] for s in (small, -small))
    assert hardening(excess, ratio)[1] == pytest.approx((up - down) / (2 * small), rel=1e-5, abs=1e-8)
    assert hardening(1e-4, ratio)[0] == pytest.approx(1 + 2e-4 * ratio, abs=2e-7 * max(1, ratio**2))


def test_a_material_that_softens_never_gives_way_in_shear():
    """Ellipticity: the shear stress g h(g^2) rises with the shear g, which Yeoh's law does not below 0."""
    g = np.linspace(0, 5, 2001)
    for ratio in (LEAST, -0.1):
        assert (np.diff(g * hardening(g**2, ratio)[0]) > 0).all()
        yeoh = g * (1 + 2 * ratio * g**2)
        assert (np.diff(yeoh) < 0).any()


def test_the_dent_is_neo_hookean_at_none_and_goes_with_the_ratio():
    force, sideways = stiffening(0.0)
    assert (force == 1).all() and (sideways == 1).all()
    at = np.searchsorted(grid(), [0.2, 0.5, 0.8])
    for factors in zip(*(stiffening(r) for r in RATIOS), strict=True):
        assert (np.diff(np.array(factors)[:, at], axis=0) > 0).all()


def test_the_dent_lies_a_little_above_that_of_yeohs_law():
    """Exponential grows faster than Yeoh's law, which it begins as. That one was solved on elements of 0.06 R
    out to 400 R: 1 + 0.197 r x^1.25, within 0.3 % of the force at r = 0.35."""
    x = grid()
    use = (x > 0.1) & (x < 1.0)
    more = (stiffening(0.35)[0] - (1 + 0.197 * 0.35 * x**1.25))[use]
    assert more.min() > -0.002 and more.max() < 0.012
    assert abs(more[x[use] < 0.4]).max() < 0.003


@pytest.mark.slow
def test_a_ratio_between_those_of_the_table_is_solved_anew():
    pytest.importorskip("pypardiso")
    from tools.dent_half_space import COARSE
    from tools.dent_table import press_curve

    ratio = -0.3
    curves = [press_curve("neo-hookean", 0.49, 0.15, 0.5, stiffening=r, grading=COARSE) for r in (0.0, ratio)]
    depth = np.linspace(0.2, 0.45, 6)
    force, sideways = (
        np.exp(np.subtract(*(_log(curve, column, depth) for curve in reversed(curves)))) for column in (1, 3)
    )
    table = stiffening(ratio)
    assert force == pytest.approx(np.interp(depth, grid(), table[0]), rel=0.005)
    assert sideways == pytest.approx(np.interp(depth, grid(), table[1]), rel=0.02)
    assert dent_law("neo-hookean").table[0, 0] == pytest.approx(4 / 3, rel=5e-3)


def _log(curve: np.ndarray, column: int, depth: np.ndarray) -> np.ndarray:
    x, y = curve[1::2, 0], np.log(curve[1::2, column])
    return np.interp(np.log(depth), np.log(x), y)
