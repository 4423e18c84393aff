"""The shape itself, as its file has it: triangles that are chords of curved faces, curved again.

Cubic patches (PN triangles: Vlachos et al., Curved PN Triangles, 2001) stand on the file's triangles. Their
corner normals are weighted so that they are exact on a sphere and on a cylinder (Max, Weights for computing
vertex normals, 1999). Between them normals are quadratic, the same on both sides of an edge. Plane faces
stay plane where a fillet begins, and creases stay where they are.

Where the faces of a closed surface end: its creases, and the normals on either side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from palpate.mechanics.disk.store import content_key
from palpate.mechanics.frames import local_frames, unit_vectors
from palpate.mechanics.shape.nearest import closest, neighbours, segments_cut, triangle_areas

CREASE_DEGREES = 35.0
_CREASE_SAG_M = 3e-4
"""A turn that would bulge its facets by more than this, were they chords of one arc, is a crease."""
_PLANE_BEND = 0.5
"""1/m: facets that bend less than this over their edge belong to one plane face."""
_PLANE_TURN = 2e-4  # rad, what the rounding of a file's coordinates turns
_WIDER = 2.5
"""A face so many times as wide as its neighbour, across their edge, is plane up to it."""
_APEX_TURNS = 2.0
"""A corner that looks away from its triangle by so many times what the surface turns over the edges there,
and lifts it by more than _CREASE_SAG_M, is the tip of a cone: on a round surface the two are about alike."""
_FEW = 8  # triangles of a face up to which all its corners are looked at


@dataclass(frozen=True)
class Facets:
    """unit: (m, 3) normals. across: (m, 3) triangle beyond each edge. crease: (m, 3) bool. plane: (m, 3) bool
    whether the triangle's face is plane up to that edge, which a narrower face meets."""

    unit: np.ndarray
    across: np.ndarray
    crease: np.ndarray
    plane: np.ndarray


def facets_of(vertices: np.ndarray, triangles: np.ndarray) -> Facets:
    p = vertices[triangles]
    area = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    twice = np.linalg.norm(area, axis=1)
    unit = area / np.maximum(twice, 1e-300)[:, None]
    edge = np.roll(p, -1, axis=1) - p
    height = twice[:, None] / np.maximum(np.linalg.norm(edge, axis=2), 1e-300)
    across = neighbours(triangles)
    flat = twice == 0.0  # such a sliver faces as those around it
    unit[flat] = unit_vectors(unit[across[flat]].sum(axis=1), np.array([0.0, 0.0, 1.0]))
    turn = angle_between(unit[:, None], unit[across])
    start = np.argmax(triangles[across] == np.roll(triangles, -1, axis=1)[..., None], axis=2)
    other = height[across, start]
    flat = turn <= np.maximum(_PLANE_TURN, _PLANE_BEND * (height + other) / 2)
    m = len(triangles)
    row, side = np.nonzero(flat & (across >= 0))
    links = sp.coo_matrix((np.ones(len(row)), (row, across[row, side])), shape=(m, m))
    face = connected_components(links, directed=False)[1]
    inner = face[:, None] == face[across]
    width = _widths(p, edge, unit, face, ~inner)
    beyond = width[across, start]
    sag = turn * np.minimum(width, beyond) / 8
    crease = ~inner & ((turn > np.radians(CREASE_DEGREES)) | (sag > _CREASE_SAG_M) | (across < 0))
    return Facets(unit, across, crease, ~inner & ~crease & (width > _WIDER * beyond))


def angle_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return 2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=-1) / 2, 0, 1))


