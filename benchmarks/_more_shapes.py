"""Four more shapes that are known exactly, for what the first four (benchmarks._known_shapes) have not: a
dish, a slope, a waist that is a saddle, a thin plate; and what kind of place a point of a shape is.

Object frame: metres, standing on z = 0.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from benchmarks._known_shapes import SHAPES, Distance, KnownShape
from palpate.scenes.phantoms import circle, column, phantom, rectangle, resampled, stacked

KINDS = ("saddle", "concave", "thin", "near the base", "rim", "convex", "flat")
"""Of places; where several fit, thin, rim and near the base come before the curvature."""
THIN_M, NEAR_BASE_M, NEAR_RIM_M = 0.020, 0.014, 0.004
"""Less of the object under a place than that; lower than that; nearer to a sharp edge than that."""
BENT = 8.0
"""1/m: a principal curvature from which a place is convex or concave."""
_TURN = 1e-3
_WAIST, _ARC, _WAIST_HEIGHT = 0.028, 0.060, 0.060
_PLATE = (0.100, 0.080, 0.018)
_FINE_M = 5e-5


def _bowl() -> KnownShape:
    given = phantom("bowl")
    radius, height, mouth, deep = 0.048, 0.050, 0.036, 0.018
    ball = (mouth**2 + deep**2) / (2 * deep)
    angle = np.linspace(np.arcsin(mouth / ball), 0.0, 2000)
    dish = np.column_stack([ball * np.sin(angle), height - deep + ball * (1 - np.cos(angle))])
    outer = resampled(np.array([[radius, 0.0], [radius, height], dish[0]]), _FINE_M)
    rims = np.vstack([_ring(radius, height), _ring(mouth, height)])
    return KnownShape("bowl", given.vertices, given.faces, _revolved(np.vstack([outer[:-1], dish])), rims)


def _waist() -> KnownShape:
    half = _WAIST_HEIGHT / 2
    angle = np.linspace(-np.arcsin(half / _ARC), np.arcsin(half / _ARC), 41)
    flank = np.column_stack([_WAIST + _ARC * (1 - np.cos(angle)), half + _ARC * np.sin(angle)])
    foot = flank[0, 0]
    floor = resampled(np.array([[0.0, 0.0], [foot, 0.0]]), 1.8e-3)[:-1]
    top = resampled(np.array([flank[-1], [0.0, _WAIST_HEIGHT]]), 1.8e-3)[1:]
    profile = np.vstack([floor, flank, top])
    vertices, faces = stacked(circle(foot), np.column_stack([profile[:, 0] / foot, profile[:, 1]]))
    fine = np.linspace(angle[0], angle[-1], 2000)
    exact = np.column_stack([_WAIST + _ARC * (1 - np.cos(fine)), half + _ARC * np.sin(fine)])
    lid = resampled(np.array([exact[-1], [0.0, _WAIST_HEIGHT]]), _FINE_M)[1:]
    return KnownShape(
        "waist", vertices, faces, _revolved(np.vstack([exact, lid])), _ring(foot, _WAIST_HEIGHT)
    )


def _wedge() -> KnownShape:
    given = phantom("wedge")
    return _prism("wedge", given.vertices, given.faces, (0.100, 0.080), 0.032, 0.058)


def _plate() -> KnownShape:
    length, width, height = _PLATE
    vertices, faces = stacked(rectangle(length, width), column(width / 2, height))
    return _prism("plate", vertices, faces, (length, width), height, height)


def _prism(
    name: str, vertices: np.ndarray, faces: np.ndarray, base: tuple[float, float], low: float, high: float
) -> KnownShape:
    """On a rectangle of length and width `base`; its top rises along the length from `low` to `high`."""
    half, slope, middle = np.array(base) / 2, (high - low) / base[0], (low + high) / 2
    up = np.array([-slope, 0.0, 1.0]) / np.hypot(slope, 1.0)

    def distance(p: np.ndarray) -> np.ndarray:
        beside = (np.abs(p[:, :2]) - half).max(axis=1)
        return np.maximum(beside, (p - [0.0, 0.0, middle]) @ up)

    corners = half * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    tops = np.column_stack([corners, middle + slope * corners[:, 0]])
    edges = [(tops[k], tops[k - 1]) for k in range(4)] + [(t, t * [1, 1, 0]) for t in tops]
    return KnownShape(name, vertices, faces, distance, _lines(edges))


def _lines(edges: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    share = np.linspace(0, 1, 1001)[:, None]
    return np.vstack([a + share * (b - a) for a, b in edges])


def _ring(radius: float, height: float) -> np.ndarray:
    turn = np.linspace(0, 2 * np.pi, 2000)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(2000, height)])


def _revolved(profile: np.ndarray) -> Distance:
    """Signed distance of a body of revolution from its fine profile (k, 2) of radius and height, the inside
    on its left."""
    middle, along = (profile[1:] + profile[:-1]) / 2, np.diff(profile, axis=0)
    out = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    tree = cKDTree(middle)

    def distance(p: np.ndarray) -> np.ndarray:
        at = np.column_stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]])
        near = tree.query(at)[1]
        return np.einsum("ij,ij->i", at - middle[near], out[near])

    return distance


EIGHT = {**SHAPES, "bowl": _bowl, "wedge": _wedge, "waist": _waist, "plate": _plate}


def thickness(shape: KnownShape, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(k,) m of the object straight below places (k, 3), to its other side or its base."""
    way = np.arange(2e-3, 0.12, 5e-4)
    below = points[:, None] - way[:, None] * normals[:, None]
    out = (shape.distance(below.reshape(-1, 3)).reshape(below.shape[:2]) > 0) | (below[..., 2] < 0)
    return np.where(out.any(axis=1), way[out.argmax(axis=1)], way[-1])


def kinds(shape: KnownShape, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(k,) of KINDS at places (k, 3)."""
    low, high = _curvatures(shape, points, normals)
    found = np.full(len(points), "flat", dtype=object)
    found[high > BENT] = "convex"
    found[low < -BENT] = "concave"
    found[(low < -BENT) & (high > BENT)] = "saddle"
    found[points[:, 2] < NEAR_BASE_M] = "near the base"
    found[thickness(shape, points, normals) < THIN_M] = "thin"
    found[shape.rim_distance(points) < NEAR_RIM_M] = "rim"
    return found


def _curvatures(shape: KnownShape, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest principal curvatures (k,) 1/m, convex positive."""
    helper = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    u = np.cross(normals, helper)
    u /= np.linalg.norm(u, axis=1)[:, None]
    frame = [u, np.cross(normals, u)]
    bent = np.empty((len(points), 2, 2))
    for j, along in enumerate(frame):
        turned = shape.normals(points + _TURN * along) - shape.normals(points - _TURN * along)
        for i, across in enumerate(frame):
            bent[:, i, j] = np.einsum("kx,kx->k", turned, across) / (2 * _TURN)
    low, high = np.linalg.eigvalsh((bent + bent.transpose(0, 2, 1)) / 2).T
    return low, high
