"""What an uncertain shape does to the modulus: the shape derivative of the compliance.

Moving a free surface outward by v (m) changes the compliance under a unit load by -integral of (sigma : eps)
v dS (Hadamard; sigma : eps is twice the strain energy density of that load). With the surface's standard
deviation place by place and a correlation length, this gives the covariance of the errors of all presses,
without meshing again.
"""

from __future__ import annotations

import numpy as np

from mechanics.elasticity import barycentric_gradients, lame_parameters, shape_derivatives
from mechanics.patch import PatchSampler
from mechanics.sites import TouchSites
from mechanics.solver import Solver
from mechanics.tetmesh import FACES, TetMesh

CORRELATION_M = 0.025
_BATCH = 16


def compliance_covariance(
    solver: Solver, sites: TouchSites, uncertainty_m: np.ndarray, *, correlation_m: float = CORRELATION_M
) -> np.ndarray:
    """(k, k) covariance, 1/m^2, of the sites' compliance along their normals for unit modulus.

    uncertainty_m: (n,) standard deviation of the surface along its normal at each node of the solver's mesh.
    Errors at two places correlate as exp(-r^2 / (2 L^2)). The patch itself, which the tip has touched, is
    left out.
    """
    mesh = solver.mesh
    triangles, owner, centres, areas = _faces(mesh)
    sampler = PatchSampler(mesh, sites.patch_width_m)
    around, slopes = _shape_gradients(mesh, owner)
    lam, mu = lame_parameters(1.0, solver.poisson_ratio)
    gradient = np.zeros((len(sites), len(triangles)))
    for start in range(0, len(sites), _BATCH):
        batch = list(range(start, min(start + _BATCH, len(sites))))
        forces = np.zeros((len(mesh.points), 3, len(batch)))
        for column, i in enumerate(batch):
            nodes, weights = sampler.weights(sites.points[i])
            forces[nodes, :, column] = weights[:, None] * sites.normals[i]
        displacement = solver.solve(forces)
        for column, i in enumerate(batch):
            moved = displacement[:, :, column][around]
            e = np.matmul(slopes.transpose(0, 2, 1), moved)
            e = (e + e.transpose(0, 2, 1)) / 2
            twice = lam * np.trace(e, axis1=1, axis2=2) ** 2 + 2 * mu * (e**2).sum(axis=(1, 2))
            away = np.linalg.norm(centres - sites.points[i], axis=1) > 2.5 * sites.patch_width_m
            gradient[i] = -np.where(away, twice, 0.0) * areas
    sd = np.asarray(uncertainty_m)[triangles].mean(axis=1)
    squared = ((centres[:, None] - centres[None]) ** 2).sum(axis=2)
    kernel = np.exp(-squared / (2 * correlation_m**2)) * np.outer(sd, sd)
    return gradient @ kernel @ gradient.T


def _shape_gradients(mesh: TetMesh, owner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (m, 4 or 10) of the owners and the gradients of their shape functions at the centroid (m, .,
    3)."""
    around = mesh.tetrahedra[owner]
    gradients, _ = barycentric_gradients(mesh.points[around[:, :4]])
    return around, np.einsum("ic,mca->mia", shape_derivatives(mesh.order, np.full(4, 0.25)), gradients)


def _faces(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Touchable boundary triangles (m, 3), the tetrahedron of each (m,), centres (m, 3), areas (m,)."""
    faces = mesh.tetrahedra[:, FACES].reshape(-1, 3)
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    boundary = first[counts == 1]
    boundary = boundary[~mesh.fixed[faces[boundary]].all(axis=1)]
    corners = mesh.points[faces[boundary]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return faces[boundary], boundary // 4, corners.mean(axis=1), np.linalg.norm(normal, axis=1) / 2
