"""The low-rank form serves the same queries as the dense one."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.compliance.compression import between_mixed, compress, mix_factor
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import MeshError


@pytest.fixture(scope="module")
def dense(box):
    mesh = box((5, 5, 3), (0.05, 0.05, 0.03)).quadratic()
    solver = Solver(mesh, 0.45)
    points = mesh.points[mesh.touchable]
    average = PatchSampler(mesh, 0.008).matrix(points)
    loads = np.zeros((len(mesh.points), 3, len(points), 3))
    for axis in range(3):
        loads[:, axis, :, axis] = average.toarray().T
    moved = solver.solve(loads.reshape(len(mesh.points), 3, -1))
    means = average @ moved.reshape(len(mesh.points), -1)
    t = len(points)
    return solver, points, means.reshape(t, 3, t, 3).transpose(0, 2, 1, 3)


def test_error_is_as_asked_and_costs_rank(dense):
    solver, points, blocks = dense
    own = blocks[np.arange(len(points)), np.arange(len(points))]
    ranks = []
    for tolerance in (0.1, 0.03, 0.005):
        compressed = compress(solver, points, 0.008, tolerance=tolerance, checked=len(points))
        error = np.linalg.norm(compressed.own() - own, axis=(1, 2)) / np.linalg.norm(own, axis=(1, 2))
        assert compressed.error == pytest.approx(error.max(), rel=1e-3, abs=1e-6)
        assert error.max() <= tolerance
        ranks.append(compressed.factor.shape[2])
    assert ranks[0] < ranks[1] < ranks[2] <= compressed.loads
    assert compressed.factor.nbytes < 0.8 * 36 * len(points) ** 2
    with pytest.raises(MeshError, match="take a wider patch"):
        compress(solver, points, 0.008, tolerance=0.001, most=120)


def test_queries_agree_and_are_symmetric(dense):
    solver, points, blocks = dense
    factor = (compressed := compress(solver, points, 0.008)).factor
    p, q = np.array([3, 50, 100]), np.array([20, 7, 3])
    w, v = np.array([0.2, 0.5, 0.3]), np.array([0.0, 0.9, 0.1])
    found, back = np.empty((3, 3)), np.empty((3, 3))
    want = np.einsum("i,ijab,j->ab", w, blocks[np.ix_(p, q)], v)
    here, there = np.empty(factor.shape[1:]), np.empty(factor.shape[1:])
    mix_factor(factor, p, w, here)
    mix_factor(factor, q, v, there)
    between_mixed(here, there, found)
    between_mixed(there, here, back)
    size = np.abs(blocks).max()
    assert np.abs(found - want).max() < 0.005 * size
    assert found == pytest.approx(back.T, abs=1e-5 * size)
    assert compressed.block(4, 9) == pytest.approx(blocks[4, 9], abs=0.005 * size)


def test_the_same_seed_gives_the_same_factor(dense):
    solver, points, _ = dense
    one, same = (compress(solver, points[:40], 0.008, seed=3).factor for _ in range(2))
    assert np.array_equal(one, same)
