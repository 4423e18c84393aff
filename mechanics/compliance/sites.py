"""Touch sites: the far-field compliance of an object at given points of its surface, from one solve each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import astuple, dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.compliance.compression import own_blocks
from palpate.mechanics.compliance.near_field import ball_law, contact_width
from palpate.mechanics.compliance.patch import half_space_compliance, usual_width
from palpate.mechanics.contact.dent import ellipse_curvature
from palpate.mechanics.contact.depth_factors import DepthFactors
from palpate.mechanics.contact.edges import edge_law
from palpate.mechanics.disk.store import content_key
from palpate.mechanics.elastic.held_base import BaseHold
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import MeshError
from palpate.mechanics.frames import local_frames
from palpate.mechanics.model.material import Ball, with_balls
from palpate.mechanics.plausible import USUAL_TIP_RADIUS_M
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.refine import refined_around, refined_near_surface, typical_edge
from palpate.mechanics.shape.tetmesh import TetMesh, vertex_normals

PATCH_WIDTH_IN_EDGES = 0.8
SURFACE_EDGE_M, _EDGE_IN_WIDTHS = 0.006, 1.75
"""Edges at a surface that touches are solved on, m; on an object smaller than 100 mm so many times its usual
patch. They bear that patch: on finer ones forces on a block, cone, wedge, dome and beam move by 1.1 %.
Under a patch 1.2 times as wide they were 7 % too hard 1 mm from a rim, 6 % too soft above a base."""


@dataclass(frozen=True)
class TouchSites:
    """k touch sites of one object; device frame, SI units, unit modulus.

    points, normals: (k, 3), surface points and outward unit normals.
    curvature: (k,) 1/m, as a contact feels it (contact_curvature), positive where the object is convex.
    far: (k, 3, 3) far-field compliance, 1/m: displacement of the patch a unit force, less that of a
    half-space.
    patch_width_m, poisson_ratio: what they hold for.
    bracing: (k,) 1/m, by which rims make deep dents harder (mechanics.contact.edges) and a stiff ball makes
    them softer than its far field has it (BallLaw); none unless given. braced: (k,) 1/m, by which a base
    below makes them harder at finite strain (EdgeLaw.braced). factors: of the k, on the force of the law that
    they were solved beside, or None.
    """

    points: np.ndarray
    normals: np.ndarray
    curvature: np.ndarray
    far: np.ndarray
    patch_width_m: float
    poisson_ratio: float
    bracing: np.ndarray = field(default_factory=lambda: np.zeros(1))
    braced: np.ndarray = field(default_factory=lambda: np.zeros(1))
    factors: DepthFactors | None = None

    def __len__(self) -> int:
        return len(self.points)

    def of(self, rows: slice | np.ndarray) -> TouchSites:
        """Some of the sites, in order."""
        return TouchSites(
            self.points[rows], self.normals[rows], self.curvature[rows], self.far[rows], self.patch_width_m,
            self.poisson_ratio, self.bracing[rows], self.braced[rows],
            None if self.factors is None else self.factors.of(rows),
        )  # fmt: skip

    def law_error(self, usual: float) -> np.ndarray:
        """(k,) standard error of the law of the touch as a share of the force; the usual one where no place
        is solved."""
        return np.full(len(self), usual) if self.factors is None else self.factors.law_error(usual)

    def __post_init__(self) -> None:
        for name in ("bracing", "braced"):
            given = np.broadcast_to(np.asarray(getattr(self, name), dtype=float), (len(self.points),))
            object.__setattr__(self, name, given)
        for name in ("points", "normals", "curvature", "far", "bracing", "braced"):
            array = np.array(
                getattr(self, name), dtype=float, order="C"
            )  # a copy: the caller's stays writable
            array.setflags(write=False)
            object.__setattr__(self, name, array)


@dataclass(frozen=True)
class LoadPatch:
    """How the load of a touch is spread. width_m: None takes `load_width`. tip_radius_m, balls: only matter
    where the modulus varies close below the surface (mechanics.compliance.near_field); balls: whether it
    does by balls, which are felt by the depth of a touch."""

    width_m: float | None = None
    tip_radius_m: float = USUAL_TIP_RADIUS_M
    balls: bool = False


def touch_solver(
    mesh: TetMesh,
    poisson_ratio: float,
    modulus_ratio: np.ndarray | None = None,
    *,
    balls: Sequence[Ball] = (),
    surface_edge_m: float | None = None,
    hold: BaseHold | None = None,
    stretch_m: float = 0.0,
) -> Solver:
    """A solver fit for touches: quadratic, the surface's elements halved until they are small enough.

    A patch as narrow as the contact needs them; with wider ones, places near an edge or the base come out 3
    to 5 % too soft. Use `solver.mesh` with what it returns; modulus_ratio: (m,) of
    `mesh`, without the balls: their elements are halved too, and they are drawn on what comes out. stretch_m:
    of a skin (mechanics.elastic.membrane).
    """
    corners, edge_m = mesh.linear(), surface_edge_m or surface_edge(mesh)
    ratio = None if modulus_ratio is None else np.asarray(modulus_ratio, dtype=float)
    if ratio is not None and (ratio == 1).all():
        ratio = None
    made = _made.get()
    if made is None:
        return _factorised(corners, poisson_ratio, ratio, edge_m, balls, hold, stretch_m)
    key = content_key(
        corners.points, corners.tetrahedra, corners.fixed, corners.touchable,
        "" if mesh.shape is None else mesh.shape.key,
        poisson_ratio, ratio, edge_m, stretch_m, *map(astuple, balls),
        *(() if hold is None else astuple(hold)),
    )  # fmt: skip
    if key not in made:
        made.clear()
        made[key] = _factorised(corners, poisson_ratio, ratio, edge_m, balls, hold, stretch_m)
    return made[key]


def _factorised(
    mesh: TetMesh,
    poisson_ratio: float,
    ratio: np.ndarray | None,
    edge_m: float,
    balls: Sequence[Ball],
    hold: BaseHold | None,
    stretch_m: float,
) -> Solver:
    fine, parent = refined_near_surface(mesh, edge_m)
    for ball in balls:
        fine, step = refined_around(fine, np.array(ball.centre_m), ball.radius_m, edge_m)
        parent = parent[step]
    if ratio is not None:
        ratio = ratio[parent]
    if balls:
        ratio = with_balls(fine, ratio, balls)
    return Solver(fine.quadratic(), poisson_ratio, ratio, hold=hold, stretch_m=stretch_m)


@contextmanager
def factorised_once() -> Iterator[None]:
    """Within it `touch_solver` gives this thread its last one again where it would make the same anew: for
    who asks an object one thing after another. It holds that one's memory, some 300 MB, to its end."""
    token = _made.set({})
    try:
        yield
    finally:
        _made.reset(token)


