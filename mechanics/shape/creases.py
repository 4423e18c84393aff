"""Where the faces of a closed surface end: its creases, and the normals on either side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from palpate.mechanics.frames import unit_vectors
from palpate.mechanics.shape.nearest import neighbours

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


def corner_normals_of(vertices: np.ndarray, triangles: np.ndarray, facets: Facets) -> np.ndarray:
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
    return np.where((tip & (lift / 4 > _CREASE_SAG_M))[..., None], facets.unit[:, None], normals)
