"""A person's hand: how fast it moves, how long it holds, how much it trembles and strays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.options import option


@dataclass(frozen=True)
class HandOptions:
    """Habits of a hand. Speeds are those of the way in, from just above the surface to the greatest depth."""

    slowest_m_per_s: float = option(0.005, "slowest press", unit="m/s")
    fastest_m_per_s: float = option(0.100, "fastest press", unit="m/s")
    hold_share: float = option(0.55, "share of touches that are held at depth")
    longest_hold_s: float = option(1.3, "longest hold", unit="s")
    tremor_m: float = option(25e-6, "physiological tremor near 9 Hz, rms per axis", unit="m")
    wander_m: float = option(0.12e-3, "slow sideways straying during a touch, rms per axis", unit="m")
    scatter_m: float = option(0.15e-3, "how far from the same place a repeat lands, rms", unit="m")
    tilt_deg: float = option(16.0, "how far the tool leans from the surface's normal, rms", unit="deg")
    pause_s: float = option(0.45, "mean pause in free air", unit="s")
    lean_m: float = option(0.35e-3, "mean lean into the object's foot while tracing", unit="m")
    trace_speed_m_per_s: float = option(0.035, "tracing speed", unit="m/s")
    trace_rounds: float = option(1.0, "rounds of the foot, plus a small overlap")
    trace_breaks: int = option(0, "how often the tracing is interrupted and continued")
    reach_pace: float = option(1.0, "how brisk the way through the air is; 1: 0.12 to 0.22 m/s")


def cohort_hand(number: int) -> HandOptions:
    """The `number`-th person of a cohort of different hands; 0 is the average one."""
    if number == 0:
        return HandOptions()
    rng = np.random.default_rng([7, number])
    pace = float(np.exp(rng.normal(0, 0.3)))
    return HandOptions(
        slowest_m_per_s=0.005 * pace,
        fastest_m_per_s=min(0.100, 0.075 * pace),
        hold_share=float(rng.uniform(0.3, 0.8)),
        longest_hold_s=float(rng.uniform(0.6, 2.0)),
        tremor_m=float(25e-6 * np.exp(rng.normal(0, 0.5))),
        wander_m=float(0.12e-3 * np.exp(rng.normal(0, 0.4))),
        scatter_m=float(0.15e-3 * np.exp(rng.normal(0, 0.4))),
        tilt_deg=float(rng.uniform(8, 24)),
        pause_s=float(rng.uniform(0.25, 0.8)),
        lean_m=float(rng.uniform(0.1e-3, 0.45e-3)),
        trace_speed_m_per_s=float(rng.uniform(0.025, 0.045)),
    )


def minimum_jerk(count: int) -> np.ndarray:
    """(count,) shares from just above 0 to 1 of a minimum-jerk reach (Flash & Hogan 1985)."""
    x = np.arange(1, count + 1) / count
    return x**3 * (10 - 15 * x + 6 * x * x)


def band_noise(
    count: int, rate_hz: float, low_hz: float, high_hz: float, rng: np.random.Generator
) -> np.ndarray:
    """(count,) Gaussian noise between two frequencies, rms 1."""
    size = max(count, 256)
    spectrum = rng.normal(size=size // 2 + 1) + 1j * rng.normal(size=size // 2 + 1)
    frequency = np.fft.rfftfreq(size, 1 / rate_hz)
    spectrum[(frequency < low_hz) | (frequency > high_hz)] = 0.0
    values = np.fft.irfft(spectrum, size)
    spread = values.std()
    return values[:count] / (spread if spread > 0 else 1.0)


def straying(count: int, rate_hz: float, hand: HandOptions, rng: np.random.Generator) -> np.ndarray:
    """(count, 2) mm by which a hand strays slowly and trembles across its way."""
    slow = [1e3 * hand.wander_m * band_noise(count, rate_hz, 0.2, 2.5, rng) for _ in range(2)]
    fast = [1e3 * hand.tremor_m * band_noise(count, rate_hz, 7, 11, rng) for _ in range(2)]
    return np.column_stack(slow) + np.column_stack(fast)
