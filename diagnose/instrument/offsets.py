"""What is found before any press is looked at: bias, drift and the tool's own weight in free air, a yielding
tool on the rigid support, a move of the object between two tracings of its base.

It is taken off the forces and positions, so that the search for other effects starts from clean ones.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from diagnose.forward.prediction import Forward
from diagnose.instrument.freeair import FreeAir, matrices
from diagnose.instrument.retraced import Move
from diagnose.instrument.rigid import Rigid
from diagnose.options import AttributionOptions
from diagnose.search.evidence import Candidate
from diagnose.search.gaps import closed_share, gap
from diagnose.search.whiten import FOLLOWED, Whitener
from diagnose.verdict.result import EffectEntry
from mechanics.effects.force_bias import EFFECT as BIAS
from mechanics.effects.force_drift import EFFECT as DRIFT
from mechanics.effects.force_gain import EFFECT as GAIN
from mechanics.effects.registry import effect
from mechanics.effects.surface_offset import EFFECT as OFFSET
from mechanics.effects.tool_compliance import EFFECT as SPRING
from mechanics.effects.tool_gravity_inertia import EFFECT as INERTIA
from mechanics.effects.tool_gravity_inertia import STANDARD_GRAVITY

RULES = AttributionOptions()


@dataclass(frozen=True)
class InstrumentOffsets:
    """names: asserted, strongest first. residual: (n, 3) N, local: what these took off the forces. reasons:
    words.

    What is sure but too small to matter is taken off as well, and put back nowhere.
    """

    names: tuple[str, ...]
    parameters: dict[str, dict]
    residual: np.ndarray
    reasons: tuple[str, ...]
    intervals: dict[str, dict] = field(default_factory=dict)

    def plain(self, whitener: Whitener, candidate: Candidate) -> np.ndarray:
        """(g,) N^2: what putting the readings back adds to a candidate's plain sums of squares."""
        if not self.names:
            return np.zeros(whitener.groups)
        r = candidate.residual
        both = np.stack([r, self.residual], axis=2)
        gram = whitener.raw_gram(both)
        return gram[:, 1, 1] + 2 * gram[:, 0, 1]

    def entries(
        self,
        before: np.ndarray,
        candidate: Candidate,
        counts: np.ndarray,
        noise: float,
        added: float,
        rng: np.random.Generator,
        sure: Callable[[str], float],
    ) -> list[EffectEntry]:
        """The effects' lines. before: (g,) N^2, what the ideal model misses; counts: (g,) samples.
        sure(name): the probability that it is there."""
        result = []
        for name in self.names:
            after = candidate.plain
            closed, interval = closed_share(before, after, counts, noise, added, rng, 100)
            left = gap(after, counts, added)
            keys, own = self.parameters[name], self.intervals[name]
            domain = effect(name).domain
            result.append(EffectEntry(name, domain, sure(name), left, closed, interval, keys, 1e3, own))
        return result


def find_instrument_offsets(
    forward: Forward,
    free: FreeAir | None,
    rigid: Rigid | None,
    excluded: set[str],
    rules: AttributionOptions = RULES,
) -> InstrumentOffsets:
    """Decide what free air and the support tell; take it off forces and positions of forward.touches."""
    offsets = _free_air_offsets(forward, free, excluded, rules)
    if rigid is None or SPRING.name in excluded or rigid.compliance <= rules.z * rigid.error:
        return offsets
    t = forward.touches
    stiffness = 1 / rigid.compliance
    change = _yielding(forward, rigid.compliance)
    if not _matters(forward, change, rules):
        return offsets
    forward.touches = dataclasses.replace(t, position=t.position + t.force / stiffness)
    error = np.hypot(rigid.error, SPRING.systematic_share[0] * rigid.compliance)
    low, high = (1 / max(rigid.compliance + s * 1.96 * error, 1e-9) for s in (1, -1))
    yields = f"on the rigid support the tip's reading gives by {1e3 * rigid.compliance:.3f} mm a newton"
    return InstrumentOffsets(
        (*offsets.names, SPRING.name),
        {**offsets.parameters, SPRING.name: {"stiffness_n_per_m": float(stiffness)}},
        offsets.residual + change,
        (*offsets.reasons, yields),
        {**offsets.intervals, SPRING.name: {"stiffness_n_per_m": [float(low), float(high)]}},
    )


