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

from palpate.mechanics.compliance.compression import compress, unit_loads
from palpate.mechanics.compliance.fine_corners import (
    EdgeMiddles,
    corners_of,
    fine_corners,
    interpolated,
    is_fine,
    less_half_space,
    linear_at,
    normals_of,
)
from palpate.mechanics.compliance.on_demand import OnDemandCompliance
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.compliance.sites import patch_width
from palpate.mechanics.elastic.held_base import BaseHold
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import Ball, with_balls
from palpate.mechanics.plausible import USUAL_TIP_RADIUS_M
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import closest
from palpate.mechanics.shape.tetmesh import TetMesh

WIDE_PATCH_M = 0.008  # of the mutual compliance of a large surface, whatever its elements
_CORNERS = 32  # patches solved at once


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
    triangle, recovered from those around (mechanics.shape.recovery). own_width_m: (1,). own_bracing: (v,)
    1/m, by which balls bend the dent's law (near_field.BallLaw).
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
    own_bracing: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not len(self.own_middles):
            middles = EdgeMiddles(self.own_points, self.own_triangles)(self.own)
            object.__setattr__(self, "own_middles", middles)
        if not len(self.own_bracing):
            object.__setattr__(self, "own_bracing", np.zeros(len(self.own_points)))
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
        own = interpolated(self.own[self.own_triangles[triangle]], self.own_middles[triangle], weights)
        return less_half_space(own, normals, float(self.poisson_ratio[0]), float(self.own_width_m[0]))

    def bracing_at(self, points: np.ndarray) -> np.ndarray:
        """(k,) 1/m, `own_bracing` at surface points (k, 3), linear in the nearest fine triangle."""
        return linear_at(points, self.own_points, self.own_triangles, self.own_bracing)

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
    stretch_m: float = 0.0,
    low_rank_error: float | None = None,
    tip_radius_m: float = USUAL_TIP_RADIUS_M,
    solved: OnDemandCompliance | None = None,
    progress: Progress = silent,
) -> SurfaceCompliance:
    """Compute both tables. mesh: linear or quadratic; modulus_ratio: (m,) or None, without the balls;
    hold: None, bonded; stretch_m: of a skin (mechanics.elastic.membrane).

    low_rank_error: None for dense blocks; else the relative error to which a factor stands in for them, under
    a patch of at least WIDE_PATCH_M. tip_radius_m: only matters where a ball lies close below the surface
    (mechanics.compliance.near_field). solved: of the same object, where some places are solved already: the
    rest is added to it.
    """
    # between places a loose base rests on the floor: never softer than what each place has of its own
    resting = None if hold is None else replace(hold, resting=True)
    drawn = with_balls(mesh, modulus_ratio, balls) if balls else modulus_ratio
    coarse = Solver(mesh.quadratic(), poisson_ratio, drawn, hold=resting, stretch_m=stretch_m)
    nodes, triangles = corners_of(coarse.mesh)
    points = coarse.mesh.points[nodes]
    normals = normals_of(coarse.mesh, nodes)
    width = patch_width(coarse.mesh)
    tables = {}
    if low_rank_error is None:
        blocks = patch_blocks(coarse, points, width, lambda f: progress("compliance between places", 0.3 * f))
    else:
        width = max(width, WIDE_PATCH_M)
        blocks = np.zeros((0, 0, 3, 3), dtype=np.float32)
        tables["factor"] = compress(coarse, points, width, tolerance=low_rank_error, progress=progress).factor
    serves = coarse if solved is None and is_fine(mesh, balls, hold) else None
    del coarse
    if solved is None:
        fine = fine_corners(
            mesh, poisson_ratio, modulus_ratio, balls=balls, hold=hold, stretch_m=stretch_m,
            tip_radius_m=tip_radius_m, solver=serves,
        )  # fmt: skip
        (own, bracing), own_width = fine.own(progress=progress), np.array([fine.width_m])
        own_points, own_normals, own_triangles = fine.points, fine.normals, fine.triangles
    else:
        solved.solve(np.arange(len(solved.own)), progress)
        own, own_width, bracing = (
            np.array(each) for each in (solved.own, solved.own_width_m, solved.own_bracing)
        )
        own_points, own_normals, own_triangles = (
            np.array(each) for each in (solved.own_points, solved.own_normals, solved.own_triangles)
        )
    progress("compliance of each place", 1.0)
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
        own_width_m=own_width,
        own_bracing=bracing,
        poisson_ratio=np.array([float(poisson_ratio)]),
        **tables,
    )


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
