"""The contact surface put onto the shape that the mesh fills.

A mesh of 10 mm cuts a fillet of 12 mm by a millimetre, and another mesh cuts it elsewhere. Where the shape is
known, each vertex of the contact surface lies on it, those of creases on its creases; triangles between them
are so small, where it bends, that they leave it by some micrometres, and lie on it in the mean. Beside sharp
rims the contact normal turns; concave creases are rounded.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from palpate.mechanics.contact.edges import softer
from palpate.mechanics.frames import unit_vectors
from palpate.mechanics.shape.nearest import facings, triangle_areas
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.render.surface.triangles import cut, cut_beside, edges_of

SAG_M = 8e-6
"""Between the middle of a fine edge and the shape: what is more is halved."""
EDGE_ROUNDING_M, NORMAL_SMOOTHING_M = 2.2e-3, 2.5e-3
"""Widths of the Gaussians by which a crease is rounded, and its contact normal turned. With 1.5 mm a tip that
slides by friction over a rim whose shape is not known stepped by 2.4 % of its force."""
_HOLLOW_ROUNDING_M = 1.5e-3
"""The first of the concave creases of a known shape, whose sharp rims are not rounded."""
RIM_STRIP_M, _STRIP_IN_RADII = 2e-3, 0.4
"""Width of the strip on either side of a sharp rim over which the contact normal turns. With 1.5 mm a ball of
5 mm that slides over the rim without friction steps; with 2.5 mm places 2 mm beside it are 4 % too stiff. A
smaller tip's is as many of its radii: of 2 mm, a tip of 1 mm felt 0.7 mm beside a rim half of the force."""
EASED_AGREEMENT = (0.99, 0.93)
"""Mean of the unit normals around a vertex above which nothing is eased, and below which all of it is."""
_CREASE_SPACING_M = 1e-4
_HOLLOW_REACH_M = 3 * NORMAL_SMOOTHING_M
_REACH = 0.75  # fine edges from which a vertex is drawn onto a crease that its triangle crosses
_CROSSES = np.cos(np.radians(25))
_ROUNDS, _HALVINGS = 4, 3
_BULGE = 0.1  # of an edge: what the middle of one that ends on a round rim may be moved by
_UNEVEN = 0.01
"""Of the force: what is left out between the ends of a fine edge. With edges of 2 to 5 mm a cone 7 mm above
its base was 3.5 % too hard, and two meshes of an L-profile 4 % apart."""
_NO_AREA = 1e-5  # of a fine edge squared, twice the area of a triangle that has none
_ALIKE = 0.8
_MEAN_GAP = 0.75  # of a triangle's gap to a round surface, over that at its middle


def rim_strip(tip_radius_m: float) -> float:
    """m, the strip's width for a tip."""
    return min(RIM_STRIP_M, _STRIP_IN_RADII * tip_radius_m)


