"""Split tetrahedra: those next to the touchable surface, for a narrow load patch, those on a narrow foot, and
those of a nodule."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from palpate.mechanics.shape.nearest import closest, first_hits, sample, triangle_areas
from palpate.mechanics.shape.tetmesh import EDGES, TetMesh, tet_volumes
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.mechanics.statistics import weighted_median

MOST_TETRAHEDRA = 50_000
"""Beyond it a round of halving is left out. A block of 250 mm, pressed 4 mm deep: 2.9 GB for 13.1 with all
rounds, the force in the middle of the top 0.3 % off, 10 mm from a rim 2.8 %."""
_RAYS, _ITSELF = 200, 1e-6
"""Of a thickness; and how far, of the size, a ray starts from what it leaves."""
_LEAST_VOLUME = 0.25
"""A node goes no further to the shape than leaves its tetrahedra this share of their volume."""
_STANDS, _FINEST_FOOT = 1 / 3, 1 / 8
"""Edges of a foot over its width: by how much narrower it is than the object, and at least. A ball on a foot
a third as wide, whose base had 12 triangles, gave way 8 % too little: it turns about the foot's outline,
where the strain is singular. Halved twice 2 % are left; a foot as wide as its object is well without."""


def typical_edge(mesh: TetMesh) -> float:
    """Edge length of the touchable surface at a place drawn at random on it, m: the median by area.

    By number, a spot of tiny triangles (the mesher leaves one now and then) would count as the whole surface.
    """
    p = mesh.points[mesh.touchable_surface[:, :3]]
    edges = np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2)
    area = triangle_areas(mesh.points, mesh.touchable_surface)
    return weighted_median(edges.ravel(), np.repeat(area, 3))


def typical_wall(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Thickness of a closed surface below a place drawn at random on it, m: the median along the normal."""
    points, triangle, _ = closest(vertices, triangles, sample(vertices, triangles, _RAYS))
    a, b, c = (vertices[triangles[triangle, k]] for k in range(3))
    inward = np.cross(c - a, b - a)
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    itself = _ITSELF * float(np.ptp(vertices, axis=0).max())
    return float(np.median(first_hits(vertices, triangles, points, inward, beyond=itself)[0]))


def refined_near_surface(mesh: TetMesh, surface_edge_m: float) -> tuple[TetMesh, np.ndarray]:
    """(linear mesh, parent) with the touchable surface's median edge at most `surface_edge_m`, m, and narrow
    feet as fine as they need.

    Every edge longer than that with an end on the touchable surface is halved, as often as it takes and
    MOST_TETRAHEDRA allow: on a larger object the edges stay longer. Then those of `coarse_feet`.
    parent: (m,) the tetrahedron of `mesh` that each new one lies in. Nodes of the linear mesh stay at the
    front. New nodes lie on straight edges; where the shape is known all touchable ones are drawn to it: on
    chords a fillet of 12 mm under edges of 12 mm gave way 2 % more, and two meshes were 2 % apart.
    """
    shape, mesh = mesh.shape, mesh.linear()
    parent = np.arange(len(mesh.tetrahedra))
    for _ in range(4):
        if typical_edge(mesh) <= surface_edge_m:
            break
        on_surface = np.zeros(len(mesh.points), dtype=bool)
        on_surface[np.unique(mesh.touchable_surface)] = True
        finer, step = _halved(mesh, on_surface, surface_edge_m)
        if len(finer.tetrahedra) > MOST_TETRAHEDRA:
            break
        mesh, parent = finer, parent[step]
    finer, step = refined_at_feet(mesh)
    return drawn_to_shape(finer, shape), parent[step]


def refined_at_feet(mesh: TetMesh) -> tuple[TetMesh, np.ndarray]:
    """(linear mesh, parent) with the edges of narrow feet halved, as often as it takes and MOST_TETRAHEDRA
    allow. parent and nodes: as of `refined_near_surface`."""
    mesh = mesh.linear()
    parent = np.arange(len(mesh.tetrahedra))
    for _ in range(4):
        feet = coarse_feet(mesh)
        if not feet:
            break
        finer, step = mesh, np.arange(len(mesh.tetrahedra))
        for nodes, edge_m in feet:
            chosen = np.zeros(len(finer.points), dtype=bool)
            chosen[nodes] = True
            finer, again = _halved(finer, chosen, edge_m)
            step = step[again]
        if len(finer.tetrahedra) > MOST_TETRAHEDRA:
            break
        mesh, parent = finer, parent[step]
    return mesh, parent


def coarse_feet(mesh: TetMesh) -> list[tuple[np.ndarray, float]]:
    """(corner nodes (k,), longest edge, m) of each part of the base whose median edge is longer than it needs
    for how narrow it is (4 area / outline) beside the object; empty where none is."""
    base = mesh.surface[:, :3]
    base = base[mesh.fixed[base].all(axis=1)]
    n = len(mesh.points)
    ends = base.ravel(), np.roll(base, 1, axis=1).ravel()
    links = sp.coo_matrix((np.ones(base.size), ends), shape=(n, n))
    part = connected_components(links, directed=False)[1][base[:, 0]]
    size, feet = float(np.ptp(mesh.points, axis=0).max()), []
    for each in np.unique(part):
        own = base[part == each]
        pairs, count = np.unique(
            np.sort(own[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True
        )
        length = np.linalg.norm(mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]], axis=1)
        width = 4 * float(triangle_areas(mesh.points, own).sum() / length[count == 1].sum())
        edge_m = width * max(_STANDS * width / size, _FINEST_FOOT)
        if np.median(length) > edge_m:
            feet.append((np.unique(own), edge_m))
    return feet


