"""The load patch, and the half-space under it."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.compliance.patch import PatchSampler, half_space_compliance
from palpate.mechanics.compliance.sites import patch_compliance, patch_width
from palpate.mechanics.elastic.elasticity import stiffness
from palpate.mechanics.elastic.pardiso import Pardiso, available
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import MeshError

from .closed_forms import boussinesq_displacement, cerruti_displacement

NU = 0.49


def test_weights_carry_the_force_and_its_place(box):
    mesh = box((8, 8, 4), (0.1, 0.1, 0.05)).quadratic()
    point = np.array([0.004, -0.007, 0.05])
    nodes, weights = PatchSampler(mesh, 0.008).weights(point)
    assert weights.sum() == pytest.approx(1.0)
    assert np.abs(weights @ mesh.points[nodes] - point).max() < 2e-4
    spread = weights @ (mesh.points[nodes] - point)[:, 0] ** 2
    assert np.sqrt(spread) == pytest.approx(0.008, rel=0.02)


def test_off_the_surface_is_refused(box):
    mesh = box((4, 4, 2), (0.1, 0.1, 0.05)).quadratic()
    with pytest.raises(MeshError, match="no touchable surface"):
        PatchSampler(mesh, 0.005).weights(np.array([0.0, 0.0, 1.0]))
    with pytest.raises(MeshError, match="greater than 0"):
        PatchSampler(mesh, 0.0)


def test_half_space_compliance_is_the_mean_of_boussinesq_and_cerruti():
    """Two points drawn from the Gaussian differ by a Gaussian of sqrt(2) s: average the kernels over it."""
    s = 0.006
    rng = np.random.default_rng(3)
    radius = s * np.sqrt(2) * np.sqrt(-2 * np.log(1 - (np.arange(4000) + 0.5) / 4000))
    angle = rng.uniform(0, 2 * np.pi) + 2 * np.pi * np.arange(60) / 60
    at = np.stack([np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle))], -1).reshape(-1, 2)
    at = np.column_stack([at, np.zeros(len(at))])
    compliance = half_space_compliance(np.array([0.0, 0.0, 1.0]), NU, s)
    down = -boussinesq_displacement(at, 1.0, 1.0, NU)[:, 2].mean()
    side = cerruti_displacement(at, 1.0, 1.0, NU)[:, 0].mean()
    assert compliance[2, 2] == pytest.approx(down, rel=0.01)
    assert compliance[0, 0] == pytest.approx(side, rel=0.01)
    assert compliance[0, 1] == compliance[0, 2] == 0


@pytest.mark.skipif(not available(), reason="a large system, slow without MKL")
@pytest.mark.parametrize("axis", [2, 0])
def test_far_field_of_boussinesq_and_cerruti(box, axis):
    """A patch on a block whose other faces move as the half-space does: the surface follows within 2 %."""
    size = 0.12
    mesh = box((14, 14, 8), (size, size, 0.06), 1.3).quadratic()
    solution = boussinesq_displacement if axis == 2 else cerruti_displacement
    top = np.isclose(mesh.points[:, 2], 0.06)
    around = np.isclose(np.abs(mesh.points[:, :2]).max(axis=1), size / 2) | np.isclose(mesh.points[:, 2], 0)
    exact = np.zeros_like(mesh.points)
    origin = np.array([0.0, 0.0, 0.06])
    exact[around] = solution(mesh.points[around] - origin, 1.0, 1.0, NU)
    sampler = PatchSampler(mesh, 0.005)
    nodes, weights = sampler.weights(origin)
    force = np.zeros_like(mesh.points)
    force[nodes, axis] = -weights if axis == 2 else weights
    matrix = stiffness(mesh, NU)
    free = np.flatnonzero(~np.repeat(around, 3))
    u = exact.ravel().copy()
    right = (force.ravel() - matrix @ u)[free]
    u[free] = Pardiso(matrix[free][:, free].tocsr()).solve(right)
    u = u.reshape(-1, 3)
    distance = np.linalg.norm(mesh.points - origin, axis=1)
    ring = top & ~around & (distance > 0.032) & (distance < 0.05)
    want = solution(mesh.points[ring] - origin, 1.0, 1.0, NU)
    error = np.linalg.norm(u[ring] - want, axis=1) / np.linalg.norm(want, axis=1)
    assert ring.sum() > 30
    assert np.sqrt((error**2).mean()) < 0.02, error
    under = weights @ u[nodes][:, axis]
    known = half_space_compliance(np.array([0.0, 0.0, 1.0]), NU, 0.005)[axis, axis]
    assert abs(under) == pytest.approx(known, rel=0.04)


def test_wider_patches_and_stiffer_places_give_less(box):
    mesh = box((8, 8, 4), (0.1, 0.1, 0.05)).quadratic()
    solver = Solver(mesh, NU)
    middle, low = np.array([0.0, 0.0, 0.05]), np.array([0.05, 0.0, 0.012])
    compliance = {}
    for width in (patch_width(mesh), 0.02):
        sampler = PatchSampler(mesh, width)
        compliance[width] = patch_compliance(solver, [sampler.weights(middle), sampler.weights(low)])
    narrow, wide = compliance.values()
    assert wide[0][2, 2] < narrow[0][2, 2]
    for block in narrow:
        assert np.array_equal(block, block.T)
        assert np.linalg.eigvalsh(block).min() > 0
