"""A file's surface in small triangles that are cut apart along creases: what a felt surface is made of.

A file is as coarse as its maker left it: 12 triangles for a box, strips as long as a wall for a cylinder.
Vertex normals of such triangles bend plane faces, and the nearest of them is not the one whose middle is.

The surface that a tip feels, curved between its fine vertices: where the nodes of a mesh belong.

An object's own tetrahedra made fine under a tip: bisected (Rivara 1984), quadratic, curved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.elastic.elasticity import shape_derivatives
from palpate.mechanics.errors import MeshError
from palpate.mechanics.kernels import kernel
from palpate.mechanics.shape.nearest import facings
from palpate.mechanics.shape.tetmesh import EDGES, FACES, TetMesh, lone_faces, tet_volumes, vertex_normals
from palpate.mechanics.shape.true_shape import TrueShape

LONGEST_M = 0.003
"""Longest edge."""
_SAME_M, _SAME_TURN = 1.2345e-8, 1.2345e-3
"""Corners this near, whose normals are this near, are one vertex; no round parts of a file's own lengths."""


def even_surface(
    vertices: np.ndarray, triangles: np.ndarray, longest_m: float = LONGEST_M
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) m and triangles (k, 3) on the shape whose file is (v, 3) m and (m, 3), closed, outward.

    Triangles are halved until no edge of theirs in the file's plane exceeds longest_m. What is new lies on
    the curved shape (mechanics.shape.true_shape), and the two sides of a crease share no vertices.
    """
    shape = TrueShape(vertices, triangles)
    corner = shape.vertices[shape.triangles]
    parent, weights = np.arange(len(corner)), np.tile(np.eye(3), (len(corner), 1, 1))
    while True:
        flat = np.einsum("kcw,kwx->kcx", weights, corner[parent])
        length = np.linalg.norm(np.roll(flat, -1, axis=1) - flat, axis=2)
        # neighbours agree on what is too long, so no corner ends on another's edge
        long = np.flatnonzero(length.max(axis=1) > longest_m * (1 + 1e-9))
        if not len(long):
            break
        turned = (length[long].argmax(axis=1)[:, None] + np.arange(3)) % 3
        start, end, tip = np.moveaxis(weights[long[:, None], turned], 1, 0)
        middle = (start + end) / 2
        weights[long] = np.stack([start, middle, tip], axis=1)
        weights = np.concatenate([weights, np.stack([middle, end, tip], axis=1)])
        parent = np.concatenate([parent, parent[long]])
    points, normals = shape.on(np.repeat(parent, 3), weights.reshape(-1, 3))
    key = np.rint(np.hstack([points / _SAME_M, normals / _SAME_TURN])).astype(np.int64)
    _, first, vertex = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return points[first], vertex.reshape(-1, 3)


_SMOOTH_COSINE = 0.85
"""A vertex normal further than some 32 degrees from a triangle's own belongs to a crease: it stays flat."""


