"""Small-strain isotropic elasticity on tetrahedra: the stiffness matrix for unit Young's modulus.

Elements: linear (4 nodes, the paper's) and quadratic (10 nodes, straight sides); integration is exact.
Degrees of freedom are ordered x, y, z node by node.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from palpate.mechanics.errors import MeshError
from palpate.mechanics.kernels import kernel
from palpate.mechanics.shape.nearest import triangle_areas
from palpate.mechanics.shape.tetmesh import EDGES, TetMesh

# four points of degree 2 (Stroud): exact for products of the quadratic element's linear gradients
_A, _B = (5 + 3 * np.sqrt(5)) / 20, (5 - np.sqrt(5)) / 20
_POINTS = np.full((4, 4), _B) + (_A - _B) * np.eye(4)
_WEIGHTS = np.full(4, 0.25)
_CHUNK = 4000

LOCAL_BULK = 1.5
"""Of Lame's lambda over mu, what a quadratic element holds point by point; it holds the rest by its mean."""


def lame_parameters(young_modulus: float, poisson_ratio: float) -> tuple[float, float]:
    """(lambda, mu) of an isotropic solid, in the unit of the modulus."""
    nu = poisson_ratio
    return young_modulus * nu / ((1 + nu) * (1 - 2 * nu)), young_modulus / (2 * (1 + nu))


