"""A base on springs, or bonded in part."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import touch_sites
from palpate.mechanics.effects.hold import base_hold
from palpate.mechanics.elastic.elasticity import triangle_mass
from palpate.mechanics.elastic.held_base import BaseHold, base_triangles
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import OptionError

UP = np.array([0.0, 0.0, 1.0])


def test_triangle_mass_integrates_to_the_area(box):
    mesh = box((2, 2, 1), (0.1, 0.1, 0.05))
    for m in (mesh, mesh.quadratic()):
        mass = triangle_mass(m.points, base_triangles(m))
        assert mass.sum() == pytest.approx(0.01)
        assert np.linalg.eigvalsh(mass).min() > 0
        x = m.points[base_triangles(m)][:, :, 0]
        assert np.einsum("ki,kij,kj->", x, mass, x) == pytest.approx(0.1**4 / 12)


def test_springs_under_a_rigidly_pushed_block(box):
    """A block far stiffer than its springs sinks by F / (k A), and shifts by F / (k_t A)."""
    mesh = box((3, 3, 2), (0.1, 0.1, 0.05)).quadratic()
    solver = Solver(mesh, 0.3, hold=BaseHold(UP, springs=(1e-3, 4e-4)))
    force = np.zeros((len(mesh.points), 3, 2))
    top = np.argmin(np.linalg.norm(mesh.points - [0, 0, 0.0], axis=1))
    force[top, 2, 0] = force[top, 0, 1] = 1.0
    moved = solver.solve(force).mean(axis=0)
    assert moved[2, 0] == pytest.approx(1 / (1e-3 * 0.01), rel=0.01)
    assert moved[0, 1] == pytest.approx(1 / (4e-4 * 0.01), rel=0.05)


def test_hard_springs_are_a_bond_and_a_free_part_gives_more(box):
    mesh = box((5, 5, 3), (0.1, 0.1, 0.05)).quadratic()
    points = np.array([[0.05, 0.0, 0.03], [-0.05, 0.0, 0.03]])
    normals = np.array([[1.0, 0, 0], [-1.0, 0, 0]])

    def compliance(hold):
        solver = Solver(mesh, 0.49, hold=hold)
        return touch_sites(mesh, points, normals, 0.49, solver=solver, curvature=0.0).far[:, 0, 0]

    bonded = compliance(None)
    assert compliance(BaseHold(UP, springs=(1e7, 1e7))) == pytest.approx(bonded, rel=1e-3)
    assert (compliance(BaseHold(UP, springs=(20.0, 20.0))) > bonded).all()
    half = compliance(BaseHold(UP, bonded_fraction=0.5, direction=np.array([1.0, 0, 0])))
    assert half[0] - bonded[0] > 2 * (half[1] - bonded[1]) > 0


def test_effects_describe_the_support():
    assert base_hold({}, UP, 30e3) is None
    springs = base_hold(
        {"compliant_base": {"k_normal_pa_per_m": 6e5, "k_tangential_pa_per_m": 3e5}}, UP, 30e3
    )
    assert springs.springs == pytest.approx((20.0, 10.0))
    part = base_hold({"unbonded_base": {"bonded_fraction": 0.5, "direction": [1, 0, 0]}}, UP, 30e3)
    assert part.bonded_fraction == 0.5
    with pytest.raises(OptionError, match="bonded_fraction"):
        BaseHold(UP, bonded_fraction=0.0)
    with pytest.raises(OptionError, match="direction"):
        BaseHold(UP, bonded_fraction=0.4)
