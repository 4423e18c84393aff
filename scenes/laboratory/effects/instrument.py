"""Effects of the instrument: they act on the readings, in the device frame, SI."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numba
import numpy as np

from palpate.scenes.laboratory.effects.base import (
    EffectContext,
    Parameters,
    SensedSamples,
    SimulatedEffect,
    unit,
)
from palpate.scenes.laboratory.tracing import RATE_HZ

GRAVITY = np.array([0.0, 0.0, -9.81])
"""m/s^2, device frame: down is -z whatever the support's tilt."""


def _rotation(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector (Rodrigues)."""
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def _offset_parameters(strength: float, bench: EffectContext) -> dict[str, Any]:
    return {
        "shift_m": (1.5e-3 * strength * unit(bench.rng)).round(7).tolist(),
        "rotation_rad": (np.radians(1.5) * strength * unit(bench.rng)).round(7).tolist(),
    }


def _displace(readings: SensedSamples, p: Parameters) -> SensedSamples:
    """Phase II is read in a frame that moved against phase I's, about the device's origin."""
    turn = _rotation(np.array(p["rotation_rad"]))
    pivot = readings.position[readings.second].mean(axis=0)
    moved = (readings.position - pivot) @ turn.T + pivot + p["shift_m"]
    # the frame slips within half a second of free air after phase I
    start = int(np.argmax(readings.second))
    share = np.clip((np.arange(len(readings.t)) - start) / (0.3 * RATE_HZ), 0, 1)[:, None]
    share = share**2 * (3 - 2 * share)
    force = np.where(share > 0, readings.force @ turn.T, readings.force)
    return replace(readings, position=readings.position + share * (moved - readings.position), force=force)


def _gain(strength: float, bench: EffectContext) -> dict[str, Any]:
    cross = 0.05 * strength * bench.rng.choice([-1.0, 1.0], size=(3, 3))
    matrix = np.where(np.eye(3) > 0, 1 + 0.1 * strength, cross)
    return {"matrix": matrix.round(6).tolist()}


def _weigh(readings: SensedSamples, p: Parameters) -> SensedSamples:
    """A mass beyond the sensor: its weight and inertia read as force on the tool; tared where the session
    began.
    """
    smooth = _smoothed(readings.position)
    acceleration = np.gradient(np.gradient(smooth, 1 / RATE_HZ, axis=0), 1 / RATE_HZ, axis=0)
    extra = p["mass_kg"] * (GRAVITY - acceleration)
    if p["tared"]:
        first = p["mass_kg"] * GRAVITY @ readings.axes[0]
        extra = extra - readings.axes @ first
    return replace(readings, force=readings.force + extra)


def _smoothed(position: np.ndarray) -> np.ndarray:
    from scipy.ndimage import gaussian_filter1d

    return gaussian_filter1d(position, 4.0, axis=0, mode="nearest")


def _late(readings: SensedSamples, p: Parameters) -> SensedSamples:
    at = readings.t - p["delay_s"]
    force = np.column_stack([np.interp(at, readings.t, readings.force[:, k]) for k in range(3)])
    return replace(readings, force=force)


@numba.njit(cache=True)
def _play(values, width):
    out = values.copy()
    for k in range(1, len(values)):
        for i in range(values.shape[1]):
            low, high = values[k, i] - width / 2, values[k, i] + width / 2
            out[k, i] = min(max(out[k - 1, i], low), high)
    return out


EFFECTS = (
    SimulatedEffect("surface_offset", "boundary", _offset_parameters, on_readings=_displace),
    SimulatedEffect(
        "tool_compliance",
        "instrument",
        lambda strength, bench: {"stiffness_n_per_m": 1200.0 / strength},
        # the device reads the handle; the tip gives way under the force on it
        on_readings=lambda r, p: replace(r, position=r.position - r.force / p["stiffness_n_per_m"]),
        forgets=True,
    ),
    SimulatedEffect(
        "tool_gravity_inertia",
        "instrument",
        lambda strength, bench: {"mass_kg": 0.05 * strength, "tared": True},
        on_readings=_weigh,
    ),
    SimulatedEffect(
        "force_gain",
        "instrument",
        _gain,
        on_readings=lambda r, p: replace(r, force=r.force @ np.array(p["matrix"]).T),
        forgets=True,
    ),
    SimulatedEffect(
        "force_bias",
        "instrument",
        lambda strength, bench: {"bias_n": (0.05 * strength * unit(bench.rng)).round(6).tolist()},
        on_readings=lambda r, p: replace(r, force=r.force + p["bias_n"]),
        forgets=True,
    ),
    SimulatedEffect(
        "force_drift",
        "instrument",
        lambda strength, bench: {"rate_n_per_s": (0.001 * strength * unit(bench.rng)).round(8).tolist()},
        on_readings=lambda r, p: replace(r, force=r.force + np.outer(r.t, p["rate_n_per_s"])),
    ),
    SimulatedEffect(
        "time_delay",
        "instrument",
        lambda strength, bench: {"delay_s": 0.02 * strength},
        on_readings=_late,
        forgets=True,
    ),
    SimulatedEffect(
        "backlash",
        "instrument",
        lambda strength, bench: {"width_m": 0.25e-3 * strength},
        on_readings=lambda r, p: replace(r, position=_play(r.position, p["width_m"])),
        forgets=True,
    ),
)
"""Effects on the readings, in the order in which the instrument adds them."""
