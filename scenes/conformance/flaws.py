"""Nine flaws of simulators, planted in the true forces: what each looks like in the score and on its page.

They act on the force along the path alone, so that they know nothing of a simulator, nor of the diagnosis.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from palpate.scenes.conformance.cases import RATE_HZ, TIP_M
from palpate.scenes.conformance.truth import TipPath

Plant = Callable[[TipPath], np.ndarray]


def _deeper(tip: TipPath, depth: np.ndarray) -> np.ndarray:
    """(n, 3) N at other depths (n,) m: the force goes as depth^1.5, with the direction and level of the
    nearest sample that touches."""
    touching = np.flatnonzero(tip.way[:, 0] > 0)
    rows = np.arange(len(depth))
    after = np.clip(np.searchsorted(touching, rows), 0, len(touching) - 1)
    before = np.maximum(after - 1, 0)
    nearer = rows - touching[before] < touching[after] - rows
    near = touching[np.where(nearer, before, after)]
    level = tip.force[near] / tip.way[near, :1] ** 1.5
    return level * np.maximum(depth, 0.0)[:, None] ** 1.5


def contact_stiffness(tip: TipPath) -> np.ndarray:
    """A spring of 1500 N/m in the contact."""
    depth = tip.way[:, 0].copy()
    for _ in range(200):
        sunk = np.linalg.norm(_deeper(tip, depth), axis=1) / 1500.0
        depth += 0.5 * (tip.way[:, 0] - sunk - depth)
    return _deeper(tip, depth)


def contact_nodes(tip: TipPath) -> np.ndarray:
    """A patch of radius 1.5 mm that one node stands for: the contact is never smaller."""
    wider = 1.5e-3 / np.sqrt(TIP_M * np.maximum(tip.way[:, 0], 1e-6))
    return tip.force * (1 + (1.5 * wider[:, None]) ** 3) ** (1 / 3)


def contact_offset(tip: TipPath) -> np.ndarray:
    """A margin of 0.1 mm around the body."""
    return _deeper(tip, tip.way[:, 0] + 1e-4)


def mesh_stiffness(tip: TipPath) -> np.ndarray:
    """Elements that lock: a fifth too stiff."""
    return 1.2 * tip.force


def numerical_damping(tip: TipPath) -> np.ndarray:
    """A dashpot of 2 N s/m along the normal, which does not pull."""
    speed = np.gradient(tip.way[:, 0], 1 / RATE_HZ)
    push = np.maximum(tip.force @ tip.normal + 2.0 * speed, 0.0)
    extra = np.where(tip.way[:, 0] > 0, push - tip.force @ tip.normal, 0.0)
    return tip.force + extra[:, None] * tip.normal


def time_step(tip: TipPath) -> np.ndarray:
    """Steps of 20 ms, each with the force of the one before."""
    late = np.floor(tip.t / 0.02 + 1e-9) * 0.02 - 0.02
    return np.column_stack([np.interp(late, tip.t, f) for f in tip.force.T])


def lost_contact(tip: TipPath) -> np.ndarray:
    """Every tenth sample without contact."""
    return np.where((np.arange(len(tip.t)) % 10 == 3)[:, None], 0.0, tip.force)


def tunnelling(tip: TipPath) -> np.ndarray:
    """The second press lets the tip through at six tenths of its depth."""
    deep, half = tip.way[:, 0] > 0.6 * tip.way[:, 0].max(), len(tip.t) // 2
    air = np.flatnonzero(tip.way[:half, 0] <= 0)[-1]
    through = air + int(np.argmax(deep[air:]))
    return np.where((np.arange(len(tip.t)) >= through)[:, None], 0.0, tip.force)


def force_law(tip: TipPath) -> np.ndarray:
    """The force goes with the square of the depth, as a pressure field's; right at the deepest."""
    share = np.maximum(tip.way[:, :1], 0.0) / tip.way[:, 0].max()
    return tip.force * np.sqrt(share)


FLAWS: dict[str, Plant] = {
    plant.__name__: plant
    for plant in (
        contact_stiffness, contact_nodes, contact_offset, mesh_stiffness, numerical_damping, time_step,
        lost_contact, tunnelling, force_law,
    )
}  # fmt: skip