_made: ContextVar[dict[str, Solver] | None] = ContextVar("made", default=None)


def surface_edge(mesh: TetMesh) -> float:
    """m, of the surface's elements at most, for touches of the mesh's object."""
    return min(SURFACE_EDGE_M, _EDGE_IN_WIDTHS * usual_width(mesh))


def patch_width(mesh: TetMesh, edge_m: float | None = None) -> float:
    """The width, m, of the patch of a touch on a quadratic mesh: the same for every mesh of an object.

    The usual one, but wider on a surface too coarse for it. edge_m: of a surface of that object whose edges
    are as long; None: the mesh's own.
    """
    edge = edge_m or typical_edge(mesh)
    return usual_width(mesh) if edge <= surface_edge(mesh) else PATCH_WIDTH_IN_EDGES * edge


def load_width(solver: Solver, tip_radius_m: float = USUAL_TIP_RADIUS_M) -> float:
    """The width, m, of the patch of a touch on that object: `patch_width` where it is of one modulus.

    Where its modulus varies, the narrowest that its elements bear, but no narrower than a contact: what they
    add hangs on the load's width.
    """
    if solver.uniform:
        return patch_width(solver.mesh)
    resolved = PATCH_WIDTH_IN_EDGES * typical_edge(solver.mesh)
    return min(max(resolved, contact_width(tip_radius_m)), patch_width(solver.mesh))


