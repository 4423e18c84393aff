"""What free air shows, taken off the forces: bias, drift, and the tool's own weight and inertia."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.forward.touches import FOLLOWED
from palpate.diagnosis.instrument.free_air import FreeAir, matrices
from palpate.diagnosis.options import AttributionOptions
from palpate.mechanics.effects.force_bias import EFFECT as BIAS
from palpate.mechanics.effects.force_drift import EFFECT as DRIFT
from palpate.mechanics.effects.tool_gravity_inertia import EFFECT as INERTIA
from palpate.mechanics.effects.tool_gravity_inertia import STANDARD_GRAVITY


@dataclass(frozen=True)
class InstrumentOffsets:
    """names: asserted, strongest first. residual: (n, 3) N, local: what these took off the forces. reasons:
    words. intervals: of the parameters, 95 %.

    What is sure but too small to matter is taken off as well, and put back nowhere.
    """

    names: tuple[str, ...]
    parameters: dict[str, dict]
    residual: np.ndarray
    reasons: tuple[str, ...]
    intervals: dict[str, dict] = field(default_factory=dict)

    def also(
        self, name: str, parameters: dict[str, Any], intervals: dict[str, Any], change: np.ndarray, why: str
    ) -> InstrumentOffsets:
        """With one effect more, which changes the forces by (n, 3) N."""
        return InstrumentOffsets(
            (*self.names, name),
            {**self.parameters, name: parameters},
            self.residual + change,
            (*self.reasons, why),
            {**self.intervals, name: intervals},
        )


def matters(forward: Forward, change: np.ndarray, rules: AttributionOptions) -> bool:
    """Whether a change (n, 3) N of the forces is felt, rms over contact samples, against their noise."""
    t = forward.touches
    return bool(np.sqrt((change[t.counted] ** 2).sum(axis=1).mean()) > rules.smallest * t.vector_noise_n)


@dataclass
class _FreeAirParts:
    """What free air shows, effect by effect. parts: (n, 3) N, device frame, of the forces. level, level_se:
    (3,) N, the constant reading that is left, and its standard error."""

    level: np.ndarray
    level_se: float
    parts: dict[str, np.ndarray] = field(default_factory=dict)
    parameters: dict[str, dict] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)

    def put(self, name: str, part: np.ndarray, parameters: dict[str, Any], why: str) -> None:
        """Take one effect in."""
        self.parts[name], self.parameters[name], self.reasons[name] = part, parameters, why

    def but_for(self, name: str, reading: np.ndarray) -> np.ndarray:
        """(n, 3) N: a reading less every part but one."""
        return reading - sum((p for n, p in self.parts.items() if n != name), np.zeros_like(reading))


def free_air_offsets(
    forward: Forward, free: FreeAir | None, excluded: Collection[str], rules: AttributionOptions
) -> InstrumentOffsets:
    """Decide what free air shows, and take it off the forces of forward.touches."""
    t = forward.touches
    nothing = np.zeros_like(t.local_force)
    if free is None:
        return InstrumentOffsets((), {}, nothing, ())
    turning = free.turning
    if turning is not None and np.linalg.norm(turning.tool_n) <= rules.z * turning.se_n:
        turning = None  # too little to be seen
    free = dataclasses.replace(free, turning=turning)
    made = _FreeAirParts(free.bias_n.copy(), free.bias_se_n)
    if DRIFT.name not in excluded:
        _drift(made, forward, free, rules)
    if INERTIA.name not in excluded:
        _weight(made, forward, free, rules)
    followed = INERTIA.name not in excluded and _followed(made, forward, free)
    if np.abs(made.level).max() > rules.z * made.level_se and BIAS.name not in excluded:
        part = np.broadcast_to(made.level, t.local_force.shape).copy()
        why = f"in free air the force reads {np.linalg.norm(made.level):.3f} N"
        made.put(BIAS.name, part, {"bias_n": made.level.tolist()}, why)
    # what is sure is taken off, however little it is, lest it be taken for an effect of the presses; what
    # matters is named
    parts = made.parts
    named = {n for n, part in parts.items() if matters(forward, part, rules)}
    if INERTIA.name in named and t.free_air.any():
        # what the table reads in the air, filtered as the forces are, is nearer than a mass times an
        # acceleration of thinned positions
        parts[INERTIA.name] = made.but_for(INERTIA.name, t.free_air)
    frame = t.frame[t.press]
    local = {n: np.einsum("nij,nj->ni", frame, parts[n]) for n in parts if n in named}
    columns = {**t.columns, FOLLOWED: parts[INERTIA.name]} if followed else t.columns
    forward.touches = dataclasses.replace(t, force=t.force - sum(parts.values(), nothing), columns=columns)
    order = tuple(sorted(local, key=lambda n: -float((local[n][t.counted] ** 2).sum())))
    error = _errors(made, free)
    intervals = {
        n: {k: around(v, error[k]) for k, v in made.parameters[n].items() if k in error} for n in order
    }
    return InstrumentOffsets(
        order,
        {n: made.parameters[n] for n in order},
        sum(local.values(), nothing),
        tuple(words for n, words in made.reasons.items() if n in named),
        intervals,
    )


def _drift(made: _FreeAirParts, forward: Forward, free: FreeAir, rules: AttributionOptions) -> None:
    """A drifting zero was zero when the recording began."""
    t = forward.touches
    drift = np.abs(free.rate_n_per_s).max()
    if not drift > rules.z * free.rate_se_n_per_s:
        return
    duration, middle = np.ptp(t.t) + 1e-9, free.t.mean()
    why = f"in free air the force drifts by {drift * duration:.3f} N over the presses"
    made.put(DRIFT.name, t.t[:, None] * free.rate_n_per_s, {"rate_n_per_s": free.rate_n_per_s.tolist()}, why)
    made.level = made.level - middle * free.rate_n_per_s
    made.level_se = float(np.hypot(made.level_se, middle * free.rate_se_n_per_s))


def _weight(made: _FreeAirParts, forward: Forward, free: FreeAir, rules: AttributionOptions) -> None:
    """The tool's weight where it turns with the tool, else its inertia and weight by the acceleration."""
    t, turning = forward.touches, free.turning
    if turning is not None and t.quaternion is not None:
        # a tare took the weight off as it lay in the tool at first; it stays where the tool turns
        mass = float(np.linalg.norm(turning.tool_n)) / STANDARD_GRAVITY
        weight = -turning.first @ turning.tool_n
        turned = np.einsum("nij,j->ni", matrices(t.quaternion), turning.tool_n)
        made.level = made.level - weight
        made.level_se = float(np.hypot(made.level_se, turning.se_n))
        made.put(
            INERTIA.name,
            weight + turned - mass * forward.acceleration,
            {"mass_kg": mass, "tared": True, "weight_n": weight.tolist()},
            f"in free air the force turns with the tool: {mass * 1e3:.0f} g of tool, tared",
        )
    elif turning is None and free.mass_kg > rules.z * free.mass_se_kg:  # no tool has less than none
        weight = -STANDARD_GRAVITY * forward.model.support.normal
        untared = made.level @ weight / (weight @ weight) > 0.5 * free.mass_kg
        part = -free.mass_kg * forward.acceleration
        if untared:
            part = part + free.mass_kg * weight
            made.level = made.level - free.mass_kg * weight
        made.put(
            INERTIA.name,
            part,
            {"mass_kg": free.mass_kg, "tared": not untared},
            f"in free air the force follows the hand's acceleration: {free.mass_kg * 1e3:.0f} g of tool",
        )


