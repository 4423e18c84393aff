"""An object's own tetrahedra made fine under a tip: bisected (Rivara 1984), quadratic, their nodes on the
curved surface that a tip feels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.elastic.elasticity import shape_derivatives
from palpate.mechanics.errors import MeshError
from palpate.mechanics.shape.nearest import Closest
from palpate.mechanics.shape.refine import moved_soundly
from palpate.mechanics.shape.tetmesh import EDGES, FACES, TetMesh, lone_faces, tet_volumes
from palpate.mechanics.shape.true_shape import TrueShape


class CurvedSurface:
    """The curved shape (mechanics.shape.true_shape) whose file is vertices (v, 3) m and triangles (k, 3),
    closed, outward; answers nearest-point questions."""

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray) -> None:
        self._shape = TrueShape(vertices, triangles)
        self._closest = Closest(self._shape.vertices, self._shape.triangles)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """(k, 3) m, the places of the surface nearest to points (k, 3) m."""
        points = np.atleast_2d(points)
        foot, normals = self._over(points)
        # a patch is drawn out beside a round rim: what is over a place of its triangle lies aside of it
        away = points - foot
        aside = away - np.einsum("ki,ki->k", away, normals)[:, None] * normals
        return self._over(points + aside)[0]

    def _over(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (k, 3) m over those of the file's triangles nearest to points (k, 3) m, normals (k, 3)."""
        _, triangle, weights = self._closest(points)
        return self._shape.on(triangle, weights)


GAUSS = np.full((4, 4), 0.1381966011250105)
GAUSS[np.arange(4), np.arange(4)] = 0.5854101966249685
"""Barycentric points of the four-point rule, each of a quarter of the weight; exact for quadratics."""

_MOST_ROUNDS, _MOST_TETRAHEDRA = 200, 150_000


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
    points = moved_soundly(mesh.points, shell, surface.nearest(mesh.points[shell]), mesh.tetrahedra)
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
        points = moved_soundly(points, new, surface.nearest(points[new]), tets)
    return points, tets, np.concatenate([fixed, on_base]), parent


def _edge_keys(triangles: np.ndarray, n: int) -> np.ndarray:
    pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return pairs[:, 0] * np.int64(n) + pairs[:, 1]


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
