"""What a device tells a renderer and the servo: the state of the tip."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

IDENTITY_QUATERNION = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class TipState:
    """One reading of a tool's tip, device frame, SI units.

    time_s: the source's own clock; sequence: counts readings from 0, so a stale one is recognised.
    position_m, velocity_m_per_s: (3,) of the tip's centre. quaternion: (w, x, y, z), tool to device frame.
    buttons: a bit mask. force_enabled, connected, calibrated, fault: the device's own flags.
    """

    time_s: float
    sequence: int
    position_m: np.ndarray
    velocity_m_per_s: np.ndarray = field(default_factory=lambda: np.zeros(3))
    quaternion: tuple[float, float, float, float] = IDENTITY_QUATERNION
    buttons: int = 0
    connected: bool = True
    calibrated: bool = True
    force_enabled: bool = False
    fault: str = ""