def refinement_key(mesh: TetMesh) -> tuple[str | float, ...]:
    """Of what is kept that hangs on how feet are refined and on a shape: nothing where there is neither."""
    drawn = () if mesh.shape is None else ("drawn",)
    return (*drawn, *(edge_m for _, edge_m in coarse_feet(mesh)))


def drawn_to_shape(mesh: TetMesh, shape: TrueShape | None) -> TetMesh:
    """The linear mesh with its touchable nodes on its shape, as far as its elements stay sound; as it is
    where none is known."""
    if shape is None:
        return mesh
    nodes = np.unique(mesh.touchable_surface)
    nodes = nodes[~mesh.fixed[nodes]]
    points = moved_soundly(mesh.points, nodes, shape.foot(mesh.points[nodes])[0], mesh.tetrahedra)
    return TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable)


def moved_soundly(points: np.ndarray, nodes: np.ndarray, to: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """(n, 3) m, points with `nodes` (k,) moved `to` (k, 3), or as far as their tetrahedra keep
    _LEAST_VOLUME."""
    mine = np.zeros(len(points), dtype=bool)
    mine[nodes] = True
    near = tets[mine[tets].any(axis=1)]
    before, share = tet_volumes(points, near), np.zeros(len(points))
    share[nodes] = 1.0
    way = np.zeros_like(points)
    way[nodes] = to - points[nodes]
    for _ in range(8):
        moved = points + share[:, None] * way
        bad = tet_volumes(moved, near) < _LEAST_VOLUME * before
        if not bad.any():
            return moved
        back = np.unique(near[bad])
        share[back] = np.where(share[back] > 0.2, share[back] - 0.25, 0.0)
    return points


def refined_around(
    mesh: TetMesh, centre_m: np.ndarray, radius_m: float, edge_m: float
) -> tuple[TetMesh, np.ndarray]:
    """(linear mesh, parent) with the edges longer than `edge_m` of a sphere's tetrahedra halved once."""
    mesh = mesh.linear()
    inside = np.linalg.norm(mesh.points - np.asarray(centre_m), axis=1) < radius_m + edge_m / 2
    return _halved(mesh, inside, edge_m)


def _halved(mesh: TetMesh, chosen: np.ndarray, edge_m: float) -> tuple[TetMesh, np.ndarray]:
    """One round: the longer edges with an end on a chosen node are bisected once.

    The longest first, which keeps neighbours conforming.
    """
    n = len(mesh.points)
    tets = mesh.tetrahedra
    ends = np.sort(tets[:, EDGES].reshape(-1, 2), axis=1)
    pairs = np.column_stack(np.divmod(np.unique(ends[:, 0] * np.int64(n) + ends[:, 1]), n))
    length = np.linalg.norm(mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]], axis=1)
    marked = pairs[chosen[pairs].any(axis=1) & (length > edge_m)]
    if not len(marked):
        return mesh, np.arange(len(tets))
    length = np.linalg.norm(mesh.points[marked[:, 0]] - mesh.points[marked[:, 1]], axis=1)
    marked = marked[np.argsort(-length, kind="stable")]
    points = np.vstack([mesh.points, mesh.points[marked].mean(axis=1)])
    key = marked[:, 0] * n + marked[:, 1]
    order = np.argsort(key)
    parent = np.arange(len(tets))
    while True:
        ends = np.sort(tets[:, EDGES], axis=2)
        old = (ends < n).all(axis=2)
        wanted = np.where(old, ends[..., 0] * n + ends[..., 1], -1)
        found = np.minimum(np.searchsorted(key[order], wanted), len(key) - 1)
        rank = np.where(key[order][found] == wanted, order[found], len(key))
        first = rank.argmin(axis=1)
        rows = np.flatnonzero(rank[np.arange(len(tets)), first] < len(key))
        if not len(rows):
            break
        edge = EDGES[first[rows]]
        middle = n + rank[rows, first[rows]]
        one, other = tets[rows].copy(), tets[rows].copy()
        one[np.arange(len(rows)), edge[:, 0]] = middle
        other[np.arange(len(rows)), edge[:, 1]] = middle
        tets = tets.copy()
        tets[rows] = one
        tets = np.vstack([tets, other])
        parent = np.concatenate([parent, parent[rows]])
    quadratic = _edge_flags(mesh, marked)
    fixed = np.concatenate([mesh.fixed, quadratic[0]])
    touchable = np.concatenate([mesh.touchable, quadratic[1]])
    return TetMesh(points, tets, fixed, touchable), parent


def _edge_flags(mesh: TetMesh, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(fixed, touchable) of the middles of `edges` (k, 2), by the rule of TetMesh.quadratic."""
    n = len(mesh.points)
    key = edges[:, 0] * np.int64(n) + edges[:, 1]

    def on(triangles: np.ndarray) -> np.ndarray:
        pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        return np.isin(key, pairs[:, 0] * np.int64(n) + pairs[:, 1])

    fixed = on(mesh.surface[mesh.fixed[mesh.surface].all(axis=1)])
    return fixed, on(mesh.touchable_surface) & ~fixed