class Feet:
    """Vertices on a shape, each looked for once while more are added behind them."""

    def __init__(self, shape: TrueShape) -> None:
        self.shape = shape
        self._placed, self._normals = np.zeros((0, 3)), np.zeros((0, 3))
        self._known = np.zeros(0, dtype=bool)

    def __call__(self, vertices: np.ndarray, used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(v, 3) m vertices of which those `used` (k,) are put onto the shape, and (v, 3) normals there, zero
        elsewhere."""
        more = len(vertices) - len(self._known)
        self._placed = np.vstack([self._placed, vertices[len(vertices) - more :]])
        self._normals = np.vstack([self._normals, np.zeros((more, 3))])
        self._known = np.concatenate([self._known, np.zeros(more, dtype=bool)])
        new = used[~self._known[used]]
        self._placed[new], self._normals[new] = self.shape.foot(vertices[new])
        self._known[new] = True
        return self._placed.copy(), self._normals.copy()


def halved_where_bent(
    feet: Feet,
    vertices: np.ndarray,
    triangles: np.ndarray,
    free: np.ndarray,
    weights: np.ndarray,
    largest: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Vertices and triangles with those edges halved whose middles the shape leaves by more than SAG_M.

    With them the one (k,) of the given triangles that each lies in, and weights (k, 3, 3) at its corners, of
    what interpolates over the triangles. At most `largest` triangles. Edges over creases stay.
    """
    within = np.arange(len(triangles))
    known, gaps = np.zeros(0, dtype=np.int64), np.zeros(0)
    for _ in range(_HALVINGS):
        touch = triangles[free[within] > 0]
        ends = edges_of(touch)
        placed, normals = feet(vertices, np.unique(touch))
        bent = np.linalg.norm(normals[ends[:, 0]] - normals[ends[:, 1]], axis=1)
        ends = ends[(bent > 1e-6) & (np.einsum("kx,kx->k", *normals[ends.T]) > _CROSSES)]
        # most edges were there before
        keys = (ends[:, 0] << 32) + ends[:, 1]
        new = ~np.isin(keys, known)
        known = np.concatenate([known, keys[new]])
        gaps = np.concatenate([gaps, np.abs(feet.shape.distance(placed[ends[new]].mean(axis=1)))])
        order = np.argsort(known)
        gap = gaps[order[np.searchsorted(known, keys, sorter=order)]]
        room = max(0, largest - len(triangles)) // 2  # an edge more makes two triangles more
        chosen = np.argsort(-gap)[:room]
        ends = ends[chosen[gap[chosen] > SAG_M]]
        if not len(ends):
            break
        vertices, triangles, part, weights = cut(vertices, triangles, weights, ends)
        within = within[part]
    return vertices, triangles, within, weights


class OnShape(NamedTuple):
    """vertices (v, 3) m on the shape, contact normals (v, 3), unit, outward; triangles (k, 3), the given one
    (k,) that each lies in, and weights (k, 3, 3) at its corners of what interpolates over the given ones."""

    vertices: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    within: np.ndarray
    weights: np.ndarray


def on_shape(
    feet: Feet,
    mesh: TetMesh,
    vertices: np.ndarray,
    triangles: np.ndarray,
    free: np.ndarray,
    weights: np.ndarray,
    strip_m: float,
    largest: int,
) -> OnShape:
    """Put a contact surface onto the shape of a mesh: its vertices (v, 3) m and triangles (k, 3), cut beside
    rims, and where neighbours differ too much; at most `largest` triangles.

    free: (k,) 1 where they may be touched; the base's inner vertices stay.
    """
    touch, shape = triangles[free > 0], feet.shape
    used = np.unique(touch)
    placed, normals = feet(vertices, used)
    inner = np.setdiff1d(triangles[free == 0], used)
    normals[inner] = _mean_normal(vertices, triangles[free == 0])
    rim = np.intersect1d(used, triangles[free == 0])
    edge = float(np.median(np.linalg.norm(vertices[touch[:, 0]] - vertices[touch[:, 1]], axis=1)))
    creased = _on_creases(shape, placed, normals, touch, rim, edge)
    normals[rim] = _of_side(placed, normals, touch)[rim]
    placed[used] = _lifted(shape, placed, normals, touch, creased)[used]
    creased[rim] = False  # no tip gets under it
    made = OnShape(placed, normals, triangles, np.arange(len(triangles)), weights)
    if not creased.any() or edge > 2 * EDGE_ROUNDING_M:
        return _halved_where_uneven(shape, mesh, made, free, creased, largest)
    creases = _creases(shape)
    sharp = creased & ~creases.hollow(placed)
    if creases.hollows.n:
        placed, normals = _eased(placed, normals, touch, np.setdiff1d(used, rim), creases)
        made = made._replace(vertices=placed, normals=normals)
    if not sharp.any():
        return _halved_where_uneven(shape, mesh, made, free, sharp, largest)
    line, sides = _line(shape, creases, placed[sharp], placed[rim])
    before = len(placed)
    placed, triangles, within, weights = cut_beside(placed, triangles, free, weights, sharp, line, strip_m)
    placed[before:], facing = shape.foot(placed[before:])
    made = OnShape(placed, np.vstack([normals, facing]), triangles, within, weights)
    made = _halved_where_uneven(shape, mesh, made, free, sharp, largest)
    placed, normals, triangles, within, _ = made
    own = np.setdiff1d(triangles[free[within] > 0], rim)
    own = own[~creases.hollow(placed[own])]
    away, nearest = line.query(placed[own], distance_upper_bound=strip_m)
    own, away, nearest = (each[away < strip_m] for each in (own, away, nearest))
    facing = unit_vectors(_around(placed[own], line, sides, strip_m), sides[nearest])
    normals[own] = _towards(normals[own], facing, 1 - away / strip_m)
    return made._replace(normals=normals)


def _halved_where_uneven(
    shape: TrueShape, mesh: TetMesh, made: OnShape, free: np.ndarray, sharp: np.ndarray, largest: int
) -> OnShape:
    """The same surface, at most `largest` triangles, with those edges halved between whose ends the force
    beside rims and the base (mechanics.contact.edges) is no straight line. sharp: (s,) bool of the first
    vertices, those on a rim, whose normal is one of its faces'."""
    vertices, normals, triangles, within, weights = made
    felt, seen = np.zeros(0), 0
    sharp = np.concatenate([sharp, np.zeros(len(vertices) - len(sharp), dtype=bool)])
    for _ in range(_HALVINGS):
        touch = triangles[free[within] > 0]
        ends = edges_of(touch)
        ends = ends[ends[:, 1] >= seen]
        felt = np.concatenate([felt, softer(mesh, vertices[len(felt) :], normals[len(felt) :])])
        seen, middles = len(vertices), vertices[ends].mean(axis=1)
        inner = np.where(sharp[ends].any(axis=1, keepdims=True), ~sharp[ends], 1)
        facing = unit_vectors((inner[..., None] * normals[ends]).sum(axis=1), normals[ends[:, 0]])
        off = np.abs(softer(mesh, middles, facing) - felt[ends].mean(axis=1))
        chosen = np.argsort(-off)[: max(0, largest - len(triangles)) // 2]
        chosen = chosen[off[chosen] > _UNEVEN]
        if not len(chosen):
            break
        vertices, triangles, part, weights = cut(vertices, triangles, weights, ends[chosen])
        beside = sharp[ends[chosen]].any(axis=1)
        new = facing[chosen]
        at = seen + np.flatnonzero(beside)
        placed, new[beside] = shape.foot(vertices[at], new[beside])
        length = np.linalg.norm(np.subtract(*vertices[ends[chosen[beside]].T]), axis=1)
        near = np.linalg.norm(placed - vertices[at], axis=1) < _BULGE * length
        vertices[at[near]] = placed[near]
        sharp = np.concatenate([sharp, sharp[ends[chosen]].all(axis=1)])
        normals, within = np.vstack([normals, new]), within[part]
    return OnShape(vertices, normals, triangles, within, weights)


def _of_side(placed: np.ndarray, normals: np.ndarray, touch: np.ndarray) -> np.ndarray:
    """(v, 3) the normals, where they are another face's the mean of the triangles `touch` (k, 3) instead.

    A point of the foot's rim is the base's as well, and what the shape says there may point straight down.
    """
    area, _ = facings(placed, touch)
    total = np.zeros_like(placed)
    np.add.at(total, touch, area[:, None])
    side = unit_vectors(total, normals)
    other = np.einsum("vx,vx->v", normals, side) < _CROSSES
    return np.where(other[:, None], side, normals)


class _Creases(NamedTuple):
    """Points along the concave creases and along the convex ones; either may have none."""

    hollows: cKDTree
    rims: cKDTree

    def share(self, points: np.ndarray) -> np.ndarray:
        """(v,) of how much they are a hollow's: 1 where one is as near as any rim, 0 on a rim and where none
        is near."""
        hollow = self.hollows.query(points, distance_upper_bound=_HOLLOW_REACH_M)[0]
        near = np.isfinite(hollow)
        rim = self.rims.query(points[near])[0]
        share = np.zeros(len(points))
        share[near] = np.minimum(2 / (1 + hollow[near] / np.maximum(rim, 1e-9)), 1.0)
        return share

    def hollow(self, points: np.ndarray) -> np.ndarray:
        """(v,) bool, so close to a concave crease, and no nearer to a convex one, that they are eased."""
        return self.share(points) >= 1


def _creases(shape: TrueShape) -> _Creases:
    middles, _, turn, _ = shape.creases_cut(_CREASE_SPACING_M)
    return _Creases(cKDTree(middles[turn < 0]), cKDTree(middles[turn > 0]))


def _line(
    shape: TrueShape, creases: _Creases, rims: np.ndarray, base: np.ndarray
) -> tuple[cKDTree, np.ndarray]:
    """Points along those sharp creases that are nearer to vertices `rims` (r, 3) than to the base's, and the
    normals (k, 3) of the faces that end there."""
    points, sides = shape.crease_points(_CREASE_SPACING_M)
    own = ~creases.hollow(points)
    if len(base):
        own &= cKDTree(rims).query(points)[0] < cKDTree(base).query(points)[0]
    return cKDTree(points[own]), sides[own]


def _around(points: np.ndarray, line: cKDTree, sides: np.ndarray, reach_m: float) -> np.ndarray:
    """(p, 3) sums of the normals of the faces that end at rims around `points` (p, 3), the nearer the more:
    beside a corner no rim has all of it."""
    near = cKDTree(points).sparse_distance_matrix(line, reach_m, output_type="coo_matrix").tocsr()
    near.data = 1 - near.data / reach_m
    return np.asarray(near @ sides)


def _on_creases(
    shape: TrueShape,
    placed: np.ndarray,
    normals: np.ndarray,
    touch: np.ndarray,
    rim: np.ndarray,
    edge_m: float,
) -> np.ndarray:
    """(v,) bool, the vertices drawn onto creases: `placed` changes.

    Those of the base's rim, and of a triangle's edge whose ends look to either side of a crease the nearer
    end.
    """
    creased = np.zeros(len(placed), dtype=bool)
    samples, _ = shape.crease_points(_CREASE_SPACING_M)
    if not len(samples):
        return creased
    tree = cKDTree(samples)
    away, nearest = tree.query(placed)
    before = placed.copy()
    start = np.stack([touch, np.roll(touch, -1, axis=1)], axis=2).reshape(-1, 2)
    pairs = np.unique(np.sort(start, axis=1), axis=0)
    wanted, taken = np.zeros(len(placed), dtype=bool), np.zeros(len(samples), dtype=bool)
    wanted[rim] = away[rim] < edge_m
    for _ in range(_ROUNDS):
        # one vertex a sample, the nearest: at the end of a crease several have the same one
        vertices = np.flatnonzero(wanted & ~taken[nearest])
        vertices = vertices[np.argsort(away[vertices], kind="stable")]
        vertices = vertices[np.unique(nearest[vertices], return_index=True)[1]]
        creased[vertices], taken[nearest[vertices]] = True, True
        placed[vertices] = samples[nearest[vertices]]
        a, b = pairs.T
        crosses = np.einsum("kx,kx->k", normals[a], normals[b]) < _CROSSES
        crosses &= ~creased[a] & ~creased[b]
        nearer = np.where(away[a] <= away[b], a, b)[crosses]
        wanted = np.zeros(len(placed), dtype=bool)
        wanted[nearer[away[nearer] < _REACH * edge_m]] = True
        if not wanted.any():
            break
    _given_back(placed, before, creased, away, touch, edge_m)
    return creased


def _given_back(
    placed: np.ndarray,
    before: np.ndarray,
    creased: np.ndarray,
    away: np.ndarray,
    touch: np.ndarray,
    edge_m: float,
) -> None:
    """Put vertices back to where they were whose triangles lost their area on a crease, the one that came
    from farthest first: `placed` and `creased` change."""
    for _ in range(3):
        flat = touch[(2 * triangle_areas(placed, touch) < _NO_AREA * edge_m**2) & creased[touch].any(axis=1)]
        if not len(flat):
            return
        farthest = np.argmax(np.where(creased[flat], away[flat], -1.0), axis=1)
        back = np.unique(flat[np.arange(len(flat)), farthest])
        placed[back], creased[back] = before[back], False


def _lifted(
    shape: TrueShape, placed: np.ndarray, normals: np.ndarray, touch: np.ndarray, creased: np.ndarray
) -> np.ndarray:
    """Vertices moved along their normals until the triangles around them lie on the shape in the mean."""
    gap = -shape.distance(placed[touch].mean(axis=1))
    facing = normals[touch]
    alike = np.einsum("kcx,kcx->kc", facing, np.roll(facing, 1, axis=1)).min(axis=1) > _ALIKE
    smooth = alike & ~creased[touch].any(axis=1)
    total = np.bincount(touch[smooth].ravel(), np.repeat(gap[smooth], 3), len(placed))
    count = np.bincount(touch[smooth].ravel(), minlength=len(placed))
    lift = _MEAN_GAP * total / np.maximum(count, 1)
    return placed + lift[:, None] * normals


def _eased(
    placed: np.ndarray, normals: np.ndarray, touch: np.ndarray, own: np.ndarray, creases: _Creases
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices `own` beside concave creases moved to the mean of the surface around them, and turned with it.

    In a sharp hollow a tip that is held by friction would snap from one face to the other.
    """
    p = placed[touch]
    area = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    # the middles of its edges integrate a triangle to second order
    places = ((p + np.roll(p, -1, axis=1)) / 2).reshape(-1, 3)
    parts = np.repeat(area / 6, 3, axis=0)
    size = np.linalg.norm(parts, axis=1)
    widest = max(_HOLLOW_ROUNDING_M, NORMAL_SMOOTHING_M)
    near = creases.hollows.query(placed[own], distance_upper_bound=3 * widest)[0]
    own, near = own[np.isfinite(near)], near[np.isfinite(near)]
    pairs = cKDTree(placed[own]).sparse_distance_matrix(cKDTree(places), 3 * widest, output_type="ndarray")
    row, column, shape = pairs["i"], pairs["j"], (len(own), len(places))
    # the far side of a thin wall is no neighbour
    same = np.einsum("ij,ij->i", normals[own][row], parts[column]) > -0.3 * size[column]

    def mean(values: np.ndarray, width: float) -> np.ndarray:
        weight = size[column] * same * np.exp(-((pairs["v"] / width) ** 2) / 2)
        around = sp.csr_matrix((weight, (row, column)), shape=shape)
        return (around @ values) / np.maximum(np.asarray(around.sum(axis=1)), 1e-300)

    moved, turned = placed.copy(), normals.copy()
    unit = parts / np.maximum(size, 1e-300)[:, None]
    agreement = np.linalg.norm(mean(unit, _HOLLOW_ROUNDING_M), axis=1)
    flat, crease = EASED_AGREEMENT
    whole = _smooth_step(creases.share(placed[own]))  # a rim close by keeps its place
    # round faces agree better than that: the mean would draw them inwards
    share = whole * _smooth_step(3 - near / _HOLLOW_ROUNDING_M)
    share *= _smooth_step((flat - agreement) / (flat - crease))
    moved[own] += share[:, None] * (mean(places, _HOLLOW_ROUNDING_M) - placed[own])
    facing = unit_vectors(mean(unit, NORMAL_SMOOTHING_M), normals[own])
    turned[own] = _towards(normals[own], facing, whole * _smooth_step(3 - near / NORMAL_SMOOTHING_M))
    return moved, turned


def _towards(normals: np.ndarray, facing: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(k, 3) unit, turned by a share (k,) of the way from `normals` (k, 3) to `facing` (k, 3), both unit."""
    return unit_vectors(normals + share[:, None] * (facing - normals), facing)


def _smooth_step(x: np.ndarray) -> np.ndarray:
    """(k,), 0 below 0 and 1 above 1."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3 - 2 * x)


def _mean_normal(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    total = facings(vertices, triangles)[0].sum(axis=0)
    return total / max(float(np.linalg.norm(total)), 1e-300)
