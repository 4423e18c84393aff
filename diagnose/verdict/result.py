"""A diagnosis: the three answers with their uncertainty, as the contract's JSON and as objects for the
report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from palpate.diagnosis import apply
from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.instrument.free_air import FreeAir
from palpate.diagnosis.search.attribution import Attribution
from palpate.diagnosis.search.rivals import Explanation
from palpate.diagnosis.verdict.where import Where
from palpate.mechanics.model.model import Model
from palpate.mechanics.press_solver.solved_places import ExactPresses
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.result import Result

_SENTENCES = {
    "none": "the gap is noise; no effect is missing",
    "effect": "{effects} {explain} the gap",
    "ambiguous": "{effects} {explain} the gap best, but these touches cannot rule out {candidates}",
    "unknown": "there is a gap, and no effect known here explains it",
    "effect+unknown": "{effects} {explain} part of the gap; something unknown remains",
}


def _listed(names: tuple[str, ...]) -> str:
    words = [n.replace("_", " ") for n in names]
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


@dataclass(frozen=True)
class EffectEntry:
    """One effect's line: probability that it is part of the cause, held-out gap with it alone, parameters.

    intervals: [low, high] of each parameter at 95 %. detectable_n: N rms of its force from which 19 of 20
    draws of such presses name it (inf: at no size; nan: unknown). size_n: N rms of what it changes, the best
    common factor taken off.
    """

    name: str
    domain: str
    probability: float
    gap_after_n: float
    gap_closed: float | None
    gap_closed_ci95: tuple[float, float] | None
    parameters: dict[str, Any]
    gain: float = 0.0
    intervals: dict[str, Any] = field(default_factory=dict)
    detectable_n: float = float("nan")
    size_n: float = float("nan")

    @property
    def odds(self) -> float:
        """That it is there, against that it is not."""
        return self.probability / (1 - self.probability) if self.probability < 1 else float("inf")

    def as_json(self) -> dict[str, Any]:
        """The contract's keys; null where a number is not known."""
        names = (
            "name",
            "domain",
            "probability",
            "gap_after_n",
            "gap_closed",
            "gap_closed_ci95",
            "parameters",
        )
        return {
            **{name: _plain(getattr(self, name)) for name in names},
            "parameters_ci95": self.intervals,
            **{
                name: value if np.isfinite(value := getattr(self, name)) else None
                for name in ("odds", "detectable_n", "size_n")
            },
        }


NOTHING = "none"
"""In the place of an effect's name: that nothing more is there."""


def parted(names: Sequence[str]) -> str:
    """'time delay from backlash': what a touch separates, in words."""
    return " from ".join("nothing" if name == NOTHING else name.replace("_", " ") for name in names)


