"""Planes through points, the samples of a path that lie in one, and points spread along it."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.robust import biweight

STEP_M, LEAST_STEPS = 0.0005, 20
"""Between the points of a traced path that is resampled; fewer of them tell nothing."""
FLAT = 0.1
"""Tip radii: a tip that is so near a plane slides on it."""
FOOT = 0.4
"""Tip radii: a wider gap in a tracing is open, a wider leap parts its strokes; off it is the air."""
_DRAWN = 200


def fit_plane(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """(centre, unit normal, rms) of the plane through points (n, 3), robust (Tukey's biweight on
    distances)."""

    def plane(weight: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        centre = np.average(points, axis=0, weights=weight)
        offset = points - centre
        normal = np.linalg.eigh((offset * weight[:, None]).T @ offset)[1][:, 0]
        return (centre, normal), offset @ normal

    found = biweight(plane, len(points), least=1e-7, reach=6.0, rounds=12)
    return *found.fitted, float(np.sqrt(np.average(found.residual**2, weights=found.weight)))


def farthest_points(points: np.ndarray, spacing_m: float, start: int = 0) -> np.ndarray:
    """Indices of a farthest-point sample: added until no point is further than `spacing_m` from the
    sample."""
    chosen = [start]
    distance = np.linalg.norm(points - points[start], axis=1)
    while distance.max() > spacing_m:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


def resampled(path: np.ndarray, step_m: float) -> np.ndarray:
    """The path at equal steps of its length; a step is taken only once the tip has moved so far (no
    jitter)."""
    kept = [0]
    for i in range(0, len(path), 5):
        if np.linalg.norm(path[i] - path[kept[-1]]) >= step_m:
            kept.append(i)
    return path[kept]


def in_its_plane(position: np.ndarray, inside: np.ndarray, tip_radius_m: float) -> np.ndarray:
    """(n,) bool: samples of a tracing that lie in the plane of most of its way; the others are in the air.

    position: (n, 3) m. inside: (n,) bool, when the base is stated to be traced.
    """
    way = resampled(position[inside], STEP_M) if inside.any() else position[inside]
    if len(way) < LEAST_STEPS:
        return inside
    corners = way[np.random.default_rng(0).integers(len(way), size=(_DRAWN, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    near = np.abs(way @ normals.T - np.einsum("ij,ij->i", corners[:, 0], normals)) < FLAT * tip_radius_m
    on = way[near[:, np.argmax(near.sum(axis=0))]]  # the plane of three points that holds most of the way
    centre, normal, _ = fit_plane(on)
    return inside & (np.abs((position - centre) @ normal) < FOOT * tip_radius_m)
