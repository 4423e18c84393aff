"""Shapes whose surface is known exactly: files of chords as a CAD program writes them, and the true distance.

Object frame: metres, standing on z = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.shape.nearest import sample
from palpate.scenes.phantoms import phantom, rectangle, resampled

Distance = Callable[[np.ndarray], np.ndarray]
CHORD_M = 1.8e-3
"""Of a fillet in the file; it lies inside the fillet by up to 0.034 mm."""
FILLET_M, HEIGHT_M = 0.012, 0.046
_BASE_M = 0.008
"""Of places over the support: a tip must get there."""


@dataclass(frozen=True)
class KnownShape:
    """vertices (n, 3) m, triangles (m, 3) outward: the file. distance: (k, 3) m to (k,) m, signed, positive
    outside: the truth. rims: (k, 3) points of sharp edges, none for a smooth shape."""

    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    distance: Distance
    rims: np.ndarray

    def normals(self, points: np.ndarray) -> np.ndarray:
        """(k, 3) outward at points (k, 3) near the surface."""
        step = 1e-5 * np.vstack([np.eye(3), -np.eye(3)])
        found = self.distance((points + step[:, None]).reshape(-1, 3)).reshape(6, -1)
        slope = (found[:3] - found[3:]).T
        return slope / np.linalg.norm(slope, axis=1, keepdims=True)

    def places(self, count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Points (count, 3) m on the true surface, spread by area, with their normals."""
        points = sample(self.vertices, self.triangles, 20 * count, seed)
        points = points[points[:, 2] > _BASE_M][: 3 * count]
        for _ in range(3):
            points = points - self.distance(points)[:, None] * self.normals(points)
        points = points[points[:, 2] > _BASE_M][:count]
        return points, self.normals(points)

    def rim_distance(self, points: np.ndarray) -> np.ndarray:
        """(k,) m to the nearest sharp edge, infinite where there is none."""
        return cKDTree(self.rims).query(points)[0] if len(self.rims) else np.full(len(points), np.inf)


def _cylinder() -> KnownShape:
    given = phantom("cylinder")

    def distance(p: np.ndarray) -> np.ndarray:
        return _extruded(np.hypot(p[:, 0], p[:, 1]) - 0.040, p[:, 2] - 0.080)

    turn = np.linspace(0, 2 * np.pi, 2000)
    rim = np.column_stack([0.04 * np.cos(turn), 0.04 * np.sin(turn), np.full(2000, 0.08)])
    return KnownShape("cylinder", given.vertices, given.faces, distance, rim)


def _block() -> KnownShape:
    given, half = phantom("block"), 0.0525

    def distance(p: np.ndarray) -> np.ndarray:
        q = np.abs(p[:, :2]) - half
        flat = np.hypot(*np.maximum(q, 0).T) + np.minimum(q.max(axis=1), 0)
        return _extruded(flat, p[:, 2] - 0.047)

    square = rectangle(2 * half, 2 * half)
    fine = resampled(np.vstack([square, square[:1]]), 1e-4)
    top = np.column_stack([fine, np.full(len(fine), 0.047)])
    walls = [np.column_stack([np.tile([[a * half, b * half]], (500, 1)), np.linspace(0, 0.047, 500)])
             for a in (-1, 1) for b in (-1, 1)]  # fmt: skip
    return KnownShape("block", given.vertices, given.faces, distance, np.vstack([top, *walls]))


def _dome() -> KnownShape:
    given = phantom("half-sphere")

    def distance(p: np.ndarray) -> np.ndarray:
        return np.linalg.norm(p - [0, 0, 0.055 - 0.060], axis=1) - 0.060

    return KnownShape("dome", given.vertices, given.faces, distance, np.zeros((0, 3)))


def _extruded(flat: np.ndarray, over: np.ndarray) -> np.ndarray:
    q = np.column_stack([flat, over])
    return np.hypot(*np.maximum(q, 0).T) + np.minimum(q.max(axis=1), 0)


