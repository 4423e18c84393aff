"""The second part of the stability grid: friction, a curved object with base and edges, one tip and two.

A silicone block whose top is bent to a dome, rendered by finite elements. The hand presses it off its crown,
drags over the crown to the other side, lets go, and does it again.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks._closed_loop import ClosedLoopResult, Loop, closed_loop, side_by_side
from palpate.devices.impedance import HandImpedance
from palpate.devices.virtual_hand import SPEC
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.render.base import Renderer
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.render.passivity import PassivityOptions

SIZE_M = (0.06, 0.06, 0.03)
DOME_RADIUS_M = 0.06
TIP_RADIUS_M = 0.005
DEPTH_M = 0.004
DRAG_M = 0.016
APART_M = 0.012
MODULI_PA = (30e3, 300e3)
HANDS = ((0.05, 2.0, 200.0), (0.2, 12.0, 600.0))
FRICTIONS = (0.0, 0.5, 1.0)
DELAYS_S = (0.0, 2e-3)
QUANTA_M = (0.0, 5e-5)


def dome() -> Model:
    """60 x 60 x 30 mm, its top a sphere of 60 mm radius with the crown at the origin, z up."""
    mesh = box_mesh((6, 6, 3), SIZE_M).quadratic()
    points = mesh.points - mesh.points.min(axis=0)
    x, y = points[:, 0] - SIZE_M[0] / 2, points[:, 1] - SIZE_M[1] / 2
    sunk = DOME_RADIUS_M - np.sqrt(DOME_RADIUS_M**2 - x**2 - y**2)
    z = points[:, 2] * (1 - sunk / SIZE_M[2]) - SIZE_M[2]
    bent = np.stack([x, y, z], axis=1)
    return Model(
        mesh=TetMesh(bent, mesh.tetrahedra, mesh.fixed, mesh.touchable),
        material=ObjectMaterial(MODULI_PA[0], 0.49),
        support=Support(np.array([0.0, 0.0, -SIZE_M[2]]), np.array([0.0, 0.0, 1.0])),
        tool=Tool(TIP_RADIUS_M),
        mesh_size_m=0.01,
    )


def press_and_drag(rate_hz: float = 1000.0, *, times: int = 2) -> np.ndarray:
    """(n + 1, 3) m: 0.55 s above the dome (the ramp), then in, over the crown at 50 mm/s, and out."""
    above, below = TIP_RADIUS_M + 0.004, TIP_RADIUS_M - DEPTH_M
    left, right = -DRAG_M / 2, DRAG_M / 2
    corners, lasts = [(left, above)], [0.55]
    for _ in range(times):
        corners += [(left, above), (left, below), (right, below), (right, above), (left, above)]
        lasts += [0.08, DRAG_M / 0.05, 0.08, 0.3, 0.02]
    x, z = np.array([*corners, (left, above)]).T
    t = np.concatenate([[0.0], np.cumsum(lasts)])
    at = np.arange(int(t[-1] * rate_hz) + 1) / rate_hz
    return np.stack([np.interp(at, t, x), 0 * at, np.interp(at, t, z)], axis=1)


def one(
    renderer: Renderer, hand: tuple[float, float, float], loop: Loop, tips: int, *, active: bool
) -> ClosedLoopResult:
    """One combination; the two tips stand side by side, across the drag."""
    offsets = np.zeros((tips, 3))
    offsets[:, 1] = APART_M * (np.arange(tips) - 0.5 * (tips - 1))
    return closed_loop(
        renderer,
        SPEC,
        HandImpedance(*hand),
        press_and_drag(loop.rate_hz),
        loop=replace(loop, coupling=active, passivity=PassivityOptions(passivity=active)),
        tip_offsets_m=offsets,
    )


def cases() -> list[dict[str, Any]]:
    """The whole grid: moduli, hands, friction, delays, steps of the position, one tip and two."""
    base = FemRenderer(dome(), RenderOptions())
    found = []
    grid = itertools.product(MODULI_PA, FRICTIONS, HANDS, DELAYS_S, QUANTA_M, (1, 2))
    for modulus, friction, hand, delay, quantum, tips in grid:
        renderer = base.with_modulus(modulus).with_friction(friction)
        loop = Loop(1000.0, quantum, delay)
        off, on = (one(renderer, hand, loop, tips, active=active) for active in (False, True))
        about = {
            "young_modulus_pa": modulus, "friction": friction, "mass_kg": hand[0],
            "damping_n_s_per_m": hand[1], "stiffness_n_per_m": hand[2], "delay_s": delay,
            "quantisation_m": quantum, "tips": tips,
        }  # fmt: skip
        found.append(side_by_side(off, on, **about))
    return found
