"""What an uncertain shape does to the modulus: the shape derivative of the compliance.

Moving a free surface outward by v (m) changes the compliance under a unit load by -integral of (sigma : eps)
v dS (Hadamard; sigma : eps is twice the strain energy density of that load). With the surface's standard
deviation place by place and a correlation length, this gives the covariance of the errors of all presses,
without meshing again. A clamped base moved outward adds as much. With both, an object that is moved as a
whole (a known shape whose pose is uncertain) is covered too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.elastic.elasticity import barycentric_gradients, lame_parameters, shape_derivatives
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.shape.tetmesh import FACES, TetMesh, lone_faces
from palpate.mechanics.statistics import squared_exponential

CORRELATION_M = 0.025
_BATCH, _ROWS = 16, 512


@dataclass(frozen=True)
class PoseError:
    """covariance: (6, 6) of a shift (m) and a turn (rad) of the whole object about pivot (3,), device
    frame."""

    covariance: np.ndarray
    pivot: np.ndarray


def compliance_covariance(
    solver: Solver,
    sites: TouchSites,
    uncertainty_m: np.ndarray,
    *,
    correlation_m: float = CORRELATION_M,
    pose: PoseError | None = None,
    gradient: np.ndarray | None = None,
) -> np.ndarray:
    """(k, k) covariance, 1/m^2, of the sites' compliance along their normals for unit modulus.

    uncertainty_m: (n,) standard deviation of the surface along its normal at each node of the solver's mesh.
    Errors at two places correlate as exp(-r^2 / (2 L^2)). The patch itself, which the tip has touched, is
    left out. pose: of an object of known shape, whose base moves along with it. gradient: (k, m),
    `shape_gradients` where they are known already.
    """
    faces = _faces(solver.mesh)
    gradient = _gradients(solver, sites, faces) if gradient is None else gradient
    free = ~faces.base
    sd = np.asarray(uncertainty_m)[faces.triangles[free]].mean(axis=1)
    centres = faces.centres[free]
    moved = gradient[:, free] * sd
    spread = np.empty_like(moved)
    for a in range(0, len(centres), _ROWS):  # all faces with all would be gigabytes
        squared = cdist(centres[a : a + _ROWS], centres, "sqeuclidean")
        spread[:, a : a + _ROWS] = moved @ squared_exponential(squared, correlation_m).T
    local = spread @ moved.T
    if pose is None:
        return local
    shift = _by_pose(gradient, faces, sites, pose)
    return local + shift @ shift.T


def _by_pose(gradient: np.ndarray, faces: _Faces, sites: TouchSites, pose: PoseError) -> np.ndarray:
    """(k, 6) 1/m: change of each site's compliance with the six independent errors of the pose, one standard
    deviation each.

    A touch says where the surface is along its own normal, so that part of the motion at a site is none.
    """
    values, vectors = np.linalg.eigh(pose.covariance)
    moves = vectors * np.sqrt(np.maximum(values, 0.0))

    def motion(points: np.ndarray) -> np.ndarray:
        arm = points - pose.pivot
        return moves[:3].T + np.cross(moves[3:].T, arm[:, None])

    everywhere = np.einsum("fmi,fi->fm", motion(faces.centres), faces.normals)
    normal = np.einsum("kmi,ki->km", motion(sites.points), sites.normals)
    facing = sites.normals @ faces.normals.T
    return gradient @ everywhere - np.einsum("kf,kf->k", gradient, facing)[:, None] * normal


def shape_gradients(solver: Solver, sites: TouchSites) -> np.ndarray:
    """(k, m) 1/m^2: change of each site's compliance as each of the mesh's m boundary faces moves outward."""
    return _gradients(solver, sites, _faces(solver.mesh))


def _gradients(solver: Solver, sites: TouchSites, faces: _Faces) -> np.ndarray:
    """(k, m) 1/m^2: change of each site's compliance as a face moves outward: minus sigma : eps a free
    surface, plus that of a clamped base."""
    sampler = PatchSampler(solver.mesh, sites.patch_width_m)
    around, slopes = _shape_gradients(solver.mesh, faces.owner)
    lam, mu = lame_parameters(1.0, solver.poisson_ratio)
    gradient = np.zeros((len(sites), len(faces.triangles)))
    sign = np.where(faces.base, 1.0, -1.0) * faces.areas
    for start in range(0, len(sites), _BATCH):
        batch = list(range(start, min(start + _BATCH, len(sites))))
        forces = np.zeros((len(solver.mesh.points), 3, len(batch)))
        for column, i in enumerate(batch):
            nodes, weights = sampler.weights(sites.points[i])
            forces[nodes, :, column] = weights[:, None] * sites.normals[i]
        displacement = solver.solve(forces)
        for column, i in enumerate(batch):
            moved = displacement[:, :, column][around]
            e = np.matmul(slopes.transpose(0, 2, 1), moved)
            e = (e + e.transpose(0, 2, 1)) / 2
            twice = lam * np.trace(e, axis1=1, axis2=2) ** 2 + 2 * mu * (e**2).sum(axis=(1, 2))
            away = np.linalg.norm(faces.centres - sites.points[i], axis=1) > 2.5 * sites.patch_width_m
            gradient[i] = np.where(away, twice, 0.0) * sign
    return gradient


def _shape_gradients(mesh: TetMesh, owner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (m, 4 or 10) of the owners and the gradients of their shape functions at the centroid (m, .,
    3)."""
    around = mesh.tetrahedra[owner]
    gradients, _ = barycentric_gradients(mesh.points[around[:, :4]])
    return around, np.einsum("ic,mca->mia", shape_derivatives(mesh.order, np.full(4, 0.25)), gradients)


@dataclass(frozen=True)
class _Faces:
    """Boundary triangles (m, 3): the tetrahedron of each (m,), centres, outward unit normals (m, 3), areas,
    whether it belongs to the base."""

    triangles: np.ndarray
    owner: np.ndarray
    centres: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    base: np.ndarray


def _faces(mesh: TetMesh) -> _Faces:
    boundary = lone_faces(mesh.tetrahedra)
    triangles = mesh.tetrahedra[:, FACES].reshape(-1, 3)[boundary]
    corners = mesh.points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.linalg.norm(normal, axis=1)
    return _Faces(
        triangles=triangles,
        owner=boundary // 4,
        centres=corners.mean(axis=1),
        normals=normal / double[:, None],
        areas=double / 2,
        base=mesh.fixed[triangles].all(axis=1),
    )
