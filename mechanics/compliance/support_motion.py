"""The far field on another support, exactly: springs under the base, or a part of it that lets go.

The bonded solution of each place presses on its base with reactions r; the base, condensed on itself, resists
motion with S. On springs of stiffness k (a unit area) the place gives way by r^T (S + k M)^-1 r more. Where a
part of the base is loose it may slip, and lift but not sink: a small contact problem a place, solved for
pressing. The base moves linearly between its corner nodes, or between MOST_CORNERS of them that are spread
over it, which keeps S to some hundred rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cho_factor, cho_solve, solve, solve_triangular
from scipy.spatial import Delaunay

from palpate.mechanics.compliance.far_field import energy_fields
from palpate.mechanics.compliance.pressed_places import Places
from palpate.mechanics.elastic.elasticity import stiffness, triangle_mass
from palpate.mechanics.elastic.floor import resting
from palpate.mechanics.elastic.held_base import base_triangles
from palpate.mechanics.frames import local_frames
from palpate.mechanics.shape.nearest import farthest_apart
from palpate.mechanics.shape.tetmesh import EDGES, TetMesh

ANGLES = 8
FREE_FRACTIONS = (0.25, 0.5, 0.75)
MOST_CORNERS = 160
"""Between which the base's motion is linear: on a slab of 150 mm each 12 mm, which is coarse enough to be
quick, and fine where it is thicker than that."""
_BATCH, _KNOWN = 128, 16


@dataclass(frozen=True)
class SupportMotion:
    """plane: (b, 2) m, corner nodes of the base along the support's two tangents.
    stiffness: (3 b, 3 b) m, of the object
    against motions of its base (normal, across, along). mass: (b, b) m^2. reaction: (q, 3 b, 3) for unit
    loads at q places."""

    plane: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    reaction: np.ndarray


def support_motion(places: Places) -> SupportMotion:
    """Condense the base; solved for once."""
    return places.stage(
        "support", lambda: SupportMotion(**places.stored("support", lambda: _condensed(places)))
    )


def _condensed(places: Places) -> dict[str, np.ndarray]:
    fields = energy_fields(places)
    solver = fields.solver
    mesh, free = solver.mesh, solver.free
    axes = local_frames(places.model.support.normal)[0]
    corners, interpolation = _corner_motion(mesh)
    plane = (mesh.points[corners] - places.model.support.point) @ axes[1:].T
    chosen, drawn = few_corners(plane)
    interpolation = (interpolation @ drawn).tocsr()
    fixed = np.setdiff1d(np.arange(3 * len(mesh.points)), free)
    full = stiffness(mesh, solver.poisson_ratio)
    lift = sp.kron(interpolation, axes.T, format="csr")[fixed]  # support axes to the device's
    coupling = (full[free][:, fixed] @ lift).tocsc()
    own = (lift.T @ (full[fixed][:, fixed] @ lift)).toarray()
    compliance = np.empty_like(own)
    for a in range(0, len(own), _BATCH):
        part = coupling[:, a : a + _BATCH].toarray()
        compliance[:, a : a + _BATCH] = coupling.T @ solver.solve_free(part).reshape(part.shape)
    loads = fields.solution.reshape(3 * len(mesh.points), -1)[free]
    reaction = (coupling.T @ loads).reshape(len(own), -1, 3).transpose(1, 0, 2)
    return {
        "plane": plane[chosen],
        "stiffness": own - 0.5 * (compliance + compliance.T),
        "mass": drawn.T @ (drawn.T @ _mass(mesh, corners)).T,
        "reaction": np.ascontiguousarray(reaction),
    }


def _corner_motion(mesh: TetMesh) -> tuple[np.ndarray, sp.csr_matrix]:
    """(base corner nodes (b,), motion of all base nodes from theirs (n, b))."""
    n = len(mesh.points)
    is_corner = np.zeros(n, dtype=bool)
    is_corner[mesh.tetrahedra[:, :4]] = True
    corners = np.flatnonzero(mesh.fixed & is_corner)
    column = np.full(n, -1)
    column[corners] = np.arange(len(corners))
    rows, columns, weights = [corners], [np.arange(len(corners))], [np.ones(len(corners))]
    mids = mesh.tetrahedra[:, 4:].ravel()
    ends = mesh.tetrahedra[:, EDGES].reshape(-1, 2)
    mids, first = np.unique(mids, return_index=True)
    ends = ends[first]
    held = mesh.fixed[mids]
    for k in (0, 1):
        rows.append(mids[held])
        columns.append(column[ends[held, k]])
        weights.append(np.full(held.sum(), 0.5))
    matrix = sp.coo_matrix(
        (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))), shape=(n, len(corners))
    )
    return corners, matrix.tocsr()


def few_corners(plane: np.ndarray) -> tuple[np.ndarray, sp.csr_matrix]:
    """(chosen (r,), drawn (b, r)): at most MOST_CORNERS of points (b, 2), each farthest from those before,
    and by which weights their motion gives that of all: linear in triangles, and beyond them."""
    count, chosen = len(plane), farthest_apart(plane, MOST_CORNERS)
    if len(chosen) == count:
        return chosen, sp.identity(count, format="csr")
    mesh = Delaunay(plane[chosen])
    # (b, t, 3) weights of the corners of every triangle: a point belongs where none is negative, or least so
    two = np.einsum("tij,btj->bti", mesh.transform[:, :2], plane[:, None] - mesh.transform[:, 2])
    weights = np.concatenate([two, 1 - two.sum(axis=2, keepdims=True)], axis=2)
    inside = np.nan_to_num(weights.min(axis=2), nan=-np.inf).argmax(axis=1)
    rows = np.repeat(np.arange(count), 3)
    entries = (weights[np.arange(count), inside].ravel(), (rows, mesh.simplices[inside].ravel()))
    return chosen, sp.csr_matrix(entries, shape=(count, len(chosen)))


def _mass(mesh: TetMesh, corners: np.ndarray) -> np.ndarray:
    triangles = base_triangles(mesh)[:, :3]
    column = np.full(len(mesh.points), -1)
    column[corners] = np.arange(len(corners))
    own = column[triangles]
    mass = np.zeros((len(corners),) * 2)
    np.add.at(mass, (own[:, :, None], own[:, None, :]), triangle_mass(mesh.points, triangles))
    return mass


def far_on_springs(places: Places, normal: float, tangential: float) -> np.ndarray:
    """(p, 3, 3) far field on springs of these stiffnesses a unit of area over the modulus, 1/m."""
    known: dict[tuple[float, float], np.ndarray] = places.stage("on springs", dict)
    if (normal, tangential) not in known:
        if len(known) >= _KNOWN:
            del known[next(iter(known))]
        known[normal, tangential] = _on_springs(places, normal, tangential)
    return known[normal, tangential].copy()


def _on_springs(places: Places, normal: float, tangential: float) -> np.ndarray:
    motion = support_motion(places)
    springs = np.diag([normal, tangential, tangential])
    factor = cho_factor(motion.stiffness + np.kron(motion.mass, springs), overwrite_a=True)
    q, b3, _ = motion.reaction.shape
    flat = motion.reaction.transpose(1, 0, 2).reshape(b3, 3 * q)
    half = solve_triangular(factor[0], flat, trans=0 if factor[1] else 1, lower=factor[1])
    columns = half.reshape(b3, q, 3).transpose(1, 0, 2)
    compliance = columns.transpose(0, 2, 1) @ columns
    return places.far + compliance[places.place]


def far_partly_bonded(places: Places, free_fraction: float, angle: float, floor: float) -> np.ndarray:
    """(p, 3, 3) far field with a share of the base loose, the one towards `angle` in the support plane.

    floor: 1 where a rigid support still carries what presses on it, 0 where nothing is under the loose part.
    Interpolated between the fractions and angles of a table.
    """
    table = places.stage(
        "loose", lambda: places.stored("loose", lambda: {"give": _table(support_motion(places))})["give"]
    )
    known = np.array([0.0, *FREE_FRACTIONS])
    i = int(np.clip(np.searchsorted(known, free_fraction) - 1, 0, len(known) - 2))
    w = (free_fraction - known[i]) / (known[i + 1] - known[i])
    place = (angle % (2 * np.pi)) / (2 * np.pi) * ANGLES
    j = int(min(place, ANGLES - 1))
    v = place - j
    lower = (1 - v) * table[i, j] + v * table[i, j + 1]
    upper = (1 - v) * table[i + 1, j] + v * table[i + 1, j + 1]
    both = (1 - w) * lower + w * upper
    compliance = (1 - floor) * both[0] + floor * both[1]
    return places.far + compliance[places.place]


def _table(motion: SupportMotion) -> np.ndarray:
    """(fractions + 1, angles + 1, 2, q, 3, 3) of `loosened`; nothing loose first, angles closed."""
    table = np.zeros((len(FREE_FRACTIONS) + 1, ANGLES + 1, 2, len(motion.reaction), 3, 3))
    for i, fraction in enumerate(FREE_FRACTIONS):
        for j in range(ANGLES):
            table[i + 1, j] = loosened(motion, fraction, 2 * np.pi * j / ANGLES)
    table[:, ANGLES] = table[:, 0]
    return table


def loosened(motion: SupportMotion, fraction: float, angle: float) -> np.ndarray:
    """(2, q, 3, 3) compliance added by a loose part: without and with a floor under it."""
    where = motion.plane @ [np.cos(angle), np.sin(angle)]
    weight = motion.mass.sum(axis=1)
    order = np.argsort(where, kind="stable")
    loose = order[np.cumsum(weight[order]) > (1 - fraction) * weight.sum() + 1e-12]
    rows = (3 * loose[:, None] + np.arange(3)).ravel()
    stiff = motion.stiffness[np.ix_(rows, rows)]
    reaction = motion.reaction[:, rows]
    q = len(reaction)
    stiff = stiff + 1e-9 * np.trace(stiff) / len(stiff) * np.eye(len(stiff))
    inverse = cho_solve(cho_factor(stiff), np.eye(len(stiff)))
    free = np.einsum("qbi,bc,qcj->qij", reaction, inverse, reaction, optimize=True)
    normal = np.arange(0, len(rows), 3)
    # eliminating the tangential motion leaves the normal one, to which the floor's pressure is dual
    normal_compliance = inverse[np.ix_(normal, normal)]
    carried = np.empty_like(free)
    for k in range(q):
        motion_free = -inverse[normal] @ reaction[k]
        held = resting(normal_compliance, -motion_free[:, 0])
        carried[k] = free[k]
        if held.any():
            part = motion_free[held]
            carried[k] -= part.T @ solve(normal_compliance[np.ix_(held, held)], part, assume_a="pos")
    return np.stack([free, carried])
