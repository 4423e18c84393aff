"""What a drawn instrument makes of readings: the tool's weight, the clock, lost samples, noise, steps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.varied.draws import Draw
from palpate.mechanics.recording.recording import Recording
from palpate.scenes.laboratory.effects import SensedSamples, effect
from palpate.scenes.laboratory.frame import quaternions
from palpate.scenes.laboratory.hand import band_noise


def weighed(readings: SensedSamples, draw: Draw) -> SensedSamples:
    """With the tool's weight and inertia, before any effect of the instrument; its axis as it is held."""
    if draw.orientation == "constant":
        readings = replace(readings, axes=np.repeat(readings.axes[:1], len(readings.t), axis=0))
    weigh = effect("tool_gravity_inertia").on_readings
    assert weigh is not None, "the tool's weight acts on the readings"
    return weigh(readings, {"mass_kg": draw.tool_mass_kg, "tared": draw.tared})


def logged(
    readings: SensedSamples,
    draw: Draw,
    *,
    within_s: tuple[float, float],
    phase_s: tuple[float, float],
    rng: np.random.Generator,
    **about: Any,
) -> Recording:
    """What is written down of the readings between two times.

    phase_s: when the base is traced. about: further fields of the recording.
    """
    t = sampling_times(*within_s, draw, rng)
    position = _between(t, readings.t, readings.position)
    noise = _noise(len(t), draw, rng)
    step = draw.resolution_m
    nearest = np.clip(np.round(np.interp(t, readings.t, np.arange(len(readings.t)))), 0, None).astype(int)
    phase = (round(max(phase_s[0], t[0]) + draw.clock_s, 2), round(phase_s[1] + draw.clock_s, 2))
    return Recording(
        t=t + draw.clock_s,
        position=np.round(position / step) * step,
        force_on_tool=_between(t, readings.t, readings.force) + noise,
        sample_rate_hz=draw.rate_hz,
        quaternion=None if draw.orientation == "absent" else quaternions(readings.axes[nearest]),
        boundary_phase=phase if draw.boundary_phase_stated else None,
        tool_mass_kg=draw.tool_mass_kg if draw.tool_mass_stated else 0.0,
        force_noise_std_n=draw.noise_n if draw.noise_stated else None,
        position_resolution_m=step if draw.resolution_stated else None,
        **about,
    )


def sampling_times(start_s: float, end_s: float, draw: Draw, rng: np.random.Generator) -> np.ndarray:
    """(n,) s, increasing: the instants that are written down, jittered, some lost alone, some in bursts."""
    period = 1 / draw.rate_hz
    t = np.arange(start_s + period, end_s - period, period)
    t = t + period * np.clip(draw.jitter * rng.normal(size=len(t)), -0.45, 0.45)
    kept = rng.random(len(t)) >= draw.lost_share / 2
    # a burst loses ten samples in the mean
    for at in np.flatnonzero(rng.random(len(t)) < draw.lost_share / 20):
        kept[at : at + rng.geometric(0.1)] = False
    return t[kept]


def _between(at: np.ndarray, t: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(at, t, values[:, k]) for k in range(values.shape[1])])


def _noise(count: int, draw: Draw, rng: np.random.Generator) -> np.ndarray:
    """(count, 3) N, white and slow."""
    white = rng.normal(size=(count, 3)) * np.sqrt(1 - draw.slow_share)
    slow = np.column_stack([band_noise(count, draw.rate_hz, 0.3, 10.0, rng) for _ in range(3)])
    return draw.noise_n * (white + np.sqrt(draw.slow_share) * slow)
