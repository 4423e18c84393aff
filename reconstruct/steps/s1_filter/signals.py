"""A recording as touches are looked for in it: low-passed, less what is read in free air, and how far that
may be wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.distance import cdist

from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import runs
from palpate.reconstruction.shapes.outline import in_its_plane
from palpate.reconstruction.steps.s1_filter.fast_drift import (
    crowd_median,
    follow_free_air,
    interpolation_error,
    passing,
    slow_part,
)
from palpate.reconstruction.steps.s1_filter.noise import (
    crowd_scale,
    least_contrast,
    low_pass_at,
    moving_spread,
    noise_gain,
    white_noise_std,
)
from palpate.reconstruction.steps.s1_filter.tool_weight import ToolWeight, tool_weight

_LOW = 0.7
"""A touch lasts while the force stays above this share of the least contrast."""
_RIPPLE = 1e-4
"""Of the greatest force: what the low-pass leaves in free air after a press, more where samples are missing;
a rendered force knows no other noise."""
_STILL_S = 0.1
"""A force without noise that is nothing for so long was rendered: it holds no weight and no drift, and what
would be taken off it becomes a touch in the air."""
_LOOSE = 0.5
"""Of the least contrast: what a touch stands above what free air may have done unseen. All of it costs true
presses of heavy tools, none of it lets the turn of a tool pass for one (decision 0102)."""
_WINDOW_S = 8.0
_SAMPLES = 300
_SHARE = 0.12


@dataclass(frozen=True)
class Signals:
    """What presses are read from: low-passed position and force (n, 3), its magnitude, noise N an axis,
    raw force."""

    recording: Recording
    position: np.ndarray
    force: np.ndarray
    magnitude: np.ndarray
    raw_force: np.ndarray
    noise_n: float


@dataclass(frozen=True)
class Filtered:
    """A recording low-passed at `cutoff_hz`, and what it reads in free air.

    free_air: (n, 3) N, taken off the signals' force. spread: (n,) N an axis, noise of the filtered force in
    free motion; more where inertia is left. weight: the tool's share of free_air, None where forces were
    taken as they are. air: (n,) bool, where the tip only passes, if no constant, drift and weight explain
    the free air, so that it was followed from one touch to the next (`passing`); else None.
    """

    signals: Signals
    free_air: np.ndarray
    spread: np.ndarray
    cutoff_hz: float
    weight: ToolWeight | None = None
    air: np.ndarray | None = None

    @property
    def followed(self) -> bool:
        """Whether the free air was followed from one touch to the next."""
        return self.air is not None

    @cached_property
    def least(self) -> float:
        """How many spreads a touch must reach (reconstruct.steps.s1_filter.noise)."""
        return least_contrast(self.signals.recording.sample_rate_hz, self.cutoff_hz)

    @property
    def threshold_n(self) -> float:
        """N that a touch reaches where the noise is least."""
        return self.least * float(self.spread.min())

    @cached_property
    def touching(self) -> np.ndarray:
        """(n,) bool: where something is touched, on the way or on purpose."""
        # so long a low-passed force may be near zero and not end: a quarter of its fastest wave
        gap = round(0.25 * self.signals.recording.sample_rate_hz / self.cutoff_hz)
        contrast = self.signals.magnitude / self.spread
        if self.air is not None:
            contrast = np.where(self.air, 0.0, contrast)
        return hysteresis(contrast, _LOW * self.least, self.least, self.signals.force, gap)


def filtered_of(
    recording: Recording, cutoff_hz: float, *, tared: bool = False, near: ToolWeight | None = None
) -> Filtered:
    """Low-passed signals of a recording with the tool's weight, inertia and a slow drift taken off. Where the
    force in free air changes faster (a tool that turns unseen), it is followed from where the tip passes.

    tared: nothing is free air, and forces are taken as they are. near: what the tool weighs by a beginning
    of the recording.
    """
    t, rate = recording.t, recording.sample_rate_hz
    filtered = low_pass_at(t, recording.force_on_tool, rate, cutoff_hz)
    position = low_pass_at(t, recording.position, rate, cutoff_hz)
    ripple = _RIPPLE * float(np.linalg.norm(recording.force_on_tool, axis=1).max())
    stated = 0.5 * (recording.force_noise_std_n or 0.0)
    read_noise = white_noise_std(recording.force_on_tool)
    noise = max(read_noise, stated, ripple, 1e-6)
    read_hz = read_rate_hz(recording)
    if read_hz < rate:  # lines between readings hold less noise than was read, of which no low-pass takes any
        noise = max(noise, 2 * stated)
    white = noise * noise_gain(read_hz, cutoff_hz)

    def less(weight: ToolWeight | None, drift: np.ndarray, still: Callable[[np.ndarray], float]) -> Filtered:
        """With weight and drift (n, 3) taken off; `still` tells the spread of a still tip by what is left."""
        free_air = drift if weight is None else drift + weight.force
        force, raw = filtered - free_air, recording.force_on_tool - free_air
        size = np.linalg.norm(force, axis=1)
        spread = np.full(len(size), max(white, still(size)))
        if weight is not None:
            spread = moving_spread(size, weight.inertia, float(spread[0]), round(rate / cutoff_hz))
        signals = Signals(recording, position, force, size, raw, noise)
        return Filtered(signals, free_air, spread, cutoff_hz, weight)

    nothing = np.zeros_like(filtered)
    if tared:
        return less(None, nothing, lambda size: white)
    untouched = (recording.force_on_tool == 0.0).all(axis=1)
    if read_noise == 0.0 and any(b - a > _STILL_S * rate for a, b in runs(untouched)):
        return less(None, nothing, lambda size: crowd_scale(size[untouched]))
    sliding = _sliding(recording, position)
    weight = tool_weight(recording, filtered, cutoff_hz, touched=sliding, near=near)
    left = filtered - weight.force
    scale = max(white, crowd_scale(np.linalg.norm(left[~sliding], axis=1)))
    drift, _ = free_air_force(t, left, scale, touched=sliding)
    steady = less(weight, drift, lambda size: crowd_scale(size[~sliding]))
    if steady.spread.min() <= noise:
        return steady  # free air is as quiet as its sensor: there is nothing to follow
    air, traced = passing(t, position, steady.signals.force, recording.tip_radius_m, sliding)
    slow = slow_part(t, recording.force_on_tool - weight.force, air)
    if slow is None or interpolation_error(t, left, air) > crowd_median(steady.signals.magnitude[air]):
        return steady
    # mass and lateness were read from a force that turned
    again = tool_weight(recording, filtered - slow, cutoff_hz, touched=sliding)
    off = interpolation_error(t, filtered - again.force, air)

    def followed(drift: np.ndarray, loose: np.ndarray) -> Filtered:
        there = less(again, drift, lambda size: max(off, crowd_scale(size[~air])))
        return replace(there, spread=np.hypot(there.spread, _LOOSE * np.where(traced, 0.0, loose)), air=air)

    raw = recording.force_on_tool - again.force
    return followed(*follow_free_air(t, raw, air, lambda *seen: followed(*seen).touching))


def read_rate_hz(recording: Recording) -> float:
    """Hz, of the force's readings: as stated, where they are slower than the samples."""
    about = recording.description.get("recording", {})
    read = about.get("read_rate_hz") if isinstance(about, Mapping) else None
    return min(float(read), recording.sample_rate_hz) if read else recording.sample_rate_hz


