"""One statistic a channel: how its values and increments are distributed, against its own noise.

A channel that is stuck, held to a limit, coarse or spiky shows in which values it repeats and how it steps.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.ndimage import label, maximum, median_filter

from palpate.mechanics.recording.segments import runs, within
from palpate.mechanics.statistics import spread_about_zero
from palpate.reconstruction.checks.finding import Finding, decades_of_tail, p_words, sure
from palpate.reconstruction.checks.samples import CHANNELS, Samples

_NINE_OF_TEN = 1.645
"""Standard deviations within which nine of ten readings of a Gaussian lie."""
_WINDOW_S, _LEAST_WINDOW = 0.25, 10
_STUCK_S = 1.5
_MOST_STUCK = 0.25  # of touches or time: a wide play holds a reading still for some presses
_MOVED, _FELT = 10.0, 30.0
_STILL_M = 1e-5
"""A tip that is no farther from where it stood stands there still, or again."""
_NOISY = 1e-5
"""Of the greatest force: a sensor's noise is more; without any, a peak is flat to the last digit written."""
_COARSE = 0.05
_SPIKE_S, _SPIKES, _AROUND_S, _LEAST_SPIKES = 0.006, 12.0, 0.04, 5
_STEEP = 0.6
_SIGNAL = 5.0
_GAP = 5.0


def channels(data: Samples) -> Iterator[Finding]:
    """Dead, stuck, limited, coarse and spiky channels."""
    yield from _dead(data)
    yield from _stuck(data)
    yield from _limited(data)
    yield from _coarse(data)
    yield from _spiky(data)


def _unit(channel: int, value: float) -> str:
    return f"{value * 1e3:.3g} mm" if channel < 3 else f"{value:.3g} N"


def _dead(data: Samples) -> Iterator[Finding]:
    """A channel without any change, or a force axis that in contact shows no more than its noise."""
    values = data.values
    dead = [k for k in range(6) if np.ptp(values[:, k]) == 0]
    touching = data.contact
    if 0 < touching.sum() < len(touching):
        noise = max(data.spread_n, 1e-9)
        signal = np.sqrt(np.mean(data.net[touching] ** 2, axis=0)) / noise
        expected = np.sqrt(np.mean((data.touches.travel**2), axis=0)) if len(data.touches) else np.zeros(3)
        expected = expected / max(float(np.linalg.norm(expected)), 1e-12) * np.linalg.norm(signal)
        dead += [
            3 + k for k in range(3) if signal[k] < 1.5 and expected[k] > 2 * _SIGNAL and 3 + k not in dead
        ]
    if not dead:
        return
    names = tuple(CHANNELS[k] for k in dead)
    yield Finding(
        "dead channel",
        f"{', '.join(names)}: no signal (from {', '.join(_unit(k, values[:, k].min()) for k in dead)} to "
        f"{', '.join(_unit(k, values[:, k].max()) for k in dead)} in {len(values)} samples)",
        "certain where nothing changes; in contact no more than its own noise otherwise",
        "check the cable and the driver of that axis, and record again",
        np.inf,
        np.inf,
        _greatest(data),
        names,
    )


_ALONG = 0.8
"""Share of a force that lies along one axis, from which on it counts as pressing along it."""