class CurvedSurface:
    """A closed surface of fine triangles, curved by its vertex normals; answers nearest-point questions.

    vertices: (v, 3) m. triangles: (k, 3), outward, none much longer than its neighbours. curved: False keeps
    the triangles flat. Between vertices the surface is the mean of the point and its projections onto the
    corners' tangent planes (Boubekeur & Alexa, Phong Tessellation, 2008, with their factor 1/2, which is
    exact for a paraboloid).
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray, *, curved: bool = True) -> None:
        self.vertices = np.ascontiguousarray(vertices, dtype=float)
        self.triangles = np.ascontiguousarray(triangles, dtype=np.int64)
        corner = self.vertices[self.triangles]
        self._tree = cKDTree(corner.mean(axis=1))
        self._candidates = min(24, len(corner))
        normals = vertex_normals(self.vertices, self.triangles)[self.triangles]
        _, facing = facings(self.vertices, self.triangles)
        smooth = np.einsum("kci,ki->kc", normals, facing) > _SMOOTH_COSINE
        self._normals = np.where(smooth[..., None] & curved, normals, 0.0)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """(k, 3) m, the places of the surface nearest to points (k, 3) m."""
        points = np.ascontiguousarray(np.atleast_2d(points), dtype=float)
        _, near = self._tree.query(points, k=self._candidates)
        near = near.reshape(len(points), -1)
        found, weights = np.empty_like(points), np.empty_like(points)
        triangle = np.empty(len(points), dtype=np.int64)
        _nearest(points, near, self.vertices, self.triangles, found, triangle, weights)
        corner, normals = self.vertices[self.triangles[triangle]], self._normals[triangle]
        over = np.einsum("kci,kci->kc", found[:, None] - corner, normals)
        return found - 0.5 * np.einsum("kc,kc,kci->ki", weights, over, normals)


@kernel
def _nearest(points, near, vertices, triangles, found, triangle, weights):
    """The nearest point of the candidate triangles `near` (k, c) to each point (Ericson 2005, 5.1)."""
    for k in range(points.shape[0]):
        least = np.inf
        px, py, pz = points[k, 0], points[k, 1], points[k, 2]
        for c in range(near.shape[1]):
            t = near[k, c]
            i, j, l = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            ax, ay, az = vertices[i, 0], vertices[i, 1], vertices[i, 2]
            ux, uy, uz = vertices[j, 0] - ax, vertices[j, 1] - ay, vertices[j, 2] - az
            vx, vy, vz = vertices[l, 0] - ax, vertices[l, 1] - ay, vertices[l, 2] - az
            wx, wy, wz = px - ax, py - ay, pz - az
            uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
            uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
            area = uu * vv - uv * uv
            s, r = vv * uw - uv * vw, uu * vw - uv * uw
            if area > 0.0 and s >= 0.0 and r >= 0.0 and s + r <= area:
                s /= area
                r /= area
            else:
                # the nearest of the three edges
                best = np.inf
                s_best, r_best = 0.0, 0.0
                for edge in range(3):
                    if edge == 0:
                        at = min(max(uw / max(uu, 1e-300), 0.0), 1.0)
                        s, r = at, 0.0
                    elif edge == 1:
                        at = min(max(vw / max(vv, 1e-300), 0.0), 1.0)
                        s, r = 0.0, at
                    else:
                        at = (uu - uv + vw - uw) / max(uu + vv - 2 * uv, 1e-300)
                        at = min(max(at, 0.0), 1.0)
                        s, r = 1.0 - at, at
                    dx, dy, dz = wx - s * ux - r * vx, wy - s * uy - r * vy, wz - s * uz - r * vz
                    away = dx * dx + dy * dy + dz * dz
                    if away < best:
                        best, s_best, r_best = away, s, r
                s, r = s_best, r_best
            dx, dy, dz = wx - s * ux - r * vx, wy - s * uy - r * vy, wz - s * uz - r * vz
            away = dx * dx + dy * dy + dz * dz
            if away < least:
                least = away
                triangle[k] = t
                found[k, 0], found[k, 1], found[k, 2] = px - dx, py - dy, pz - dz
                weights[k, 0], weights[k, 1], weights[k, 2] = 1.0 - s - r, s, r


GAUSS = np.full((4, 4), 0.1381966011250105)
GAUSS[np.arange(4), np.arange(4)] = 0.5854101966249685
"""Barycentric points of the four-point rule, each of a quarter of the weight; exact for quadratics."""

_MOST_ROUNDS, _MOST_TETRAHEDRA = 200, 150_000
_LEAST_VOLUME = 0.25
"""A node goes no further to the surface than leaves its tetrahedra this share of their volume."""


@dataclass(frozen=True)
class GradedMesh:
    """points (n, 3) m; cells (m, 10) in VTK's order; fixed (n,) bool; faces (k, 6), the touchable boundary;
    parent (m,), the tetrahedron of the object's mesh that each cell lies in."""

    points: np.ndarray
    cells: np.ndarray
    fixed: np.ndarray
    faces: np.ndarray
    parent: np.ndarray


def drawn_to(mesh: TetMesh, surface: CurvedSurface | None) -> TetMesh:
    """The linear mesh with its touchable nodes on the felt surface, as far as its cells stay sound."""
    mesh = mesh.linear()
    if surface is None:
        return mesh
    shell = np.unique(mesh.touchable_surface)
    shell = shell[~mesh.fixed[shell]]
    points = _moved(mesh.points, shell, surface.nearest(mesh.points[shell]), mesh.tetrahedra)
    return TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable)


def graded_mesh(
    mesh: TetMesh, surface: CurvedSurface | None, size: Callable[[np.ndarray], np.ndarray]
) -> GradedMesh:
    """Bisect until no tetrahedron's longest edge exceeds `size(its centroid)`, m, and make it quadratic.

    mesh: linear. New nodes of the touchable boundary lie on the surface where the elements stay sound.
    """
    points, tets, fixed = mesh.points, mesh.tetrahedra, mesh.fixed
    parent = np.arange(len(tets))
    for _ in range(_MOST_ROUNDS):
        ends, of_tet, longest, length = _longest_edges(points, tets)
        too_long = length[longest] > size(points[tets].mean(axis=1))
        if not too_long.any():
            break
        if len(tets) > _MOST_TETRAHEDRA:
            raise MeshError(f"a graded mesh grew beyond {_MOST_TETRAHEDRA} tetrahedra: use a coarser mesh")
        split = _splittable(of_tet, longest, too_long, len(ends))
        points, tets, fixed, parent = _bisected(points, tets, fixed, parent, (ends, longest, split), surface)
    flat = TetMesh(points, tets, fixed, ~fixed)
    whole = flat.quadratic()
    faces = whole.touchable_surface
    return GradedMesh(_curved(whole, faces, surface), whole.tetrahedra, whole.fixed, faces, parent)


