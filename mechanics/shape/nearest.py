"""Triangulated surfaces: areas, the nearest places by VTK's cell locator, points spread over one, rays."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import numpy as np

_SAME_HIT_M = 1e-9
"""Hits nearer to each other lie on the edge of two triangles."""


def segments_cut(
    start: np.ndarray, end: np.ndarray, longest_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pieces of at most `longest_m` of segments from start to end (s, 3) m: their middles (k, 3) m, lengths
    (k,) m, and of which segment each is (k,)."""
    length = np.linalg.norm(end - start, axis=1)
    count = np.maximum(np.ceil(length / longest_m).astype(int), 1)
    row = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[row]
    return start[row] + share[:, None] * (end - start)[row], (length / count)[row], row


def triangle_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(k,) m^2, of straight triangles (k, 3 or 6) of points (n, 3) m."""
    return np.linalg.norm(facings(points, triangles)[0], axis=1) / 2


def facings(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(k, 3) m^2, twice each triangle's area along its normal, and the (k, 3) unit normals; 0 of one without
    area."""
    a, b, c = np.moveaxis(points[triangles[:, :3]], 1, 0)
    across = np.cross(b - a, c - a)
    return across, across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)


def farthest_apart(points: np.ndarray, most: int) -> np.ndarray:
    """(p,) numbers of at most so many of points (n, d), each the farthest from those before; the first lies
    farthest from their mean."""
    if len(points) <= most:
        return np.arange(len(points))
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    away = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < most:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


def neighbours(triangles: np.ndarray) -> np.ndarray:
    """(k, 3) the triangle across the edge from corner i to corner i+1; -1 where there is none."""
    k = len(triangles)
    start = triangles.ravel()
    end = np.roll(triangles, -1, axis=1).ravel()
    n = int(triangles.max()) + 1
    forward, backward = start * np.int64(n) + end, end * np.int64(n) + start
    order = np.argsort(forward, kind="stable")
    place = np.searchsorted(forward[order], backward)
    place = np.minimum(place, len(order) - 1)
    found = order[place]
    return np.where(forward[found] == backward, found // 3, -1).reshape(k, 3)


class Closest:
    """Asks for the closest point of triangles (m, 3) of vertices (n, 3), prepared once."""

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray) -> None:
        import pyvista
        from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator

        self._corners = np.asarray(vertices, dtype=float)[np.asarray(triangles)]
        shell = pyvista.PolyData.from_regular_faces(np.asarray(vertices, dtype=float), np.asarray(triangles))
        self._locator = vtkStaticCellLocator()
        self._locator.SetDataSet(shell)
        self._locator.BuildLocator()

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `closest`."""
        from vtkmodules.vtkCommonCore import reference
        from vtkmodules.vtkCommonDataModel import vtkGenericCell

        # the library's own loop makes anew for every point what serves for all
        cell, place = vtkGenericCell(), [0.0] * 3
        triangle, part, squared = (cast(Any, reference(zero)) for zero in (0, 0, 0.0))
        index, found = np.empty(len(points), dtype=np.int64), np.empty((len(points), 3))
        for k, point in enumerate(np.asarray(points, dtype=float).tolist()):
            self._locator.FindClosestPoint(point, place, cell, triangle, part, squared)
            index[k], found[k] = triangle.get(), place
        a, b, c = np.moveaxis(self._corners[index], 1, 0)
        u, v, w = b - a, c - a, found - a
        uu, vv, uv = (np.einsum("ij,ij->i", x, y) for x, y in ((u, u), (v, v), (u, v)))
        wu, wv = np.einsum("ij,ij->i", w, u), np.einsum("ij,ij->i", w, v)
        area = np.maximum(uu * vv - uv * uv, 1e-300)
        s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
        weights = np.clip(np.column_stack([1 - s - t, s, t]), 0, 1)
        return found, index, weights / weights.sum(axis=1, keepdims=True)


def closest(
    vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For points (k, 3): closest points (k, 3), their triangle (k,), and barycentric weights (k, 3) in it."""
    return Closest(vertices, triangles)(points)


