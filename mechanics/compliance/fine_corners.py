"""The corners of the fine touchable surface: how each gives under its own touch, and a triangle in between.

They are solved at any time and in any number: what one gives does not hang, to the bit, on which others are
solved with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from palpate.mechanics.compliance.compression import own_blocks
from palpate.mechanics.compliance.near_field import ball_law
from palpate.mechanics.compliance.patch import (
    PatchSampler,
    half_space_compliance,
    triangle_shapes,
    usual_width,
)
from palpate.mechanics.compliance.sites import (
    load_width,
    patch_width,
    shape_under_one_patch,
    surface_edge,
    touch_solver,
)
from palpate.mechanics.elastic.floor import carried_by_floor
from palpate.mechanics.elastic.held_base import BaseHold
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import Ball
from palpate.mechanics.plausible import USUAL_TIP_RADIUS_M
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import closest, facings
from palpate.mechanics.shape.refine import coarse_feet, typical_edge
from palpate.mechanics.shape.tetmesh import TetMesh, vertex_normals

_SAME_FACE = np.cos(np.radians(40))
_WIDER = 1.25
_ENOUGH = 10  # corners for the six coefficients of a quadratic


@dataclass(frozen=True)
class FineCorners:
    """v corners of the mesh that `solver` factorised. points, normals: (v, 3) m and unit. triangles: (g, 3)
    into them. width_m: of the load patch. balls: whether the material has some; loose: whether a part of the
    base is (mechanics.elastic.floor)."""

    solver: Solver
    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    width_m: float
    balls: bool
    loose: bool
    tip_radius_m: float

    def own(
        self, corners: np.ndarray | slice = slice(None), progress: Progress = silent
    ) -> tuple[np.ndarray, np.ndarray]:
        """((k, 3, 3) 1/m: displacement of the patch at each of these corners for a unit force on itself, unit
        modulus; (k,) 1/m, bracing by balls (near_field.BallLaw)). Where a part of the base is loose, the
        numbers hang on which are solved together."""
        points, normals, width = self.points[corners], self.normals[corners], self.width_m
        each = "compliance of each place"
        own = own_blocks(
            self.solver, points, width, lambda f: progress(each, 0.3 + 0.5 * f), sampler=self._sampler
        )
        own += shape_under_one_patch(self.solver, points, normals, width)
        bracing = np.zeros(len(points))
        if self.balls:  # what covers the whole surface is in the dent: its law, and the modulus under the tip
            by_balls = ball_law(
                self.solver, points, normals, width, self.tip_radius_m,
                lambda s, f: progress(s, 0.8 + 0.2 * f),
            )  # fmt: skip
            own, bracing = own + by_balls.far, by_balls.bracing
        if self.loose:
            own -= carried_by_floor(self.solver, points, normals, width)
        return own, bracing

    @cached_property
    def _sampler(self) -> PatchSampler:
        return PatchSampler(self.solver.mesh, self.width_m)


@dataclass(frozen=True)
class NarrowedCorners(FineCorners):
    """Of elements too coarse for a patch of width_m: `wide` has the same corners under one that they bear,
    and what that gives and one wider still are drawn out to it in a straight line."""

    wide: FineCorners

    def own(
        self, corners: np.ndarray | slice = slice(None), progress: Progress = silent
    ) -> tuple[np.ndarray, np.ndarray]:
        normals, nu = self.normals[corners], self.solver.poisson_ratio
        (own, bracing), (wider, _) = (each.own(corners, progress) for each in (self.wide, self._wider))
        far = less_half_space(own, normals, nu, self.wide.width_m)
        slope = far - less_half_space(wider, normals, nu, self._wider.width_m)
        slope /= self.wide.width_m - self._wider.width_m
        far += slope * (self.width_m - self.wide.width_m)
        return far + half_space_compliance(normals, nu, self.width_m), bracing

    @cached_property
    def _wider(self) -> FineCorners:
        return replace(self.wide, width_m=_WIDER * self.wide.width_m)


def narrowed(wide: FineCorners) -> NarrowedCorners:
    """The same corners under the usual patch."""
    given = {each.name: getattr(wide, each.name) for each in fields(wide)}
    return NarrowedCorners(**{**given, "width_m": usual_width(wide.solver.mesh)}, wide=wide)


def fine_corners(
    mesh: TetMesh,
    poisson_ratio: float,
    modulus_ratio: np.ndarray | None = None,
    *,
    balls: Sequence[Ball] = (),
    hold: BaseHold | None = None,
    stretch_m: float = 0.0,
    tip_radius_m: float = USUAL_TIP_RADIUS_M,
    solver: Solver | None = None,
) -> FineCorners:
    """Factorise the fine mesh, or take the mesh's own solver where that `is_fine`. The others: see
    `surface_compliance`."""
    if solver is None and is_fine(mesh, balls, hold):
        solver = Solver(mesh.quadratic(), poisson_ratio, modulus_ratio, hold=hold, stretch_m=stretch_m)
    elif solver is None:
        solver = touch_solver(mesh, poisson_ratio, modulus_ratio, balls=balls, hold=hold, stretch_m=stretch_m)
    nodes, triangles = corners_of(solver.mesh)
    # with balls `ball_law` takes what they add under narrower loads
    width = patch_width(solver.mesh) if balls else load_width(solver)
    return FineCorners(
        solver, solver.mesh.points[nodes], normals_of(solver.mesh, nodes), triangles, width, bool(balls),
        is_loose(hold), tip_radius_m,
    )  # fmt: skip


def is_fine(mesh: TetMesh, balls: Sequence[Ball], hold: BaseHold | None) -> bool:
    """Whether a mesh serves as it is."""
    fine = typical_edge(mesh) <= surface_edge(mesh) and not coarse_feet(mesh)
    return fine and mesh.shape is None and not balls and not is_loose(hold)


def is_loose(hold: BaseHold | None) -> bool:
    """Whether a part of the base may lift and slip."""
    return hold is not None and hold.bonded_fraction < 1


def corners_of(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray]:
    """Corner nodes (t,) of the touchable surface, and its triangles (f, 3) into them."""
    nodes, local = np.unique(mesh.touchable_surface[:, :3], return_inverse=True)
    return nodes, local.reshape(-1, 3)


def normals_of(mesh: TetMesh, nodes: np.ndarray) -> np.ndarray:
    """(t, 3) unit outward normals at corner nodes (t,) of the touchable surface."""
    return vertex_normals(mesh.points, mesh.touchable_surface[:, :3])[nodes]


def interpolated(corners: np.ndarray, middles: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(k, 3, 3), quadratic in a triangle each: its corners' and its edges' middles' (k, 3, 3, 3), at
    weights (k, 3)."""
    six = np.concatenate([corners, middles], axis=1)
    return np.einsum("kc,kcab->kab", triangle_shapes(2, weights), six)