def _longest_edges(
    points: np.ndarray, tets: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(ends (e, 2), edges of each tetrahedron (m, 6), its longest (m,), lengths (e,))."""
    pairs = np.sort(tets[:, EDGES].reshape(-1, 2), axis=1)
    n = np.int64(len(points))
    key, inverse = np.unique(pairs[:, 0] * n + pairs[:, 1], return_inverse=True)
    of_tet = inverse.reshape(-1, 6)
    ends = np.column_stack(np.divmod(key, n))
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    # a strict order of all edges, so that neighbours agree on the longest
    rank = np.empty(len(ends), dtype=np.int64)
    rank[np.lexsort((np.arange(len(ends)), np.round(length, 12)))] = np.arange(len(ends))
    longest = of_tet[np.arange(len(tets)), rank[of_tet].argmax(axis=1)]
    return ends, of_tet, longest, length


def _splittable(of_tet: np.ndarray, longest: np.ndarray, too_long: np.ndarray, edges: int) -> np.ndarray:
    """(e,) bool: marked edges that are the longest of all their tetrahedra, marks spread to neighbours."""
    marked = np.zeros(edges, dtype=bool)
    marked[longest[too_long]] = True
    while True:
        touched = longest[marked[of_tet].any(axis=1)]
        if marked[touched].all():
            break
        marked[touched] = True
    shared = np.bincount(of_tet.ravel(), minlength=edges)
    return marked & (shared == np.bincount(longest, minlength=edges))


def _bisected(
    points: np.ndarray,
    tets: np.ndarray,
    fixed: np.ndarray,
    parent: np.ndarray,
    cut: tuple[np.ndarray, np.ndarray, np.ndarray],
    surface: CurvedSurface | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    ends, longest, split = cut
    n, (a, b) = len(points), ends[split].T
    number = np.full(len(ends), -1)
    number[split] = n + np.arange(len(a))
    rows = np.flatnonzero(split[longest])
    edge = longest[rows]
    one, other = tets[rows].copy(), tets[rows].copy()
    one[one == ends[edge, 1][:, None]] = number[edge]
    other[other == ends[edge, 0][:, None]] = number[edge]
    lone = lone_faces(tets)
    boundary = tets[lone // 4][np.arange(len(lone))[:, None], FACES[lone % 4]]
    base = fixed[boundary].all(axis=1)
    key = a * np.int64(n) + b
    on_base = np.isin(key, _edge_keys(boundary[base], n))
    on_shell = np.isin(key, _edge_keys(boundary[~base], n)) & ~on_base
    tets, parent = tets.copy(), np.concatenate([parent, parent[rows]])
    tets[rows] = one
    tets = np.vstack([tets, other])
    points = np.vstack([points, (points[a] + points[b]) / 2])
    if surface is not None and on_shell.any():
        new = n + np.flatnonzero(on_shell)
        points = _moved(points, new, surface.nearest(points[new]), tets)
    return points, tets, np.concatenate([fixed, on_base]), parent


def _edge_keys(triangles: np.ndarray, n: int) -> np.ndarray:
    pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return pairs[:, 0] * np.int64(n) + pairs[:, 1]


def _moved(points: np.ndarray, nodes: np.ndarray, to: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """`points` with `nodes` moved `to` (k, 3), or as far as their tetrahedra keep _LEAST_VOLUME."""
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


def _curved(mesh: TetMesh, faces: np.ndarray, surface: CurvedSurface | None) -> np.ndarray:
    """The quadratic mesh's points with the boundary's middles on the surface where the cells stay sound."""
    if surface is None:
        return mesh.points
    n = int(mesh.tetrahedra[:, :4].max()) + 1
    ends = np.empty((len(mesh.points), 2), dtype=np.int64)
    ends[mesh.tetrahedra[:, 4:]] = mesh.tetrahedra[:, EDGES]
    middles = np.unique(faces[:, 3:])
    middles = middles[(middles >= n) & ~mesh.fixed[middles]]
    to = surface.nearest(mesh.points[middles])
    length = np.linalg.norm(mesh.points[ends[middles, 0]] - mesh.points[ends[middles, 1]], axis=1)
    # an edge that cuts across a sharp rim is left straight
    close = np.linalg.norm(to - mesh.points[middles], axis=1) < 0.15 * length
    bent = mesh.points.copy()
    bent[middles[close]] = to[close]
    chosen = np.zeros(len(bent), dtype=bool)
    chosen[middles[close]] = True
    cells = mesh.tetrahedra[chosen[mesh.tetrahedra].any(axis=1)]
    straight = 6 * tet_volumes(mesh.points, cells)
    for _ in range(10):
        bad = _least_jacobian(bent, cells) < 0.25 * straight
        if not bad.any():
            return bent
        back = np.unique(cells[bad][:, 4:])
        bent[back] = mesh.points[back]
    return mesh.points


def _least_jacobian(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    least = np.full(len(cells), np.inf)
    for at in np.vstack([GAUSS, np.eye(4)]):
        slope = shape_derivatives(2, at)
        jacobian = np.einsum("ax,eay->exy", slope[:, 1:] - slope[:, :1], points[cells])
        least = np.minimum(least, np.linalg.det(jacobian))
    return least
