"""Structured meshes for the tests: the same nodes every time, no mesher needed."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.compliance.sites import patch_width
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance, patch_blocks
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import TetMesh, vertex_normals
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions

_SIX = np.array([[0, 1, 3, 7], [0, 1, 7, 5], [0, 5, 7, 4], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7]])


def _grid(nx: int, ny: int, nz: int) -> tuple[np.ndarray, np.ndarray]:
    x, y, z = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), np.arange(nz + 1), indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(float)
    index = np.arange(len(points)).reshape(nx + 1, ny + 1, nz + 1)
    corners = [
        index[i : i + nx, j : j + ny, k : k + nz].ravel() for k in (0, 1) for j in (0, 1) for i in (0, 1)
    ]
    cubes = np.stack(corners, axis=1)
    return points, cubes[:, _SIX].reshape(-1, 4)


def _mesh(points: np.ndarray, tets: np.ndarray, order: int) -> TetMesh:
    p = points[tets]
    volume = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0])
    tets[volume < 0] = tets[volume < 0][:, [0, 2, 1, 3]]
    fixed = np.isclose(points[:, 2], 0.0)
    bare = TetMesh(points, tets, fixed, ~fixed)
    surface = np.zeros(len(points), dtype=bool)
    surface[bare.surface] = True
    mesh = TetMesh(points, tets, fixed, surface & ~fixed)
    return mesh.quadratic() if order == 2 else mesh


def block(size: tuple[float, float, float], cells: tuple[int, int, int], order: int = 2) -> TetMesh:
    """A block centred over the origin, its base at z = 0; metres."""
    points, tets = _grid(*cells)
    points = points / np.array(cells) * np.array(size)
    points[:, :2] -= np.array(size[:2]) / 2
    return _mesh(points, tets, order)


def cylinder(radius: float, height: float, cells: tuple[int, int], order: int = 2) -> TetMesh:
    """A cylinder about the z axis: a square grid of cells[0]^2 drawn out to the disc, cells[1] layers."""
    points, tets = _grid(cells[0], cells[0], cells[1])
    xy = 2 * points[:, :2] / cells[0] - 1
    reach = np.abs(xy).max(axis=1)
    length = np.linalg.norm(xy, axis=1)
    # concentric squares become concentric circles
    xy = xy * np.where(length > 0, reach / np.maximum(length, 1e-12), 0.0)[:, None]
    points = np.column_stack([radius * xy, points[:, 2] / cells[1] * height])
    return _mesh(points, tets, order)


def model(mesh: TetMesh, modulus: float = 30e3, poisson: float = 0.49, tip: float = 0.005, **more) -> Model:
    """A homogeneous model of a mesh on the plane z = 0."""
    return Model(
        mesh=mesh,
        material=ObjectMaterial(modulus, poisson),
        support=Support(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        tool=Tool(tip),
        mesh_size_m=0.01,
        **more,
    )


def quick_compliance(made: Model) -> SurfaceCompliance:
    """The surface compliance on the model's own mesh, without the refinement that accuracy near edges asks
    for."""
    mesh = made.mesh
    nodes, local = np.unique(mesh.touchable_surface[:, :3], return_inverse=True)
    points = mesh.points[nodes]
    normals = vertex_normals(mesh.points, mesh.touchable_surface[:, :3])[nodes]
    width = patch_width(mesh)
    blocks = patch_blocks(Solver(mesh, made.material.poisson_ratio), points, width)
    every = np.arange(len(nodes))
    return SurfaceCompliance(
        nodes=nodes,
        points=points,
        normals=normals,
        triangles=local.reshape(-1, 3),
        blocks=blocks,
        patch_width_m=np.array([width]),
        own_points=points.copy(),
        own_normals=normals.copy(),
        own_triangles=local.reshape(-1, 3).copy(),
        own=blocks[every, every].astype(float),
        own_width_m=np.array([width]),
        poisson_ratio=np.array([made.material.poisson_ratio]),
    )


def fem(made: Model, compliance: SurfaceCompliance | None = None, **options) -> FemRenderer:
    """A finite-element renderer on the quick compliance, solved here where it is not given."""
    return FemRenderer(made, RenderOptions(**options), compliance=compliance or quick_compliance(made))
