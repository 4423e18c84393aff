"""One addition to a set of effects: every effect's linear answer weighed, the most promising ones fitted.

The score of a set is the log predictive density of places that it was not fitted to, own errors' variances
estimated beside it. The recording's own null says what gain the best of all effects reaches where none is
there. What the places cannot tell from the best is in the model confidence set. A nameless pattern over
depth, rate, history and direction stands for what is not in the library: it competes like any effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnose.confidence_set import confidence_p
from diagnose.fit import Fit, settings_of
from mechanics.effects.base import Effect
from palpate.benchmarks._density_covariance import Terms, estimated, weigh
from palpate.benchmarks._density_fits import FAR, Judged, Weighing
from palpate.benchmarks._density_score import linear_gains, null_gains, predictive

UNKNOWN = "unknown"
FITTED = 6
"""Effects that are fitted: those whose linear answer promises most."""
MANY = 8
"""Starts of an effect beyond which its parameters are not moved as well."""
DRAWS = 400


@dataclass(frozen=True)
class Step:
    """One addition that was weighed. linear: name -> gain of the linear answer; gains: of the fit, log
    predictive density over the set before. standing: name -> p in the model confidence set ('none' among
    them). best: the greatest gain's name, p its share of the null's draws that reach it. null: (draws,)
    their greatest gains."""

    linear: dict[str, float]
    gains: dict[str, float]
    standing: dict[str, float]
    best: str
    p: float
    null: np.ndarray


def step(
    weighing: Weighing, current: Judged, effects: Sequence[Effect], known: Effect, seed: int = 0
) -> Step:
    """Every effect added to a set in turn; those that hide finite strain with it and without."""
    linear, null = _screened(weighing, current, effects, np.random.default_rng(seed))
    ranked = sorted((n for n in linear if n != UNKNOWN), key=lambda n: -linear[n])[:FITTED]
    held = {}
    for effect in effects:
        if effect.name in ranked:
            tried = [[*current.found.effects, effect]]
            if effect.hides_strain:
                rest = [e for e in current.found.effects if e is not known]
                tried.append([*rest, effect] if known in current.found.effects else [*rest, known, effect])
            judged = [weighing.judge(each) for each in tried]
            held[effect.name] = max(judged, key=lambda j: j.held.sum()).held
    terms = _nameless(weighing, current)
    held[UNKNOWN] = predictive(terms, estimated(terms, current.weighed.x))
    gains = {n: float((h - current.held).sum()) for n, h in held.items()}
    held["none"] = current.held
    p = confidence_p(-np.array(list(held.values())), np.random.default_rng(seed))
    best = max(gains, key=lambda n: gains[n])
    reached = float((1 + (null >= gains[best]).sum()) / (1 + len(null)))
    return Step(linear, gains, dict(zip(held, p.tolist(), strict=True)), best, reached, null)


def features(weighing: Weighing, found: Fit) -> np.ndarray:
    """(n, 3, c) N: a tenth of the force by depth, rate, history, order and direction; a twentieth of a newton
    along each axis of the device."""
    t = weighing.forward.touches
    f = _predicted(weighing, found)
    depth = np.clip(t.travel[:, 0] + found.onset[t.press], 0, None) / max(np.quantile(t.deepest, 0.9), 1e-4)
    fast = max(float(np.quantile(np.abs(t.speed[t.counted]), 0.9)), 1e-4)
    rate = np.clip(t.speed / fast, -2, 2)
    since = np.clip(t.t - t.onset_s[t.press], 0, 2.0)
    clock = (t.t - t.t.mean()) / max(float(np.ptp(t.t)), 1e-9)
    again = (t.repeat[t.press] > 0).astype(float)
    way_out = (t.speed < 0).astype(float)
    weights = [
        depth, depth**2, rate, np.abs(rate), since, clock, again, way_out, way_out * depth, depth * rate
    ]  # fmt: skip
    zero = np.zeros(len(f))
    columns = [f * x[:, None] for x in weights]
    columns += [np.column_stack([zero, f[:, 1], f[:, 2]]), np.column_stack([zero, -f[:, 2], f[:, 1]])]
    columns += [0.5 * t.frame[t.press][:, :, axis] for axis in range(3)]
    return 0.1 * np.stack(columns, axis=2)


def _predicted(weighing: Weighing, found: Fit, added: tuple[Effect, np.ndarray] | None = None) -> np.ndarray:
    settings = settings_of(weighing.forward, found.effects, found.values, found.onset)
    if added is not None:
        added[0].act(settings, added[1], weighing.forward)
    return np.nan_to_num(weighing.forward.predict(settings))


def _nameless(weighing: Weighing, current: Judged) -> Terms:
    extra = features(weighing, current.found)
    terms = weighing.terms(current.found, np.concatenate([current.found.jacobian, extra], axis=2))
    terms.prior[len(current.found.values) :] = 1.0
    return terms


def _screened(
    weighing: Weighing, current: Judged, effects: Sequence[Effect], rng: np.random.Generator
) -> tuple[dict[str, float], np.ndarray]:
    """(linear gain of every effect over a set, (draws,) greatest of them where the set is all that is
    there)."""
    kept = len(current.found.values)
    answers = [
        (effect.name, *answer)
        for effect in effects
        if effect.name not in current.names
        for answer in _answers(weighing, current.found, effect)
    ]
    extra = features(weighing, current.found)
    answers.append((UNKNOWN, extra, np.ones(extra.shape[2])))
    blocks = [current.found.jacobian, *(block for _, block, _ in answers)]
    ends = np.cumsum([b.shape[2] for b in blocks])
    sets = [np.arange(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
    terms = weighing.terms(current.found, np.concatenate(blocks, axis=2))
    terms.prior[kept:] = np.concatenate([prior for *_, prior in answers])
    weighed = weigh(terms, current.weighed.x)[0]
    linear: dict[str, float] = {}
    for (name, *_), gain in zip(answers, linear_gains(terms, weighed, kept, sets), strict=True):
        linear[name] = max(gain, linear.get(name, -np.inf))
    return linear, null_gains(terms, weighed, kept, sets, DRAWS, rng)


def _answers(weighing: Weighing, found: Fit, effect: Effect) -> list[tuple[np.ndarray, np.ndarray]]:
    """(columns (n, 3, c), priors (c,)) of an effect near each of its starts: its whole change, then a step
    of each parameter; those that change nothing are left out."""
    starts = weighing.starts.get(effect.name) or effect.starts()
    base = _predicted(weighing, found)
    answers = []
    for start in starts:
        there = _predicted(weighing, found, (effect, start))
        columns = [there - base]
        if len(starts) <= MANY:
            moved = np.diag([p.step for p in effect.parameters])
            columns += [_predicted(weighing, found, (effect, start + own)) - there for own in moved]
        felt = [i for i, c in enumerate(columns) if np.abs(c).max() > 1e-6]
        if felt:
            prior = np.full(len(columns), 1 / FAR**2)
            prior[0] = 1.0
            answers.append((np.stack(columns, axis=2)[:, :, felt], prior[felt]))
    return answers
