"""Two recordings of one object, before and after, or with two tools: what differs, by how much, and what
explains it.

Each is reconstructed by itself, so what its own shape, touches and law leave uncertain is in its interval,
and the two are taken as independent. Then each is diagnosed: an effect that only one of them has, or whose
parameters lie apart, explains a difference of the moduli where the moduli beside their effects agree; else
the object differs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.effects.base import Role
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.result import Result

_95 = 1.96
_NEAR_M = 0.012
"""Sites of the two recordings that lie nearer are one place."""
_LEAST_PLACES = 4
_OBJECT = "young_modulus"
_HALVES = 0.5
"""Effects explain a difference of moduli where beside them it is at most this share of it."""


@dataclass(frozen=True)
class Side:
    """One of the two: its recording, model, and diagnosis (None where none was asked for)."""

    recording: Recording
    model: Model
    diagnosis: Diagnosis | None

    @property
    def modulus_pa(self) -> float:
        """As reconstructed, by the ideal model."""
        return self.model.material.young_modulus_pa

    @property
    def log_sd(self) -> float:
        """Standard error of ln modulus."""
        low, high = self.model.material.young_modulus_ci95_pa
        return float(np.log(high / low)) / (2 * _95)

    @property
    def named(self) -> tuple[str, ...]:
        """Effects that its diagnosis asserts, but for what every solid has."""
        if self.diagnosis is None:
            return ()
        return tuple(n for n in self.diagnosis.effects if effect(n).role is not Role.KNOWN)

    @property
    def beside_effects_pa(self) -> float:
        """The modulus beside the effects that were named."""
        return self.modulus_pa if self.diagnosis is None else self.diagnosis.young_modulus_pa


@dataclass(frozen=True)
class Place:
    """A place that both pressed: (3,) m in the first's frame, ratio second over first of the moduli there
    and its 95 % interval."""

    point: np.ndarray
    ratio: float
    ci95: tuple[float, float]


@dataclass(frozen=True, eq=False, repr=False)
class Changes(Result):
    """Two recordings of one object: their moduli, ratio and difference, and which effect explains it.

    ratio, difference_pa: second over, less first, with 95 % intervals; beside: the ratio of the moduli
    beside the effects named, None without diagnoses. places: that both pressed, empty where they share none.
    explained_by: effects, "young_modulus" where the object itself differs, nothing where no difference
    shows. `plot`: both moduli, or each shared place's ratio. `show`: the first object, coloured at shared
    places by the ratio.
    """

    before: Side
    after: Side
    ratio: float
    ratio_ci95: tuple[float, float]
    difference_pa: float
    difference_ci95_pa: tuple[float, float]
    beside: tuple[float, tuple[float, float]] | None
    places: tuple[Place, ...]
    explained_by: tuple[str, ...]
    shifted: dict[str, dict[str, Any]]
    reasons: tuple[str, ...]

    @property
    def differs(self) -> bool:
        """Whether the moduli differ beyond their intervals."""
        return not self.ratio_ci95[0] <= 1 <= self.ratio_ci95[1]

    @property
    def summary(self) -> str:
        """The answer in one sentence."""
        low, high = (100 * (r - 1) for r in self.ratio_ci95)
        size = f"the second modulus is {_more(self.ratio)} (95 % sure: {low:+.0f} to {high:+.0f} %)"
        if not self.differs and not self.explained_by:
            return f"no difference that these recordings can show: {size}"
        return size if self.before.diagnosis is None and self.differs else f"{size}; {self.cause}"

    @property
    def cause(self) -> str:
        """What explains the difference, in words."""
        effects = " and ".join(n.replace("_", " ") for n in self.explained_by if n != _OBJECT)
        if not self.differs:
            return f"what differs is {effects}"
        if _OBJECT not in self.explained_by:
            return f"explained by {effects}" if effects else "nothing explains it"
        return "the object itself differs" + (f", in addition to {effects}" if effects else "")


def _more(ratio: float) -> str:
    share = f"{100 * abs(ratio - 1):.0f}"
    return (
        "that of the first"
        if share == "0"
        else f"{share} % {'higher' if ratio > 1 else 'lower'} than the first"
    )


def changes(before: Side, after: Side) -> Changes:
    """Weigh two sides against one another."""
    log = float(np.log(after.modulus_pa / before.modulus_pa))
    sd = float(np.hypot(before.log_sd, after.log_sd))
    between = _ratio95(log, sd)
    spread = float(np.hypot(before.modulus_pa * before.log_sd, after.modulus_pa * after.log_sd))
    gap = after.modulus_pa - before.modulus_pa
    beside, reasons = None, []
    if before.diagnosis is not None and after.diagnosis is not None:
        left = float(np.log(after.beside_effects_pa / before.beside_effects_pa))
        beside = float(np.exp(left)), _ratio95(left, sd)
    own = [n for n in (*before.named, *after.named) if (n in before.named) != (n in after.named)]
    shifted = _shifted(before, after)
    causes = [*dict.fromkeys([*own, *shifted])]
    explained: list[str] = []
    if abs(log) > _95 * sd:
        if causes and beside is not None and abs(np.log(beside[0])) <= max(_HALVES * abs(log), _95 * sd):
            explained = causes
            reasons.append(
                "with its effects taken into account the modulus differs by "
                f"{100 * (beside[0] - 1):+.0f} % only"
            )
        else:
            explained = [_OBJECT, *causes]
            if beside is not None:
                shift = f"{100 * (beside[0] - 1):+.0f} %"
                reasons.append(
                    f"with the effects of both taken into account the moduli still differ by {shift}"
                    if causes
                    else f"no effect that only one has explains it: {shift} with those of both taken "
                    f"into account"
                )
    else:
        explained = causes
    for name in own:
        side = "second" if name in after.named else "first"
        reasons.append(f"{name.replace('_', ' ')}: in the {side} recording alone")
    return Changes(
        before, after, float(np.exp(log)), between, gap, (gap - _95 * spread, gap + _95 * spread), beside,
        _places(before, after), tuple(explained), shifted, tuple(reasons),
    )  # fmt: skip


def _ratio95(log: float, sd: float) -> tuple[float, float]:
    """95 % interval of a ratio from its logarithm and its standard deviation."""
    return float(np.exp(log - _95 * sd)), float(np.exp(log + _95 * sd))


def _shifted(before: Side, after: Side) -> dict[str, dict[str, Any]]:
    """Effects of both whose parameters' intervals lie apart: {effect: {key: [first, second]}}."""
    found: dict[str, dict[str, Any]] = {}
    for name in before.named:
        if name not in after.named or before.diagnosis is None or after.diagnosis is None:
            continue
        one, two = (next(e for e in d.entries if e.name == name) for d in (before.diagnosis, after.diagnosis))
        for key in set(one.intervals) & set(two.intervals):
            a, b = (np.atleast_1d(np.asarray(e.intervals[key], dtype=float)) for e in (one, two))
            if a.shape != b.shape or a.ndim < 1:
                continue
            if ((a[0] > b[1]) | (b[0] > a[1])).any():
                found.setdefault(name, {})[key] = [one.parameters.get(key), two.parameters.get(key)]
    return found


