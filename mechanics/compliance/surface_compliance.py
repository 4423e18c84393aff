"""The compliance that a servo interpolates, for unit Young's modulus; two tables, since two things are
asked.

How one place gives under its own touch (`own`): sharp near edges and the base, so it is computed with a
patch as narrow as a contact, at the corners of a surface finer than the mesh's. How a touch moves the rest
of the object (`blocks`, or `factor` for a large surface): smooth, so a patch as wide as the mesh's own
elements and the mesh's own corners serve.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
import scipy.sparse as sp

from palpate.mechanics.compliance.compression import compress, own_blocks, unit_loads
from palpate.mechanics.compliance.near_field import sharpening
from palpate.mechanics.compliance.patch import PatchSampler, half_space_compliance, triangle_shapes
from palpate.mechanics.compliance.sites import (
    SURFACE_EDGE_M,
    load_width,
    patch_width,
    shape_under_one_patch,
    touch_solver,
)
from palpate.mechanics.elastic.floor import carried_by_floor
from palpate.mechanics.elastic.held_base import BaseHold
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import Ball, with_balls
from palpate.mechanics.plausible import USUAL_TIP_RADIUS_M
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import closest
from palpate.mechanics.shape.refine import typical_edge
from palpate.mechanics.shape.tetmesh import TetMesh, vertex_normals

WIDE_PATCH_M = 0.008  # of the mutual compliance of a large surface, whatever its elements
_CORNERS = 32  # patches solved at once
_SAME_FACE = np.cos(np.radians(40))
_ENOUGH = 10  # corners for the six coefficients of a quadratic


@dataclass(frozen=True)
class SurfaceCompliance:
    """Device frame, SI units; the touchable surface with its rim at the base.

    Coarse, t corners of the mesh: nodes (t,), points, normals (t, 3), triangles (f, 3) into them, blocks
    (t, t, 3, 3) float32, 1/m: displacement of the patch at i for a unit force on the patch at j; symmetric as
    a whole. patch_width_m: (1,). A large surface has no blocks (shape 0) but a factor (t, 3, r) float32:
    block (i, j) = factor[i] @ factor[j].T.
    Fine, v corners: own_points, own_normals (v, 3), own_triangles (g, 3) into them, own (v, 3, 3), 1/m:
    displacement of the patch at i for a unit force on itself, and what a nodule close below adds
    (mechanics.compliance.near_field); own_middles (g, 3, 3, 3): the same half way between the corners of each
    triangle, recovered from those around (mechanics.shape.recovery). own_width_m: (1,).
    poisson_ratio: (1,). Rounding to float32 moves a block by less than 1e-7 of its greatest entry.
    """

    nodes: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    blocks: np.ndarray
    patch_width_m: np.ndarray
    own_points: np.ndarray
    own_normals: np.ndarray
    own_triangles: np.ndarray
    own: np.ndarray
    own_width_m: np.ndarray
    poisson_ratio: np.ndarray
    factor: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 0), dtype=np.float32))
    own_middles: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3, 3)))

    def __post_init__(self) -> None:
        if not len(self.own_middles):
            middles = edge_middles(self.own_points, self.own_triangles, self.own)
            object.__setattr__(self, "own_middles", middles)
        for each in fields(self):
            getattr(self, each.name).setflags(write=False)

    def arrays(self) -> dict[str, np.ndarray]:
        """The fields by name."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> SurfaceCompliance:
        """The inverse of `arrays`."""
        return cls(**arrays)

    def far_at(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(k, 3, 3) far-field compliance, 1/m, at surface points (k, 3) with normals (k, 3).

        Interpolated quadratically in the nearest fine triangle; what TouchSites.far holds for a site there,
        but for rims and base (mechanics.contact.edges).
        """
        points, normals = np.atleast_2d(points), np.atleast_2d(normals)
        _, triangle, weights = closest(self.own_points, self.own_triangles, points)
        six = np.concatenate([self.own[self.own_triangles[triangle]], self.own_middles[triangle]], axis=1)
        own = np.einsum("kc,kcab->kab", triangle_shapes(2, weights), six)
        nu, width = float(self.poisson_ratio[0]), float(self.own_width_m[0])
        return own - half_space_compliance(normals, nu, width)

    def displacement(self, corner: int, force: np.ndarray) -> np.ndarray:
        """(t, 3) m Pa: motion of all corners for a force (3,) N on the object at one, times the modulus."""
        force = np.asarray(force, dtype=np.float32)
        if len(self.factor):
            return self.factor @ (force @ self.factor[corner])
        return self.blocks[:, corner] @ force


def surface_compliance(
    mesh: TetMesh,
    poisson_ratio: float,
    modulus_ratio: np.ndarray | None = None,
    *,
    balls: Sequence[Ball] = (),
    hold: BaseHold | None = None,
    low_rank_error: float | None = None,
    tip_radius_m: float = USUAL_TIP_RADIUS_M,
    progress: Progress = silent,
) -> SurfaceCompliance:
    """Compute both tables. mesh: linear or quadratic; modulus_ratio: (m,) or None, without the balls;
    hold: None, bonded.

    low_rank_error: None for dense blocks; else the relative error to which a factor stands in for them, under
    a patch of at least WIDE_PATCH_M. tip_radius_m: only matters where a ball lies close below the surface
    (mechanics.compliance.near_field).
    """
    # between places a loose base rests on the floor: never softer than what each place has of its own
    resting = None if hold is None else replace(hold, resting=True)
    loose = hold is not None and hold.bonded_fraction < 1
    drawn = with_balls(mesh, modulus_ratio, balls) if balls else modulus_ratio
    coarse = Solver(mesh.quadratic(), poisson_ratio, drawn, hold=resting)
    nodes, triangles = _corners(coarse.mesh)
    points = coarse.mesh.points[nodes]
    normals = _normals(coarse.mesh, nodes)
    width = patch_width(coarse.mesh)
    tables = {}
    if low_rank_error is None:
        blocks = patch_blocks(coarse, points, width, lambda f: progress("compliance between places", 0.3 * f))
    else:
        width = max(width, WIDE_PATCH_M)
        blocks = np.zeros((0, 0, 3, 3), dtype=np.float32)
        tables["factor"] = compress(coarse, points, width, tolerance=low_rank_error, progress=progress).factor
    if typical_edge(mesh) > SURFACE_EDGE_M or balls or loose:
        del coarse
        fine = touch_solver(mesh, poisson_ratio, modulus_ratio, balls=balls, hold=hold)
    else:  # what touch_solver would factorise once more
        fine = coarse
    own_nodes, own_triangles = _corners(fine.mesh)
    own_points = fine.mesh.points[own_nodes]
    own_normals = _normals(fine.mesh, own_nodes)
    each = "compliance of each place"
    # with balls `sharpening` takes what they add under a narrower load
    own_width = patch_width(fine.mesh) if balls else load_width(fine)
    own = own_blocks(fine, own_points, own_width, lambda f: progress(each, 0.3 + 0.5 * f))
    own += shape_under_one_patch(fine, own_points, own_normals, own_width)
    if balls:  # what covers the whole surface is in the dent: its law, and the modulus under the tip
        own += sharpening(fine, own_points, own_width, tip_radius_m, lambda s, f: progress(s, 0.8 + 0.2 * f))
    if loose:
        own -= carried_by_floor(fine, own_points, own_normals, own_width)
    progress(each, 1.0)
    return SurfaceCompliance(
        nodes=nodes,
        points=points,
        normals=normals,
        triangles=triangles,
        blocks=blocks,
        patch_width_m=np.array([width]),
        own_points=own_points,
        own_normals=own_normals,
        own_triangles=own_triangles,
        own=own,
        own_width_m=np.array([own_width]),
        poisson_ratio=np.array([float(poisson_ratio)]),
        **tables,
    )


def _corners(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray]:
    """Corner nodes (t,) of the touchable surface, and its triangles (f, 3) into them."""
    nodes, local = np.unique(mesh.touchable_surface[:, :3], return_inverse=True)
    return nodes, local.reshape(-1, 3)


def _normals(mesh: TetMesh, nodes: np.ndarray) -> np.ndarray:
    return vertex_normals(mesh.points, mesh.touchable_surface[:, :3])[nodes]


def patch_blocks(
    solver: Solver, points: np.ndarray, width: float, tell: Callable[[float], None] = lambda share: None
) -> np.ndarray:
    """(t, t, 3, 3) float32, 1/m: mean displacement of the patch at i for a unit force on the patch at j."""
    mesh = solver.mesh
    average = PatchSampler(mesh, width).matrix(points)
    t = len(points)
    blocks = np.empty((t, t, 3, 3), dtype=np.float32)
    for start in range(0, t, _CORNERS):
        part = slice(start, min(start + _CORNERS, t))
        count = part.stop - start
        moved = solver.solve(unit_loads(average[part]).reshape(len(mesh.points), 3, 3 * count))
        means = average @ moved.reshape(len(mesh.points), -1)
        blocks[:, part] = means.reshape(t, 3, count, 3).transpose(0, 2, 1, 3)
        tell(part.stop / t)
    for i in range(t):
        mean = 0.5 * (blocks[i, i:] + blocks[i:, i].transpose(0, 2, 1))
        blocks[i, i:] = mean
        blocks[i:, i] = mean.transpose(0, 2, 1)
    return blocks


def edge_middles(points: np.ndarray, triangles: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(g, 3, ...): at the middles of the edges 01, 12, 20 of triangles (g, 3), from nodal values (v, ...).

    A quadratic polynomial in the triangle's plane is fitted to the corners around it, those beyond a sharp
    edge left out; its second derivatives correct the mean of an edge's ends. Fewer than 7 corners: the mean.
    """
    v = len(points)
    flat = values.reshape(v, -1)
    ends = flat[triangles]
    middles = 0.5 * (ends + np.roll(ends, -1, axis=1))
    links = sp.csr_matrix(
        (np.ones(triangles.size), (triangles.ravel(), np.repeat(np.arange(len(triangles)), 3)))
    )
    around = (links.T @ links).tocsr()  # triangles that share a corner
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for t in range(len(triangles)):
        near = around.indices[around.indptr[t] : around.indptr[t + 1]]
        near = near[normals[near] @ normals[t] > _SAME_FACE]
        nodes = np.unique(triangles[near])
        if len(nodes) < _ENOUGH:  # in a corner of a face: one ring further
            near = np.unique(around[near].indices)
            near = near[normals[near] @ normals[t] > _SAME_FACE]
            nodes = np.unique(triangles[near])
        if len(nodes) < 7:
            continue
        u = corners[t, 1] - corners[t, 0]
        size = np.linalg.norm(u)
        frame = np.stack([u / size, np.cross(normals[t], u / size)]) / size
        x, y = frame @ (points[nodes] - corners[t].mean(axis=0)).T
        weight = 1 / (0.5 + x * x + y * y)
        columns = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
        fit = np.linalg.lstsq(columns * weight[:, None], flat[nodes] * weight[:, None], rcond=1e-8)[0]
        dx, dy = frame @ (np.roll(corners[t], -1, axis=0) - corners[t]).T
        bend = np.stack([dx * dx, dx * dy, dy * dy], axis=1) @ fit[3:]
        middles[t] -= 0.25 * bend
    return middles.reshape(len(triangles), 3, *values.shape[1:])
