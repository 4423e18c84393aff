"""A tetrahedral mesh with its fixed base and touchable surface; linear or quadratic, in VTK node order.

A structured block: the mesh of reference problems in tests and benchmarks.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.mechanics.errors import MeshError
from palpate.mechanics.shape.true_shape import TrueShape

FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Corner triples of a tetrahedron's faces, outward for positive volume; face i is opposite to corner i."""

EDGES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
"""Corner pairs of the mid-edge nodes 4 to 9, VTK's order."""

_EDGE_NODE = {tuple(sorted(e)): 4 + k for k, e in enumerate(EDGES.tolist())}
FACES6 = np.array(
    [[*f, *(_EDGE_NODE[tuple(sorted((f[i], f[(i + 1) % 3])))] for i in range(3))] for f in FACES.tolist()]
)
"""Quadratic faces: three corners, then the mid nodes of edges 01, 12, 20 (VTK's quadratic triangle)."""


@dataclass(frozen=True)
class TetMesh:
    """points: (n, 3) m, device frame. tetrahedra: (m, 4) linear or (m, 10) quadratic, VTK order.

    fixed: (n,) bool, base nodes with zero displacement. touchable: (n,) bool, surface nodes off the base.
    shape: the surface that the mesh fills, where that is known; None where the mesh is all there is.
    Raises MeshError where shapes disagree, a volume is not positive, or nothing is fixed or touchable.
    """

    points: np.ndarray
    tetrahedra: np.ndarray
    fixed: np.ndarray
    touchable: np.ndarray
    shape: TrueShape | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", np.ascontiguousarray(self.points, dtype=float))
        object.__setattr__(self, "tetrahedra", np.ascontiguousarray(self.tetrahedra, dtype=np.int64))
        object.__setattr__(self, "fixed", np.ascontiguousarray(self.fixed, dtype=bool))
        object.__setattr__(self, "touchable", np.ascontiguousarray(self.touchable, dtype=bool))
        n = len(self.points)
        if self.tetrahedra.ndim != 2 or self.tetrahedra.shape[1] not in (4, 10) or not len(self.tetrahedra):
            raise MeshError(f"tetrahedra must be (m, 4) or (m, 10) with m > 0; got {self.tetrahedra.shape}")
        if self.fixed.shape != (n,) or self.touchable.shape != (n,):
            raise MeshError("fixed and touchable need one value a node")
        if self.tetrahedra.min() < 0 or self.tetrahedra.max() >= n:
            raise MeshError("a tetrahedron names a node that does not exist")
        if not np.isfinite(self.points).all():
            raise MeshError("a node's position is not finite")
        if self.volumes.min() <= 0:
            bad = int((self.volumes <= 0).sum())
            raise MeshError(f"{bad} tetrahedra are flat or inverted: mesh the surface again")
        for array in (self.points, self.tetrahedra, self.fixed, self.touchable):
            array.setflags(write=False)

    @property
    def order(self) -> int:
        """1 linear, 2 quadratic."""
        return 1 if self.tetrahedra.shape[1] == 4 else 2

    @cached_property
    def volumes(self) -> np.ndarray:
        """(m,) m^3, of the straight-sided tetrahedra."""
        return tet_volumes(self.points, self.tetrahedra)

    @cached_property
    def surface(self) -> np.ndarray:
        """(k, 3) or (k, 6): the whole boundary, base included, outward by the right-hand rule."""
        faces = FACES if self.order == 1 else FACES6
        return self.tetrahedra[:, faces].reshape(-1, faces.shape[1])[self._boundary]

    @cached_property
    def _boundary(self) -> np.ndarray:
        """Faces of one tetrahedron alone, ascending, as 4 x tetrahedron + face."""
        return lone_faces(self.tetrahedra)

    @cached_property
    def touchable_surface(self) -> np.ndarray:
        """The triangles of `surface` that are not part of the base (not all of whose corners are fixed)."""
        return self.surface[self._off_base]

    @cached_property
    def touchable_elements(self) -> np.ndarray:
        """The tetrahedron behind each triangle of `touchable_surface`."""
        return self._boundary[self._off_base] // 4

    @property
    def _off_base(self) -> np.ndarray:
        return ~self.fixed[self.surface[:, :3]].all(axis=1)

    def linear(self) -> TetMesh:
        """The corners alone, as a linear mesh whose nodes keep their order."""
        if self.order == 1:
            return self
        used = np.unique(self.tetrahedra[:, :4])
        index = np.full(len(self.points), -1)
        index[used] = np.arange(len(used))
        return TetMesh(
            self.points[used],
            index[self.tetrahedra[:, :4]],
            self.fixed[used],
            self.touchable[used],
            self.shape,
        )

    def quadratic(self) -> TetMesh:
        """The same tetrahedra with straight mid-edge nodes appended after the corners.

        A mid-edge node is fixed where both ends are and the edge lies on a base triangle, touchable where its
        edge lies on the touchable surface and it is not fixed.
        """
        if self.order == 2:
            return self
        edges = np.sort(self.tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
        n = len(self.points)
        key, inverse = np.unique(edges[:, 0] * np.int64(n) + edges[:, 1], return_inverse=True)
        unique = np.column_stack(np.divmod(key, n))
        mid = n + inverse.reshape(-1, 6)

        def on(triangles: np.ndarray) -> np.ndarray:
            pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
            return np.isin(key, pairs[:, 0] * np.int64(n) + pairs[:, 1])

        base = self.surface[self.fixed[self.surface].all(axis=1)]
        fixed_mid = on(base)
        touch_mid = on(self.touchable_surface) & ~fixed_mid
        return TetMesh(
            np.vstack([self.points, self.points[unique].mean(axis=1)]),
            np.hstack([self.tetrahedra, mid]),
            np.concatenate([self.fixed, fixed_mid]),
            np.concatenate([self.touchable, touch_mid]),
            self.shape,
        )


def tet_volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """(m,) m^3, of straight tetrahedra (m, 4 or more), negative where turned inside out."""
    a, b, c, d = np.moveaxis(points[tetrahedra[:, :4]], 1, 0)
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def lone_faces(tetrahedra: np.ndarray) -> np.ndarray:
    """Faces of one tetrahedron alone, ascending, as 4 x tetrahedron + face. tetrahedra: (m, 4 or 10)."""
    faces = np.sort(tetrahedra[:, FACES].reshape(-1, 3), axis=1).astype(np.int64)
    n = int(faces.max(initial=0)) + 1
    # one number a face: far faster to sort than rows
    key = (faces[:, 0] * n + faces[:, 1]) * n + faces[:, 2]
    _, first, counts = np.unique(key, return_index=True, return_counts=True)
    return np.sort(first[counts == 1])


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n, 3) unit outward normals, weighted by the triangles' area; zero where no triangle touches a node."""
    # far faster than rows' cross products added one by one, and the touch window does it at every picture
    x, y, z = (np.take(axis, triangles[:, :3].T) for axis in points.T)
    (ax, bx), (ay, by), (az, bz) = ((c[1:] - c[0]) for c in (x, y, z))
    area = (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    nodes = triangles.T.ravel()
    each = (np.tile(axis, triangles.shape[1]) for axis in area)
    normals = np.stack([np.bincount(nodes, axis, len(points)) for axis in each], axis=1)
    length = np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
    return normals / np.where(length > 0, length, 1.0)


def box_mesh(cells: tuple[int, int, int], size: tuple[float, float, float], grade: float = 1.0) -> TetMesh:
    """A box, size in m, base at z = 0 fixed, centred in x and y, six tetrahedra a cell.

    cells: along x, y, z. grade > 1 makes cells finer towards the middle of the top.
    """
    axes = []
    for k, (count, length) in enumerate(zip(cells, size, strict=True)):
        t = np.linspace(0, 1, count + 1)
        if k < 2:
            s = 2 * t - 1
            axes.append(np.sign(s) * np.abs(s) ** grade * length / 2)
        else:
            axes.append((1 - (1 - t) ** grade) * length)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    points = grid.reshape(-1, 3)
    index = np.arange(len(points)).reshape(grid.shape[:3])
    nx, ny, nz = cells
    corner = {
        (i, j, k): index[i : nx + i, j : ny + j, k : nz + k].ravel()
        for i, j, k in itertools.product((0, 1), repeat=3)
    }
    tetrahedra = []
    for order in itertools.permutations(range(3)):
        bits, path = [0, 0, 0], [corner[(0, 0, 0)]]
        for axis in order:
            bits[axis] = 1
            path.append(corner[bits[0], bits[1], bits[2]])
        tets = np.stack(path, axis=1)
        p = points[tets[0]]
        if np.linalg.det(p[1:] - p[0]) < 0:
            tets = tets[:, [0, 2, 1, 3]]
        tetrahedra.append(tets)
    fixed = points[:, 2] == 0
    inside = np.abs(points[:, :2]) < np.array(size[:2]) / 2 - 1e-12
    surface = ~(inside.all(axis=1) & (points[:, 2] < size[2] - 1e-12))
    return TetMesh(points, np.vstack(tetrahedra), fixed, surface & ~fixed)
