"""The virtual coupling: a spring in series with the object, only as soft as the device demands.

Sampled at T and delayed by n ticks, a device renders a stiffness stably up to a limit that its maker states
at 1 kHz; it falls with T (1 + 2 n) (Colgate and Schenkel 1997: b > K T / 2, and each tick of delay adds K T),
and because the passivity controller's damper must shrink by the same factor, by that factor squared here
(chosen on `palpate bench stability`). An object stiffer than that, k, is felt through a series spring c
that brings it to the limit exactly; softer places are softened less, and soft objects not at all:

    1 / k_felt = 1 / k + c,    c = max(0, 1 / k_limit - 1 / k_stiffest)

The renderer adds c to each tip's own compliance (`with_series_compliance`), so the coupling costs no lag and
no drag in free air.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.mechanics.shape.nearest import facings


def stable_stiffness_n_per_m(
    max_stiffness_n_per_m: float, rate_hz: float = 1000.0, delay_ticks: float = 0.0
) -> float:
    """What a device that renders `max_stiffness_n_per_m` at 1 kHz renders at this rate and delay."""
    slower = max(1.0, 1000.0 / rate_hz) * (1.0 + 2.0 * delay_ticks)
    return max_stiffness_n_per_m / slower**2


_PLACES, _DEEPEST_M = 100, 0.02
"""Of the presses that seek the stiffest."""


def series_compliance_m_per_n(stiffest_n_per_m: float, limit_n_per_m: float) -> float:
    """The softest coupling that the limit demands, m/N; 0 where the object is softer than the limit."""
    if limit_n_per_m <= 0.0 or stiffest_n_per_m <= limit_n_per_m:
        return 0.0
    return 1.0 / limit_n_per_m - 1.0 / stiffest_n_per_m


def stiffest_n_per_m(renderer: Any, max_force_n: float) -> float:
    """The greatest normal stiffness felt anywhere below `max_force_n`, by presses all over the surface."""
    points, triangles = renderer.surface
    corners, (_, normals) = points[triangles[:, :3]], facings(points, triangles)
    greatest = 0.0
    for k in np.unique(np.linspace(0, len(triangles) - 1, _PLACES).astype(int)):
        state = renderer.start()
        radius = float(state.radii_m[0])
        for depth in np.linspace(-0.001, _DEEPEST_M, 85):
            tip = corners[k].mean(axis=0) + (radius - depth) * normals[k]
            state, forces = renderer.step(state, tip[None])
            if np.linalg.norm(forces[0]) > max_force_n:
                break
            greatest = max(greatest, float(state.stiffness[0]))
    return greatest