def stated_tracing(recording: Recording) -> tuple[float, float] | None:
    """(start, end) s of phase I as it is stated: by itself, or as the first segment of that kind."""
    stated = [(s.start_s, s.end_s) for s in recording.segments if s.kind == "trace"]
    return recording.boundary_phase or (stated[0] if stated else None)


def _sliding(recording: Recording, position: np.ndarray) -> np.ndarray:
    """(n,) bool: where the base is traced for certain; nowhere where nobody states when, or all would be."""
    stated, t = stated_tracing(recording), recording.t
    if stated is None:
        return np.zeros(len(t), dtype=bool)
    on = in_its_plane(position, (t >= stated[0]) & (t <= stated[1]), recording.tip_radius_m)
    return on & ~on.all()


def hysteresis(
    magnitude: np.ndarray, low: float, high: float, force: np.ndarray | None = None, gap: int = 0
) -> np.ndarray:
    """(n,) bool: the state machine's contacts, each back-tracked: runs above `low` that reach `high`.

    gap: samples; a shorter fall below `low` ends no contact whose force (n, 3) has not turned round by then.
    """
    state, above = np.zeros(len(magnitude), dtype=bool), magnitude > low
    if force is not None:
        for a, b in runs(~above):
            if 0 < a and b < len(above) and b - a < gap and force[a - 1] @ force[b] > 0:
                above[a:b] = True
    for a, b in runs(above):
        if magnitude[a:b].max() > high:
            state[a:b] = True
    return state


def free_air_force(
    t: np.ndarray,
    force: np.ndarray,
    spread_n: float,
    *,
    reach: float = 5.0,
    touched: np.ndarray | None = None,
) -> tuple[np.ndarray, float]:
    """Free-air force (n, 3) N interpolated over time, and the share of windows where it was found.

    Free air is where readings crowd: in each window of 8 s the densest cluster of low-passed readings (n, 3)
    within `reach` times their noise `spread_n` (N an axis). Windows without such a crowd, or far from their
    neighbours', are passed over. Where no window has one the force is zero. touched: (n,) bool, where
    something is touched for certain: a tracing crowds as well.
    """
    may = np.ones(len(t), dtype=bool) if touched is None else ~touched
    starts = np.arange(t[0], t[-1], _WINDOW_S / 2)
    times, levels = [], []
    for start in starts:
        inside = np.flatnonzero(may & (t >= start) & (t < start + _WINDOW_S))
        if len(inside) < 20:
            continue
        chosen = inside[np.linspace(0, len(inside) - 1, min(_SAMPLES, len(inside))).astype(int)]
        f = force[chosen]
        gap = cdist(f, f)
        neighbours = (gap < reach * spread_n).sum(axis=1)
        best = int(np.argmax(neighbours))
        if neighbours[best] < max(5, _SHARE * len(chosen)):
            continue
        crowd = gap[best] < reach * spread_n
        times.append(float(np.mean(t[chosen[crowd]])))
        levels.append(np.median(f[crowd], axis=0))
    if not times and touched is not None:  # nothing else was recorded: air is in there too
        return free_air_force(t, force, spread_n, reach=reach)
    if not times:
        return np.zeros_like(force), 0.0
    at, level = np.array(times), np.array(levels)
    # a long hold crowds as well: what stands far from the median of its neighbours is such a hold
    typical = np.array([np.median(level[max(0, i - 3) : i + 4], axis=0) for i in range(len(level))])
    lowest = level[np.argmin(np.linalg.norm(level, axis=1))]
    good = np.linalg.norm(level - typical, axis=1) < 4 * reach * spread_n
    if not good.any():
        return np.broadcast_to(lowest, force.shape).copy(), 0.0
    at, level = at[good], level[good]
    return np.column_stack([np.interp(t, at, level[:, a]) for a in range(3)]), len(at) / len(starts)