def ruled_out(
    forward: Forward,
    rigid: Rigid | None,
    move: Move | None,
    rules: AttributionOptions = RULES,
) -> frozenset[str]:
    """What the support shows not to be there: a spring or a move that is too small to matter even if it is
    `rules.z` standard errors greater than it was read."""
    gone = set()
    if rigid is not None and np.isfinite(rigid.error):
        most = max(rigid.compliance, 0.0) + rules.z * rigid.error
        if not _matters(forward, _yielding(forward, most), rules):
            gone.add(SPRING.name)
    if move is not None:
        t = forward.touches
        along, error = move.along(t.point, t.normal)
        most = np.abs(along) + rules.z * np.sqrt(np.diag(error))
        if not _matters(forward, _moved(forward, most), rules):
            gone.add(OFFSET.name)
    return frozenset(gone)


def _yielding(forward: Forward, compliance: float) -> np.ndarray:
    """(n, 3) N: what the ideal model says more where a spring of m/N has been taken off the readings."""
    t, settings = forward.touches, forward.ideal(forward.model.material.young_modulus_pa)
    read = np.nan_to_num(forward.predict(settings))
    corrected = dataclasses.replace(t, position=t.position + compliance * t.force)
    return np.nan_to_num(dataclasses.replace(forward, touches=corrected).predict(settings)) - read


def _moved(forward: Forward, along: np.ndarray) -> np.ndarray:
    """(n, 3) N: what the ideal model says more than where its places are along (p,) m farther in."""
    settings = forward.ideal(forward.model.material.young_modulus_pa)
    here = np.nan_to_num(forward.predict(settings))
    settings.onset = settings.onset - along
    return here - np.nan_to_num(forward.predict(settings))


def _matters(forward: Forward, change: np.ndarray, rules: AttributionOptions) -> bool:
    """Whether a change (n, 3) N of the forces is felt, rms over contact samples, against their noise."""
    t = forward.touches
    return bool(np.sqrt((change[t.counted] ** 2).sum(axis=1).mean()) > rules.smallest * t.vector_noise_n)


def with_move(
    offsets: InstrumentOffsets,
    forward: Forward,
    move: Move | None,
    excluded: set[str],
    rules: AttributionOptions = RULES,
) -> InstrumentOffsets:
    """The offsets, and the object's move where its base was traced twice and it shows.

    forward's surface was fitted to the same presses, so it stands where the object was pressed and nothing is
    taken off: `residual` is what the surface would miss by where its base was first traced.
    """
    if move is None or OFFSET.name in excluded:
        return offsets
    t = forward.touches
    along, error = move.along(t.point, t.normal)
    if (along**2).mean() <= rules.z**2 * np.trace(error) / len(along):
        return offsets
    change = _moved(forward, along)
    if not _matters(forward, change, rules):
        return offsets
    sd = np.sqrt(np.diag(move.error))
    words = (
        f"the base traced once more lies {1e3 * np.linalg.norm(move.shift):.1f} mm and "
        f"{np.degrees(np.linalg.norm(move.turn)):.1f} degrees from where it was traced first"
    )
    return InstrumentOffsets(
        (*offsets.names, OFFSET.name),
        {
            **offsets.parameters,
            OFFSET.name: {"shift_m": move.shift.tolist(), "rotation_rad": move.turn.tolist()},
        },
        offsets.residual + change,
        (*offsets.reasons, words),
        {
            **offsets.intervals,
            OFFSET.name: {
                "shift_m": _around(move.shift, sd[:3]),
                "rotation_rad": _around(move.turn, sd[3:]),
            },
        },
    )


def read_sideways(rigid: Rigid | None, rules: AttributionOptions = RULES) -> frozenset[str]:
    """What the support shows to be there, but does not tell wholly: a force that is read into other axes."""
    return frozenset({GAIN.name} if rigid is not None and rigid.sideways_z > rules.z else ())


