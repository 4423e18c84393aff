"""A stiff nodule as a low-rank change: equal to a full recompute, and felt."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from palpate.mechanics.elastic.inclusion import StiffenedElements
from palpate.mechanics.elastic.pardiso import available
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import MeshError
from palpate.mechanics.model.material import inclusion_ratio, share_inside

from ..support.nodule import AxisPress, felt

UP = np.array([0.0, 0.0, 1.0])


def selection(mesh):
    nodes = np.flatnonzero(mesh.touchable)
    return sp.csr_matrix(
        (np.ones(len(nodes)), (np.arange(len(nodes)), nodes)), (len(nodes), len(mesh.points))
    )


def compliance(mesh, ratio):
    """(3t, 3t): the touchable nodes' motion for a unit force on each."""
    chosen = selection(mesh)
    loads = np.kron(chosen.toarray().T, np.eye(3)).reshape(len(mesh.points), 3, -1)
    moved = Solver(mesh, 0.49, ratio).solve(loads)
    return (chosen @ moved.reshape(len(mesh.points), -1)).reshape(loads.shape[2], -1)


@pytest.mark.parametrize("base", [False, True])
def test_low_rank_update_equals_full_recompute(box, base):
    mesh = box((4, 4, 3), (0.08, 0.08, 0.05)).quadratic()
    rng = np.random.default_rng(0)
    before = rng.uniform(0.8, 1.3, len(mesh.tetrahedra))
    plain = compliance(mesh, before)
    centre = np.array([0.01, 0.0, 0.006 if base else 0.03])
    pool = np.flatnonzero(share_inside(mesh, centre, 0.022) > 0)
    region = StiffenedElements(Solver(mesh, 0.49, before), pool, selection(mesh))
    for radius in (0.012, 0.018):
        ratio = inclusion_ratio(mesh, centre, radius, 6.0)
        after = compliance(mesh, before * ratio)
        updated = region.updated(plain, ratio[pool])
        assert np.abs(updated - after).max() < 1e-6 * np.abs(after).max()
    assert np.abs(after - plain).max() > 1e-3 * np.abs(after).max()


def test_a_region_that_grew_is_the_region_from_the_start(box):
    mesh = box((4, 4, 3), (0.08, 0.08, 0.05)).quadratic()
    solver = Solver(mesh, 0.49)
    rng = np.random.default_rng(1)
    pool = rng.permutation(np.flatnonzero(share_inside(mesh, np.array([0.01, 0.0, 0.01]), 0.025) > 0))
    factor = rng.uniform(0.5, 8.0, len(pool))
    whole = StiffenedElements(solver, pool, selection(mesh))
    grown = StiffenedElements(solver, pool[:9], selection(mesh))
    grown.extend(pool[4:20])
    grown.extend(pool)
    grown.extend(pool[3:5])
    assert (grown.elements == pool).all()
    zero = np.zeros((3 * mesh.touchable.sum(),) * 2)
    want = whole.updated(zero, factor)
    assert np.abs(grown.updated(zero, factor) - want).max() < 1e-6 * np.abs(want).max()


def test_share_of_a_sphere_adds_up_to_its_volume(box):
    mesh = box((8, 8, 8), (0.1, 0.1, 0.1))
    share = share_inside(mesh, np.array([0.003, -0.002, 0.05]), 0.03)
    assert (share * mesh.volumes).sum() == pytest.approx(4 / 3 * np.pi * 0.03**3, rel=0.02)


def test_a_factor_an_element_is_asked_for(box):
    mesh = box((2, 2, 2), (0.1, 0.1, 0.1))
    region = StiffenedElements(Solver(mesh, 0.4), np.array([0, 5]), selection(mesh))
    with pytest.raises(MeshError, match="2 positive values"):
        region.change(np.array([1.0]))


@pytest.mark.slow
@pytest.mark.skipif(not available(), reason="large systems, slow without MKL")
@pytest.mark.parametrize(("top_mm", "within"), [(4, 0.07), (8, 0.01), (14, 0.005)])
def test_a_nodule_is_felt_at_every_depth_as_in_a_fine_reference(top_mm, within):
    """Nodules of 10 mm, 6 times as stiff: force with over without within a share of another library's, at
    every depth of a touch (under a load of one width 8, 1.7 and 0.4 % off, rising with the depth)."""
    press = AxisPress(0.004, 0.010 + 1e-3 * top_mm, nodule_radius_m=0.01, modulus_ratio=6.0)
    rows = felt(press, (0.0005, 0.001, 0.002, 0.003, 0.004, 0.0045))
    ratio = (1 + rows["contrast"]) / (1 + rows["reference"])
    assert ratio == pytest.approx(np.ones(6), abs=within)
    assert rows["reference"][-1] > rows["reference"][0] > 0.02
    assert rows["plain_force_over_reference"] == pytest.approx(np.ones(6), abs=0.04)