@dataclass(frozen=True)
class NextTouch:
    """What would best separate the two of `separates` (names, or NOTHING): a "press" of the object, or what
    is done beside it, "rigid" presses of the bare support or the base traced once more ("retrace").

    difference_n: rms by which predictions of a press differ; sigmas: by how many times noise and our own
    errors what is separated differs.
    """

    x: float
    y: float
    z: float
    direction: tuple[float, float, float]
    depth_m: float
    speed_m_per_s: float
    hold_s: float
    separates: tuple[str, ...]
    why: str
    difference_n: float = 0.0
    sigmas: float = 0.0
    kind: str = "press"

    def as_json(self) -> dict[str, Any]:
        """The contract's keys, which are the fields."""
        return {f.name: _plain(getattr(self, f.name)) for f in fields(self)}


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Result):
    """The sim-to-real gap: where, which effect, how far it shrinks. Gaps: N, rms of the force 3-vector over
    held-out contact samples.

    errors_n: our own errors, N rms: sensor, repeatability, shape, numerical. reasons: the verdict in words.
    held_out_n: gap (before, after), N, at the places of the deepest and of the fastest presses, fitted to the
    rest. explanations: the smallest collection of sets of causes that holds nine tenths of the posterior, the
    likeliest first. left_out: effects that were not tried, as such presses cannot show them or a quick
    diagnosis does without. recording, model: what was diagnosed. `plot`: what each effect would take away.
    `show`: the object coloured by the gap, with the next touch as an arrow.
    """

    noise_n: float
    gap_before_n: float
    gap_after_n: float
    gap_closed: float | None
    gap_closed_ci95: tuple[float, float] | None
    kind: str
    effects: tuple[str, ...]
    candidates: tuple[str, ...]
    where: Where
    entries: tuple[EffectEntry, ...]
    young_modulus_pa: float
    next_touch: NextTouch | None
    errors_n: dict[str, float]
    reasons: tuple[str, ...]
    confusable: tuple[tuple[str, str, float], ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    forward: Forward | None = None
    attribution: Attribution | None = None
    free_air: FreeAir | None = None
    residual_before: np.ndarray | None = None
    residual_after: np.ndarray | None = None
    left_out: tuple[str, ...] = ()
    held_out_n: dict[str, tuple[float, float]] = field(default_factory=dict)
    recording: Recording | None = None
    model: Model | None = None
    explanations: tuple[Explanation, ...] = ()
    findings: Any = None  # diagnose.verdict.answer.Findings: all that the verdict rests on

    def improved(self) -> Model:
        """The model with the object's, contact's and boundary's effects that were named; the instrument's are
        not the object's and stay out, and so does what makes the replayed force worse (`improvement`). Its
        modulus is that at which the renderer meets the recording best."""
        return self.improvement().model

    def improvement(self) -> apply.Improvement:
        """`improved`, and how far the replayed force of the given and of the improved model is off."""
        assert self.model is not None, "only what `diagnose` returned knows its model"
        found = apply.improvement(self.model, self, self.corrected())
        return replace(found, model=found.model.replaced(path=None))

    def corrected(self) -> Recording:
        """The recording with the instrument's effects taken off."""
        assert self.recording is not None, "only what `diagnose` returned knows its recording"
        return apply.corrected(self.recording, self)

    @property
    def exact(self) -> ExactPresses | None:
        """The touched places that were solved."""
        return None if self.forward is None else self.forward.exact

    @property
    def summary(self) -> str:
        """The verdict in one sentence."""
        return _SENTENCES[self.kind].format(
            effects=_listed(self.effects),
            candidates=_listed(self.candidates),
            explain="explains" if len(self.effects) == 1 else "explain",
        )

    @property
    def constant_n(self) -> float | None:
        """rms error, N, of the ceiling: at every place a constant push along the normal, the mean of the
        other places'; None where the touches are not at hand."""
        if self.forward is None or self.forward.touches.sites < 2:
            return None
        t = self.forward.touches
        force, site = t.local_force[t.counted], t.site[t.press[t.counted]]
        total, count = np.bincount(site, weights=force[:, 0]), np.bincount(site)
        others = (total.sum() - total) / np.maximum(len(site) - count, 1)
        missed = force - others[site, None] * [1.0, 0.0, 0.0]
        return float(np.sqrt(max((missed**2).sum(axis=1).mean() + t.thinned_away, 0.0)))

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Parameters of the effects named that stand where the search ends: 'effect: parameter'."""
        if self.attribution is None:
            return ()
        fit, found = self.attribution.final.found, []
        for e in fit.effects:
            for p, value in zip(e.parameters, fit.of(e.name), strict=True):
                near = 1e-3 * (p.high - p.low)
                absent = abs(value - p.ideal) <= near
                if e.name in self.effects and not absent and not p.low + near < value < p.high - near:
                    found.append(f"{e.name.replace('_', ' ')}: {p.name}")
        return tuple(found)

    @property
    def unsettled(self) -> bool:
        """Whether the verdict leaves something open: rivals, or a remainder."""
        return bool(self.candidates) or "unknown" in self.kind

    def as_json(self) -> dict[str, Any]:
        """The contract's keys, and some more."""
        return {
            **answers_json(self, self.next_touch),
            "errors_n": dict(self.errors_n),
            "held_out": {k: {"gap_before_n": a, "gap_after_n": b} for k, (a, b) in self.held_out_n.items()},
            "constant_rmse_n": self.constant_n,
            "at_bound": list(self.at_bound),
            "reasons": list(self.reasons),
            "confusable": [{"pair": [a, b], "cosine": c} for a, b, c in self.confusable],
            "seconds": dict(self.seconds),
            "left_out": list(self.left_out),
            **({} if self.exact is None else {"exact": self.exact.as_json()}),
        }


def answers_json(found: Any, next_touch: NextTouch | None) -> dict[str, Any]:
    """What the contract says of every gap, a Diagnosis or another simulator's: how large, which, where."""
    closed = found.gap_closed_ci95
    return {
        "noise_n": found.noise_n,
        "gap_before_n": found.gap_before_n,
        "gap_after_n": found.gap_after_n,
        "gap_closed": found.gap_closed,
        "gap_closed_ci95": None if closed is None else list(closed),
        "verdict": {
            "kind": found.kind,
            "effects": list(found.effects),
            "candidates": list(found.candidates),
            "explanations": [
                {"effects": list(e.effects), "probability": e.probability} for e in found.explanations
            ],
        },
        "where": {
            "axes": [{"axis": a.axis, "share": a.share, "p": a.p} for a in found.where.axes],
            "worst": [{"x": x, "y": y, "z": z, "rmse_n": r} for x, y, z, r in found.where.worst],
            "bins": found.where.bins,
        },
        "effects": [e.as_json() for e in found.entries],
        "young_modulus_pa": found.young_modulus_pa,
        "next_touch": None if next_touch is None else next_touch.as_json(),
    }