def shape_under_one_patch(
    solver: Solver, points: np.ndarray, normals: np.ndarray, width_m: float
) -> np.ndarray:
    """(k, 3, 3) 1/m: to add to the far field of places (k, 3) under patches of `width_m`, unit modulus.

    What the shape of an object of one modulus adds to a half-space under `patch_width`, the one patch of
    every mesh, less what it adds under theirs. Zero where the two are alike; else it takes `solver.plain`.
    """
    wide, nu = patch_width(solver.mesh), solver.poisson_ratio
    if width_m >= wide:
        return np.zeros((len(points), 3, 3))
    under_wide, under_own = (
        own_blocks(solver.plain, points, width) - half_space_compliance(normals, nu, width)
        for width in (wide, width_m)
    )
    return under_wide - under_own


def touch_sites(
    mesh: TetMesh,
    points: np.ndarray,
    normals: np.ndarray,
    poisson_ratio: float,
    *,
    solver: Solver | None = None,
    curvature: np.ndarray | float | None = None,
    patch: LoadPatch = LoadPatch(),
    progress: Progress = silent,
) -> TouchSites:
    """Far-field compliance at surface points (k, 3) m with outward normals (k, 3).

    mesh: linear or quadratic. solver: a factorisation to use, whose own mesh then counts; None makes
    `touch_solver(mesh, poisson_ratio)`, of one modulus.
    curvature: (k,) 1/m where the caller knows it; None estimates it from the mesh.
    Raises MeshError for points off the surface.
    """
    points = np.atleast_2d(np.asarray(points, dtype=float))
    normals = np.atleast_2d(np.asarray(normals, dtype=float))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    if points.shape != normals.shape or points.shape[1] != 3 or not (length > 0).all():
        raise MeshError(
            f"points {points.shape} and normals {normals.shape} must both be (k, 3), normals not 0"
        )
    normals = normals / length
    solver = solver or touch_solver(mesh, poisson_ratio)
    width = patch.width_m or load_width(solver, patch.tip_radius_m)
    far = own_blocks(solver, points, width, lambda share: progress("touch sites", share))
    bracing, braced, rims = np.zeros((3, len(points)))
    if patch.balls:
        by_balls = ball_law(solver, points, normals, width, patch.tip_radius_m)
        far, bracing = far + by_balls.far, by_balls.bracing
    far -= half_space_compliance(normals, poisson_ratio, width)
    if patch.width_m is None:
        far += shape_under_one_patch(solver, points, normals, width)
        missed = edge_law(mesh, points, normals)
        far, bracing, braced, rims = (
            far + missed.far,
            bracing + missed.bracing,
            missed.braced,
            missed.curvature,
        )
    if curvature is None:
        curvature = contact_curvature(mesh, points, normals, patch.tip_radius_m)
    bent = np.asarray(curvature, dtype=float) + rims
    return TouchSites(points, normals, bent, far, float(width), float(poisson_ratio), bracing, braced)


