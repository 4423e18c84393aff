"""A rigid flat punch on tetrahedra against 2 E* a d; the stress at its rim is singular."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from palpate.mechanics.elastic.elasticity import stiffness
from palpate.mechanics.elastic.pardiso import Pardiso, available
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh

from .closed_forms import boussinesq_displacement, flat_punch_force

A, NU = 0.01, 0.45


def cylinder(rings: int) -> TetMesh:
    """A cylinder about z <= 0, nine punch radii wide and high, with `rings` rings of elements under the punch
    and as small ones beside it."""
    beside = 3 + rings
    growth = brentq(lambda g: (g**beside - 1) / (g - 1) - 8 * rings, 1.01, 9)
    outside = 1 + np.cumsum(growth ** np.arange(beside)) / rings
    steps = A * np.concatenate([np.arange(rings + 1) / rings, outside])
    count = len(steps) - 1
    mesh = box_mesh((2 * count, 2 * count, count), (2.0 * count, 2.0 * count, 1.0 * count))
    x, y, z = mesh.points.T
    square, length = np.maximum(np.abs(x), np.abs(y)), np.hypot(x, y)
    scale = np.interp(square, np.arange(count + 1), steps) / np.where(length > 0, length, 1.0)
    points = np.stack([x * scale, y * scale, -np.interp(count - z, np.arange(count + 1), steps)], axis=1)
    return TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable).quadratic()


def punch_force(rings: int) -> float:
    """Force over the half-space's of a frictionless punch; the outer faces move as the half-space does."""
    mesh = cylinder(rings)
    p = mesh.points
    top = p[:, 2] > -1e-9
    under = top & (np.hypot(p[:, 0], p[:, 1]) < A * (1 + 1e-9))
    nodes = np.unique(mesh.surface)
    outer = np.zeros(len(p), dtype=bool)
    outer[nodes] = True
    outer &= np.linalg.norm(p, axis=1) > 6 * A
    known = flat_punch_force(1.0, A, 1.0, NU)
    given = np.zeros((len(p), 3))
    given[outer] = boussinesq_displacement(p[outer], known, 1.0, NU)
    given[under, 2] = -1.0
    held = np.zeros((len(p), 3), dtype=bool)
    held[outer & ~top] = True
    held[under, 2] = True
    given[~held] = 0.0
    matrix = stiffness(mesh, NU)
    free = np.flatnonzero(~held.ravel())
    u = given.ravel().copy()
    u[free] = Pardiso(matrix[free][:, free].tocsr()).solve(-(matrix @ u)[free])
    return -(matrix @ u).reshape(-1, 3)[under, 2].sum() / known


@pytest.mark.slow
@pytest.mark.skipif(not available(), reason="large systems, slow without MKL")
def test_flat_punch_converges_to_the_half_space():
    """The force is too great in proportion to the elements at the rim, and right for ones of no size."""
    two, three = punch_force(2) - 1, punch_force(3) - 1
    assert 0 < three < two < 0.07
    assert 3 * three - 2 * two == pytest.approx(0, abs=0.015)