def _widths(
    p: np.ndarray, edge: np.ndarray, unit: np.ndarray, face: np.ndarray, outer: np.ndarray
) -> np.ndarray:
    """(m, 3) m: how far the plane face (m,) of each triangle reaches inwards from those of its edges that
    are its outline, `outer` (m, 3); 0 at the others."""
    inward = np.cross(unit[:, None], edge)
    inward /= np.maximum(np.linalg.norm(inward, axis=2, keepdims=True), 1e-300)
    width = np.zeros(outer.shape)
    order = np.argsort(face, kind="stable")
    starts = np.searchsorted(face[order], np.arange(face.max() + 2))
    counts = np.diff(starts)
    few = counts[face] <= _FEW
    for count in np.unique(counts[counts <= _FEW]):
        own = order[starts[:-1][counts == count][:, None] + np.arange(count)]
        corners = p[own].reshape(len(own), -1, 3)
        reach = np.einsum("fvx,ftex->ftev", corners, inward[own])
        reach -= np.einsum("ftex,ftex->fte", p[own], inward[own])[..., None]
        width[own] = reach.max(axis=3)
    row, side = np.nonzero(outer & ~few[:, None])
    for large in np.unique(face[row]):
        some = face[row] == large
        r, e = row[some], side[some]
        # the outline's own corners reach furthest
        corners = np.unique(np.concatenate([p[r, e], p[r, (e + 1) % 3]]), axis=0)
        reach = inward[r, e] @ corners.T - np.einsum("kx,kx->k", p[r, e], inward[r, e])[:, None]
        width[r, e] = reach.max(axis=1)
    return width


