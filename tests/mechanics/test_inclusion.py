"""A stiff nodule as a low-rank change: equal to a full recompute, and felt."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from mechanics.compliance import condense
from mechanics.errors import MeshError
from mechanics.inclusion import Region, inclusion_ratio, share_inside
from mechanics.pardiso import available
from mechanics.sites import patch_width, touch_sites, touch_solver
from mechanics.solver import Solver
from mechanics.touch import touch_force

UP = np.array([0.0, 0.0, 1.0])


def selection(mesh):
    nodes = np.flatnonzero(mesh.touchable)
    return sp.csr_matrix(
        (np.ones(len(nodes)), (np.arange(len(nodes)), nodes)), (len(nodes), len(mesh.points))
    )


@pytest.mark.parametrize("base", [False, True])
def test_low_rank_update_equals_full_recompute(box, base):
    mesh = box((4, 4, 3), (0.08, 0.08, 0.05)).quadratic()
    rng = np.random.default_rng(0)
    before = rng.uniform(0.8, 1.3, len(mesh.tetrahedra))
    plain = condense(mesh, 0.49, before)
    centre = np.array([0.01, 0.0, 0.006 if base else 0.03])
    pool = np.flatnonzero(share_inside(mesh, centre, 0.022) > 0)
    region = Region(Solver(mesh, 0.49, before), pool, selection(mesh))
    for radius in (0.012, 0.018):
        ratio = inclusion_ratio(mesh, centre, radius, 6.0)
        after = condense(mesh, 0.49, before * ratio).matrix
        updated = region.updated(plain.matrix, ratio[pool])
        assert np.abs(updated - after).max() < 1e-9 * np.abs(after).max()
        t = len(plain.nodes)
        own = plain.matrix.reshape(t, 3, t, 3)[np.arange(t), :, np.arange(t)]
        want = after.reshape(t, 3, t, 3)[np.arange(t), :, np.arange(t)]
        assert np.abs(region.updated_own(own, ratio[pool]) - want).max() < 1e-9 * np.abs(after).max()
    assert np.abs(after - plain.matrix).max() > 1e-3 * np.abs(after).max()


def test_share_of_a_sphere_adds_up_to_its_volume(box):
    mesh = box((8, 8, 8), (0.1, 0.1, 0.1))
    share = share_inside(mesh, np.array([0.003, -0.002, 0.05]), 0.03)
    assert (share * mesh.volumes).sum() == pytest.approx(4 / 3 * np.pi * 0.03**3, rel=0.02)


def test_a_factor_an_element_is_asked_for(box):
    mesh = box((2, 2, 2), (0.1, 0.1, 0.1))
    region = Region(Solver(mesh, 0.4), np.array([0, 5]), selection(mesh))
    with pytest.raises(MeshError, match="2 positive values"):
        region.change(np.array([1.0]))


@pytest.mark.slow
@pytest.mark.skipif(not available(), reason="large systems, slow without MKL")
def test_a_nodule_is_felt_as_on_a_fine_mesh(box):
    """Force above a nodule of 10 mm, 6 times as stiff, 14 mm deep, over the force without: within 10 %."""
    centre, depth, nu = np.array([0.0, 0.0, 0.032]), 4e-3, 0.49
    touch = {"young_modulus_pa": 20e3, "poisson_ratio": nu, "tip_radius_m": 5e-3, "law": "linear"}
    points = np.array([[0.0, 0.0, 0.046], [0.006, 0.003, 0.046], [0.03, 0.0, 0.046]])
    contrast = {}
    for cells in ((10, 10, 5), (24, 24, 11)):
        mesh = box(cells, (0.1, 0.1, 0.046))
        fars = []
        for factor in (1.0, 6.0):
            solver = touch_solver(mesh, nu, inclusion_ratio(mesh, centre, 0.01, factor))
            width = 0.8 * 0.007  # the same patch on both
            assert patch_width(solver.mesh) < 1.2 * width
            normals = np.tile(UP, (3, 1))
            sites = touch_sites(mesh, points, normals, nu, solver=solver, patch_width_m=width, curvature=0.0)
            fars.append(sites.far)
        path = -np.linspace(0, depth, 50)[:, None] * UP
        force = [[touch_force(path, UP, far, **touch)[-1, 2] for far in each] for each in fars]
        contrast[cells] = np.array(force[1]) / np.array(force[0]) - 1
    coarse, fine = contrast.values()
    assert fine[0] > 0.05
    assert coarse[:2] == pytest.approx(fine[:2], rel=0.10)
    assert abs(coarse[2] - fine[2]) < 0.01
