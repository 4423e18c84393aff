"""A solid where a file's triangles enclose none as they are: what their winding number calls inside.

fTetWild takes soups, gaps, crossings and edges of three triangles; what lies inside is decided by the
generalised winding number (Hu and others 2020, "Fast tetrahedral meshing in the wild"). The solid is taken
where it follows the triangles; a sheet encloses nothing and stays refused. Corners that lie apart by rounding
alone are joined first: that takes no time, and moves nothing.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from palpate.mechanics.disk.surface_files import ClosedSurface, surface_of
from palpate.mechanics.errors import MeshError, NotClosedError, SurfaceError
from palpate.mechanics.shape.nearest import distance, facings, inside, sample, windings
from palpate.mechanics.shape.tetmesh import FACES, lone_faces
from palpate.reconstruction.steps.s5_mesh.tetwild import tetrahedralize

_EDGE, _ENVELOPE = 1 / 25, 1e-3
"""Of the diagonal: the tetrahedra's edge, and how far their surface may lie off the triangles."""
_PASSES = 8
"""Of optimisation: the solid's surface alone is taken, not its tetrahedra."""
_ROUNDING = 3e-4
"""Of the diagonal: corners as near as this may be one corner, which a file holds in few digits."""
_ASTRAY, _AT_ONCE = 0.05, 20_000_000
"""Of the points that the triangles wind around: so many may lie outside of the solid, or others in it; points
times triangles that are looked at."""
_RAYS, _BESIDE, _PUSHED = 2000, 1e-5, 3e-3
"""Rays by which a surface is looked for that bounds no solid; where they begin, of the diagonal beside it;
its share of the area up to which it is let be."""
_NEAR, _FOLLOWED, _SOLID = 0.01, 0.9, 0.02
"""How near the solid's surface, of the diagonal, triangles lie that it follows, and their least share of the
area; the solid's least share of its box."""


def solid_of(shape: Any, unit: str = "m", up: np.ndarray | None = None) -> ClosedSurface:
    """As `surface_of`; where that finds no solid, or sheets that bound none, the one that the triangles'
    winding number tells.

    Raises NotClosedError, as `surface_of` does, where there is none, or it does not follow the triangles.
    """
    try:
        found = surface_of(shape, unit, up)
    except NotClosedError as error:
        diagonal = float(np.linalg.norm(np.ptp(error.vertices, axis=0)))
        return _sewn(error, _ROUNDING * diagonal, up) or _filled(error)
    share = _inside_out(found)
    if share <= _PUSHED:
        return found
    pushed = f"crosses itself, and bounds nothing by {100 * share:.2g} % of its area"
    kept = replace(found, notes=(*found.notes, f"it {pushed}: a tip may be felt there too early"))
    if found.parts:  # bodies and labels would be one
        return kept
    try:
        return _filled(
            NotClosedError(f"'{found.name}' {pushed}", found.name, found.vertices, found.triangles)
        )
    except NotClosedError:
        return kept


def _inside_out(surface: ClosedSurface) -> float:
    """Share of the area outside of which the surface winds around the other way, as where a fold is pushed
    out through itself: no solid is there, and a tip must not meet it. Crossing bodies have none."""
    vertices, triangles = surface.vertices, surface.triangles
    across, facing = facings(vertices, triangles)
    area = np.linalg.norm(across, axis=1)
    drawn = np.random.default_rng(0)
    one = drawn.choice(len(triangles), _RAYS, p=area / area.sum())
    points = np.einsum("kw,kwx->kx", drawn.dirichlet(np.ones(3), _RAYS), vertices[triangles[one]])
    beside = _BESIDE * np.linalg.norm(np.ptp(vertices, axis=0))
    return float((windings(vertices, triangles, points + beside * facing[one], facing[one]) < 0).mean())