def _followed(made: _FreeAirParts, forward: Forward, free: FreeAir) -> bool:
    """Whether the table's free air stands for the weight: of a tool that turns unseen it is nearer than any
    constant, which is then no bias but the weight's own mean."""
    t = forward.touches
    if not t.free_air.any():
        return False
    left = t.free_air - sum(made.parts.values(), np.zeros_like(t.local_force))
    if not float(np.linalg.norm(left[t.counted].std(axis=0))) > t.vector_noise_n:
        return False
    made.parts = {n: part for n, part in made.parts.items() if n == DRIFT.name}
    made.level = np.zeros(3)
    made.put(
        INERTIA.name,
        made.but_for(INERTIA.name, t.free_air),
        {"mass_kg": max(free.mass_kg, 0.0), "tared": True},
        "in free air the force wanders as the weight of a tool does that turns unseen",
    )
    return True


def _errors(made: _FreeAirParts, free: FreeAir) -> dict[str, ArrayLike]:
    """{key: standard error} of what free air shows."""
    mass_se = free.mass_se_kg if free.turning is None else free.turning.se_n / STANDARD_GRAVITY
    mass_kg = made.parameters.get(INERTIA.name, {}).get("mass_kg", 0.0)
    return {
        "bias_n": made.level_se,
        "rate_n_per_s": free.rate_se_n_per_s,
        "mass_kg": np.hypot(mass_se, INERTIA.hints.systematic_share[0] * abs(mass_kg)),
    }


def around(value: ArrayLike, error: ArrayLike) -> list:
    """[low, high] at 95 % of a value with a standard error."""
    value, half = np.asarray(value), 1.96 * np.asarray(error)
    return [(value - half).tolist(), (value + half).tolist()]
