"""Bounds of a convex object: the hull of touched points and base (the paper's surface, section 2.2) inside,
the half-spaces behind the tangent planes at all touches outside.

A convex solid of plane faces: walls on a polygon, each with its own tilt, under one or more top planes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, Delaunay, HalfspaceIntersection, QhullError

from palpate.mechanics.errors import SurfaceError
from palpate.mechanics.shape.nearest import distance
from palpate.reconstruction.shapes.fit import LEAN_M, Evidence
from palpate.reconstruction.shapes.outline import Outline, farthest_points, sides
from palpate.reconstruction.shapes.shape import ShapeParameter, values_of, with_values

_SECTORS, _RIM_SPACING_M = 48, 0.005


def hull_surface(evidence: Evidence) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and outward triangles (m, 3) of the hull in the support frame, base on z = 0.

    Touched points below the support are lifted onto it. The hull is an inner bound of a convex object.
    Raises SurfaceError where the points are flat.
    """

    rim = evidence.to_support(evidence.outline)
    rim[:, 2] = 0.0
    rim = rim[farthest_points(rim, _RIM_SPACING_M)]
    touched = evidence.to_support(evidence.points)
    touched[:, 2] = np.maximum(touched[:, 2], 0.0)
    return delaunay_hull(np.vstack([rim, touched]))


def delaunay_hull(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward triangles of the convex hull of points (n, 3)."""
    try:
        triangles = Delaunay(points).convex_hull
    except QhullError as error:
        raise SurfaceError(
            "the touched points and the base lie in one plane: touch the object above its base"
        ) from error
    used = np.unique(triangles)
    index = np.full(len(points), -1)
    index[used] = np.arange(len(used))
    vertices, triangles = points[used], index[triangles]
    corner = vertices[triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    inward = np.einsum("ij,ij->i", normal, corner[:, 0] - vertices.mean(axis=0)) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return vertices, triangles


def tangent_surface(evidence: Evidence) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and outward triangles (m, 3) in the support frame, base on z = 0.

    A plane stands at every touch, facing as the first force says but turned as far as
    needed for no other touch to lie before it (`supporting_normals`), so that the hull lies inside. An object
    that does not lean outwards stays within its base: an upright plane stands at each of 48 sectors of the
    outline, as far out as tracing hands lean in.
    Raises SurfaceError where the planes enclose nothing.
    """
    rim = evidence.to_support(evidence.outline)[:, :2]
    touched = evidence.to_support(evidence.points)
    ground = np.column_stack([rim[::8], np.zeros(len(rim[::8]))])
    normals = supporting_normals(touched, evidence.normals @ evidence.axes.T, np.vstack([touched, ground]))
    offsets = (touched * normals).sum(axis=1)
    angle = 2 * np.pi * np.arange(_SECTORS) / _SECTORS
    walls = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_SECTORS)])
    reach = (rim @ walls[:, :2].T).max(axis=0) + LEAN_M
    top = touched[:, 2].max() + 0.02
    planes = np.vstack(
        [
            np.column_stack([normals, -offsets]),
            np.column_stack([walls, -reach]),
            [[0, 0, -1, 0.0], [0, 0, 1, -top]],
        ]
    )
    inside = np.array([*rim.mean(axis=0), 0.3 * touched[:, 2].max()])
    if (planes[:, :3] @ inside + planes[:, 3]).max() > -1e-4:
        raise SurfaceError("the tangent planes at the touches enclose nothing: the object is not convex")
    try:
        corners = HalfspaceIntersection(planes, inside).intersections
    except QhullError as error:
        raise SurfaceError("the tangent planes at the touches do not close: touch more places") from error
    corners[np.abs(corners[:, 2]) < 1e-9, 2] = 0.0
    return delaunay_hull(np.unique(corners.round(9), axis=0))