def _free_air_offsets(
    forward: Forward, free: FreeAir | None, excluded: set[str], rules: AttributionOptions
) -> InstrumentOffsets:
    t = forward.touches
    nothing = np.zeros_like(t.local_force)
    if free is None:
        return InstrumentOffsets((), {}, nothing, ())
    duration = np.ptp(t.t) + 1e-9
    middle = free.t.mean()
    parts: dict[str, np.ndarray] = {}
    parameters: dict[str, dict] = {}
    reasons: dict[str, str] = {}
    level, level_se = free.bias_n.copy(), free.bias_se_n
    drift = np.abs(free.rate_n_per_s).max()
    if drift > rules.z * free.rate_se_n_per_s and DRIFT.name not in excluded:
        # a drifting zero was zero when the recording began
        parts[DRIFT.name] = t.t[:, None] * free.rate_n_per_s
        parameters[DRIFT.name] = {"rate_n_per_s": free.rate_n_per_s.tolist()}
        reasons[DRIFT.name] = f"in free air the force drifts by {drift * duration:.3f} N over the presses"
        level = level - middle * free.rate_n_per_s
        level_se = float(np.hypot(level_se, middle * free.rate_se_n_per_s))
    turning = free.turning
    if turning is not None and np.linalg.norm(turning.tool_n) <= rules.z * turning.se_n:
        turning = None  # too little to be told
    if turning is not None and INERTIA.name not in excluded and t.quaternion is not None:
        # a tare took the weight off as it lay in the tool at first; it stays where the tool turns
        mass = float(np.linalg.norm(turning.tool_n)) / STANDARD_GRAVITY
        weight = -turning.first @ turning.tool_n
        turned = np.einsum("nij,j->ni", matrices(t.quaternion), turning.tool_n)
        parts[INERTIA.name] = weight + turned - mass * forward.acceleration
        parameters[INERTIA.name] = {
            "mass_kg": mass,
            "tared": True,
            "weight_n": weight.tolist(),
        }
        level = level - weight
        level_se = float(np.hypot(level_se, turning.se_n))
        reasons[INERTIA.name] = (
            f"in free air the force turns with the tool: {mass * 1e3:.0f} g of tool, tared"
        )
    heavy = abs(free.mass_kg) > rules.z * free.mass_se_kg
    if heavy and turning is None and INERTIA.name not in excluded:
        weight = -STANDARD_GRAVITY * forward.model.support.normal
        untared = level @ weight / (weight @ weight) > 0.5 * free.mass_kg
        part = -free.mass_kg * forward.acceleration
        if untared:
            part = part + free.mass_kg * weight
            level = level - free.mass_kg * weight
        parts[INERTIA.name] = part
        parameters[INERTIA.name] = {"mass_kg": free.mass_kg, "tared": not untared}
        reasons[INERTIA.name] = (
            f"in free air the force follows the hand's acceleration: {free.mass_kg * 1e3:.0f} g of tool"
        )
    followed = False
    wanders = float(np.linalg.norm((t.free_air - sum(parts.values(), nothing))[t.counted].std(axis=0)))
    if t.free_air.any() and wanders > t.vector_noise_n and INERTIA.name not in excluded:
        # a tool that turns unseen: what was followed through the touches is nearer than any constant, which
        # is then no bias but the weight's own mean
        parts = {n: part for n, part in parts.items() if n == DRIFT.name}
        parts[INERTIA.name] = t.free_air - sum(parts.values(), nothing)
        followed = True
        parameters[INERTIA.name] = {"mass_kg": max(free.mass_kg, 0.0), "tared": True}
        level = np.zeros(3)
        reasons[INERTIA.name] = "in free air the force wanders as the weight of a tool does that turns unseen"
    if np.abs(level).max() > rules.z * level_se and BIAS.name not in excluded:
        parts[BIAS.name] = np.broadcast_to(level, t.local_force.shape).copy()
        parameters[BIAS.name] = {"bias_n": level.tolist()}
        reasons[BIAS.name] = f"in free air the force reads {np.linalg.norm(level):.3f} N"
    # what is sure is taken off, however little it is, lest it be taken for an effect of the presses; what
    # matters is named
    named = {n for n, part in parts.items() if _matters(forward, part, rules)}
    if INERTIA.name in named and t.free_air.any():
        # what the table reads in the air, filtered as the forces are, is nearer than a mass times an
        # acceleration of thinned positions
        parts[INERTIA.name] = t.free_air - sum((p for n, p in parts.items() if n != INERTIA.name), nothing)
    mass_se = free.mass_se_kg if turning is None else turning.se_n / STANDARD_GRAVITY
    mass_kg = parameters.get(INERTIA.name, {}).get("mass_kg", 0.0)
    error = {
        "bias_n": level_se,
        "rate_n_per_s": free.rate_se_n_per_s,
        "mass_kg": np.hypot(mass_se, INERTIA.systematic_share[0] * abs(mass_kg)),
    }
    frame = t.frame[t.press]
    local = {n: np.einsum("nij,nj->ni", frame, parts[n]) for n in parts if n in named}
    columns = {**t.columns, FOLLOWED: parts[INERTIA.name]} if followed else t.columns
    forward.touches = dataclasses.replace(t, force=t.force - sum(parts.values(), nothing), columns=columns)
    order = tuple(sorted(local, key=lambda n: -float((local[n][t.counted] ** 2).sum())))
    intervals = {n: {k: _around(v, error[k]) for k, v in parameters[n].items() if k in error} for n in order}
    return InstrumentOffsets(
        order,
        {n: parameters[n] for n in order},
        sum(local.values(), nothing),
        tuple(words for n, words in reasons.items() if n in named),
        intervals,
    )


def _around(value: ArrayLike, error: ArrayLike) -> list:
    return [
        (np.asarray(value) - 1.96 * np.asarray(error)).tolist(),
        (np.asarray(value) + 1.96 * np.asarray(error)).tolist(),
    ]