def _places(before: Side, after: Side) -> tuple[Place, ...]:
    """Places that both pressed, where the two share a frame."""
    one, two = _by_site(before), _by_site(after)
    if not len(one[0]) or not len(two[0]):
        return ()
    away = np.linalg.norm(one[0][:, None] - two[0], axis=2)
    pairs = [(i, int(away[i].argmin())) for i in range(len(away))]
    pairs = [(i, k) for i, k in pairs if away[i, k] < _NEAR_M and away[:, k].argmin() == i]
    if len(pairs) < max(_LEAST_PLACES, 0.3 * min(len(one[0]), len(two[0]))):
        return ()
    logs = np.array([two[1][k] - one[1][i] for i, k in pairs])
    sds = np.array([np.hypot(two[2][k], one[2][i]) for i, k in pairs])
    return tuple(
        Place(one[0][i], float(np.exp(x)), _ratio95(x, s))
        for (i, _), x, s in zip(pairs, logs, sds, strict=True)
    )


def _by_site(side: Side) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(places (s, 3) m, ln of the median modulus of each place's presses, its standard error)."""
    presses = side.model.presses
    own = presses.fits["e_pa"]
    good = np.isfinite(own) & (own > 0)
    if good.sum() < 2:
        return np.zeros((0, 3)), np.zeros(0), np.zeros(0)
    log = np.log(np.where(good, own, 1.0))
    sites = np.unique(presses.site[good])
    middle = np.array([np.median(log[good & (presses.site == s)]) for s in sites])
    within = np.concatenate([log[good & (presses.site == s)] - m for s, m in zip(sites, middle, strict=True)])
    counts = np.array([int((good & (presses.site == s)).sum()) for s in sites])
    scatter = np.sqrt((within**2).sum() / max(len(within) - len(sites), 1)) if counts.max() > 1 else 0.05
    points = np.array([presses.point[good & (presses.site == s)].mean(axis=0) for s in sites])
    return points, middle, np.hypot(scatter / np.sqrt(counts), 0.03)
