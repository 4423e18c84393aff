"""Faults to put into a sound recording, each as a lab would make it; the check-up must name them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.steps.s3_contacts.contacts import explore

Change = Callable[[Recording, np.random.Generator], Recording]


@dataclass(frozen=True)
class Fault:
    """words: what is wrong. names: findings that name it rightly. change: puts it in."""

    words: str
    names: tuple[str, ...]
    change: Change


def _force(matrix: np.ndarray) -> Change:
    return lambda r, _: replace(r, force_on_tool=r.force_on_tool @ matrix.T)


def _position(matrix: np.ndarray) -> Change:
    return lambda r, _: replace(r, position=r.position @ matrix.T)


def _swapped(r: Recording, random: np.random.Generator) -> Recording:
    order = [[1, 0, 2], [2, 1, 0], [0, 2, 1]][random.integers(3)]
    return replace(r, force_on_tool=r.force_on_tool[:, order])


def _mirrored(r: Recording, random: np.random.Generator) -> Recording:
    sign = np.ones(3)
    sign[random.integers(3)] = -1
    return replace(r, position=r.position * sign)


def _turned(r: Recording, random: np.random.Generator) -> Recording:
    order = [[1, 2, 0], [2, 0, 1]][random.integers(2)]
    return replace(r, force_on_tool=r.force_on_tool[:, order])


def _dead(r: Recording, random: np.random.Generator) -> Recording:
    force = np.array(r.force_on_tool)
    force[:, random.integers(3)] = 0.0
    return replace(r, force_on_tool=force)


def _stuck(what: str, seconds: float) -> Change:
    def change(r: Recording, random: np.random.Generator) -> Recording:
        values = np.array(getattr(r, what))
        length = min(seconds, 0.6 * float(r.t[-1] - r.t[0]))
        start = random.uniform(0.2, 0.8) * (r.t[-1] - r.t[0] - length) + r.t[0]
        rows = (r.t >= start) & (r.t < start + length)
        axes = slice(None) if random.random() < 0.5 else random.integers(3)
        values[rows, axes] = values[np.argmax(rows), axes]
        changed: dict[str, Any] = {what: values}
        return replace(r, **changed)

    return change


def _saturated(share: float) -> Change:
    def change(r: Recording, _: np.random.Generator) -> Recording:
        limit = share * float(np.abs(r.force_on_tool).max())
        return replace(r, force_on_tool=np.clip(r.force_on_tool, -limit, limit))

    return change


def _saturated_at(limit: float) -> Change:
    return lambda r, _: replace(r, force_on_tool=np.clip(r.force_on_tool, -limit, limit))


def _steps(r: Recording, _: np.random.Generator) -> Recording:
    return replace(r, force_on_tool=np.round(r.force_on_tool / 0.1) * 0.1)


def _spikes(r: Recording, random: np.random.Generator) -> Recording:
    force = np.array(r.force_on_tool)
    many = max(8, round(0.5 * (r.t[-1] - r.t[0])))
    long = max(1, round(0.003 * (len(r.t) - 1) / (r.t[-1] - r.t[0])))
    for start in random.integers(0, len(force) - long, many):
        force[start : start + long, random.integers(3)] += random.choice([-1, 1]) * random.uniform(2, 8)
    return replace(r, force_on_tool=force)


def _drift(r: Recording, random: np.random.Generator) -> Recording:
    way = random.standard_normal(3)
    slow = np.sin(2 * np.pi * (r.t - r.t[0]) / 6.0) * 2.0
    return replace(r, force_on_tool=r.force_on_tool + np.outer(slow, way / np.linalg.norm(way)))


def _gaps(r: Recording, random: np.random.Generator) -> Recording:
    kept = np.ones(len(r.t), dtype=bool)
    for start in random.uniform(r.t[0], r.t[-1], 40):
        kept &= (r.t < start) | (r.t > start + 0.4)
    return _rows(r, np.flatnonzero(kept))


def _year(r: Recording, _: np.random.Generator) -> Recording:
    t = np.array(r.t)
    t[len(t) // 2 :] += 3.15e7
    return replace(r, t=t)


def _jitter(r: Recording, random: np.random.Generator) -> Recording:
    """Times as an operating system gives them: read late by up to 20 ms, in order."""
    dt = float(np.median(np.diff(r.t)))
    t = np.maximum.accumulate(r.t + random.exponential(0.005, len(r.t)))
    return replace(r, t=t + 1e-3 * dt * np.arange(len(t)))


def _rows(r: Recording, rows: np.ndarray, **changed: Any) -> Recording:
    quaternion = None if r.quaternion is None else r.quaternion[rows]
    return replace(
        r, t=r.t[rows], position=r.position[rows], force_on_tool=r.force_on_tool[rows],
        quaternion=quaternion, **changed,
    )  # fmt: skip


def _slow(hz: float) -> Change:
    def change(r: Recording, _: np.random.Generator) -> Recording:
        wanted = np.arange(r.t[0], r.t[-1], 1 / hz)
        return _rows(r, np.unique(np.searchsorted(r.t, wanted)), sample_rate_hz=hz)

    return change


def _late(seconds: float) -> Change:
    def change(r: Recording, _: np.random.Generator) -> Recording:
        force = np.column_stack([np.interp(r.t - seconds, r.t, r.force_on_tool[:, k]) for k in range(3)])
        return replace(r, force_on_tool=force)

    return change


def _base(factor: float) -> Change:
    """The base traced at another size, along the support; the tip comes back to where it was in the air."""

    def change(r: Recording, _: np.random.Generator) -> Recording:
        found = explore(r)
        a, b = found.boundary.interval
        middle, normal = found.boundary.outline.mean(axis=0), found.boundary.support_normal
        until = int(np.searchsorted(r.t, found.presses.onset_s[0] - 0.3))
        weight = np.ones(len(r.t))
        weight[b:] = 0.0
        if until > b:
            weight[b:until] = np.linspace(1, 0, until - b)
        flat = r.position - middle
        flat = flat - (flat @ normal)[:, None] * normal
        return replace(r, position=r.position + (factor - 1) * weight[:, None] * flat)

    return change


def _sunk(r: Recording, _: np.random.Generator) -> Recording:
    """The support was traced 2 cm above where the presses then find it."""
    found = explore(r)
    b = found.boundary.interval[1]
    shift = 0.02 * found.boundary.support_normal
    weight = (np.arange(len(r.t)) < b).astype(float)
    weight[b : b + 200] = np.linspace(1, 0, len(weight[b : b + 200]))
    return replace(r, position=r.position + weight[:, None] * shift)


_FORCE_UNIT, _POSITION_UNIT = ("force unit",), ("position unit", "tip radius")
FAULTS = {
    "force in mN": Fault("force in mN", _FORCE_UNIT, _force(1e3 * np.eye(3))),
    "force in grams": Fault("force in grams", _FORCE_UNIT, _force(101.97 * np.eye(3))),
    "position in inches": Fault("position in inches", _POSITION_UNIT, _position(39.37 * np.eye(3))),
    "position x 10": Fault("position x 10", _POSITION_UNIT, _position(10 * np.eye(3))),
    "position / 10": Fault("position / 10", _POSITION_UNIT, _position(0.1 * np.eye(3))),
    "position / 1000": Fault("position in km", _POSITION_UNIT, _position(1e-3 * np.eye(3))),
    "time in ms": Fault("time in ms", ("time unit",), lambda r, _: replace(r, t=1e3 * r.t)),
    "tip of 50 mm": Fault("tip", ("tip radius", "position unit"), lambda r, _: replace(r, tip_radius_m=0.05)),
    "tip of 1 um": Fault("tip", ("tip radius", "position unit"), lambda r, _: replace(r, tip_radius_m=1e-6)),
    "position mirrored": Fault("mirrored", ("mirrored",), _mirrored),
    "force axes swapped": Fault("swapped", ("swapped axes",), _swapped),
    "force axes turned": Fault("turned", ("turned axes",), _turned),
    "|force|": Fault(
        "abs", ("force magnitude",), lambda r, _: replace(r, force_on_tool=np.abs(r.force_on_tool))
    ),
    "force sign flipped": Fault("sign", ("force sign",), _force(-np.eye(3))),
    "dead force axis": Fault("dead", ("dead channel",), _dead),
    "encoder stuck 60 s": Fault("stuck", ("stuck channel",), _stuck("position", 60.0)),
    "encoder stuck 5 s": Fault("stuck", ("stuck channel",), _stuck("position", 5.0)),
    "force stuck 10 s": Fault("stuck", ("stuck channel",), _stuck("force_on_tool", 10.0)),
    "saturated at 0.3 N": Fault("clipped", ("clipped",), _saturated_at(0.3)),
    "saturated at half": Fault("clipped", ("clipped",), _saturated(0.5)),
    "force steps of 0.1 N": Fault("coarse", ("coarse steps",), _steps),
    "spikes": Fault("spikes", ("spikes",), _spikes),
    "drift of 2 N in 3 s": Fault("drift", ("drift",), _drift),
    "gaps": Fault("gaps", ("gap",), _gaps),
    "gap of a year": Fault("gap", ("gap",), _year),
    "jitter of 5 ms": Fault("jitter", ("jitter",), _jitter),
    "rate said 1 Hz": Fault("rate", ("rate",), lambda r, _: replace(r, sample_rate_hz=1.0)),
    "rate said 10 times": Fault(
        "rate", ("rate",), lambda r, _: replace(r, sample_rate_hz=10 * r.sample_rate_hz)
    ),
    "rate said a tenth": Fault(
        "rate", ("rate",), lambda r, _: replace(r, sample_rate_hz=0.1 * r.sample_rate_hz)
    ),
    "50 Hz": Fault("slow", ("slow",), _slow(50.0)),
    "10 Hz": Fault("slow", ("slow",), _slow(10.0)),
    "force 200 ms late": Fault("delay", ("delay",), _late(0.2)),
    "force 120 ms late": Fault("delay", ("delay",), _late(0.12)),
    "base half the size": Fault("base", ("base size", "tip radius"), _base(0.5)),
    "base double the size": Fault("base", ("base size",), _base(2.0)),
    "support 2 cm too high": Fault("support", ("below the support",), _sunk),
}
