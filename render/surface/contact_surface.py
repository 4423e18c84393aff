"""The contact surface: the model's surface, rounded between its nodes and cut fine enough to slide on
unnoticed.

A mesh of 10 mm facets would be felt as facets. Cubic patches through the nodes (PN triangles: Vlachos et al.,
Curved PN Triangles, 2001) follow the shape between them; edges where normals jump stay edges, but the
*contact normal* turns over a few millimetres there, as it does under a sphere that rolls over a soft edge, so
that no force steps. Everything here is made once; the 1 kHz side reads flat arrays.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from palpate.mechanics.errors import MeshError
from palpate.mechanics.shape.nearest import facings, neighbours
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.render.surface.bvh import Bvh, build_bvh
from palpate.render.surface.shaped import (
    EASED_AGREEMENT,
    EDGE_ROUNDING_M,
    NORMAL_SMOOTHING_M,
    RIM_STRIP_M,
    Feet,
    halved_where_bent,
    on_shape,
)
from palpate.render.surface.triangles import pseudonormals

CREASE_DEGREES = 35.0


class SurfaceArrays(NamedTuple):
    """What the kernels read; v fine vertices, k fine triangles.

    vertices, normals: (v, 3). triangles: (k, 3) outward. neighbours: (k, 3) triangle across edge i -> i+1, -1
    none. free: (k,) 1 where the triangle may be touched, 0 on the base. bvh: over the triangles.
    vertex_pseudo (v, 3), edge_pseudo (k, 3, 3): pseudonormals that tell inside from outside.
    """

    vertices: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    neighbours: np.ndarray
    free: np.ndarray
    vertex_pseudo: np.ndarray
    edge_pseudo: np.ndarray
    bvh: Bvh


@dataclass(frozen=True)
class ContactSurface:
    """Fine surface of a mesh. arrays: for kernels. nodes (v, 3), node_weights (v, 3): the mesh nodes whose
    linear interpolation holds at a vertex; parents (k, 3): mesh nodes that interpolate over triangle k;
    parent_weights (k, 3, 3): their weights at the triangle's corners."""

    arrays: SurfaceArrays
    nodes: np.ndarray
    node_weights: np.ndarray
    parents: np.ndarray
    parent_weights: np.ndarray

    def flat(self) -> dict[str, np.ndarray]:
        """All its arrays by name, for a file."""
        given = self.arrays._asdict()
        tree = given.pop("bvh")._asdict()
        own = {each.name: getattr(self, each.name) for each in fields(self) if each.name != "arrays"}
        return {**given, **{f"bvh_{name}": array for name, array in tree.items()}, **own}

    @classmethod
    def from_flat(cls, flat: Mapping[str, np.ndarray]) -> ContactSurface:
        """The inverse of `flat`; the arrays are copied, since the kernels know only writable ones."""
        copies = {name: np.array(array) for name, array in flat.items()}
        bvh = Bvh(**{name: copies.pop(f"bvh_{name}") for name in Bvh._fields})
        arrays = SurfaceArrays(bvh=bvh, **{n: copies.pop(n) for n in SurfaceArrays._fields if n != "bvh"})
        return cls(arrays, **copies)

    @property
    def edge_m(self) -> float:
        """Median length of the fine edges, m."""
        p = self.arrays.vertices[self.arrays.triangles]
        return float(np.median(np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2)))


LARGEST = 60_000


def contact_surface(mesh: TetMesh, *, edge_m: float = 2.5e-3, strip_m: float = RIM_STRIP_M) -> ContactSurface:
    """Round and refine a mesh's boundary to about `edge_m`, with at most about LARGEST triangles.

    Where the mesh's shape is known every vertex is put onto it, and edges are halved where it bends; the
    contact normal turns within strip_m of its sharp rims.
    Raises MeshError where the boundary is not closed.
    """
    shape = mesh.shape
    corners = mesh.surface[:, :3]
    touchable = ~mesh.fixed[corners].all(axis=1)
    edges = mesh.points[corners] - mesh.points[np.roll(corners, 1, axis=1)]
    longest = float(np.median(np.linalg.norm(edges, axis=2)))
    parts = max(1, round(longest / edge_m))
    while parts > 1 and len(corners) * parts**2 > LARGEST:
        parts -= 1
    barycentric, cells = _lattice(parts)
    corner_normals = _corner_normals(mesh.points, corners, touchable)
    positions = _pn_patch(
        mesh.points[corners], corner_normals, _flat_edges(corners, corner_normals), barycentric
    )
    index, count = _merged(corners, parts)
    vertices = np.zeros((count, 3))
    vertices[index] = positions
    triangles = index[:, cells].reshape(-1, 3)
    free = np.repeat(touchable, len(cells)).astype(np.int64)
    parents = np.repeat(corners, len(cells), axis=0)
    parent_weights = np.tile(barycentric[cells], (len(corners), 1, 1))
    if shape is not None:
        feet = Feet(shape)
        vertices, triangles, within, parent_weights = halved_where_bent(
            feet, vertices, triangles, free, parent_weights, LARGEST
        )
        free, parents = free[within], parents[within]
        placed = on_shape(feet, mesh, vertices, triangles, free, parent_weights, strip_m, LARGEST)
        vertices, triangles, parent_weights = placed.vertices, placed.triangles, placed.weights
        free, parents = free[placed.within], parents[placed.within]
    across = neighbours(triangles)
    if (across < 0).any():
        raise MeshError("the mesh's boundary is not closed: mesh the surface again")
    nodes = np.zeros((len(vertices), 3), dtype=np.int64)
    node_weights = np.zeros((len(vertices), 3))
    for corner in range(3):
        nodes[triangles[:, corner]] = parents
        node_weights[triangles[:, corner]] = parent_weights[:, corner]
    if shape is None:
        vertices = _rounded_edges(vertices, triangles, free)
    arrays = with_vertices(vertices, triangles, across, free)
    if shape is not None:
        arrays = arrays._replace(normals=placed.normals)
    return ContactSurface(arrays, nodes, node_weights, parents, parent_weights)


