"""The global modulus as the paper finds it: a point load on one node of linear tetrahedra (equations 7
to 13).

The displacement under a point load has no limit as the mesh is refined, so the answer depends on the mesh
(the paper's own included); the finite-tip estimate of `reconstruct.steps.s7_modulus.modulus` does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.elastic.elasticity import stiffness
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import ContactError, OptionError
from palpate.mechanics.options import option
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.shape.tetmesh import TetMesh


@dataclass(frozen=True)
class PaperOptions:
    """The paper's own setting."""

    indentation_m: float = option(
        0.010, "method paper: displacement at which each press is read", unit="m", flag="--indentation"
    )

    def __post_init__(self) -> None:
        """Raises OptionError for an indentation that is not positive."""
        if not self.indentation_m > 0:
            raise OptionError(f"--indentation is {self.indentation_m} m; it must be greater than 0")


@dataclass(frozen=True)
class PaperFit:
    """Equation (13) over all palpations that reach the indentation, and for each alone.

    modulus_pa, ci95_pa: global, and its interval by resampling palpations. press_modulus_pa: (k,) NaN where a
    palpation is not used. node: (k,) the loaded node, -1 where not used. measured, predicted: (k, 3)
    displacement, m and m Pa. reaction_error: greatest |sum of base reactions (9) + load| over the load.
    not_used: (t, reason).
    """

    modulus_pa: float
    ci95_pa: tuple[float, float]
    press_modulus_pa: np.ndarray
    node: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    reaction_error: float
    not_used: tuple[tuple[float, str], ...]


def readings(
    presses: Presses, indentation_m: float
) -> tuple[np.ndarray, np.ndarray, list[tuple[float, str]]]:
    """Displacement (k, 3) m since first touch and force on the object (k, 3) N where each press reaches the
    depth.

    presses: low-passed (`uniaxial`). Rows are NaN for presses that stay shallower; the list names
    them.
    """
    k = len(presses)
    moved, pushed = np.full((k, 3), np.nan), np.full((k, 3), np.nan)
    shallow = []
    for i in range(k):
        rows = presses.rows([i])
        displacement = presses.displacement[rows]
        reached = np.flatnonzero(np.linalg.norm(displacement, axis=1) >= indentation_m)
        if not len(reached):
            deepest = float(np.linalg.norm(displacement, axis=1).max())
            why = f"reaches {deepest * 1e3:.1f} mm, not {indentation_m * 1e3:g} mm"
            shallow.append((float(presses.onset_s[i]), why))
            continue
        moved[i] = displacement[reached[0]]
        pushed[i] = -presses.force[rows][reached[0]]
    return moved, pushed, shallow


def fit_paper_modulus(
    presses: Presses,
    mesh: TetMesh,
    poisson_ratio: float,
    options: PaperOptions | None = None,
    *,
    seed: int = 0,
) -> PaperFit:
    """Equations (8), (10) to (13) on a linear mesh, of low-passed presses (`uniaxial`). Raises
    ContactError where fewer than 2 presses are deep enough."""
    options = options or PaperOptions()
    moved, pushed, shallow = readings(presses, options.indentation_m)
    used = np.flatnonzero(np.isfinite(moved[:, 0]))
    if len(used) < 2:
        deepest = presses.depth_m.max()
        raise ContactError(
            f"{len(used)} of {len(moved)} palpations reach the indentation of "
            f"{options.indentation_m * 1e3:g} mm (the deepest {deepest * 1e3:.1f} mm); at least 2 are "
            "needed: give a smaller --indentation"
        )
    node = np.where(
        np.isfinite(moved[:, 0]),
        nearest_nodes(mesh, presses.centre - presses.tip_radius_m * presses.contact_normal),
        -1,
    )
    solver = Solver(mesh, poisson_ratio)
    loads = np.zeros((len(mesh.points), 3, len(used)))
    loads[node[used], :, np.arange(len(used))] = pushed[used]
    displacement = solver.solve(loads)
    predicted = np.full_like(moved, np.nan)
    predicted[used] = displacement[node[used], :, np.arange(len(used))]
    reactions = base_reactions(mesh, poisson_ratio, displacement)
    balance = np.linalg.norm(reactions.sum(axis=0).T + pushed[used], axis=1)
    each = np.full(len(moved), np.nan)
    each[used] = (predicted[used] * moved[used]).sum(axis=1) / (moved[used] ** 2).sum(axis=1)
    random = np.random.default_rng(seed)
    draws = [least_squares_modulus(predicted[s], moved[s]) for s in random.choice(used, (1000, len(used)))]
    low, high = np.percentile(draws, [2.5, 97.5])
    return PaperFit(
        modulus_pa=least_squares_modulus(predicted[used], moved[used]),
        ci95_pa=(float(low), float(high)),
        press_modulus_pa=each,
        node=node,
        measured=moved,
        predicted=predicted,
        reaction_error=float((balance / np.linalg.norm(pushed[used], axis=1)).max()),
        not_used=tuple(shallow),
    )


def nearest_nodes(mesh: TetMesh, points: np.ndarray) -> np.ndarray:
    """(k,) the touchable node nearest to each of the points (k, 3): contacts cast onto the mesh (section
    2.2)."""
    touchable = np.flatnonzero(mesh.touchable)
    gap = np.linalg.norm(points[:, None] - mesh.points[touchable][None], axis=2)
    return touchable[np.argmin(gap, axis=1)]


def least_squares_modulus(predicted: np.ndarray, measured: np.ndarray) -> float:
    """Equation (13), flattened: e = sum(u_pred . u_meas) / sum(u_meas . u_meas); predicted for unit
    modulus."""
    return float((predicted * measured).sum() / (measured**2).sum())


def base_reactions(mesh: TetMesh, poisson_ratio: float, displacement: np.ndarray) -> np.ndarray:
    """Equation (9): forces of the support on the fixed nodes, (f, 3, r) N, from displacements times the
    modulus.

    displacement: (n, 3, r) m Pa, zero on the fixed nodes. f runs over the fixed nodes in order.
    """
    rows = (3 * np.flatnonzero(mesh.fixed)[:, None] + np.arange(3)).ravel()
    below = stiffness(mesh, poisson_ratio)[rows]
    flat = displacement.reshape(3 * len(mesh.points), -1)
    return (below @ flat).reshape(-1, 3, flat.shape[1])
