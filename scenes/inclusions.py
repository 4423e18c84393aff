"""Stiff balls inside an object, as a modulus ratio a tetrahedron."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import numpy as np

from mechanics.tetmesh import TetMesh
from scenes.phantoms import Region

_STEPS = 6
_COUNTS = np.array([w for w in product(range(_STEPS + 1), repeat=4) if sum(w) == _STEPS])
_WEIGHTS = (_COUNTS + 0.25) / (_STEPS + 1)
"""(k, 4) barycentric points spread evenly inside a tetrahedron, none on its faces."""


def modulus_ratio(mesh: TetMesh, regions: Iterable[Region]) -> np.ndarray:
    """(m,) modulus of each tetrahedron over the object's: 1 outside, the region's ratio inside.

    A tetrahedron that the ball's surface cuts gets the mean by volume (Voigt's bound), so that a ball that
    moves changes the object steadily and one smaller than an element is not lost. Region centres: mesh frame.
    """
    ratio = np.ones(len(mesh.tetrahedra))
    corners = mesh.points[mesh.tetrahedra[:, :4]]
    middle = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    for region in regions:
        centre = np.asarray(region.centre_m, dtype=float)
        near = np.flatnonzero(np.linalg.norm(middle - centre, axis=1) < region.radius_m + reach)
        points = np.einsum("pk,nkx->npx", _WEIGHTS, corners[near])
        inside = np.linalg.norm(points - centre, axis=2) < region.radius_m
        ratio[near] += inside.mean(axis=1) * (region.modulus_ratio - 1.0)
    return ratio
