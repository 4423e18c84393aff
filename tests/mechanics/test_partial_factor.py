"""Matrices condensed onto few unknowns: by MKL Pardiso where it is, and by SciPy alike."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from palpate.mechanics.elastic.partial_factor import SuperLuFactor, partial_factor


def test_both_factorisations_condense_alike():
    rng = np.random.default_rng(0)
    full = sp.random(60, 60, 0.1, random_state=0)
    full = full @ full.T + 2 * sp.eye(60)
    upper, kept = sp.triu(full, format="csr"), np.array([3, 20, 41])
    upper.sort_indices()
    load, change = rng.normal(size=60), rng.normal(size=3)
    factors = [kind(upper, kept) for kind in (partial_factor, SuperLuFactor)]
    schur = [f.refresh(upper.data) for f in factors]
    np.testing.assert_allclose(schur[0], np.linalg.inv(np.linalg.inv(full.toarray())[np.ix_(kept, kept)]))
    np.testing.assert_allclose(*schur)
    np.testing.assert_allclose(*(f.backward(f.forward(load), change) for f in factors))


@pytest.mark.parametrize("kind", [partial_factor, SuperLuFactor])
def test_definite_and_indefinite_matrices_are_solved_in_turn(kind):
    rng = np.random.default_rng(2)
    turn, kept, b = np.linalg.qr(rng.normal(size=(40, 40)))[0], np.arange(3, 40, 5), rng.normal(size=40)
    factor = kind(sp.csr_matrix(np.triu(np.ones((40, 40)))), kept)
    for low in (1.0, -1.0, 1.0):
        matrix = turn @ np.diag(np.concatenate([[low], np.linspace(2, 9, 39)])) @ turn.T
        schur = factor.refresh(matrix[np.triu_indices(40)])
        assert np.linalg.inv(schur) == pytest.approx(np.linalg.inv(matrix)[np.ix_(kept, kept)], abs=1e-9)
        half = factor.forward(b)
        x = factor.backward(half, np.linalg.solve(schur, half[kept]))
        assert matrix @ x == pytest.approx(b, abs=1e-9)
