"""Moves the nodes of badly shaped tetrahedra until their radius-edge ratio is within bounds.

A mesher bounds its own measure of shape; the few tetrahedra that miss rho mostly need one node moved a
little.
"""

from __future__ import annotations

import numpy as np

from mechanics.shape.tetmesh import EDGES

_TRIALS = 40
_SWEEPS = 40
_REACH = 0.3  # of the longest edge at the node
_MARGIN = 0.975  # of the bound; what is aimed at


def radius_edge_ratio(corners: np.ndarray) -> np.ndarray:
    """(...,) circumradius over shortest edge of tetrahedra (..., 4, 3); infinite where inverted or flat."""
    a, b, c = (corners[..., k, :] - corners[..., 0, :] for k in (1, 2, 3))
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    six_volumes = (a * bc).sum(axis=-1)
    lengths = (a * a).sum(axis=-1), (b * b).sum(axis=-1), (c * c).sum(axis=-1)
    centre = sum(s[..., None] * w for s, w in zip(lengths, (bc, ca, ab), strict=True))
    edge = corners[..., EDGES[:, 0], :] - corners[..., EDGES[:, 1], :]
    shortest = np.sqrt((edge * edge).sum(axis=-1).min(axis=-1))
    radius = np.linalg.norm(centre, axis=-1) / np.maximum(2 * six_volumes, 1e-300)
    good = six_volumes > 1e-9 * shortest**3
    return np.where(good, radius / np.maximum(shortest, 1e-300), np.inf)


def relaxed(
    points: np.ndarray,
    cells: np.ndarray,
    bound: float,
    *,
    on_surface: np.ndarray,
    fixed: np.ndarray,
    up: np.ndarray,
    limit_m: float,
) -> np.ndarray:
    """Nodes (n, 3) with tetrahedra (m, 4) of ratios below `bound` wherever moving nodes can do it.

    on_surface, fixed: (n,) bool. Nodes of the surface stay within `limit_m` of where they were, fixed nodes
    in their plane besides (up: its unit normal); nodes inside are free. No move makes a node's worst
    tetrahedron worse, so none turns inside out. Repeatable: the trial moves are seeded.
    """
    found, wanted = points.copy(), _MARGIN * bound
    order = np.argsort(cells.ravel(), kind="stable")
    owner = order // cells.shape[1]
    first = np.searchsorted(cells.ravel()[order], np.arange(len(points) + 1))
    random = np.random.default_rng(0)
    bad = radius_edge_ratio(found[cells]) > wanted
    for _ in range(_SWEEPS):
        if not bad.any():
            break
        for node in np.unique(cells[bad]):
            star = owner[first[node] : first[node + 1]]
            corners = found[cells[star]]
            worst = radius_edge_ratio(corners).max()
            if worst <= wanted:
                continue
            move = _trial_moves(random, _REACH * np.linalg.norm(corners - found[node], axis=2).max())
            if on_surface[node]:
                move += found[node] - points[node]
                move *= np.minimum(1, limit_m / np.maximum(np.linalg.norm(move, axis=1), 1e-300))[:, None]
                move += points[node] - found[node]
            if fixed[node]:
                move -= (move @ up)[:, None] * up
            trial = np.repeat(corners[None], _TRIALS, axis=0)
            trial[:, cells[star] == node] += move[:, None]
            score = radius_edge_ratio(trial).max(axis=1)
            best = int(np.argmin(score))
            if score[best] < worst:
                found[node] += move[best]
        bad = radius_edge_ratio(found[cells]) > wanted
    return found


def _trial_moves(random: np.random.Generator, reach_m: float) -> np.ndarray:
    """(_TRIALS, 3) m in all directions, long and short."""
    direction = random.standard_normal((_TRIALS, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction * (reach_m * np.exp(-3 * random.random((_TRIALS, 1))))