def supporting_normals(points: np.ndarray, normals: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The unit normals (k, 3) closest to `normals` whose planes through `points` (k, 3) have all `others`
    behind them.

    Projection onto the cone {n: n . (q - p) <= 0 for all q}, by non-negative least squares on its polar cone
    (Moreau). A point inside the others' hull has no such plane and keeps its normal.
    """
    found = normals.copy()
    for k, (point, normal) in enumerate(zip(points, normals, strict=True)):
        offset = others - point
        away = np.linalg.norm(offset, axis=1)
        # places nearer than the touches' own error say nothing about the direction
        toward = offset[away > 0.003] / away[away > 0.003, None]
        projected = normal - toward.T @ nnls(toward.T, normal)[0]
        length = np.linalg.norm(projected)
        if length > 0.5:
            found[k] = projected / length
    return found


def volume_bounds(evidence: Evidence) -> tuple[float, float]:
    """Volumes (m^3) of the hull of the touches and of the intersection of their tangent half-spaces (or
    nan)."""
    import trimesh

    low = float(trimesh.Trimesh(*hull_surface(evidence), process=False).volume)
    try:
        high = float(trimesh.Trimesh(*tangent_surface(evidence), process=False).volume)
    except SurfaceError:
        high = float("nan")
    return low, high


def gap_to_other_bound(evidence: Evidence, vertices: np.ndarray, which: str) -> np.ndarray:
    """(n,) m: half the distance to the other bound, as a standard deviation of a bound."""
    try:
        other = tangent_surface(evidence) if which == "hull" else hull_surface(evidence)
    except SurfaceError:
        return np.full(len(vertices), 0.002)
    return distance(*other, vertices) / 2


_ON_PLANE_M = 0.0005
_TOPS_AT_MOST = 5


@dataclass(frozen=True)
class Polyhedron:
    """Parameters: side_k_rad, side_k_m and tilt_k_rad of each wall (tilt inwards), then height, slope_x,
    slope_y of each top plane z = height + slope . (x, y)."""

    walls: int
    tops: int
    parameters: tuple[ShapeParameter, ...]
    name: str = "polyhedron"
    faceted: bool = True

    @property
    def complexity(self) -> int:
        return 2 + max(self.tops, 1)

    @classmethod
    def of(
        cls, outline: Outline, centres: np.ndarray, normals: np.ndarray, tip_radius_m: float
    ) -> Polyhedron | None:
        """A first guess over a polygon from touches (m, 3), or None where the touches show no such planes."""
        angles, offsets = sides(outline.vertices)
        tilts, free = [], np.ones(len(centres), dtype=bool)
        for angle, offset in zip(angles, offsets, strict=True):
            out = np.array([np.cos(angle), np.sin(angle)])
            flat = normals[:, :2] / np.maximum(np.linalg.norm(normals[:, :2], axis=1, keepdims=True), 1e-9)
            facing = (flat @ out > np.cos(np.radians(35))) & (normals[:, 2] < 0.8)
            tilt = (
                float(np.arcsin(np.clip(np.median(normals[facing, 2]), -0.3, 0.95))) if facing.any() else 0.0
            )
            for _ in range(8):
                gap = _wall_gap(centres, out, offset, tilt, tip_radius_m)
                near = facing & (np.abs(gap) < 0.003)
                if not near.any():
                    break
                slope = centres[near, 2] * np.cos(tilt) - (centres[near, :2] @ out - offset) * np.sin(tilt)
                tilt -= float(np.median(gap[near] / slope))
            free &= ~(facing & (np.abs(_wall_gap(centres, out, offset, tilt, tip_radius_m)) < _ON_PLANE_M))
            tilts.append(tilt)
        tops = _planes(centres[free], normals[free], tip_radius_m)
        if not tops and not (np.array(tilts) > 0.1).all():
            return None
        found = [ShapeParameter(f"side_{k + 1}_rad", float(a), 0.05) for k, a in enumerate(angles)]
        found += [ShapeParameter(f"side_{k + 1}_m", float(o), 0.005) for k, o in enumerate(offsets)]
        found += [ShapeParameter(f"tilt_{k + 1}_rad", t, 0.1, -0.3, 1.4) for k, t in enumerate(tilts)]
        for k, plane in enumerate(tops):
            found += [
                ShapeParameter(f"top_{k + 1}_height_m", float(plane[0]), 0.01),
                ShapeParameter(f"top_{k + 1}_slope_x", float(plane[1]), 0.2),
                ShapeParameter(f"top_{k + 1}_slope_y", float(plane[2]), 0.2),
            ]
        return cls(len(angles), len(tops), tuple(found))

    def with_values(self, values: np.ndarray) -> Polyhedron:
        return replace(self, parameters=with_values(self.parameters, values))

    def planes(self) -> np.ndarray:
        """(walls + tops, 4): unit outward normal and offset, normal . x - offset <= 0 inside."""
        values, n = values_of(self), self.walls
        angle, offset, tilt = values[:n], values[n : 2 * n], values[2 * n : 3 * n]
        wall = np.column_stack(
            [np.cos(tilt) * np.cos(angle), np.cos(tilt) * np.sin(angle), np.sin(tilt), offset * np.cos(tilt)]
        )
        top = values[3 * n :].reshape(-1, 3)
        length = np.sqrt(1 + top[:, 1] ** 2 + top[:, 2] ** 2)
        cover = np.column_stack([-top[:, 1], -top[:, 2], np.ones(len(top)), top[:, 0]]) / length[:, None]
        return np.vstack([wall, cover])

    def distance(self, points: np.ndarray) -> np.ndarray:
        planes = self.planes()
        found = points @ planes[:, :3].T - planes[:, 3]
        rows = np.arange(len(points))
        first = np.argmax(found, axis=1)
        one = found[rows, first]
        found[rows, first] = -np.inf
        second = np.argmax(found, axis=1)
        two = found[rows, second]
        cosine = np.einsum("ij,ij->i", planes[first, :3], planes[second, :3])
        # beyond an edge of two faces, the edge is nearest
        beyond = (two > one * cosine) & (two > 0) & (cosine < 0.999)
        square = np.maximum(1 - cosine**2, 1e-6)
        edge = np.sqrt(np.maximum(one**2 + two**2 - 2 * one * two * cosine, 0) / square)
        return np.where(beyond, edge, one)

    def mesh(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        planes = self.planes()
        around = planes[: self.walls]
        foot = around[:, :2] * (around[:, 3] / (around[:, :2] ** 2).sum(axis=1))[:, None]
        inside = np.array([*foot.mean(axis=0), 0.002])
        half = np.vstack([np.column_stack([planes[:, :3], -planes[:, 3]]), [0, 0, -1, 0]])
        try:
            corners = HalfspaceIntersection(half, inside).intersections
        except (QhullError, ValueError) as error:
            raise SurfaceError("the planes of the polyhedron do not close") from error
        corners = corners[np.isfinite(corners).all(axis=1) & (np.abs(corners).max(axis=1) < 1)]
        corners[np.abs(corners[:, 2]) < 1e-9, 2] = 0.0
        if len(corners) < 4 or ConvexHull(corners).volume < 1e-9:
            raise SurfaceError("the planes of the polyhedron do not close")
        return refine(*delaunay_hull(np.unique(corners.round(8), axis=0)), spacing_m)


def refine(vertices: np.ndarray, triangles: np.ndarray, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Split every edge longer than 4/3 of the spacing at its middle, until none is left; the surface stays
    closed."""
    for _ in range(12):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        long = np.linalg.norm(vertices[unique[:, 0]] - vertices[unique[:, 1]], axis=1) > 4 / 3 * spacing_m
        if not long.any():
            break
        number = np.full(len(unique), -1)
        number[long] = len(vertices) + np.arange(long.sum())
        vertices = np.vstack([vertices, vertices[unique[long]].mean(axis=1)])
        middle = number[inverse.reshape(-1, 3)]
        pieces = []
        for corners, mids in zip(triangles, middle, strict=True):
            pieces += _split(vertices, corners, mids)
        triangles = np.array(pieces)
    return vertices, triangles


def _split(vertices: np.ndarray, corners: np.ndarray, mids: np.ndarray) -> list[tuple[int, int, int]]:
    count = int((mids >= 0).sum())
    if count == 0:
        return [tuple(corners)]
    if count == 3:
        (a, b, c), (p, q, r) = corners, mids
        return [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
    # turn until edge ab is split, and with two splits bc as well
    turn = next(k for k in range(3) if mids[k] >= 0 and (count == 1 or mids[(k + 1) % 3] >= 0))
    a, b, c = np.roll(corners, -turn)
    p, q, _ = np.roll(mids, -turn)
    if count == 1:
        return [(a, p, c), (p, b, c)]
    if np.linalg.norm(vertices[a] - vertices[q]) < np.linalg.norm(vertices[p] - vertices[c]):
        return [(p, b, q), (a, p, q), (a, q, c)]
    return [(p, b, q), (a, p, c), (p, q, c)]


def _wall_gap(
    centres: np.ndarray, out: np.ndarray, offset: float, tilt: float, tip_radius_m: float
) -> np.ndarray:
    return (centres[:, :2] @ out - offset) * np.cos(tilt) + centres[:, 2] * np.sin(tilt) - tip_radius_m


def _planes(centres: np.ndarray, normals: np.ndarray, tip_radius_m: float) -> list[np.ndarray]:
    """(height, slope_x, slope_y) of planes on which several touches lie and as which they face (seeded
    RANSAC)."""
    rng = np.random.default_rng(0)
    left = np.arange(len(centres))
    found: list[np.ndarray] = []
    while len(left) >= 3 and len(found) < _TOPS_AT_MOST:
        best = left[:0]
        for _ in range(250):
            three = rng.choice(left, 3, replace=False)
            plane = _plane(centres[three])
            if plane is None or (normals[three] @ plane[:3]).min() < np.cos(np.radians(22)):
                continue
            off = np.abs(centres[left] @ plane[:3] - plane[3])
            same = left[(off < _ON_PLANE_M) & (normals[left] @ plane[:3] > np.cos(np.radians(30)))]
            if len(same) > len(best):
                best = same
        if len(best) < 4:
            break
        plane = _plane(centres[best])
        if plane is None:
            break
        a, b, c, offset = plane
        found.append(np.array([(offset - tip_radius_m) / c, -a / c, -b / c]))
        left = np.setdiff1d(left, best)
    return found


def _plane(points: np.ndarray) -> np.ndarray | None:
    """(4,): upward unit normal and offset of the plane through points; None where they are in a line or it
    stands."""
    middle = points.mean(axis=0)
    _, size, axes = np.linalg.svd(points - middle)
    if size[1] < 0.006 or abs(axes[2, 2]) < 0.25:
        return None
    normal = axes[2] * np.sign(axes[2, 2])
    return np.append(normal, normal @ middle)
