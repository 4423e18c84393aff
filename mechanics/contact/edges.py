"""What the load patch misses of a touch beside a sharp rim and close above the base.

The patch of a touch (mechanics.compliance.sites) is a Gaussian that reaches round a rim, where no tip
presses, and is wider than a contact whose strain meets the base. Solved presses beside rims and above the
base say what compliance that puts in or leaves out, and how much harder a deep dent is above the base
(tools.dent_edge). It is laid on as Gaussians summed over the length of the rims and the area of the base, so
it is smooth from place to place, adds up where edges meet, and ends some patch widths away. What of the base
lies straight below counts most, by the cube of the cosine: what is beside a flank holds it less. However far
it lies, it comes nearer as the tip goes in: what it takes off a compliance grows as 1 / (h - depth) at height
h, so its bracing falls as 1 / h^2. All are numbers of a place: the force at it stays the slope of one energy.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.compliance.patch import usual_width
from palpate.mechanics.shape.nearest import distance, segments_cut, triangle_areas
from palpate.mechanics.shape.tetmesh import TetMesh

RIMS, BASE, INVERSE_SQUARE = 0, 1, 2
"""What a row of dent_edge.csv is: a Gaussian along rims, one over the base, or the base from afar."""
TURN_POWER = 3
"""Power of a rim's turn, over a right angle, with which it counts: solved for 60 and 90 degrees."""
_REACH, _STEP = 3.5, 0.5
"""Widths of a Gaussian beyond which it is left out (0.002); between its samples."""
_FOOT = 0.73
"""Patch widths, of the Gaussian along the base's outline by which a patch on a flank reaches over it."""
_PEAK = 1.4
"""Compliances of a half-space under a patch by which a patch on a straight rim of a right angle gives more
across it than two widths further in. Solved at 300 places beside the rims of a block, and of a wedge on two
meshes: 1.37 to 1.43, and 1.5 % of a half-space is lost between corners where 4.4 % were; along rims it is
0.3, by their bisector 0."""
_HALF_SPACE = 0.21  # over the patch's width, its compliance along the normal, unit modulus, nu 0.49
_FAR, _BRACED, _CURVED = 1.8, 0.07, 0.6
"""Shares of a force that a compliance, a bracing and a curvature of 1 over the patch's width are worth."""
_ON_BASE = 0.2
"""Patch widths from the base within which a crease is the base's outline, no rim."""
_AT_ONCE, _FEW = 1000, 64
_NOWHERE = 1e-18  # m^2 from a piece of the base within which a place lies on it


class EdgeLaw(NamedTuple):
    """far: (k, 3, 3) 1/m, to add to the far field, unit modulus, along the normals alone. bracing: (k,) 1/m,
    to add to the mean curvature by which a deep dent departs from Hertz (mechanics.contact.dent.bend_of), of
    rims; braced: (k,) 1/m, the same of the base at finite strain (DentLaw.braced), which makes a dent harder,
    the more the deeper. curvature: (k,) 1/m, to add to the surface's, by which a rim cuts a contact off."""

    far: np.ndarray
    bracing: np.ndarray
    braced: np.ndarray
    curvature: np.ndarray


def edge_law(mesh: TetMesh, points: np.ndarray, normals: np.ndarray) -> EdgeLaw:
    """At places (k, 3) m with unit normals (k, 3). The base counts on every mesh, rims where its shape is
    known."""
    _, over, *fits = fitted()
    amount, bracing, curvature = np.stack(fits)
    near = laid(mesh, points, normals) / usual_width(mesh)
    rims = over == RIMS
    return EdgeLaw(
        (near @ amount)[:, None, None] * normals[:, :, None] * normals[:, None, :],
        near[:, rims] @ bracing[rims], near[:, ~rims] @ bracing[~rims], near @ curvature,
    )  # fmt: skip