@lru_cache(maxsize=1)
def _kidney_outline() -> tuple[np.ndarray, np.ndarray]:
    """(n, 2) m and outward normals (n, 2) of a smooth outline 112 mm long with a concave flank."""
    angle = np.linspace(0, 2 * np.pi, 40_000, endpoint=False)
    radius = 1 / np.sqrt((np.cos(angle) / 0.056) ** 2 + (np.sin(angle) / 0.040) ** 2)
    turn = np.angle(np.exp(1j * (angle + np.pi / 2)))
    radius = radius * (1 - 0.35 * np.exp(-((turn / 0.55) ** 2)))
    outline = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    along = np.roll(outline, -1, axis=0) - np.roll(outline, 1, axis=0)
    out = np.column_stack([along[:, 1], -along[:, 0]])
    return outline, out / np.linalg.norm(out, axis=1, keepdims=True)


def _kidney() -> KnownShape:
    outline, out = _kidney_outline()
    tree = cKDTree(outline)

    def flat(p: np.ndarray) -> np.ndarray:
        near = tree.query(p)[1]
        return np.einsum("ij,ij->i", p - outline[near], out[near])

    def distance(p: np.ndarray) -> np.ndarray:
        q = np.column_stack([flat(p[:, :2]), p[:, 2] - HEIGHT_M]) + FILLET_M
        return np.hypot(*np.maximum(q, 0).T) + np.minimum(q.max(axis=1), 0) - FILLET_M

    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1))])
    count = int(length[-1] / CHORD_M)
    pick = np.searchsorted(length, np.linspace(0, length[-1], count, endpoint=False))
    rim, facing = outline[pick], out[pick]
    turns = np.linspace(0, np.pi / 2, int(np.ceil(FILLET_M * np.pi / 2 / CHORD_M)) + 1)
    low = np.linspace(0, HEIGHT_M - FILLET_M, 12)[:-1]
    levels = [(np.zeros(len(rim)), z) for z in low]
    levels += [(np.full(len(rim), FILLET_M * (1 - np.cos(t))), HEIGHT_M - FILLET_M * (1 - np.sin(t)))
               for t in turns]  # fmt: skip
    rings = [np.column_stack([rim - inset[:, None] * facing, np.full(len(rim), z)]) for inset, z in levels]
    top = rings[-1][:, :2]
    middle = np.array([0.0, 0.006])
    for share in np.linspace(1, 0, 14)[1:-1]:
        rings.append(np.column_stack([middle + share * (top - middle), np.full(len(rim), HEIGHT_M)]))
    inner = [
        np.column_stack([middle + s * (rim - middle), np.zeros(len(rim))])
        for s in np.linspace(0, 1, 14)[1:-1]
    ]
    vertices, triangles = _closed(np.array([*inner, *rings]), [*middle, 0.0], [*middle, HEIGHT_M])
    return KnownShape("kidney", vertices, triangles, distance, np.zeros((0, 3)))


def _closed(rings: np.ndarray, bottom: list[float], top: list[float]) -> tuple[np.ndarray, np.ndarray]:
    k, n = rings.shape[:2]
    i, j = np.arange(n), (np.arange(n) + 1) % n
    faces = []
    for ring in range(k - 1):
        a, b = ring * n, (ring + 1) * n
        faces += [np.column_stack([a + i, a + j, b + j]), np.column_stack([a + i, b + j, b + i])]
    faces += [np.column_stack([np.full(n, k * n), j, i])]
    faces += [np.column_stack([(k - 1) * n + i, (k - 1) * n + j, np.full(n, k * n + 1)])]
    return np.vstack([rings.reshape(-1, 3), bottom, top]), np.vstack(faces)


SHAPES: dict[str, Callable[[], KnownShape]] = {
    "cylinder": _cylinder, "block": _block, "kidney": _kidney, "dome": _dome,
}  # fmt: skip
