"""Planes through points, the samples of a path that lie in one, and points spread along it.

The base's outline in the plane of the support: circle, polygon with straight sides, or a smooth closed
curve.

The tip was leaned into the object's foot while tracing, so an outline is known up to an inward bias, which
the fits of `reconstruct.shapes.fit` estimate from the touches.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import map_coordinates, spline_filter

from palpate.mechanics.statistics import biweight

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


def farthest_points(points: np.ndarray, spacing_m: float) -> np.ndarray:
    """Indices of a farthest-point sample: added until no point is further than `spacing_m` from the
    sample."""
    chosen = [0]
    distance = np.linalg.norm(points - points[0], axis=1)
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


_SIDES_AT_MOST = 8
_STRAIGHT_M = 0.00035
_SHORTEST_SIDE_M = 0.009


@dataclass(frozen=True)
class Outline:
    """A closed curve seen whole from its centre; support frame, m.

    kind: 'circle', 'polygon' or 'curve'. vertices: (n, 2), counter-clockwise, not closed (corners of a
    polygon, dense points of the others). centre: (2,), a point from which every vertex is seen.
    """

    kind: str
    vertices: np.ndarray
    centre: np.ndarray

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance (k,) of points (k, 2), negative inside."""
        if self.kind == "polygon":
            return polyline_distance(points, self.vertices)
        if self.kind == "circle":
            return np.linalg.norm(points - self.centre, axis=1) - np.linalg.norm(
                self.vertices[0] - self.centre
            )
        return self._distance_map(points)

    @cached_property
    def _distance_map(self) -> Callable[[np.ndarray], np.ndarray]:
        """The distance on a grid, splined: a curve of many short pieces is asked some hundred thousand
        times."""
        step, margin = 0.002, 0.012
        low = self.vertices.min(axis=0) - margin
        count = np.ceil((self.vertices.max(axis=0) + margin - low) / step).astype(int) + 1
        axes = [low[k] + step * np.arange(count[k]) for k in (0, 1)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
        table = np.concatenate([polyline_distance(g, self.vertices) for g in np.array_split(grid, 16)])
        spline = spline_filter(table.reshape(count), order=3)

        def interpolated(points: np.ndarray) -> np.ndarray:
            inside = np.clip(points, low, low + step * (count - 1))
            found = map_coordinates(
                spline, ((inside - low) / step).T, order=3, prefilter=False, mode="nearest"
            )
            return found + np.linalg.norm(points - inside, axis=1)

        return interpolated

    def ring(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, 2) along the outline about `spacing_m` apart, corners kept, and outward unit normals (n,
        2)."""
        ends = np.roll(self.vertices, -1, axis=0)
        if self.kind == "polygon":
            pieces = []
            for a, b in zip(self.vertices, ends, strict=True):
                count = max(1, int(np.ceil(np.linalg.norm(b - a) / spacing_m)))
                pieces.append(a + (b - a) * np.arange(count)[:, None] / count)
            points = np.vstack(pieces)
        else:
            step = np.linalg.norm(ends - self.vertices, axis=1)
            length = np.concatenate([[0.0], np.cumsum(step)])
            closed = np.vstack([self.vertices, self.vertices[:1]])
            at = np.linspace(0, length[-1], max(24, int(np.ceil(length[-1] / spacing_m))), endpoint=False)
            points = np.column_stack([np.interp(at, length, closed[:, k]) for k in (0, 1)])
        tangent = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        return points, np.column_stack([tangent[:, 1], -tangent[:, 0]])

    def radius(self, points: np.ndarray) -> np.ndarray:
        """(k,) distance from the centre to the outline in the direction of each of points (k, 2)."""
        rim = self.ring(0.0015)[0] - self.centre
        angle = np.arctan2(rim[:, 1], rim[:, 0])
        order = np.argsort(angle)
        offset = points - self.centre
        asked = np.arctan2(offset[:, 1], offset[:, 0])
        return np.interp(asked, angle[order], np.linalg.norm(rim, axis=1)[order], period=2 * np.pi)

    def grown(self, by_m: float) -> Outline:
        """The outline moved outward by `by_m` along its normals."""
        following, before = np.roll(self.vertices, -1, axis=0), np.roll(self.vertices, 1, axis=0)
        if self.kind != "polygon":
            tangent = following - before
            tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
            outward = np.column_stack([tangent[:, 1], -tangent[:, 0]])
            return Outline(self.kind, self.vertices + by_m * outward, self.centre)
        angles, offsets = sides(self.vertices)
        return Outline("polygon", corners(angles, offsets + by_m), self.centre)


def polyline_distance(points: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Signed distance (k,) of points (k, 2) from the closed polygon (n, 2), negative inside."""
    a, b = vertices, np.roll(vertices, -1, axis=0)
    edge = b - a
    offset = points[:, None] - a
    along = np.clip((offset * edge).sum(axis=2) / np.maximum((edge**2).sum(axis=1), 1e-18), 0, 1)
    nearest = np.sqrt(((offset - along[..., None] * edge) ** 2).sum(axis=2)).min(axis=1)
    y = points[:, None, 1]
    crosses = (a[:, 1] > y) != (b[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = a[:, 0] + (y - a[:, 1]) / edge[:, 1] * edge[:, 0]
    inside = (crosses & (points[:, None, 0] < at)).sum(axis=1) % 2 == 1
    return np.where(inside, -nearest, nearest)


def sides(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outward angle (rad) and distance from the origin of each side of a counter-clockwise polygon."""
    edge = np.roll(vertices, -1, axis=0) - vertices
    angle = np.arctan2(-edge[:, 0], edge[:, 1])
    return angle, vertices[:, 0] * np.cos(angle) + vertices[:, 1] * np.sin(angle)


def corners(angles: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Vertices of the polygon whose side k has outward angle `angles[k]` at `offsets[k]`; inverse of
    `sides`."""
    before, before_offset = np.roll(angles, 1), np.roll(offsets, 1)
    turn = np.sin(angles - before)
    turn = np.where(np.abs(turn) < 1e-3, np.copysign(1e-3, turn), turn)
    x = (before_offset * np.sin(angles) - offsets * np.sin(before)) / turn
    y = (offsets * np.cos(before) - before_offset * np.cos(angles)) / turn
    return np.column_stack([x, y])


def seeing_centre(rim: np.ndarray, outward: np.ndarray) -> tuple[np.ndarray, float]:
    """A point that sees the whole rim (k, 2) best, and the least cosine at which it does (negative: not
    star-shaped)."""
    low, high = rim.min(axis=0), rim.max(axis=0)
    grid = np.stack(
        np.meshgrid(*(np.linspace(a, b, 25) for a, b in zip(low, high, strict=True))), -1
    ).reshape(-1, 2)
    grid = np.vstack([rim.mean(axis=0), (low + high) / 2, grid])
    offset = rim - grid[:, None]
    cosine = (offset * outward).sum(axis=2) / np.maximum(np.linalg.norm(offset, axis=2), 1e-9)
    # a few per cent of the rim may look away: the tracing is noisy
    score = np.percentile(cosine, 4, axis=1)
    enough = score > 0.9 * score.max()
    middle = np.linalg.norm(grid - (low + high) / 2, axis=1)
    best = int(np.argmin(np.where(enough, middle, np.inf))) if score.max() > 0 else int(np.argmax(score))
    return grid[best], float(score[best])


def smooth_curve(rim: np.ndarray, centre: np.ndarray, count: int = 180) -> Outline:
    """Closed curve through overlapping, noisy rim points (k, 2): radius over angle with a curvature
    penalty."""
    offset = rim - centre
    radius = np.linalg.norm(offset, axis=1)
    place = np.arctan2(offset[:, 1], offset[:, 0]) / (2 * np.pi) * count % count
    left = np.floor(place).astype(int) % count
    share = place - np.floor(place)
    bend = 2 * np.eye(count) - np.roll(np.eye(count), 1, axis=0) - np.roll(np.eye(count), -1, axis=0)
    design = np.zeros((len(rim), count))
    design[np.arange(len(rim)), left] = 1 - share
    design[np.arange(len(rim)), (left + 1) % count] += share
    weight = np.ones(len(rim))
    for _ in range(4):
        found = np.linalg.solve(
            (design.T * weight) @ design + 3.0 * bend.T @ bend, (design.T * weight) @ radius
        )
        miss = np.abs(design @ found - radius)
        weight = 1 / np.maximum(1.0, miss / 0.0004)
    angle = 2 * np.pi * np.arange(count) / count
    return Outline("curve", centre + found[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]), centre)


def circle(rim: np.ndarray, count: int = 180) -> Outline:
    """The circle of least squares through rim points (k, 2)."""
    design = np.column_stack([2 * rim, np.ones(len(rim))])
    x, y, c = np.linalg.lstsq(design, (rim**2).sum(axis=1), rcond=None)[0]
    angle = 2 * np.pi * np.arange(count) / count
    radius = np.sqrt(c + x * x + y * y)
    centre = np.array([x, y])
    return Outline("circle", centre + radius * np.column_stack([np.cos(angle), np.sin(angle)]), centre)


def polygon(curve: Outline, rim: np.ndarray) -> Outline | None:
    """Straight sides, where nearly all of the rim (k, 2) lies on at most eight of them; else None.

    Neighbouring pieces of the rim are joined as long as one line explains both.
    """
    offset = rim - curve.centre
    order = np.argsort(np.arctan2(offset[:, 1], offset[:, 0]))
    points = rim[order]
    pieces = [points[i] for i in np.array_split(np.arange(len(points)), min(48, len(points) // 4))]

    def misfit(group: np.ndarray) -> float:
        return float(np.linalg.svd(group - group.mean(axis=0), compute_uv=False)[1] / np.sqrt(len(group)))

    while len(pieces) > 2:
        joined = [misfit(np.vstack([pieces[i - 1], pieces[i]])) for i in range(len(pieces))]
        i = int(np.argmin(joined))
        if joined[i] > _STRAIGHT_M:
            break
        merged = np.vstack([pieces[i - 1], pieces[i]])
        pieces = [*pieces[:-1], merged][1:] if i == 0 else [*pieces[: i - 1], merged, *pieces[i + 1 :]]
    length = [float(np.ptp(p @ np.linalg.svd(p - p.mean(axis=0))[2][0])) for p in pieces]
    kept = [p for p, size in zip(pieces, length, strict=True) if size > _SHORTEST_SIDE_M]
    if not 3 <= len(kept) <= _SIDES_AT_MOST or sum(map(len, kept)) < 0.85 * len(points):
        return None
    angles, offsets = [], []
    for piece in kept:
        middle = np.median(piece, axis=0)
        normal = np.linalg.svd(piece - piece.mean(axis=0))[2][1]
        inside = curve.distance(np.array([middle + 0.003 * normal, middle - 0.003 * normal]))
        normal = normal if inside[0] > inside[1] else -normal
        angles.append(np.arctan2(normal[1], normal[0]))
        offsets.append(float(np.median(piece @ normal)))
    found = corners(np.array(angles), np.array(offsets))
    if not np.isfinite(found).all() or np.abs(found - curve.centre).max() > 2 * np.abs(offset).max():
        return None
    return Outline("polygon", found, curve.centre)