def _stuck(data: Samples) -> Iterator[Finding]:
    """Windows in which a channel stands still although its companions move: how long in a row."""
    n = len(data.t)
    size = max(_LEAST_WINDOW, round(_WINDOW_S * data.rate_hz))
    count = n // size
    if count < 20:
        return
    spread = np.ptp(data.values[: count * size].reshape(count, size, 6), axis=1)
    first = data.values[: count * size : size]
    limit = (first == data.values.max(axis=0)) | (first == data.values.min(axis=0))
    limit[:, :3] = False
    least = np.where(data.step > 0, data.step, 1e-12)
    move = np.ptp(data.path[: count * size].reshape(count, size, 3), axis=1)
    felt = np.ptp(data.net[: count * size].reshape(count, size, 3), axis=1).max(axis=1)
    load = np.abs(data.net[: count * size].reshape(count, size, 3).mean(axis=1))
    # what presses mostly along an axis may slide on something flat and hard across it: the traced support
    held = (load > _ALONG * np.linalg.norm(load, axis=1, keepdims=True)) & (load > _FELT * data.spread_n)
    # a robot presses the bare support straight down: nothing moves across
    rigid = within(data.recording.segments, "rigid", data.recording.t)
    held |= rigid[: count * size : size, None]
    resolution = max(float(np.median(least[:3])), 1e-6)
    fastest = _fastest(data, count, size)
    worst: tuple[float, int, int, list[int]] | None = None
    for k in range(6):
        if np.ptp(data.values[:, k]) == 0:
            continue
        if k >= 3 and np.mean(np.diff(data.values[:, k]) == 0) > 0.5:
            continue  # its steps are wider than its noise: `_coarse`
        still = (spread[:, k] < 0.5 * least[k]) & ~limit[:, k]
        if k < 3:
            others = move[:, [j for j in range(3) if j != k]].max(axis=1) > _MOVED * resolution
            active = np.where(others, ~held[:, k], felt > _FELT * data.spread_n)
        else:  # noise alone keeps a force channel moving
            active = np.ones(count, dtype=bool)
        row = active & still
        usual = (row.sum() + 1) / (active.sum() + 2)
        for a, b in runs(still):
            many = int(row[a:b].sum())
            decades = -many * float(np.log10(usual))
            if (b - a) * size / data.rate_hz < _STUCK_S or many < 3 or not sure(decades):
                continue
            if k < 3 and b < count:  # what was stuck comes back with a jump, a hand that held still does not
                elsewhere = np.delete(fastest[:, k], np.arange(a, b + 1))
                if fastest[b - 1 : b + 1, k].max() <= elsewhere.max():
                    continue
            if worst is None or b - a > worst[2] - worst[1]:
                worst = (decades, a, b, [k])
            elif (a, b) == worst[1:3]:
                worst[3].append(k)
    if worst is None:
        return
    decades, a, b, stuck = worst
    names = tuple(CHANNELS[k] for k in stuck)
    begin, end = float(data.recording.t[a * size]), float(data.recording.t[min(b * size, n - 1)])
    seconds = (b - a) * size / data.rate_hz
    lost = sum(any(a * size <= i < b * size for i in (start, stop)) for start, stop in data.spans)
    share = max(seconds / (n / data.rate_hz), lost / max(len(data.spans), 1))
    yield Finding(
        "stuck channel",
        f"{', '.join(names)} stand still for {seconds:.3g} s from {data.t[a * size]:.1f} s on, while the "
        "rest goes on" + (f"; {lost} of {len(data.spans)} touches lie there" if lost else ""),
        p_words(decades),
        "cut that stretch out of the recording, or record again",
        np.inf if share > _MOST_STUCK else max(float(share), 0.02),
        decades,
        (begin, end),
        names,
    )


def _fastest(data: Samples, count: int, size: int) -> np.ndarray:
    """(count, 6) fastest change of each channel, per second, within each window and into the next."""
    change = np.abs(np.diff(data.values, axis=0)) / np.maximum(np.diff(data.t), 1e-9)[:, None]
    change = np.vstack([change, np.zeros((1, 6))])
    return change[: count * size].reshape(count, size, 6).max(axis=1)


def _limited(data: Samples) -> Iterator[Finding]:
    """Touches whose greatest reading is one and the same: as improbable as their peaks are unlike."""
    signals: dict[str, tuple[np.ndarray, float, tuple[str, ...]]] = {
        f"{name} {words}": (sign * data.force[:, k], float(data.step[3 + k]), (name,))
        for k, name in enumerate(CHANNELS[3:])
        for sign, words in ((1, "upwards"), (-1, "downwards"))
    }
    if not data.step[3:].any():
        signals["|force|"] = (np.linalg.norm(data.force, axis=1), 0.0, tuple(CHANNELS[3:]))
    first, last = data.traced
    spans = [*data.spans, *([(first, last)] if last > first else [])]
    worst: tuple[float, str, int, int, float, int, tuple[str, ...]] | None = None
    for words, (values, step, names) in signals.items():
        if not spans:
            return
        tops = np.array([values[a:b].max() for a, b in spans])
        top = float(tops.max())
        width = max(1.01 * float(step), 0.1 * data.noise_n)
        high = tops > 0.5 * top
        if top < 10 * data.noise_n or not high.any():
            continue
        at = tops > top - width
        share = float(width / (0.5 * top))
        peaks = [a + int(values[a:b].argmax()) for a, b in spans]
        apart = _places(data.position[[peak for peak, limit in zip(peaks, at, strict=True) if limit]])
        decades = decades_of_tail(apart - 1, int(high.sum()) - 1, share)
        # within one touch a limit is read again and again, exactly, where noise would never repeat it
        a, b = spans[int(np.argmax(tops))]
        same = _places(data.position[a:b][values[a:b] == tops.max()])
        if not step and data.noise_n > _NOISY * top and same > 3:
            decades = max(decades, 2.0 * same)
        if sure(decades) and (worst is None or decades > worst[0]):
            worst = (
                decades,
                words,
                int(at[: len(data.spans)].sum()),
                len(data.spans),
                top,
                int(np.argmax(tops)),
                names,
            )
    if worst is None:
        return
    decades, words, count, among, top, touch, names = worst
    where = f"in {count} of {among} touches" if count else "while the base was traced"
    a, b = spans[touch]
    yield Finding(
        "clipped",
        f"{words} ends at {top:.4g} N {where}",
        p_words(decades),
        "press less hard or take a sensor with a wider range; samples at the limit carry no information",
        float(max(count / max(among, 1), 0.02)),
        decades,
        (float(data.recording.t[a]), float(data.recording.t[b - 1])),
        names,
    )


