"""What one picture of a session shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def level(up: np.ndarray) -> np.ndarray:
    """(3,) unit vector across a unit vector `up` (3,): from the object away from the person."""
    away = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
    return away / np.linalg.norm(away)


@dataclass(frozen=True)
class View:
    """One renderer's side of a frame: force on the tool (3,) N and the surface's displacement (n, 3) m."""

    name: str
    force_n: np.ndarray
    displacement_m: np.ndarray


@dataclass(frozen=True)
class Frame:
    """Of the first tip: tip_m (3,), depth_m in the object, stiffness in N/m, 0 in air.

    reason: why the commanded force is not the rendered one, in plain words. busy: what the worker does, or
    why it failed. recorded_s: how long a recording runs, None without one.
    """

    time_s: float
    tip_m: np.ndarray
    depth_m: float
    touching: bool
    stiffness_n_per_m: float
    force_enabled: bool
    reason: str
    views: tuple[View, ...]
    busy: str
    recorded_s: float | None
