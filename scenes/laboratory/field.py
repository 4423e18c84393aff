"""A solid whose modulus differs from place to place: a sum of random waves, and layers under the surface."""

from __future__ import annotations

import numpy as np

from palpate.scenes.laboratory.surface import TriangleSurface

Field = tuple[tuple[tuple[float, ...], ...], tuple[tuple[float, float], ...], float]
"""waves: (amplitude of ln E, wave vector x, y, z in rad/mm, phase). layers: (thickness mm, ln of the modulus)
from the touchable surface inwards, the last one to the bottom. width: mm, over which layers pass into one
another."""


def log_ratio(field: Field, points: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """(k,) ln of the modulus over the matrix's at points (k, 3) mm, `depth` (k,) mm under the surface."""
    waves, layers, width = field
    total = np.zeros(len(points))
    for amplitude, x, y, z, phase in waves:
        total += amplitude * np.cos(points @ [x, y, z] + phase)
    below, value = 0.0, 0.0
    for thickness, level in layers:
        # a step from the layer above, smeared
        share = 1.0 if below == 0.0 else 0.5 * (1 + np.tanh((depth - below) / width))
        total += (level - value) * share
        below, value = below + thickness, level
    return total


def ratio_at(field: Field, at: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(m, 4) modulus over the matrix's at Gauss points (m, 4, 3) mm of an object that stands on z = 0."""
    points = at.reshape(-1, 3)
    depth = np.zeros(len(points))
    if field[1]:
        surface = TriangleSurface(vertices, faces)
        off_base = surface.corners[..., 2].max(axis=1) > 1e-6
        depth = TriangleSurface(surface.vertices, surface.faces[off_base]).nearest(points)[1]
    return np.exp(log_ratio(field, points, depth)).reshape(at.shape[:2])
