"""The paper's three samples in their true shapes: meshes, and ten places on each to press.

Object frame: the base in z = 0, its centre at the origin.
"""

from __future__ import annotations

import contextlib

import numpy as np

from palpate.mechanics.errors import MeshError
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.reconstruction.steps.s5_mesh.tetwild import tetrahedralize

# sample: rows of (azimuth or x in degrees or mm, height or y in mm, which face)
PLACES = {
    "cylinder": [(10, 15, "side"), (70, 25, "side"), (130, 35, "side"), (190, 45, "side"), (250, 55, "side")]
    + [(310, 65, "side"), (0, 0, "top"), (40, 12, "top"), (160, 20, "top"), (280, 27, "top")],
    "block": [(0, 0, "top"), (20, 10, "top"), (-30, 15, "top"), (38, -38, "top"), (-42, 5, "top")]
    + [(0, 15, "side"), (20, 23, "side"), (-30, 30, "side"), (35, 20, "side"), (-10, 36, "side")],
    "half-sphere": [
        (36 * k, angle, "cap") for k, angle in enumerate((5, 15, 25, 35, 45, 52, 60, 66, 70, 74))
    ],
}
_SPHERE, _CUT = 0.060, 0.055


def sample_places(sample: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(points (10, 3) m, outward normals (10, 3), mean curvature (10,) 1/m)."""
    points, normals, bent = [], [], []
    for a, b, face in PLACES[sample]:
        angle = np.radians(a)
        around = np.array([np.cos(angle), np.sin(angle), 0.0])
        if sample == "cylinder":
            side = face == "side"
            normals.append(around if side else np.array([0, 0, 1.0]))
            points.append(0.04 * around + [0, 0, 1e-3 * b] if side else 1e-3 * b * around + [0, 0, 0.08])
            bent.append(0.5 / 0.04 if side else 0.0)
        elif sample == "block":
            side = face == "side"
            normals.append(np.array([0, -1.0, 0]) if side else np.array([0, 0, 1.0]))
            points.append(1e-3 * np.array([a, -52.5, b]) if side else 1e-3 * np.array([a, b, 47.0]))
            bent.append(0.0)
        else:
            polar = np.radians(b)
            normal = np.sin(polar) * around + [0, 0, np.cos(polar)]
            normals.append(normal)
            points.append(_SPHERE * normal + [0, 0, _CUT - _SPHERE])
            bent.append(1 / _SPHERE)
    return np.array(points), np.array(normals), np.array(bent)


def sample_mesh(sample: str, size_m: float) -> TetMesh:
    """A fresh tetrahedral mesh of that edge length; meshing is not deterministic."""
    for _ in range(4):
        with contextlib.suppress(MeshError):  # a flat tetrahedron now and then
            return _meshed(sample, size_m)
    return _meshed(sample, size_m)


def _meshed(sample: str, size_m: float) -> TetMesh:
    points, triangles = _surface(sample)
    nodes, tets = tetrahedralize(points, triangles, edge_m=size_m, envelope_m=1.5e-4)
    nodes = np.array(nodes, dtype=float)
    fixed = nodes[:, 2] < 2e-4
    nodes[fixed, 2] = 0.0
    nobody = np.zeros(len(nodes), dtype=bool)
    bare = TetMesh(nodes, tets, fixed, nobody)
    touchable = nobody.copy()
    touchable[np.unique(bare.surface)] = True
    return TetMesh(nodes, tets, fixed, touchable & ~fixed)


def _surface(sample: str) -> tuple[np.ndarray, np.ndarray]:
    if sample == "block":
        half = 0.0525
        corners = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (0, 0.047)])
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    if sample == "cylinder":
        profile = [(0.04, 0.08), (0.04, 0.0)]
    else:
        lowest = np.arccos((_SPHERE - _CUT) / _SPHERE)
        angles = np.linspace(0, lowest, 40)[1:]
        profile = [(_SPHERE * np.sin(t), _CUT - _SPHERE + _SPHERE * np.cos(t)) for t in angles]
        profile[-1] = (profile[-1][0], 0.0)
    return _revolved(profile, top=0.08 if sample == "cylinder" else _CUT)


def _revolved(
    profile: list[tuple[float, float]], top: float, count: int = 96
) -> tuple[np.ndarray, np.ndarray]:
    """A closed surface of revolution from rings (radius, height), highest first; caps at `top` and at 0."""
    angle = 2 * np.pi * np.arange(count) / count
    rings = [np.stack([r * np.cos(angle), r * np.sin(angle), np.full(count, z)], axis=1) for r, z in profile]
    points = np.vstack([[[0, 0, top]], *rings, [[0, 0, 0]]])
    here = np.arange(count)
    after = (here + 1) % count
    triangles = [np.stack([np.zeros(count, dtype=int), 1 + here, 1 + after], axis=1)]
    for ring in range(len(profile) - 1):
        a, b = 1 + ring * count, 1 + (ring + 1) * count
        triangles.append(np.stack([a + here, b + here, b + after], axis=1))
        triangles.append(np.stack([a + here, b + after, a + after], axis=1))
    last = 1 + (len(profile) - 1) * count
    bottom = np.full(count, len(points) - 1)
    triangles.append(np.stack([last + here, bottom, last + after], axis=1))
    return points, np.vstack(triangles)
