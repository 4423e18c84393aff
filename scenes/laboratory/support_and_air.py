"""What a complete exploration does beside tracing and pressing the object: presses on the bare support, and
waving in the air. Lengths mm, forces N.
"""

from __future__ import annotations

import numpy as np

from palpate.scenes.laboratory.hand import band_noise, minimum_jerk
from palpate.scenes.laboratory.tracing import RATE_HZ

RIGID_N = 4.0
"""Greatest force of a press on the bare support."""
ABOVE_MM = 30.0
"""From so high above the support its presses come."""
WAVE_MM, WAVE_DEG = 15.0, 20.0
"""How far a hand waves a tool and turns it, rms, in the middle of it."""


def on_the_support() -> tuple[np.ndarray, np.ndarray]:
    """((n,) height of the tip's lowest point, (n,) N along the support's normal) of three presses, from the
    air to the air."""
    still = np.zeros(int(0.3 * RATE_HZ))
    down = ABOVE_MM * (1 - minimum_jerk(int(0.4 * RATE_HZ)))
    held = 0.5 * RIGID_N * (1 - np.cos(2 * np.pi * np.arange(int(0.8 * RATE_HZ)) / (0.8 * RATE_HZ)))
    height = [ABOVE_MM + still, *[np.r_[down, 0 * held, down[::-1]]] * 3, ABOVE_MM + still]
    push = [still, *[np.r_[0 * down, held, 0 * down]] * 3, still]
    return np.concatenate(height), np.concatenate(push)


def waving(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """((n, 3) way, (n, 3) rotation vectors) of three seconds in the air: to and fro, and turning."""
    count = int(3 * RATE_HZ)
    fade = np.sin(np.pi * np.arange(count) / count)[:, None] ** 0.5
    way = fade * WAVE_MM * np.column_stack([band_noise(count, RATE_HZ, 0.4, 2.5, rng) for _ in range(3)])
    turn = np.column_stack([band_noise(count, RATE_HZ, 0.3, 1.5, rng) for _ in range(3)])
    return way, fade * np.radians(WAVE_DEG) * turn
