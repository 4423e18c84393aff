"""Units by plausibility: which units make a hand's exploration of the samples most probable.

Each reading of the samples (seconds or milliseconds, metres or inches, newtons or grams) gives the same dozen
quantities other values. What is known of them is wide and log-normal; ratios to what the recording states
(tip radius, noise, resolution, rate) are heavy-tailed, since statements are wrong too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.stats import norm

from palpate.mechanics.plausible import EXPLORATION
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.statistics import weighted_quantile
from palpate.reconstruction.checks.finding import ALL_THE_SAME, SURE_ODDS, Finding, Way, p_words, sure
from palpate.reconstruction.checks.samples import Samples, Units
from palpate.reconstruction.steps.s3_contacts.first_touch import CLEAR

READINGS = {
    "time": {"s": 1.0, "ms": 1e3, "us": 1e6},
    "position": {
        "m": 1.0, "mm": 1e3, "cm": 1e2, "inches": 39.37, "dm": 10.0, "um": 1e6,
        "m divided by 10": 0.1, "m divided by 100": 0.01, "km": 1e-3,
    },
    "force": {"N": 1.0, "mN": 1e3, "grams": 101.97, "kgf": 0.10197, "kN": 1e-3, "lbf": 0.22481},
    "tip": {"m": 1.0, "mm": 1e3, "cm": 1e2, "m times 10": 10.0, "m divided by 10": 0.1, "km": 1e-3},
}  # fmt: skip
"""What the samples may be, and how many of it make the SI unit, which comes first."""
COLUMNS = {"time": ("t",), "position": ("x", "y", "z"), "force": ("fx", "fy", "fz"), "tip": ("tip_radius_m",)}
_UNITS = {"inches": "in", "grams": "gf"}
_NO_UNITS = ("m divided by 10", "m divided by 100", "dm", "km", "kN")
_SI = {"time": "seconds", "position": "metres", "force": "newtons", "tip": "metres"}
_SHOWN = 3
_LEAST_M = 1e-7
"""Rounding moves a tip that stands still by less."""
_PRIOR = 1e-2
"""Odds on a reading other than SI before anything is seen."""
_ELSE = 1e-3
"""Probability that a quantity is out of the usual for a reason that has nothing to do with units."""
_OF_TIME = ("duration", "rate", "speed", "extent")


def settled(recording: Recording, cutoff_hz: float) -> tuple[Samples, tuple[Finding, ...]]:
    """The samples in their most probable units, and a finding for each that is far more probable than SI.

    The clock comes first: everything else is read through filters that need one.
    """
    data = Samples(recording, cutoff_hz=cutoff_hz)
    known, odds = _best({k: v for k, v in measured(data, of_touches=False).items() if k in _OF_TIME})
    found = []
    if known["time"] != "s" and odds["time"] > SURE_ODDS:
        found.append(_finding(data, "time", known["time"], odds["time"], measured(data, of_touches=False)))
        data = Samples(recording, Units(time=READINGS["time"][known["time"]]), cutoff_hz)
    seen = measured(data)
    known, odds = _best(seen)
    wrong = [
        kind for kind in ("position", "force", "tip") if known[kind] not in _PLAIN and odds[kind] > SURE_ODDS
    ]
    if wrong:
        found += [_finding(data, kind, known[kind], odds[kind], seen) for kind in wrong]
        factors = {kind: READINGS[kind][known[kind]] for kind in wrong}
        data = Samples(recording, replace(data.units, **factors), cutoff_hz)
    return data, (*found, *_beyond(measured(data)))


def asked(data: Samples) -> Iterator[Finding]:
    """One question about the force's unit, of an object whose geometry is stated: a machine's sizes and
    speeds may be anything, so it refuses nothing, and stands only where the force alone is in an odd unit."""
    seen = measured(data)
    known, odds = _best(seen)
    others = any(known[kind] not in _PLAIN for kind in ("time", "position", "tip"))
    if others or known["force"] in _PLAIN or odds["force"] < SURE_ODDS:
        return
    yield replace(_finding(data, "force", known["force"], odds["force"], seen), error=0.0)


def _beyond(seen: dict[str, float]) -> Iterator[Finding]:
    """A quantity that no reading of the units makes usual. (A simulation has no noise.)"""
    for name, value in seen.items():
        q = EXPLORATION[name]
        z = abs(q.off(value))
        decades = float(-(norm.logsf(z) + np.log(2)) / np.log(10))
        if q.stated or name == "noise" or not sure(decades):
            continue
        kind = list(READINGS)[int(np.flatnonzero(q.powers)[-1])]
        yield Finding(
            "tip radius" if kind == "tip" else f"{kind} unit",
            f"{q.words} is {value:.3g}, where {q.usual:.3g} is usual",
            f"{z:.0f} standard deviations, each a factor of {q.factor:g}; {p_words(decades)}",
            f"check the unit and meaning of {', '.join(COLUMNS[kind])}",
            np.inf,
            decades,
            None,
            COLUMNS[kind],
        )


_PLAIN = ("s", "m", "N")


def _best(seen: dict[str, float]) -> tuple[dict[str, str], dict[str, float]]:
    """The most probable reading of each kind, and its odds over the best one that reads this kind as SI."""
    kinds = tuple(READINGS)

    def score(names: tuple[str, ...]) -> float:
        logs = [np.log(READINGS[kind][name]) for kind, name in zip(kinds, names, strict=True)]
        total = float(np.log(_PRIOR)) * sum(x != 0.0 for x in logs)
        for name, value in seen.items():
            q = EXPLORATION[name]
            z = q.off(value, sum(p * x for p, x in zip(q.powers, logs, strict=True)))
            usual = 1 / (1 + z**2) if q.stated else np.exp(-0.5 * z**2)
            total += float(np.log((1 - _ELSE) * usual + _ELSE))
        return total

    scores = {names: score(names) for names in product(*READINGS.values())}
    best = max(scores, key=lambda names: scores[names])
    odds = {}
    for i, kind in enumerate(kinds):
        plain = max(v for names, v in scores.items() if names[i] in _PLAIN)
        odds[kind] = float(np.exp(min(scores[best] - plain, 200.0)))
    return dict(zip(kinds, best, strict=True)), odds


def _finding(data: Samples, kind: str, name: str, odds: float, seen: dict[str, float]) -> Finding:
    index, columns = list(READINGS).index(kind), COLUMNS[kind]
    shown = [(EXPLORATION[k], v) for k, v in seen.items() if EXPLORATION[k].powers[index]]
    shown.sort(key=lambda pair: -abs(pair[0].off(pair[1])))
    listed = ", ".join(f"{q.words} {v:.3g} (usual {q.usual:.3g})" for q, v in shown[:_SHOWN])
    return Finding(
        "tip radius" if kind == "tip" else f"{kind} unit",
        f"{', '.join(columns)} look like {name}: {listed}",
        f"odds {odds:.1g} to 1 over {_SI[kind]}",
        f"convert {', '.join(columns)} to {_SI[kind]}; check the stated noise, resolution and tip radius",
        float("inf"),
        float(np.log10(odds)),
        (float(data.recording.t[0]), float(data.recording.t[-1])),
        columns,
        _ways(data, kind, name),
    )


def _ways(data: Samples, kind: str, name: str) -> tuple[Way, ...]:
    """Read in those units, where a table can be."""
    if kind == "tip":
        radius = data.recording.tip_radius_m / READINGS[kind][name]
        return (Way(f"the radius is {1e3 * radius:.3g} mm", {"tip_radius_m": radius}), ALL_THE_SAME)
    if name in _NO_UNITS:
        return (ALL_THE_SAME,)
    return (Way(f"they are {name}", {"units": {kind: _UNITS.get(name, name)}}), ALL_THE_SAME)


def measured(data: Samples, of_touches: bool = True) -> dict[str, float]:
    """The quantities of EXPLORATION that the recording has, in the units of `data`."""
    recording, radius = data.recording, data.tip_radius_m
    every = max(1, round(0.05 * data.rate_hz))
    moved = np.linalg.norm(np.diff(data.position[::every], axis=0), axis=1)
    passed = np.diff(data.times[::every])
    extent = float(np.ptp(data.position, axis=0).max())
    found = {
        "duration": float(np.ptp(data.t)),
        "rate": data.rate_hz / recording.sample_rate_hz,
        "extent": extent,
        "tip": radius,
        "ratio": extent / radius,
    }
    if len(moved) > 3:
        # over the way, not over time: however long the hand rests
        found["speed"] = weighted_quantile(moved / passed, moved, 0.25)
    if not of_touches:
        return _proper(found)
    found["noise"] = data.noise_n
    if recording.position_resolution_m and (data.step[:3] > 0).all():
        found["resolution"] = float(np.median(data.step[:3])) / recording.position_resolution_m
    if recording.force_noise_std_n:
        found["noise stated"] = data.noise_n / recording.force_noise_std_n
    touches = data.touches
    depth, peak = (np.linalg.norm(v, axis=1) for v in (touches.travel, touches.push))
    rise = data.t[touches.peak] - data.t[touches.start]
    good = (depth > max(3 * float(data.step[:3].max()), _LEAST_M)) & (rise > 0)
    # what barely leaves the noise is felt late and lost early
    good &= peak > CLEAR * data.filtered.threshold_n
    if good.sum() > 3:
        plane = 4 / 3 * np.sqrt(radius) * depth[good] ** 1.5
        found |= {
            "touch": float(np.median(rise[good])),
            "depth": float(np.median(depth[good])) / radius,
            "peak": float(np.median(peak[good])),
            "modulus": 0.75 * float(np.median(peak[good] / plane)),
        }
    return _proper(found)


def _proper(found: dict[str, float]) -> dict[str, float]:
    return {name: value for name, value in found.items() if np.isfinite(value) and value > 0}