def with_vertices(
    vertices: np.ndarray, triangles: np.ndarray, neighbours: np.ndarray, free: np.ndarray
) -> SurfaceArrays:
    """The kernels' arrays for these vertices: normals, pseudonormals and search tree."""
    area, face = facings(vertices, triangles)
    edge_pseudo = face[:, None, :] + face[neighbours]
    return SurfaceArrays(
        vertices=np.ascontiguousarray(vertices),
        normals=_smooth_normals(vertices, triangles, free, area),
        triangles=np.ascontiguousarray(triangles, dtype=np.int64),
        neighbours=neighbours,
        free=free,
        vertex_pseudo=pseudonormals(vertices, triangles),
        edge_pseudo=np.ascontiguousarray(edge_pseudo),
        bvh=build_bvh(vertices[triangles]),
    )


def _rounded_edges(vertices: np.ndarray, triangles: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Vertices with the creases between touchable triangles eased over some EDGE_ROUNDING_M.

    Over a sharp edge a tip that is held by friction would snap from one face to the other. Near a crease a
    vertex moves to the mean of the surface around it, an integral, so that an irregular mesh makes an even
    rim. A fine mesh too coarse for that stays as it is.
    """
    touch = triangles[free > 0]
    p = vertices[touch]
    area = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) / 2
    if np.median(np.linalg.norm(p[:, 1] - p[:, 0], axis=1)) > 2 * EDGE_ROUNDING_M:
        return vertices
    # the middles of its edges integrate a triangle to second order
    places = ((p + np.roll(p, -1, axis=1)) / 2).reshape(-1, 3)
    parts = np.repeat(area / 3, 3, axis=0)
    size = np.linalg.norm(parts, axis=1)
    own = np.setdiff1d(touch, triangles[free == 0])
    normals = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normals, touch[:, corner], area)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    pairs = cKDTree(vertices[own]).sparse_distance_matrix(
        cKDTree(places), 2.5 * EDGE_ROUNDING_M, output_type="ndarray"
    )
    row, column = pairs["i"], pairs["j"]
    weight = size[column] * np.exp(-((pairs["v"] / EDGE_ROUNDING_M) ** 2) / 2)
    # the far side of a thin wall is no neighbour
    weight *= np.einsum("ij,ij->i", normals[own][row], parts[column]) > -0.3 * size[column]
    around = sp.csr_matrix((weight, (row, column)), shape=(len(own), len(places)))
    total = np.maximum(np.asarray(around.sum(axis=1)), 1e-300)
    agreement = np.linalg.norm(around @ (parts / np.maximum(size, 1e-300)[:, None]), axis=1) / total[:, 0]
    flat, crease = EASED_AGREEMENT
    share = np.clip((flat - agreement) / (flat - crease), 0.0, 1.0)
    share = (share * share * (3 - 2 * share))[:, None]
    rounded = vertices.copy()
    rounded[own] += share * ((around @ places) / total - vertices[own])
    return rounded


def _smooth_normals(
    vertices: np.ndarray, triangles: np.ndarray, free: np.ndarray, area: np.ndarray
) -> np.ndarray:
    """Unit vertex normals of the touchable part, averaged along the surface over NORMAL_SMOOTHING_M."""
    touch = triangles[free > 0]
    normals = np.zeros_like(vertices)
    for c in range(3):
        np.add.at(normals, touch[:, c], area[free > 0])
        np.add.at(normals, triangles[free == 0][:, c], 1e-9 * area[free == 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    pairs = np.vstack([touch[:, [0, 1]], touch[:, [1, 2]], touch[:, [2, 0]]])
    edge = np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)
    n = len(vertices)
    links = sp.coo_matrix(
        (np.ones(2 * len(pairs)), (pairs.ravel("F"), pairs[:, ::-1].ravel("F"))), shape=(n, n)
    )
    links = links.tocsr()
    links.data[:] = 1.0
    degree = np.asarray(links.sum(axis=1)).ravel()
    # half a step towards the neighbours' mean spreads by a quarter of the squared edge in each direction
    sweeps = max(1, round(NORMAL_SMOOTHING_M**2 / (0.25 * float(np.median(edge)) ** 2)))
    for _ in range(sweeps):
        mean = links @ normals / np.maximum(degree, 1)[:, None]
        normals = np.where(degree[:, None] > 0, (normals + mean) / 2, normals)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return np.ascontiguousarray(normals)


def _corner_normals(points: np.ndarray, triangles: np.ndarray, touchable: np.ndarray) -> np.ndarray:
    """(k, 3, 3) unit normals of each corner, averaged over the faces joined to it without a crease."""
    area, face = facings(points, triangles)
    k = len(triangles)
    across = neighbours(triangles)
    rows, columns = [], []
    for edge in range(3):
        other = across[:, edge]
        smooth = (other >= 0) & (
            np.einsum("ij,ij->i", face, face[other]) > np.cos(np.radians(CREASE_DEGREES))
        )
        smooth &= touchable == touchable[other]
        here = np.flatnonzero(smooth)
        for corner in (edge, (edge + 1) % 3):
            node = triangles[here, corner]
            match = (triangles[other[here]] == node[:, None]).argmax(axis=1)
            rows.append(here * 3 + corner)
            columns.append(other[here] * 3 + match)
    r, c = np.concatenate(rows), np.concatenate(columns)
    group = connected_components(
        sp.coo_matrix((np.ones(len(r)), (r, c)), shape=(3 * k, 3 * k)), directed=False
    )[1]
    total = np.zeros((group.max() + 1, 3))
    np.add.at(total, group, np.repeat(area, 3, axis=0))
    total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
    return total[group].reshape(k, 3, 3)


def _flat_edges(triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(k, 3) edges whose two sides disagree on the normals: creases, which stay straight so that no gap
    opens."""
    across = neighbours(triangles)
    flat = np.zeros(triangles.shape, dtype=bool)
    for edge in range(3):
        other = across[:, edge]
        for corner in (edge, (edge + 1) % 3):
            match = (triangles[other] == triangles[:, corner][:, None]).argmax(axis=1)
            differs = np.abs(normals[:, corner] - normals[other, match]).max(axis=1) > 1e-9
            flat[:, edge] |= differs | (other < 0)
    return flat


def _pn_patch(p: np.ndarray, n: np.ndarray, flat: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """(k, q, 3) points of the cubic patches through corners p (k, 3, 3) with corner normals n."""

    def control(i: int, j: int) -> np.ndarray:
        edge = i if (i + 1) % 3 == j else j
        along = p[:, j] - p[:, i]
        lift = np.einsum("ij,ij->i", along, n[:, i])[:, None] * n[:, i]
        return p[:, i] + (along - np.where(flat[:, edge, None], 0.0, lift)) / 3

    b = {(i, j): control(i, j) for i in range(3) for j in range(3) if i != j}
    mean = sum(b.values()) / 6
    centre = mean + (mean - p.mean(axis=1)) / 2
    u, v, w = barycentric.T
    result = np.zeros((len(p), len(barycentric), 3))
    for weight, value in (
        (u**3, p[:, 0]),
        (v**3, p[:, 1]),
        (w**3, p[:, 2]),
        (3 * u * u * v, b[0, 1]),
        (3 * u * v * v, b[1, 0]),
        (3 * v * v * w, b[1, 2]),
        (3 * v * w * w, b[2, 1]),
        (3 * w * w * u, b[2, 0]),
        (3 * w * u * u, b[0, 2]),
        (6 * u * v * w, centre),
    ):
        result += weight[None, :, None] * value[:, None, :]
    return result


def _lattice(parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric points (q, 3) of a triangle cut into parts^2, and its small triangles (parts^2, 3)."""
    points = [(parts - i - j, i, j) for i in range(parts + 1) for j in range(parts + 1 - i)]
    index = {point: k for k, point in enumerate(points)}
    cells = []
    for a, i, j in points:
        if a >= 1:
            cells.append([index[a, i, j], index[a - 1, i + 1, j], index[a - 1, i, j + 1]])
        if a >= 1 and i >= 1:
            cells.append([index[a, i, j], index[a - 1, i, j + 1], index[a, i - 1, j + 1]])
    return np.array(points) / parts, np.array(cells)


def _merged(triangles: np.ndarray, parts: int) -> tuple[np.ndarray, int]:
    """(k, q) vertex numbers of the lattice points, shared along edges and corners; and how many there are."""
    lattice = np.rint(_lattice(parts)[0] * parts).astype(np.int64)
    k, q = len(triangles), len(lattice)
    keys = np.zeros((k, q, 6), dtype=np.int64)
    own = np.arange(k)
    for column, count in enumerate(lattice):
        on = np.flatnonzero(count)
        if len(on) == 3:
            keys[:, column, 0], keys[:, column, 1], keys[:, column, 2] = -1, own, column
            continue
        pairs = np.sort(triangles[:, on] * np.int64(parts + 1) + count[on], axis=1)
        keys[:, column, : len(on)] = pairs
        keys[:, column, 5] = len(on)
    _, index = np.unique(keys.reshape(-1, 6), axis=0, return_inverse=True)
    index = index.reshape(k, q)
    return index, int(index.max()) + 1