def _filled(refused: NotClosedError) -> ClosedSurface:
    """What the triangles wind around; raises `refused` where that is no solid, or does not follow them."""
    vertices, triangles = refused.vertices, refused.triangles
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    try:
        points, cells = tetrahedralize(
            vertices, triangles, edge_m=_EDGE * diagonal, envelope_m=_ENVELOPE * diagonal, passes=_PASSES
        )
    except MeshError as error:
        raise refused from error
    shell = trimesh.Trimesh(*_boundary(points, cells), process=False)
    there = sample(vertices, triangles, 1000)
    near = distance(shell.vertices, shell.faces, there) < _NEAR * diagonal
    # walls between bodies that touch, and sheets inside of one, are no surface of it
    near |= inside(shell.vertices, shell.faces, there)
    followed = near.mean() >= _FOLLOWED and shell.is_watertight
    if (
        not followed
        or not _alike(shell, vertices, triangles)
        or shell.volume < _SOLID * np.prod(np.ptp(vertices, axis=0))
    ):
        raise refused
    reason = str(refused).removeprefix(f"'{refused.name}' ").split("; ")[0]
    note = f"it {reason}; filled by its winding number, {1e6 * shell.volume:.4g} cm³"
    return ClosedSurface(
        np.asarray(shell.vertices), np.asarray(shell.faces, dtype=np.int64), refused.name, (note,)
    )


def _alike(shell: trimesh.Trimesh, vertices: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether the solid holds what the triangles wind around; the mesher may lose one of two that lie on one
    another, and with it a body."""
    count = int(np.clip(_AT_ONCE // len(triangles), 100, 2000))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    points = np.random.default_rng(0).uniform(low, high, (count, 3))
    meant = np.abs(winding(vertices, triangles, points)) > 0.5
    astray = inside(shell.vertices, shell.faces, points) != meant
    return bool(astray.sum() <= _ASTRAY * meant.sum())


def winding(vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(k,) how often triangles wind around points (k, 3): 1 inside of a closed surface, 0 outside, and in
    between where it is open (Jacobson and others 2013)."""
    found = np.empty(len(points))
    for k, point in enumerate(points):
        a, b, c = (vertices[triangles[:, j]] - point for j in range(3))
        la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
        solid = np.einsum("ij,ij->i", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (b, c), (c, a)))
        found[k] = np.arctan2(solid, la * lb * lc + ab * lc + bc * la + ca * lb).sum() / (2 * np.pi)
    return found


def _boundary(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward triangles of tetrahedra (m, 4). Where they meet in an edge or a corner alone, each
    side has vertices of its own, so that every edge belongs to two triangles."""
    corners = np.arange(cells.size).reshape(cells.shape)
    faces, owners = cells[:, FACES].reshape(-1, 3), corners[:, FACES].reshape(-1, 3)
    order = np.argsort(faces, axis=1)
    _, same = np.unique(np.take_along_axis(faces, order, 1), axis=0, return_inverse=True)
    along, by_face = np.argsort(same.ravel(), kind="stable"), np.take_along_axis(owners, order, 1)
    both = np.flatnonzero(np.diff(same.ravel()[along]) == 0)
    ends = by_face[along[both]].ravel(), by_face[along[both + 1]].ravel()
    graph = coo_matrix((np.ones(len(ends[0])), ends), shape=(cells.size, cells.size))
    one = connected_components(graph, directed=False)[1]
    used, triangles = np.unique(one[owners[lone_faces(cells)]], return_inverse=True)
    return points[cells.ravel()[np.unique(one, return_index=True)[1]]][used], triangles.reshape(-1, 3)


def _sewn(refused: NotClosedError, reach_m: float, up: np.ndarray | None) -> ClosedSurface | None:
    """The surface with corners within `reach_m` of one another joined; None where that closes nothing, or
    where corners farther apart would run together."""
    vertices, count = refused.vertices, len(refused.vertices)
    pairs = cKDTree(vertices).query_pairs(reach_m, output_type="ndarray")
    if not len(pairs):
        return None
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    number, one = connected_components(graph, directed=False)
    share = np.bincount(one, minlength=number)[:, None]
    joined = np.column_stack([np.bincount(one, column, number) for column in vertices.T]) / share
    if np.linalg.norm(joined[one] - vertices, axis=1).max() > reach_m:
        return None
    shell = trimesh.Trimesh(joined, one[refused.triangles], process=False)
    try:
        found = surface_of(shell, "m", up)
    except SurfaceError:
        return None
    note = f"corners within {1e3 * reach_m:.2g} mm of one another joined"
    return replace(found, name=refused.name, notes=(note, *found.notes))
