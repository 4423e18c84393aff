"""Moduli of single presses spread over the surface, wherever the places lie."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.show.reconstruction import modulus

RNG = np.random.default_rng(0)
PLANE = np.column_stack([0.04 * RNG.random((8, 2)), np.zeros(8)])
TURN = np.linalg.qr(RNG.standard_normal((3, 3)))[0]
PLACES = {
    "a plane": PLANE,
    "a plane aslant": PLANE @ TURN.T + 0.1,
    "a plane, but for noise": PLANE + 1e-6 * RNG.standard_normal((8, 3)),
    "a line": PLANE * [1, 0, 0],
    "one place": np.zeros((5, 3)),
    "three places": PLANE[:3],
    "a body": 0.04 * RNG.random((12, 3)),
}


@pytest.mark.parametrize("name", PLACES)
def test_moduli_are_spread_whatever_the_places_span(monkeypatch, name):
    points = PLACES[name]
    monkeypatch.setattr(modulus, "felt_surface", lambda model: SimpleNamespace(points=points))
    values = 1e4 * (1 + np.arange(len(points)))
    values[0] = np.nan
    field = modulus.over_surface(SimpleNamespace(presses=SimpleNamespace(point=points)), values)
    assert field.shape == (len(points),) and np.isfinite(field).all()
    if name == "a plane":  # each place has about its own
        assert np.corrcoef(field[1:], values[1:])[0, 1] > 0.9