def patch_compliance(solver: Solver, patches: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """(k, 3, 3) mean displacement a unit force of each patch (nodes, weights), unit modulus, 1/m."""
    loads = patch_loads(solver.mesh, patches).reshape(-1, len(patches), 3)
    return solver.quadratic_forms(loads[solver.free])


def patch_loads(mesh: TetMesh, patches: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """(n, 3, 3k) N: nodal forces of unit forces x, y, z on each patch (nodes, weights)."""
    forces = np.zeros((len(mesh.points), 3, 3 * len(patches)))
    for k, (nodes, weights) in enumerate(patches):
        for axis in range(3):
            forces[nodes, axis, 3 * k + axis] = weights
    return forces


def contact_curvature(
    mesh: TetMesh, points: np.ndarray, normals: np.ndarray, tip_radius_m: float = USUAL_TIP_RADIUS_M
) -> np.ndarray:
    """(k,) 1/m at surface points, convex positive, as a tip of that radius feels both principal ones
    (mechanics.contact.dent.ellipse_curvature)."""
    return ellipse_curvature(principal_curvatures(mesh, points, normals, tip_radius_m), tip_radius_m)


_MIDDLE = 0.4
"""Of a contact's width: what lies under its middle."""


def uneven_curvature(
    mesh: TetMesh, points: np.ndarray, normals: np.ndarray, tip_radius_m: float
) -> np.ndarray:
    """(k,) 1/m by how much a known shape is curved otherwise under the middle of a contact than over all of
    it, as in a groove as narrow as a tip; 0 where no shape is known, whose curvature is fitted to nodes."""
    if mesh.shape is None or not len(points):
        return np.zeros(len(points))
    middle = mesh.shape.curvatures(points, normals, _MIDDLE * contact_width(tip_radius_m))[0]
    whole = contact_curvature(mesh, points, normals, tip_radius_m)
    return np.abs(ellipse_curvature(middle, tip_radius_m) - whole)


def principal_curvatures(
    mesh: TetMesh, points: np.ndarray, normals: np.ndarray, tip_radius_m: float = USUAL_TIP_RADIUS_M
) -> np.ndarray:
    """(k, 2) 1/m at surface points, convex positive, the greatest first.

    Where the mesh's shape is known, means over the width of a tip's contact. Else of a paraboloid fitted to
    the nodes within 1.8 surface edges whose triangles face the normal within 50 degrees: near an edge that
    keeps the other face out. Fewer than 6 nodes count as flat.
    """
    if mesh.shape is not None:
        return mesh.shape.curvatures(points, normals, contact_width(tip_radius_m))[0]
    triangles = mesh.touchable_surface[:, :3]
    nodes = np.unique(triangles)
    facing = vertex_normals(mesh.points, triangles)[nodes]
    near = cKDTree(mesh.points[nodes]).query_ball_point(points, 1.8 * typical_edge(mesh), return_sorted=True)
    place = np.repeat(np.arange(len(points)), [len(each) for each in near])
    node = np.concatenate([*near, []]).astype(int)
    seen = np.einsum("nx,nx->n", facing[node], normals[place]) > np.cos(np.radians(50))
    place, node = place[seen], node[seen]
    frames = local_frames(normals)
    z, x, y = np.einsum("nix,nx->in", frames[place], mesh.points[nodes[node]] - points[place])
    fit = _least_squares(
        np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1), z, place, len(points)
    )
    fit[np.bincount(place, minlength=len(points)) < 6] = 0.0
    bent = np.stack([2 * fit[:, 3], fit[:, 4], fit[:, 4], 2 * fit[:, 5]], axis=1)
    return np.linalg.eigvalsh(-bent.reshape(-1, 2, 2))[:, ::-1]


def _least_squares(columns: np.ndarray, values: np.ndarray, group: np.ndarray, groups: int) -> np.ndarray:
    """(groups, c) least-squares solutions, of the least norm, of rows (n, c) and values (n,) that belong to
    ascending groups (n,); one without rows is zero."""
    held = np.bincount(group, minlength=groups)
    row = np.arange(len(group)) - np.repeat(np.cumsum(held) - held, held)
    matrix = np.zeros((groups, held.max(initial=1), columns.shape[1]))
    matrix[group, row] = columns
    right = np.zeros(matrix.shape[:2])
    right[group, row] = values
    u, s, vt = np.linalg.svd(matrix, full_matrices=False)
    least = np.finfo(float).eps * np.maximum(held, columns.shape[1])[:, None] * s[:, :1]
    share = np.einsum("gmc,gm->gc", u, right) * np.divide(1.0, s, out=np.zeros_like(s), where=s > least)
    return np.einsum("gcd,gc->gd", vt, share)
