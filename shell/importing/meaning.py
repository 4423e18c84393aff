"""What numbers mean that no header explains: which way is in, whose force it is, one clock or many.

Each reading is a hypothesis. It is scored by what every solid does: the force rises as the tip goes in and
returns as it comes out, free air is flat, a cycle costs work, the tip starts outside, and contact pushes more
than it pulls. Scores are log likelihoods in nats; the best reading is taken where its odds against all others
together are at least `LEAST_ODDS`, else `Unclear` names the flag that says it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.errors import RecordingError
from palpate.words import listed

LEAST_ODDS = 9.0
MOST_ODDS = 1e6
"""Greater odds than these only state that no other reading was thought of."""
_ROWS = 600
_TOUCHES = 48
_EXPONENTS = (1.0, 1.5, 2.0)
_ROWS_TOLD, _MODEL_ERROR = 8.0, 0.02
"""A curve tells as much as so many independent rows, and a law misses so much of its variance."""
_PULL, _OUTSIDE, _WORK, _DRIFT = 8.0, 2.0, 3.0, 0.02
_CLOCK_SHARE, _SENSE_SHARE, _TWICE_SHARE = 10.0, 14.0, 60.0


class Unclear(RecordingError):
    """Two readings are both likely. option: the operand that decides (`force_on`), choices: its values
    (none: a number), question: in plain words."""

    def __init__(self, question: str, option: str, choices: Sequence[str]) -> None:
        self.question, self.option, self.choices = question, option, tuple(choices)
        flag = "--" + option.removesuffix("_m").removesuffix("_deg").replace("_", "-")
        either = listed((f"{flag} {choice}" for choice in choices), "or")
        stop = "" if question.endswith("?") else ":"
        super().__init__(f"{question}{stop} say {either or flag + ' NUMBER'}")


@dataclass(frozen=True)
class BestReading:
    """The best of several readings. value: which; odds: against all others together."""

    value: tuple[int, ...]
    odds: float

    @property
    def sure(self) -> bool:
        """Whether it may be taken."""
        return self.odds >= LEAST_ODDS

    @property
    def words(self) -> str:
        """'odds 40 to 1'."""
        return f"odds over {MOST_ODDS:g} to 1" if self.odds >= MOST_ODDS else f"odds {self.odds:.3g} to 1"


def best(scores: Mapping[tuple[int, ...], float]) -> BestReading:
    """The likeliest of some readings by their log likelihoods (nats)."""
    value = max(scores, key=lambda key: scores[key])
    rest = [score - scores[value] for key, score in scores.items() if key != value]
    against = float(np.exp(rest).sum()) if rest else 0.0
    return BestReading(value, min(1 / max(against, 1e-300), MOST_ODDS))


def press_scores(position: np.ndarray, load: np.ndarray) -> dict[tuple[int, ...], float]:
    """{(travel, load) signs: nats} of one curve of a machine: travel +1 where position (n,) counts into the
    sample, load +1 where its sign is positive in compression."""
    block = max(1, len(load) // _ROWS)
    count = len(load) // block
    u, f = (np.asarray(v, float)[: count * block].reshape(count, block).mean(1) for v in (position, load))
    u, f = _scaled(u), _scaled(f)
    return {(a, b): _score(a * u, b * f) for a in (1, -1) for b in (1, -1)}


def _scaled(values: np.ndarray) -> np.ndarray:
    return (values - values[0]) / max(float(np.ptp(values)), 1e-300)


def _score(u: np.ndarray, f: np.ndarray) -> float:
    """Log likelihood of travel u into the sample and force f that pushes the tip out, both of range 1."""
    missed = _contact_misfit(u, f)
    end = max(3, len(f) // 20)
    share = min(_pull_share(f, float(np.median(part))) for part in (f[:end], f[-end:]))
    started = float(u[0] - u.min())
    returned = abs(float(u[-1] - u[0])) < 0.1 and abs(float(f[-1] - f[0])) < 0.1
    work = float(((f[1:] + f[:-1]) / 2 * np.diff(u)).sum()) if returned else 0.0
    return (
        -_ROWS_TOLD / 2 * np.log(missed + _MODEL_ERROR)
        - _PULL * share
        - _OUTSIDE * started
        - _WORK * (work < -_DRIFT)
    )


def _pull_share(f: np.ndarray, level: float) -> float:
    """How far f goes below the level of free air, over its whole range; either end may be in free air."""
    push, pull = (max(float(v), 0.0) for v in (np.quantile(f, 0.99) - level, level - np.quantile(f, 0.01)))
    return pull / max(push + pull, 1e-300)


def _contact_misfit(u: np.ndarray, f: np.ndarray) -> float:
    """Share of the variance of f that a + k (u - u0)^p misses, k > 0, exponent of a contact."""
    lowest = float(f.var())
    whole = max(lowest, 1e-300)
    for u0 in np.linspace(float(u.min()), float(u.max()), _TOUCHES, endpoint=False):
        for p in _EXPONENTS:
            shape = np.maximum(u - u0, 0.0) ** p
            spread = float(shape.var())
            together = float(((shape - shape.mean()) * (f - f.mean())).mean())
            if spread > 0 and together > 0:
                lowest = min(lowest, float(f.var()) - together**2 / spread)
    return max(lowest, 0.0) / whole


def force_sense(position: np.ndarray, force: np.ndarray) -> BestReading:
    """Whose force it is: ((1,): on the tool, (-1,): on the object) of a path (n, 3) m and its force (n, 3).

    Against whatever is elastic the force on the tool grows as the tip moves against it: the score is the
    correlation of the two, step by step in contact.
    """
    block = max(1, len(force) // 5000)
    count = len(force) // block
    p, f = (v[: count * block].reshape(count, block, 3).mean(1) for v in (position, force))
    f = f - np.median(f, axis=0)
    size = np.linalg.norm(f, axis=1)
    touching = size > 0.2 * np.quantile(size, 0.99)
    both = touching[1:] & touching[:-1]
    if both.sum() < 3:
        return BestReading((1,), 1.0)
    along = f[1:] + f[:-1]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    pressed = -(np.diff(p, axis=0) * along).sum(1)[both]
    grown = np.diff(size)[both]
    both_sizes = float(np.linalg.norm(pressed) * np.linalg.norm(grown))
    rises = float(pressed @ grown) / both_sizes if both_sizes > 0 else 0.0
    return best({(1,): _SENSE_SHARE / 2 * rises, (-1,): -_SENSE_SHARE / 2 * rises})


def clock_starts(t: np.ndarray) -> np.ndarray:
    """Rows at which a clock starts again, the first row among them."""
    return np.concatenate([[0], np.flatnonzero(np.diff(t) < 0) + 1])


def clock_of(t: np.ndarray, values: np.ndarray) -> BestReading:
    """((1,): one clock whose rows are out of order, (-1,): blocks with clocks of their own) of times (n,) and
    what was read then (n, k): of the right order it is the smoother."""
    if len(clock_starts(t)) == 1:
        return BestReading((1,), MOST_ODDS)
    scaled = (values - values.mean(0)) / np.maximum(np.ptp(values, axis=0), 1e-300)
    in_time, as_written = (
        float(np.abs(np.diff(scaled[order], axis=0)).sum()) for order in (np.argsort(t, kind="stable"), ...)
    )
    log_odds = _CLOCK_SHARE * float(np.log(max(as_written, 1e-12) / max(in_time, 1e-12)))
    if abs(log_odds) < 1e-3:  # rows that are merely reversed
        log_odds = np.log(MOST_ODDS)
    # one clock does not show a time twice
    log_odds -= _TWICE_SHARE * (1 - len(np.unique(t)) / len(t))
    return best({(1,): log_odds / 2, (-1,): -log_odds / 2})


def settled_clock(where: str, t: np.ndarray, stated: str | None, reading: BestReading) -> BestReading:
    """The clock as it was stated ("one" or "blocks"), else as it was read. Raises Unclear where neither is
    sure; where: what the line begins with."""
    if stated is not None:
        return BestReading((1 if stated == "one" else -1,), MOST_ODDS)
    if not reading.sure:
        blocks = len(clock_starts(t))
        raise Unclear(
            f"{where}: the time goes back {blocks - 1} times, and neither sorted rows nor {blocks} blocks "
            "with clocks of their own are clearly right",
            "clock",
            ("one", "blocks"),
        )
    return reading


def joined(t: np.ndarray) -> np.ndarray:
    """Blocks with clocks of their own, one after the other on one clock that increases where theirs do."""
    starts = clock_starts(t)
    steps = np.diff(t)
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    out = np.asarray(t, dtype=float).copy()
    for start, end in zip(starts, [*starts[1:], len(t)], strict=True):
        if start:
            out[start:end] = t[start:end] - t[start] + out[start - 1] + step
    return out