def _places(position: np.ndarray) -> int:
    """At how many places, each of its own, the tip stood in samples (n, 3) m: at one and the same an object
    gives the same force."""
    return len(np.unique(np.rint(position / _STILL_M), axis=0))


def _coarse(data: Samples) -> Iterator[Finding]:
    """Steps of a channel against what a press makes of it; a channel whose noise hides its steps has none."""
    depths, peaks = (np.linalg.norm(v, axis=1) for v in (data.touches.travel, data.touches.push))
    if not (moved := depths > data.step[:3].max()).any():
        return
    depth, peak = float(np.median(depths[moved])), float(np.median(peaks[moved]))
    # a moving tip passes its steps and averages them; a force's first rise hides within one
    off = np.concatenate([data.step[:3] / np.sqrt(12) / max(depth, 1e-9), data.step[3:] / max(peak, 1e-9)])
    coarse = [k for k in range(6) if off[k] > _COARSE]
    if not coarse:
        return
    names = tuple(CHANNELS[k] for k in coarse)
    step = max(coarse, key=lambda k: off[k])
    yield Finding(
        "coarse steps",
        f"{', '.join(names)} come in steps of {_unit(step, float(data.step[step]))}, where a press is "
        f"{depth * 1e3:.3g} mm deep and peaks at {peak:.3g} N (medians)",
        "certain: 98 % of the increments are multiples of the step",
        "raise the sensor's resolution, or log before rounding",
        float(1.5 * off[step]),
        np.inf,
        _greatest(data),
        names,
    )


def _spiky(data: Samples) -> Iterator[Finding]:
    """Readings that leave the running median by far and are back within 6 ms: noise hardly does, no touch is
    so short."""
    if data.rate_hz < 200:
        return
    width = 2 * round(_AROUND_S * data.rate_hz / 2) + 1
    dt = np.diff(data.times)
    cut = np.convolve(np.concatenate([[0], dt > _GAP / data.rate_hz]), np.ones(2 * width + 1), "same") > 0.5
    found: list[tuple[int, int, float]] = []
    for k in range(6):
        values = data.values[:, k]
        off = values - median_filter(values, size=width, mode="nearest")
        # along a straight line without noise no spread is left: a spike leaves by more than a usual step
        moves = np.abs(np.diff(values))
        usual = float(np.median(moves[moves > 0])) if moves.any() else np.inf
        scale = max(spread_about_zero(off), float(data.step[k]), usual / _SPIKES)
        away, count = label((np.abs(off) > _SPIKES * scale) & ~cut)
        if not count:
            continue
        length = np.bincount(away)[1:]
        first = np.concatenate([[0], np.flatnonzero(np.diff(away) > 0) + 1])[-count:]
        last = np.minimum(first + length, len(values) - 1)
        top = maximum(np.abs(off), away, np.arange(1, count + 1))
        # a spike steps up and down; what swings, as a hand with a heavy tool does, only turns
        steep = np.minimum(np.abs(values[first] - values[first - 1]), np.abs(values[last] - values[last - 1]))
        short = (length <= max(1, _SPIKE_S * data.rate_hz)) & (first > 2) & (steep > _STEEP * top)
        for i in first[short]:
            about = np.abs(off[max(i - 5 * width, 0) : i + 5 * width])
            if abs(off[i]) > _SPIKES * np.quantile(about, 0.9) / _NINE_OF_TEN:  # out of its surroundings too
                found.append((k, int(i), float(abs(off[i])) / scale))
    if len(found) < _LEAST_SPIKES:
        return
    names = tuple(CHANNELS[k] for k in sorted({k for k, _, _ in found}))
    places = np.array([i for _, i, _ in found])
    hit = sum(bool(((places >= a) & (places < b)).any()) for a, b in data.spans)
    height = float(np.median([h for _, _, h in found]))
    middle = found[len(found) // 2][1]
    begin, end = (min(max(middle + d, 0), len(data.t) - 1) for d in (-width, width))
    yield Finding(
        "spikes",
        f"{len(found)} readings of {', '.join(names)} jump away and back within {_SPIKE_S * 1e3:.0f} ms; "
        f"{hit} of {len(data.spans)} touches have one",
        f"{height:.0f} standard deviations of the channel (median)",
        "take them out by a median filter over 5 samples, and look for a loose contact",
        float(max(0.02, 0.2 * hit / max(len(data.spans), 1))),
        np.inf,
        (float(data.recording.t[begin]), float(data.recording.t[end])),
        names,
    )


def _greatest(data: Samples) -> tuple[float, float]:
    """The touch of the greatest force, s."""
    middle = int(np.argmax(np.linalg.norm(data.force, axis=1)))
    around = round(0.5 * data.rate_hz)
    rows = (min(max(middle + d, 0), len(data.t) - 1) for d in (-around, around))
    begin, end = (float(data.recording.t[i]) for i in rows)
    return begin, end
