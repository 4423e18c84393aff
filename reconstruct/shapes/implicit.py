"""Any shape, convex or not: a signed distance interpolated from the touches and the base's rim (radial basis
functions), and its zero level. Knows of no edges; for outlines that no point sees whole."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from palpate.mechanics.errors import SurfaceError
from palpate.mechanics.shape.nearest import distance
from palpate.reconstruction.shapes.fit import LEAN_M, Evidence, ShapeEvidence
from palpate.reconstruction.shapes.outline import farthest_points

_OFF_M = 0.004
_RIM_SPACING_M = 0.005
_SMOOTHING = 1e-6
_FOLDS = 5
_PER_DISTANCE = 0.12


def implicit_surface(
    evidence: Evidence, spacing_m: float = 0.003, left_out: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and outward triangles (m, 3) in the support frame, base on z = 0.

    The function is one tip radius at each tip's centre, zero on the surface below it, negative further in;
    likewise across the base's rim. Biharmonic basis |x|, which bends least in the mean. left_out: (m,) bool,
    touches not used.
    Raises SurfaceError where the zero level is empty.
    """
    import pyvista

    used = slice(None) if left_out is None else ~left_out
    centres = evidence.to_support(evidence.centres)[used]
    normals = (evidence.normals @ evidence.axes.T)[used]
    radius = evidence.tip_radius_m
    rim = evidence.to_support(evidence.outline)
    traced = evidence.to_support(evidence.outline_centres)
    kept = farthest_points(rim, _RIM_SPACING_M)
    rim, traced = rim[kept], traced[kept]
    outward = traced[:, :2] - rim[:, :2]
    outward = np.column_stack([outward / np.linalg.norm(outward, axis=1, keepdims=True), np.zeros(len(rim))])
    rim = rim * [1, 1, 0] + LEAN_M * outward
    places = np.vstack(
        [
            centres,
            centres - radius * normals,
            centres - (radius + _OFF_M) * normals,
            rim,
            rim + _OFF_M * outward,
            rim - _OFF_M * outward,
        ]
    )
    k, r = len(centres), len(rim)
    values = np.concatenate([np.full(k, radius), np.zeros(k), np.full(k, -_OFF_M), np.zeros(r)])
    values = np.concatenate([values, np.full(r, _OFF_M), np.full(r, -_OFF_M)])
    # two touches at one place would make the system singular
    apart = _apart(places, 0.0008)
    field = RBFInterpolator(places[apart], values[apart], kernel="linear", degree=1, smoothing=_SMOOTHING)
    low, high = places.min(axis=0) - 0.004, places.max(axis=0) + 0.004
    count = np.ceil((high - low) / spacing_m).astype(int) + 1
    count[2] = int(np.ceil(high[2] / spacing_m)) + 1
    grid = pyvista.ImageData(
        dimensions=tuple(count + [0, 0, 1]), spacing=(spacing_m,) * 3, origin=(low[0], low[1], -spacing_m)
    )
    at = np.asarray(grid.points)
    level = np.full(len(at), spacing_m)
    above = at[:, 2] > -0.5 * spacing_m
    level[above] = np.concatenate([field(part) for part in np.array_split(at[above], 8)])
    level[above & (at[:, 2] < 0.5 * spacing_m) & (level >= 0)] = np.maximum(spacing_m, 1e-4)
    grid["level"] = level
    found = grid.contour([0.0], scalars="level").extract_largest()
    if found.n_points < 10:
        raise SurfaceError("the touches enclose nothing: touch more places all round the object")
    found = found.extract_surface(algorithm="dataset_surface").triangulate().clean()
    points, faces = np.asarray(found.points, dtype=float), found.regular_faces
    # the lowest layer of cells closes the object: it is put on the support
    points[points[:, 2] < 1e-9, 2] = 0.0
    corner = points[faces]
    volume = np.einsum("ij,ij->i", np.cross(corner[:, 0], corner[:, 1]), corner[:, 2]).sum()
    return points, faces if volume > 0 else faces[:, ::-1]


def implicit_held_out(evidence: Evidence, seen: ShapeEvidence) -> float:
    """Root mean square error (m) of touches in places left out, a fifth of the places at a time."""
    misses = []
    for fold in range(_FOLDS):
        left_out = seen.sites % _FOLDS == fold
        if left_out.any() and not left_out.all():
            shell = implicit_surface(evidence, 0.006, left_out)
            misses.append(distance(*shell, seen.centres[left_out]) - seen.tip_radius_m)
    if not misses:
        return float("inf")  # all touches at one place: nothing can be left out
    return float(np.sqrt(np.mean(np.concatenate(misses) ** 2)))


def implicit_deviation(evidence: Evidence, vertices: np.ndarray) -> np.ndarray:
    """(n,) m: grows with the distance from the nearest touch or rim point; a rule of thumb measured on known
    shapes."""
    known = np.vstack([evidence.to_support(evidence.points), evidence.to_support(evidence.outline)])
    return 0.0002 + _PER_DISTANCE * cKDTree(known).query(vertices)[0]


def _apart(points: np.ndarray, reach_m: float) -> np.ndarray:
    """(k,) numbers of points of which no earlier one lies closer than `reach_m`."""
    kept = np.ones(len(points), dtype=bool)
    for a, b in sorted(cKDTree(points).query_pairs(reach_m)):
        if kept[a]:
            kept[b] = False
    return np.flatnonzero(kept)