def barycentric_gradients(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the four barycentric coordinates (m, 4, 3), 1/m, and volumes (m,), m^3.

    corners: (m, 4, 3) m.
    """
    edges = corners[:, 1:] - corners[:, :1]
    inverse = np.linalg.inv(edges)  # columns are the gradients of coordinates 1 to 3
    gradients = np.empty((len(corners), 4, 3))
    gradients[:, 1:] = inverse.transpose(0, 2, 1)
    gradients[:, 0] = -gradients[:, 1:].sum(axis=1)
    return gradients, np.abs(np.linalg.det(edges)) / 6


def shape_derivatives(order: int, barycentric: np.ndarray) -> np.ndarray:
    """Derivatives of the shape functions by the four barycentric coordinates: (4 or 10, 4) at one point."""
    if order == 1:
        return np.eye(4)
    derivatives = np.zeros((10, 4))
    derivatives[np.arange(4), np.arange(4)] = 4 * barycentric - 1
    for k, (i, j) in enumerate(EDGES):
        derivatives[4 + k, i] = 4 * barycentric[j]
        derivatives[4 + k, j] = 4 * barycentric[i]
    return derivatives


def element_stiffness(
    corners: np.ndarray, order: int, poisson_ratio: float, *, local_bulk: float = LOCAL_BULK
) -> np.ndarray:
    """Element matrices for unit Young's modulus: (m, k, 3, k, 3) with k = 4 or 10 nodes, in metres.

    K[i, a, j, b] = integral of lambda B_ia B_jb + mu (B_ib B_ja + delta_ab B_i . B_j), B the shape
    gradients. Of lambda, at most `local_bulk` mu acts on the divergence at every point, which makes quadratic
    elements too hard near nu = 0.5; the rest on its mean over the element (B-bar; Hughes 1980), which alone
    makes them too soft. Infinite: all at every point.
    """
    lam, mu = lame_parameters(1.0, poisson_ratio)
    gradients, volumes = barycentric_gradients(corners)
    points, weights = (_POINTS, _WEIGHTS) if order == 2 else (np.full((1, 4), 0.25), np.ones(1))
    derivatives = np.array([shape_derivatives(order, p) for p in points])
    b = np.einsum("qic,mca->mqia", derivatives, gradients)
    w = np.outer(volumes, weights)
    weighted = b * w[:, :, None, None]
    m, q, k, _ = b.shape
    flat, weighted_flat = b.reshape(m, q, 3 * k), weighted.reshape(m, q, 3 * k)
    outer = np.einsum("mqx,mqy->mxy", weighted_flat, flat, optimize=True).reshape(m, k, 3, k, 3)
    laplace = np.einsum("miaja->mij", outer)
    at_points = min(lam, local_bulk * mu) if order == 2 else lam
    matrices = at_points * outer + mu * outer.transpose(0, 1, 4, 3, 2)
    if at_points < lam:
        mean = weighted_flat.sum(axis=1)
        by_mean = ((lam - at_points) / volumes)[:, None] * mean
        matrices += (by_mean[:, :, None] * mean[:, None, :]).reshape(m, k, 3, k, 3)
    for a in range(3):
        matrices[:, :, a, :, a] += mu * laplace
    return matrices


def stiffness(
    mesh: TetMesh,
    poisson_ratio: float,
    modulus_ratio: np.ndarray | None = None,
    *,
    local_bulk: float = LOCAL_BULK,
) -> sp.csr_matrix:
    """`stiffness_blocks` as (3n, 3n) numbers."""
    return stiffness_blocks(mesh, poisson_ratio, modulus_ratio, local_bulk=local_bulk).tocsr()


def stiffness_blocks(
    mesh: TetMesh,
    poisson_ratio: float,
    modulus_ratio: np.ndarray | None = None,
    *,
    local_bulk: float = LOCAL_BULK,
) -> sp.bsr_matrix:
    """Stiffness for unit Young's modulus: symmetric (3n, 3n) in blocks of 3, m (newtons a metre a pascal),
    nothing fixed.

    modulus_ratio: (m,) modulus of each tetrahedron over the global one; None: homogeneous. local_bulk: see
    `element_stiffness`.
    Raises MeshError where the ratio does not fit the mesh.
    """
    m, n = len(mesh.tetrahedra), len(mesh.points)
    ratio = np.ones(m) if modulus_ratio is None else np.asarray(modulus_ratio, dtype=float)
    if ratio.shape != (m,) or not (ratio > 0).all():
        raise MeshError(f"modulus_ratio must hold {m} positive values, one a tetrahedron")
    tets = mesh.tetrahedra
    corners_of = np.arange(0, tets.size + 1, tets.shape[1])
    held = sp.csr_matrix((np.ones(tets.size), tets.ravel(), corners_of), shape=(m, n))
    pattern = (held.T @ held).tocsr()  # nodes that share an element
    pattern.sort_indices()
    rows, columns = pattern.indptr, pattern.indices
    blocks = np.zeros((len(columns), 3, 3))
    for start in range(0, m, _CHUNK):
        part = slice(start, start + _CHUNK)
        corners = mesh.points[tets[part, :4]]
        element = element_stiffness(corners, mesh.order, poisson_ratio, local_bulk=local_bulk)
        element *= ratio[part, None, None, None, None]
        _add(blocks, rows, columns, tets[part], element)
    return sp.bsr_matrix((blocks, columns, rows), shape=(3 * n, 3 * n))


@kernel
def _add(blocks, rows, columns, tets, elements):
    """Add element matrices (m, k, 3, k, 3) of tetrahedra (m, k) to the blocks of a pattern, columns sorted
    in each row."""
    for e in range(tets.shape[0]):
        for i in range(tets.shape[1]):
            for j in range(tets.shape[1]):
                low, high = rows[tets[e, i]], rows[tets[e, i] + 1]
                while high - low > 1:
                    middle = (low + high) // 2
                    if columns[middle] <= tets[e, j]:
                        low = middle
                    else:
                        high = middle
                for a in range(3):
                    for b in range(3):
                        blocks[low, a, b] += elements[e, i, a, j, b]


def triangle_mass(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Integrals of the products of shape functions over straight triangles: (k, 3, 3) or (k, 6, 6), m^2."""
    area = triangle_areas(points, triangles)
    if triangles.shape[1] == 3:
        unit = (np.ones((3, 3)) + np.eye(3)) / 12
    else:
        corner = 6 * np.eye(3) - (1 - np.eye(3))
        mixed = np.array([[0, -4, 0], [0, 0, -4], [-4, 0, 0]])  # a corner and the middle of the side opposite
        middle = 16 * (np.ones((3, 3)) + np.eye(3))
        unit = np.block([[corner, mixed], [mixed.T, middle]]) / 180
    return area[:, None, None] * unit


def strain(mesh: TetMesh, displacement: np.ndarray) -> np.ndarray:
    """Small strain at each element's centroid: (m, 3, 3), from nodal displacements (n, 3) m."""
    gradients, _ = barycentric_gradients(mesh.points[mesh.tetrahedra[:, :4]])
    derivatives = shape_derivatives(mesh.order, np.full(4, 0.25))
    b = np.einsum("ic,mca->mia", derivatives, gradients)
    gradient = np.einsum("mia,mib->mab", b, displacement[mesh.tetrahedra])
    return 0.5 * (gradient + gradient.transpose(0, 2, 1))