def corner_normals_of(
    vertices: np.ndarray, triangles: np.ndarray, facets: Facets
) -> tuple[np.ndarray, np.ndarray]:
    """(m, 3, 3) unit normals; (m, 3) bool, where a corner is the tip of a cone."""
    m = len(triangles)
    rows, columns, plane = [], [], np.zeros(3 * m, dtype=bool)
    for edge in range(3):
        here = np.flatnonzero(~facets.crease[:, edge])
        other = facets.across[here, edge]
        for corner in (edge, (edge + 1) % 3):
            match = (triangles[other] == triangles[here, corner][:, None]).argmax(axis=1)
            rows.append(here * 3 + corner)
            columns.append(other * 3 + match)
            plane[here * 3 + corner] |= facets.plane[here, edge]
    r, c = np.concatenate(rows), np.concatenate(columns)
    group = connected_components(sp.coo_matrix((np.ones(len(r)), (r, c)), shape=(3 * m, 3 * m)), False)[1]
    p = vertices[triangles]
    after, before = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    square = (after**2).sum(axis=2) * (before**2).sum(axis=2)
    each = (np.cross(after, before) / np.maximum(square, 1e-300)[..., None]).reshape(-1, 3)
    # where plane faces end, their triangles alone say which way the surface looks
    some = np.zeros(group.max() + 1, dtype=bool)
    some[group[plane]] = True
    each = np.where((some[group] & ~plane)[:, None], 0.0, each)
    total = np.stack([np.bincount(group, each[:, k]) for k in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    normals = (total / np.maximum(length, 1e-300))[group]
    lost = ~(length[group, 0] > 0)
    normals[lost] = np.repeat(facets.unit, 3, axis=0)[lost]
    normals = normals.reshape(m, 3, 3)
    # a cone's triangles meet at its tip, and bulge if that looks one way for all of them
    turn = np.zeros(group.max() + 1)
    np.maximum.at(turn, group[r], angle_between(facets.unit[r // 3], facets.unit[c // 3]))
    tip = angle_between(normals, facets.unit[:, None]) > _APEX_TURNS * turn[group].reshape(m, 3)
    lift = np.maximum(*(np.abs(np.einsum("mcx,mcx->mc", side, normals)) for side in (after, before)))
    tip &= lift / 4 > _CREASE_SAG_M
    return np.where(tip[..., None], facets.unit[:, None], normals), tip


_SAME_SIDE = np.cos(np.radians(50))
_FACING = np.cos(np.radians(75))
_SAMPLE_M = 1.2e-3
"""Longest edge of the pieces that curvatures are averaged over."""
_MOST_PIECES, _PIECE = 1_000_000, 0.18
"""So many pieces at about most, larger ones on an object beyond 0.26 m^2, where they took 3 GB; area of one
over its longest edge squared."""
_COARSE_M = 2.5e-3
"""Longest edge from which a patch's curvature is its own, not what the normals at its corners turn by: as
wide as a usual tip's contact, under which finer patches average out."""
_THIN = 1e-6
"""Width of a line over which the surface turns, over the length of its pieces."""
_WIDTHS, _PAIRS = 2.7, 300_000
"""Widths of a Gaussian beyond which it is left out (0.03); pieces that are averaged at once."""


@dataclass(frozen=True, eq=False)
class TrueShape:
    """A closed surface: vertices (n, 3) m, triangles (m, 3) outward by the right-hand rule; device frame."""

    vertices: np.ndarray
    triangles: np.ndarray

    def __post_init__(self) -> None:
        for name, kind in (("vertices", float), ("triangles", np.int64)):
            value = np.array(getattr(self, name), dtype=kind, order="C")
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @cached_property
    def key(self) -> str:
        """Hash of its content."""
        return content_key("true shape 2", self.vertices, self.triangles)

    @cached_property
    def corner_normals(self) -> np.ndarray:
        """(m, 3, 3) unit outward normals of the curved shape at each triangle's corners."""
        return self._corners[0]

    @cached_property
    def _corners(self) -> tuple[np.ndarray, np.ndarray]:
        return corner_normals_of(self.vertices, self.triangles, self._facets)

    @cached_property
    def creases(self) -> np.ndarray:
        """(k, 2) vertices of the edges over which the normal jumps, each once."""
        ends = np.stack([self.triangles, np.roll(self.triangles, -1, axis=1)], axis=2)
        pairs = np.sort(ends[self._facets.crease], axis=1)
        return np.unique(pairs, axis=0)

    def crease_points(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Points (k, 3) m along all creases, at most `spacing_m` apart, and the tips of cones, once for each
        face that ends there, with its unit normals (k, 3); none where the shape is smooth."""
        triangle, edge = np.nonzero(self._facets.crease)
        p = self.vertices[self.triangles[triangle]]
        rows = np.arange(len(triangle))
        length = np.linalg.norm(p[rows, edge] - p[rows, (edge + 1) % 3], axis=1)
        count = np.maximum(np.ceil(length / spacing_m).astype(int), 1) + 1
        row = np.repeat(rows, count)
        along = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        share = along / (count[row] - 1)
        weights = np.zeros((len(row), 3))
        weights[np.arange(len(row)), edge[row]] = 1 - share
        weights[np.arange(len(row)), (edge[row] + 1) % 3] += share
        points, normals = self.on(triangle[row], weights)
        facing, tip = self._corners
        points = np.vstack([points, self.vertices[self.triangles[tip]]])
        return points, np.vstack([normals, facing[tip]])

    def creases_cut(self, longest_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Creases in straight pieces of at most `longest_m`: middles (k, 3) m, lengths (k,) m, by what angle
        (k,) rad the surface turns there, positive where it is convex, and the unit way (k, 3) across it,
        square to the crease and to the mean of its two normals."""
        facets = self._facets
        triangle, edge = np.nonzero(facets.crease & (np.arange(len(self.triangles))[:, None] < facets.across))
        start, end = (self.vertices[self.triangles[triangle, (edge + k) % 3]] for k in (0, 1))
        own, other = facets.unit[triangle], facets.unit[facets.across[triangle, edge]]
        convex = np.einsum("kx,kx->k", np.cross(own, other), end - start)
        middles, length, row = segments_cut(start, end, longest_m)
        turn = np.copysign(angle_between(own, other), convex)
        return middles, length, turn[row], unit_vectors(own - other, own)[row]

    def on(self, triangle: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (k, 3) m of the curved shape and unit normals (k, 3) at weights (k, 3) of triangles (k,)."""
        points = np.einsum("kb,kbx->kx", _bernstein(weights), self._control[triangle])
        u, v, w = weights.T
        shares = np.stack([u * u, v * v, w * w, 2 * u * v, 2 * v * w, 2 * w * u], axis=1)
        normals = np.einsum("kb,kbx->kx", shares, self._facing_at[triangle])
        # corners that look opposite ways, at the end of a crease, leave their triangle's own
        return points, unit_vectors(normals, self._facets.unit[triangle])

    def foot(self, points: np.ndarray, facing: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Points (k, 3) m of the curved shape nearest to points (k, 3), unit normals (k, 3) there.

        facing: (k, 3) unit; where the nearest face looks away from it by more than 75 degrees, the nearest
        of those that do not is taken: beside a rim a place stays on its own face.
        """
        _, triangle, weights = closest(self.vertices, self.triangles, points)
        if facing is not None:
            triangle, weights = self._facing(points, facing, triangle, weights)
        return self.on(triangle, weights)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(k,) m, signed, positive outside, of points (k, 3) near the curved shape."""
        foot, normals = self.foot(points)
        return np.einsum("ki,ki->k", points - foot, normals)

    def curvatures(
        self, points: np.ndarray, normals: np.ndarray, width_m: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Principal curvatures (k, 2) 1/m, convex positive, greatest first, and the unit direction (k, 3) of
        the greatest, at surface points (k, 3) with normals (k, 3).

        Means of the curvature tensor under a Gaussian of `width_m`, over the faces that look the same way
        within 50 degrees: a contact feels what lies under it, and an edge is no curvature.
        """
        places, facing, area, bend, tree = self._bends
        result, direction = np.zeros((len(points), 2)), np.zeros((len(points), 3))
        reach = _WIDTHS * width_m
        each = len(places) * np.pi * reach**2 / area.sum()
        step = max(20, int(_PAIRS / each))
        for start in range(0, len(points), step):
            rows = slice(start, start + step)
            frame = local_frames(normals[rows])
            near = cKDTree(points[rows]).sparse_distance_matrix(tree, reach, output_type="coo_matrix").tocsr()
            i, j = np.repeat(np.arange(len(frame)), np.diff(near.indptr)), near.indices
            seen = np.einsum("kx,kx->k", frame[i, 0], facing[j]) > _SAME_SIDE
            weight = area[j] * np.exp(-((near.data / width_m) ** 2) / 2)
            i, j, weight = i[seen], j[seen], weight[seen]
            turned = _turned(bend[j], facing[j], frame[i])
            total = np.maximum(np.bincount(i, weight, len(frame)), 1e-300)
            xx, yy, xy = (np.bincount(i, weight * each, len(frame)) / total for each in turned)
            mean, half = (xx + yy) / 2, (xx - yy) / 2
            apart, angle = np.hypot(half, xy), np.arctan2(xy, half) / 2
            result[rows] = np.stack([mean + apart, mean - apart], axis=1)
            direction[rows] = np.cos(angle)[:, None] * frame[:, 1] + np.sin(angle)[:, None] * frame[:, 2]
        return result, direction

    def _facing(
        self, points: np.ndarray, facing: np.ndarray, triangle: np.ndarray, weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        away = np.flatnonzero(np.einsum("kx,kx->k", self._facets.unit[triangle], facing) < _FACING)
        for k in away:
            allowed = np.flatnonzero(self._facets.unit @ facing[k] > _FACING)
            if len(allowed):
                _, one, weights[k] = closest(self.vertices, self.triangles[allowed], points[k : k + 1])
                triangle[k] = allowed[one[0]]
        return triangle, weights

    @cached_property
    def _facets(self) -> Facets:
        return facets_of(self.vertices, self.triangles)

    @cached_property
    def _control(self) -> np.ndarray:
        return _control(self.vertices, self.triangles, self.corner_normals, self._facets)

    @cached_property
    def _facing_at(self) -> np.ndarray:
        """(m, 6, 3) normals that `on` weighs by quadratics: at the corners, then of the edges' middles.

        A middle's is the corners' mean as mirrored across the edge (Vlachos et al.): where both corners look
        along an edge that bends one way and back, the surface between them looks the other way.
        """
        corners = self.corner_normals
        edge = np.roll(self.vertices[self.triangles], -1, axis=1) - self.vertices[self.triangles]
        both = corners + np.roll(corners, -1, axis=1)
        square = np.maximum((edge**2).sum(axis=2, keepdims=True), 1e-300)
        both = both - 2 * (both * edge).sum(axis=2, keepdims=True) / square * edge
        instead = np.repeat(self._facets.unit, 3, axis=0)
        return np.concatenate([corners, unit_vectors(both.reshape(-1, 3), instead).reshape(-1, 3, 3)], axis=1)

    def _square_to(self, triangle: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(k, 3) unit normals that the cubic patches themselves have: `on`'s are smooth over their edges."""
        u, v, w = np.einsum("kwb,kbx->wkx", _slopes(weights), self._control[triangle])
        return unit_vectors(np.cross(v - u, w - u), self._facets.unit[triangle])

    def _turns(
        self, among: np.ndarray, longest_m: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Places, normals, areas and curvature tensors of pieces of at most `longest_m` of the edges between
        patches of some triangles (m,), over which these turn: all but sharp creases, which are rims
        (mechanics.contact.edges). Patches that are as wide do not meet smoothly, and a gentle crease is
        curvature on a line."""
        facets = self._facets
        sharp = angle_between(facets.unit[:, None], facets.unit[facets.across]) >= np.radians(CREASE_DEGREES)
        first = np.arange(len(self.triangles))[:, None] < facets.across
        own, edge = np.nonzero(first & ~sharp & among[:, None] & among[facets.across])
        beyond = facets.across[own, edge]
        ends = self.triangles[own, edge], self.triangles[own, (edge + 1) % 3]
        start, end = self.vertices[ends[0]], self.vertices[ends[1]]
        _, length, row = segments_cut(start, end, longest_m)
        count = np.bincount(row, minlength=len(own))
        share = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[row]
        on_own, on_other = np.zeros((2, len(row), 3))
        for weights, of in ((on_own, own), (on_other, beyond)):
            for corner, part in zip(ends, (1 - share, share), strict=True):
                at = (self.triangles[of] == corner[:, None]).argmax(axis=1)
                weights[np.arange(len(row)), at[row]] = part
        places, facing = self.on(own[row], on_own)
        one, other = self._square_to(own[row], on_own), self._square_to(beyond[row], on_other)
        convex = np.einsum("kx,kx->k", np.cross(one, other), (end - start)[row])
        turn, way = np.copysign(angle_between(one, other), convex), unit_vectors(one - other, one)
        area = _THIN * longest_m * length
        tensor = (turn * length / np.maximum(area, 1e-300))[:, None, None] * way[:, :, None] * way[:, None, :]
        return places, facing, area, tensor

    @cached_property
    def _bends(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, cKDTree]:
        """Places, normals, areas and curvature tensors of pieces of the curved shape of at most _SAMPLE_M, or
        as small as _MOST_PIECES allow, and of the lines between patches over which it turns."""
        surface = float(triangle_areas(self.vertices, self.triangles).sum())
        longest = max(_SAMPLE_M, np.sqrt(surface / (_PIECE * _MOST_PIECES)))
        triangle, corners = _pieces(self.vertices[self.triangles], longest)
        places, facing = self.on(triangle, corners.mean(axis=1))
        p = np.einsum("kcw,kwx->kcx", corners, self.vertices[self.triangles[triangle]])
        area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2
        bend = _bends(self.vertices[self.triangles], self.corner_normals)[triangle]
        sides = np.roll(self.vertices[self.triangles], -1, axis=1) - self.vertices[self.triangles]
        coarse = np.linalg.norm(sides, axis=2).max(axis=1) > _COARSE_M
        some = coarse[triangle]
        whole = triangle[some].repeat(3), corners[some].reshape(-1, 3)
        at = np.einsum("kb,kbx->kx", _bernstein(whole[1]), self._control[whole[0]])
        bend[some] = _bends(at.reshape(-1, 3, 3), self._square_to(*whole).reshape(-1, 3, 3))
        lines = self._turns(coarse, longest)
        places, facing, area, bend = (
            np.concatenate(both) for both in zip((places, facing, area, bend), lines, strict=True)
        )
        # pieces of one cell that look alike count as one: a fine file takes no longer
        cell = np.hstack([np.floor(places / longest), np.rint(3 * facing)]).astype(np.int64)
        cell -= cell.min(axis=0)
        _, cell = np.unique(np.ravel_multi_index(tuple(cell.T), cell.max(axis=0) + 1), return_inverse=True)
        total = np.bincount(cell, area)

        def mean(values: np.ndarray) -> np.ndarray:
            columns = (area[:, None] * values.reshape(len(area), -1)).T
            sums = np.stack([np.bincount(cell, column) for column in columns], axis=1)
            return (sums / total[:, None]).reshape(-1, *values.shape[1:])

        places, facing, tensors = mean(places), mean(facing), mean(bend)
        facing /= np.linalg.norm(facing, axis=1, keepdims=True)
        return places, facing, total, tensors, cKDTree(places)


def _control(vertices: np.ndarray, triangles: np.ndarray, normals: np.ndarray, facets: Facets) -> np.ndarray:
    """(m, 10, 3) control points of the cubic patches, in the order of `_bernstein`."""
    p = vertices[triangles]
    beyond = normals[facets.across]
    made = {}
    for i in range(3):
        for j in ((i + 1) % 3, (i + 2) % 3):
            edge = i if (i + 1) % 3 == j else j
            along = p[:, j] - p[:, i]
            own = normals[:, i]
            match = (triangles[facets.across[:, edge]] == triangles[:, i][:, None]).argmax(axis=1)
            other = beyond[np.arange(len(p)), edge, match]
            step = along - np.einsum("kx,kx->k", along, own)[:, None] * own
            # a crease runs along both its faces, and both must draw it alike
            tangent = np.cross(own, other)
            size = np.linalg.norm(tangent, axis=1, keepdims=True)
            tangent /= np.maximum(size, 1e-300)
            crease = np.einsum("kx,kx->k", along, tangent)[:, None] * tangent
            straight = np.linalg.norm(crease, axis=1) < 0.9 * np.linalg.norm(along, axis=1)
            crease = np.where(straight[:, None], along, crease)
            sharp = size[:, 0] > 1e-9
            made[i, j] = p[:, i] + np.where(sharp[:, None], crease, step) / 3
    mean = sum(made.values()) / 6
    centre = mean + (mean - p.mean(axis=1)) / 2
    outer = [made[pair] for pair in ((0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2))]
    return np.stack([p[:, 0], p[:, 1], p[:, 2], *outer, centre], axis=1)


def _bernstein(weights: np.ndarray) -> np.ndarray:
    """(k, 10) of barycentric weights (k, 3)."""
    u, v, w = weights.T
    outer = [3 * u * u * v, 3 * u * v * v, 3 * v * v * w, 3 * v * w * w, 3 * w * w * u, 3 * w * u * u]
    return np.stack([u**3, v**3, w**3, *outer, 6 * u * v * w], axis=1)


def _slopes(weights: np.ndarray) -> np.ndarray:
    """(k, 3, 10) derivatives of `_bernstein` by each of the weights (k, 3)."""
    u, v, w = weights.T
    o = np.zeros_like(u)
    rows = [
        [3 * u * u, o, o, 6 * u * v, 3 * v * v, o, o, 3 * w * w, 6 * w * u, 6 * v * w],
        [o, 3 * v * v, o, 3 * u * u, 6 * u * v, 6 * v * w, 3 * w * w, o, o, 6 * u * w],
        [o, o, 3 * w * w, o, o, 3 * v * v, 6 * v * w, 6 * w * u, 3 * u * u, 6 * u * v],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _bends(p: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(m, 3, 3) 1/m curvature tensors of triangles (m, 3, 3) from their corners' normals, convex positive.

    Least squares over the three edges (Rusinkiewicz, Estimating curvatures on triangle meshes, 2004).
    """
    edge = np.roll(p, -1, axis=1) - p
    turn = np.roll(normals, -1, axis=1) - normals
    facing = np.cross(edge[:, 0], edge[:, 1])
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-300)
    u = edge[:, 0] / np.maximum(np.linalg.norm(edge[:, 0], axis=1, keepdims=True), 1e-300)
    axes = np.stack([u, np.cross(facing, u)], axis=1)
    x, y = np.einsum("max,mex->ame", axes, edge)
    a, b = np.einsum("max,mex->ame", axes, turn)
    zero = np.zeros_like(x)
    system = np.concatenate([np.stack([x, y, zero], axis=2), np.stack([zero, x, y], axis=2)], axis=1)
    right = np.concatenate([a, b], axis=1)
    square = np.einsum("mei,mej->mij", system, system)
    square += 1e-9 * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(3) + 1e-300 * np.eye(3)
    e, f, g = np.linalg.solve(square, np.einsum("mei,me->mi", system, right)[..., None])[..., 0].T
    flat = np.stack([np.stack([e, f], axis=1), np.stack([f, g], axis=1)], axis=1)
    return np.einsum("max,mab,mby->mxy", axes, flat, axes)


def _turned(
    bend: np.ndarray, before: np.ndarray, frames: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(k,) each, xx, yy and xy in frames (k, 3, 3) of normal, x and y, of tensors (k, 3, 3) of the planes
    with unit normals `before` (k, 3), turned with them the shortest way onto the frames'."""
    (nn, nx, ny), (_, xx, xy), (_, _, yy) = np.moveaxis(frames @ bend @ frames.transpose(0, 2, 1), 0, 2)
    along, x, y = np.einsum("kax,kx->ak", frames, before)
    share = 1 / (1 + along)
    x, y = share * x, share * y
    return xx - 2 * x * nx + nn * x * x, yy - 2 * y * ny + nn * y * y, xy - x * ny - y * nx + nn * x * y


def _pieces(p: np.ndarray, longest_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (m, 3, 3) cut at the middles of their longest edges until none is longer than `longest_m`.

    The triangle (k,) that each piece lies in, and its corners' weights there (k, 3, 3).
    """
    triangle = np.flatnonzero(np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) > 1e-16)
    corners = np.tile(np.eye(3), (len(triangle), 1, 1))
    done_triangle, done_corners = [], []
    while len(triangle):
        at = np.einsum("kcw,kwx->kcx", corners, p[triangle])
        length = np.linalg.norm(np.roll(at, -1, axis=1) - at, axis=2)
        long = length.max(axis=1) > longest_m
        done_triangle.append(triangle[~long])
        done_corners.append(corners[~long])
        triangle, corners, length = triangle[long], corners[long], length[long]
        rows, first = np.arange(len(triangle)), length.argmax(axis=1)
        second = (first + 1) % 3
        middle = (corners[rows, first] + corners[rows, second]) / 2
        one, other = corners.copy(), corners
        one[rows, second], other[rows, first] = middle, middle
        triangle, corners = np.concatenate([triangle, triangle]), np.concatenate([one, other])
    return np.concatenate(done_triangle), np.concatenate(done_corners)