def linear_at(points: np.ndarray, corners: np.ndarray, triangles: np.ndarray, own: np.ndarray) -> np.ndarray:
    """(k,) at points (k, 3), linear in the nearest of triangles (g, 3) of corners (v, 3), from values (v,).

    Nothing is sought where all that is known is zero, as on an object without balls.
    """
    if not np.nan_to_num(own).any():
        return np.zeros(len(points))
    _, triangle, weights = closest(corners, triangles, points)
    return np.einsum("kc,kc->k", own[triangles[triangle]], weights)


def quadratic_at(
    points: np.ndarray, corners: np.ndarray, triangles: np.ndarray, values: np.ndarray
) -> np.ndarray:
    """(k, 3, 3) at points (k, 3), quadratic in the nearest of triangles (g, 3) of corners (v, 3), from values
    (v, 3, 3): as a compliance is interpolated."""
    _, triangle, weights = closest(corners, triangles, points)
    met, which = np.unique(triangle, return_inverse=True)
    middles = EdgeMiddles(corners, triangles)(values, met)
    return interpolated(values[triangles[triangle]], middles[which], weights)


def less_half_space(own: np.ndarray, normals: np.ndarray, poisson_ratio: float, width_m: float) -> np.ndarray:
    """(k, 3, 3) far field, 1/m, of places whose own compliance and normals these are."""
    return own - half_space_compliance(normals, poisson_ratio, width_m)


class EdgeMiddles:
    """Values at the middles of the edges 01, 12, 20 of triangles (g, 3) of points (v, 3), from those at the
    points.

    A quadratic polynomial in the triangle's plane is fitted to the corners around it, those beyond a sharp
    edge left out; its second derivatives correct the mean of an edge's ends. Fewer than 7 corners: the mean.
    """

    def __init__(self, points: np.ndarray, triangles: np.ndarray) -> None:
        self._points, self._triangles = points, triangles
        links = sp.csr_matrix(
            (np.ones(triangles.size), (triangles.ravel(), np.repeat(np.arange(len(triangles)), 3)))
        )
        self._around = (links.T @ links).tocsr()  # triangles that share a corner
        _, self._normals = facings(points, triangles)

    def corners(self, triangle: int) -> np.ndarray:
        """(k,) the points whose values count for a triangle, its own among them."""
        around, normals = self._around, self._normals
        near = around.indices[around.indptr[triangle] : around.indptr[triangle + 1]]
        near = near[normals[near] @ normals[triangle] > _SAME_FACE]
        nodes = np.unique(self._triangles[near])
        if len(nodes) < _ENOUGH:  # in a corner of a face: one ring further
            near = np.unique(around[near].indices)
            near = near[normals[near] @ normals[triangle] > _SAME_FACE]
            nodes = np.unique(self._triangles[near])
        return nodes

    def __call__(self, values: np.ndarray, chosen: np.ndarray | None = None) -> np.ndarray:
        """(k, 3, ...) from values (v, ...), at k chosen triangles, all unless some are."""
        chosen = np.arange(len(self._triangles)) if chosen is None else chosen
        flat = values.reshape(len(values), -1)
        ends = flat[self._triangles[chosen]]
        middles = 0.5 * (ends + np.roll(ends, -1, axis=1))
        for k, t in enumerate(chosen):
            nodes = self.corners(t)
            if len(nodes) < 7:
                continue
            corners = self._points[self._triangles[t]]
            u = corners[1] - corners[0]
            size = np.linalg.norm(u)
            frame = np.stack([u / size, np.cross(self._normals[t], u / size)]) / size
            x, y = frame @ (self._points[nodes] - corners.mean(axis=0)).T
            weight = 1 / (0.5 + x * x + y * y)
            columns = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
            fit = np.linalg.lstsq(columns * weight[:, None], flat[nodes] * weight[:, None], rcond=1e-8)[0]
            dx, dy = frame @ (np.roll(corners, -1, axis=0) - corners).T
            bend = np.stack([dx * dx, dx * dy, dy * dy], axis=1) @ fit[3:]
            middles[k] -= 0.25 * bend
        return middles.reshape(len(chosen), 3, *values.shape[1:])