def nearness(mesh: TetMesh, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(k,) how near places (k, 3) are to a rim, by the first Gaussian, and to the base; 0 far away, 1 on a
    straight rim of a right angle."""
    over = fitted()[1]
    near = laid(mesh, points, normals)
    return near[:, np.argmax(over == RIMS)], near[:, np.argmax(over == BASE)]


def foot_within(mesh: TetMesh, points: np.ndarray) -> np.ndarray:
    """(k,) how much of the patch of places (k, 3) would lie below the base's outline, by one Gaussian: 1 on
    a straight outline, 0 far away."""
    triangles, sigma = _base_triangles(mesh), _FOOT * usual_width(mesh)
    pairs = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    ends, count = np.unique(pairs, axis=0, return_counts=True)
    a, b = mesh.points[ends[count == 1].T]
    middles, length, _ = segments_cut(a, b, _STEP * sigma)
    return _summed(points, middles, length / (np.sqrt(2 * np.pi) * sigma), sigma)


def ends_within(mesh: TetMesh, points: np.ndarray, width_m: float) -> np.ndarray:
    """(k,) how many rims come within a patch of that width, m, of places (k, 3), by one Gaussian: 1 on
    a straight rim of a right angle, 3 on a block's corner, 0 far away."""
    samples, length, _ = _rims(mesh, _STEP * width_m)
    return _summed(points, samples, length / (np.sqrt(2 * np.pi) * width_m), width_m)


def peaks(mesh: TetMesh, points: np.ndarray, width_m: float) -> np.ndarray:
    """(k, 3, 3) how much more places (k, 3) give across the rims within a patch of that width than places
    further in, over a half-space's compliance under it: a Gaussian as wide as the patch."""
    samples, length, across = _rims(mesh, _STEP * width_m)
    weight = _PEAK / (np.sqrt(2 * np.pi) * width_m) * length[:, None]
    rows, columns = np.triu_indices(3)
    six = [
        _summed(points, samples, each, width_m) for each in (weight * across[:, rows] * across[:, columns]).T
    ]
    tensor = np.empty((len(points), 3, 3))
    tensor[:, rows, columns] = tensor[:, columns, rows] = np.stack(six, axis=1)
    return tensor


def softer(mesh: TetMesh, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(k,) share by which rims and the base right below lower the force at places (k, 3) with unit normals
    (k, 3): roughly, to tell where neighbours differ. Of a tip 1.25 patches wide, 0.3 radii deep."""
    far = _HALF_SPACE * np.einsum("ka,kab,kb->k", normals, peaks(mesh, points, usual_width(mesh)), normals)
    share = _FAR * far
    for row in zip(*fitted(), strict=True):
        if row[1] != INVERSE_SQUARE:  # even
            share += (np.array([_FAR, -_BRACED, _CURVED]) @ row[2:]) * _one(mesh, points, normals, *row[:2])
    return share


def laid(mesh: TetMesh, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(k, g) what each comes to at places (k, 3): a Gaussian 1 on a straight rim that turns by a right angle,
    and, but for the cube of the cosine, on a plane base; the inverse square (s / h)^2 at a great height h
    above a wide one."""
    widths, over, *_ = fitted()
    return np.stack([_one(mesh, points, normals, *row) for row in zip(widths, over, strict=True)], axis=1)


def _one(mesh: TetMesh, points: np.ndarray, normals: np.ndarray, width: float, kind: float) -> np.ndarray:
    """(k,) of `laid`, a row of dent_edge.csv."""
    s = width * usual_width(mesh)
    if kind == INVERSE_SQUARE:
        return _from_afar(points, normals, *_base(mesh, _STEP * s), s)
    if kind == BASE:
        middles, area = _base(mesh, _STEP * s)
        return _summed(points, middles, area / (2 * np.pi * s**2), s, normals)
    return ends_within(mesh, points, s)


@lru_cache(maxsize=1)
def fitted() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(g,) widths over the patch's; RIMS, BASE or INVERSE_SQUARE of the base; their amounts: compliance times
    the patch's width and the modulus; bracing and curvature times the patch's width."""
    table = np.loadtxt(Path(__file__).with_name("dent_edge.csv"), delimiter=",", ndmin=2)
    widths, over, amount, bracing, curvature = table.T
    return widths, over, amount, bracing, curvature


def _from_afar(
    points: np.ndarray, normals: np.ndarray, middles: np.ndarray, area: np.ndarray, width_m: float
) -> np.ndarray:
    """(k,) of pieces of the base (s, 3) m, (s,) m^2, by the fourth power of their distance to points (k, 3)
    from width_m on, and by the cube of the cosine."""
    # products of matrices: every renderer of an object begins with its 30,000 places times 2,000 pieces
    total, middle = np.zeros(len(points)), middles.mean(axis=0) if len(middles) else 0.0
    points, middles = points - middle, middles - middle
    length, way = np.einsum("sx,sx->s", middles, middles), np.ascontiguousarray(middles.T)
    for start in range(0, len(points), _FEW):
        p, n = points[start : start + _FEW], normals[start : start + _FEW]
        square = np.einsum("kx,kx->k", p, p)[:, None] + length - 2 * (p @ way)
        np.maximum(square, _NOWHERE, out=square)
        below = np.maximum(np.einsum("kx,kx->k", p, n)[:, None] - n @ way, 0.0)
        each = below * below
        each *= below
        each /= np.sqrt(square)
        each /= square
        square += width_m**2
        square *= square
        each /= square
        total[start : start + _FEW] = each @ area
    return 5 / (2 * np.pi) * width_m**2 * total


def _summed(
    points: np.ndarray,
    samples: np.ndarray,
    weight: np.ndarray,
    sigma: float,
    normals: np.ndarray | None = None,
) -> np.ndarray:
    """(k,) sums over samples (s, 3) of their weight (s,) times a Gaussian of their distance to each point;
    times the cube of the cosine of how far below they lie where the points' normals (k, 3) are given."""
    total = np.zeros(len(points))
    if not len(samples) or not len(points):
        return total
    tree = cKDTree(samples)
    near = np.flatnonzero(tree.query(points, distance_upper_bound=_REACH * sigma)[0] < np.inf)
    for start in range(0, len(near), _AT_ONCE):
        some = near[start : start + _AT_ONCE]
        pairs = cKDTree(points[some]).sparse_distance_matrix(tree, _REACH * sigma, output_type="ndarray")
        i, j, away = pairs["i"], pairs["j"], pairs["v"]
        each = weight[j] * np.exp(-((away / sigma) ** 2) / 2)
        if normals is not None:
            below = np.einsum("kx,kx->k", points[some][i] - samples[j], normals[some][i])
            each *= np.maximum(below / np.maximum(away, 1e-300), 0.0) ** 3
        total[some] = np.bincount(i, each, len(some))
    return total


def _rims(mesh: TetMesh, step_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles (s, 3) m of pieces of the convex rims above the base; their lengths (s,) m, by their turn; and
    the ways (s, 3) across them."""
    if mesh.shape is None:
        return np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3))
    samples, length, turn, across = mesh.shape.creases_cut(step_m)
    rim, base = turn > 0, _base_triangles(mesh)
    if rim.any() and len(base):
        rim &= distance(mesh.points, base, samples) > _ON_BASE * usual_width(mesh)
    return samples[rim], length[rim] * (turn[rim] / (np.pi / 2)) ** TURN_POWER, across[rim]


def _base_triangles(mesh: TetMesh) -> np.ndarray:
    corners = mesh.surface[:, :3]
    return corners[mesh.fixed[corners].all(axis=1)]


def _base(mesh: TetMesh, step_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Middles (s, 3) m of the small triangles that the base is cut into, and their areas (s,) m^2."""
    triangles = _base_triangles(mesh)
    p, area = mesh.points[triangles], triangle_areas(mesh.points, triangles)
    longest = np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2).max(axis=1, initial=0.0)
    parts = np.maximum(np.ceil(longest / step_m).astype(int), 1)
    middles, areas = [np.zeros((0, 3))], [np.zeros(0)]
    for count in np.unique(parts):
        own = parts == count
        i, j = np.divmod(np.arange(count**2), count)
        upper = np.column_stack([i, j])[i + j < count] + 1 / 3
        lower = np.column_stack([i, j])[i + j < count - 1] + 2 / 3
        u, v = np.vstack([upper, lower]).T / count
        weights = np.column_stack([1 - u - v, u, v])
        middles.append(np.einsum("qc,tcx->tqx", weights, p[own]).reshape(-1, 3))
        areas.append(np.repeat(area[own] / count**2, count**2))
    return np.concatenate(middles), np.concatenate(areas)
