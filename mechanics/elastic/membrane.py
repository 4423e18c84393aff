"""A skin of another modulus as a membrane on the touchable surface, which stretches along with it.

Its stretch length s, m, is its thickness times what its modulus has beyond the object's: the elements under
it stay what they are. A normal load on a half-space of Poisson's ratio 0.5 stretches no surface, so what the
membrane adds to a place is of the object's form alone, whatever the load's width. How a skin gives under the
tip is the dent's (mechanics.contact.skin); both beside axisymmetric solutions: tests/mechanics/test_skin.py.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from palpate.mechanics.frames import local_frames
from palpate.mechanics.shape.nearest import facings
from palpate.mechanics.shape.tetmesh import TetMesh

_MIDDLES = 0.5 * (1 - np.eye(3))
"""Of a triangle's edges, barycentric: three points that are exact for quadratics."""
_WAVES = 200


def membrane_stiffness(mesh: TetMesh, poisson_ratio: float, stretch_m: np.ndarray | float) -> sp.csr_matrix:
    """(3n, 3n) m, what a membrane of stretch lengths (f,) m, one a touchable triangle or one for all, adds to
    the stiffness for unit modulus: plane stress in the triangles' planes, nothing across them."""
    nu, triangles = poisson_ratio, mesh.touchable_surface
    corners, k = mesh.points[triangles[:, :3]], triangles.shape[1]
    across, normals = facings(mesh.points, triangles)
    area = 0.5 * np.linalg.norm(across, axis=1)
    plane = local_frames(normals)[:, 1:]
    edge = np.einsum("fax,fex->fea", plane, corners[:, 1:] - corners[:, :1])
    gradient = np.zeros((len(triangles), 3, 2))
    gradient[:, 1:] = np.linalg.inv(edge).transpose(0, 2, 1)
    gradient[:, 0] = -gradient[:, 1:].sum(axis=1)
    law = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, 0.5 * (1 - nu)]]) / (1 - nu**2)
    matrices = np.zeros((len(triangles), 3 * k, 3 * k))
    for at in _MIDDLES:
        own = np.eye(3) if k == 3 else _quadratic(at)
        slope = np.einsum("ic,fca->fia", own, gradient)
        # strains xx, yy and twice xy of nodal displacements
        strain = np.zeros((len(triangles), 3, k, 3))
        for row, (a, b) in enumerate(((0, 0), (1, 1))):
            strain[:, row] = slope[:, :, a, None] * plane[:, None, b]
        strain[:, 2] = slope[:, :, 1, None] * plane[:, None, 0] + slope[:, :, 0, None] * plane[:, None, 1]
        flat = strain.reshape(len(triangles), 3, 3 * k)
        weighed = (area * stretch_m / 3)[:, None, None] * (law @ flat)
        matrices += flat.transpose(0, 2, 1) @ weighed
    dof = (3 * triangles[:, :, None] + np.arange(3)).reshape(len(triangles), 3 * k)
    rows, columns = np.repeat(dof, 3 * k, axis=1).ravel(), np.tile(dof, (1, 3 * k)).ravel()
    return sp.csr_matrix((matrices.ravel(), (rows, columns)), shape=(3 * len(mesh.points),) * 2)


def _quadratic(at: np.ndarray) -> np.ndarray:
    """(6, 3) derivatives of a triangle's shape functions by its barycentric coordinates."""
    middles = [[at[1], at[0], 0], [0, at[2], at[1]], [at[2], 0, at[0]]]
    return np.vstack([np.diag(4 * at - 1), 4 * np.array(middles)])


def half_space_change(
    normals: np.ndarray, poisson_ratio: float, width_m: float, stretch_m: float
) -> np.ndarray:
    """(..., 3, 3) 1/m, unit modulus: what the membrane changes of a half-space's compliance under a Gaussian
    patch (mechanics.compliance.patch.half_space_compliance); normals (..., 3).

    A wave k of the load moves the surface along itself by (1 - nu) / (mu k (1 + 2 s k)), and
    across itself by 1 / (mu k (1 + s k)); along the normal a solid that gives way in volume loses a little.
    """
    nu, mu = poisson_ratio, 0.5 / (1 + poisson_ratio)
    x, share = np.polynomial.legendre.leggauss(_WAVES)
    x, share = 3 * (x + 1), 3 * share  # wavenumbers times the width
    wave = share * np.exp(-(x**2)) / (2 * np.pi * mu * width_m)
    held = stretch_m * x / width_m
    along = -((1 - 2 * nu) ** 2) / (2 * (1 - nu)) * held / (1 + 2 * held)
    across = -0.5 * ((1 - nu) * 2 * held / (1 + 2 * held) + held / (1 + held))
    nn = normals[..., :, None] * normals[..., None, :]
    return np.asarray((wave @ along) * nn + (wave @ across) * (np.eye(3) - nn))
