"""The local frame of a contact: rows n, u, v, carried along without spin as the normal turns."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.kernels import inner, part


@part
def turn_frame(frame, normal):
    """Parallel-transport the rows (n, u, v) of `frame` (3, 3) to a new normal: no spin about it."""
    for r in range(1, 3):
        dot = 0.0
        for k in range(3):
            dot += frame[r, k] * normal[k]
        for k in range(3):
            frame[r, k] -= dot * normal[k]
    length = np.sqrt(frame[1, 0] ** 2 + frame[1, 1] ** 2 + frame[1, 2] ** 2)
    for k in range(3):
        frame[1, k] /= length
        frame[0, k] = normal[k]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        frame[2, k] = normal[i] * frame[1, j] - normal[j] * frame[1, i]


@inner
def new_frame(frame, normal):
    """Any right-handed rows (n, u, v), chosen by the normal alone."""
    axis = 0
    if abs(normal[1]) < abs(normal[axis]):
        axis = 1
    if abs(normal[2]) < abs(normal[axis]):
        axis = 2
    for k in range(3):
        frame[1, k] = (1.0 if k == axis else 0.0) - normal[axis] * normal[k]
    turn_frame(frame, normal)