def distance(vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(k,) m, unsigned distance of points (k, 3) from the surface."""
    return np.linalg.norm(closest(vertices, triangles, points)[0] - points, axis=1)


def inside(vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(k,) bool, whether points (k, 3) lie inside of a closed surface."""
    import pyvista

    around = pyvista.PolyData.from_regular_faces(np.asarray(vertices), np.asarray(triangles))
    found = pyvista.PolyData(points).select_interior_points(around, check_surface=False)
    return np.asarray(found["selected_points"], dtype=bool)


def sample(vertices: np.ndarray, triangles: np.ndarray, count: int, seed: int = 0) -> np.ndarray:
    """(count, 3) points spread evenly by area over the surface; the same for the same seed."""
    generator = np.random.default_rng(seed)
    corner = np.asarray(vertices)[np.asarray(triangles)]
    area = triangle_areas(np.asarray(vertices), np.asarray(triangles))
    chosen = corner[generator.choice(len(area), count, p=area / area.sum())]
    r, s = np.sqrt(generator.random(count)), generator.random(count)
    return np.einsum("ik,ikj->ij", np.column_stack([1 - r, r * (1 - s), r * s]), chosen)


def first_hits(
    vertices: np.ndarray,
    triangles: np.ndarray,
    starts: np.ndarray,
    directions: np.ndarray,
    *,
    beyond: float = 0.0,
    leaving: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """(k,) how far along unit directions (k, 3) rays from starts (k, 3) first meet the surface, infinite
    where they do not, and which triangle (k,) they meet there, -1 where none.

    beyond: nearer hits do not count. leaving: only where rays come out of the body count, by the winding
    number: not where it crosses itself, nor where they enter.
    """
    found, hit = np.full(len(starts), np.inf), np.full(len(starts), -1)
    for k, (far, met, step) in enumerate(_hits(vertices, triangles, starts, directions)):
        counts = far > beyond
        if leaving:  # outside is what winds around 0 times: as many lead in as out of those farther on
            counts &= (step > 0) & (step.sum() - np.cumsum(step) <= 0)
        if counts.any():
            first = np.argmax(counts)
            found[k], hit[k] = far[first], met[first]
    return found, hit


def windings(
    vertices: np.ndarray, triangles: np.ndarray, starts: np.ndarray, directions: np.ndarray
) -> np.ndarray:
    """(k,) how often a closed surface winds around starts (k, 3), which lie beside it, by rays along unit
    directions (k, 3): 0 outside, 1 inside, -1 inside of what it encloses inside out."""
    return np.array([step.sum() for *_, step in _hits(vertices, triangles, starts, directions)])


def _hits(
    vertices: np.ndarray, triangles: np.ndarray, starts: np.ndarray, directions: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Of each ray, by its hits from near to far (h,): m along it, the triangles, and 1 where it comes out
    through one, -1 where it goes in; 0 of a second hit on the same edge. VTK's tree of oriented boxes names
    the triangles."""
    import pyvista

    vertices, triangles = np.asarray(vertices, dtype=float), np.asarray(triangles)
    shell = pyvista.PolyData.from_regular_faces(vertices, triangles)
    across, _ = facings(vertices, triangles)
    middle, size = vertices.mean(axis=0), float(np.linalg.norm(np.ptp(vertices, axis=0)))
    for start, way in zip(starts, directions, strict=True):
        end = start + (float(np.linalg.norm(start - middle)) + size) * way
        met = np.unique(shell.ray_trace(start, end)[1]).astype(int)
        # a triangle that the ray runs along has no one place where they meet
        met = met[np.abs(across[met] @ way) > 1e-9 * np.linalg.norm(across[met], axis=1)]
        # the tree's points are of single precision, so where it meets each triangle's plane is found again
        far = np.einsum("ij,ij->i", vertices[triangles[met, 0]] - start, across[met]) / (across[met] @ way)
        near_first = np.argsort(far, kind="stable")
        near_first = near_first[far[near_first] > 0]
        far, met = far[near_first], met[near_first]
        step = np.where(across[met] @ way > 0, 1, -1)
        for side in (1, -1):
            of = np.flatnonzero(step == side)
            step[of[np.diff(far[of], prepend=-np.inf) <= _SAME_HIT_M]] = 0
        yield far, met, step
