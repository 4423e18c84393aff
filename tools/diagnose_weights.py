"""How evidence weighs in naming an effect: fitted to judged cases, beside the weights in use.

Of every case that was judged blind: each effect of a step with its evidence (log10 of the gain in log
likelihood). What is there is told from what is not by a logistic regression with a ridge. Where nothing that
is there is left to be named, all effects are false: a control's, and those of the steps after all true ones
were picked. Else only the true ones count, where the fit found them at all (evidence above 10, and gained at
places left out); after a wrong pick nothing does. What gains nothing there is never named, so it does not
count. The lapse is the share of first picks at log odds above SURE that were wrong.
"""

from __future__ import annotations

import argparse
import sys
from itertools import zip_longest
from typing import Any

import numpy as np
from scipy.optimize import minimize

from benchmarks.timing import table
from palpate.diagnosis.search.naming import FILE, WEIGHTS
from palpate.mechanics.effects.base import Scope
from palpate.mechanics.effects.registry import effect, effects
from palpate.mechanics.errors import OptionError
from tools.judged_cases import add_opened_arguments, opened_cases, write_fitted
from tools.script import script

RIDGE = 10.0
"""One standard deviation of the weight's prior."""
FOUND = 10.0
"""Gain in log likelihood below which a fit has not found an effect."""


KEYS = ("border", "in_time", "evidence")
SURE = 4.0
"""Log odds from which a pick counts for the lapse."""
BORDER = 4.0
"""Log odds within which a row is shown."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the judged cases are."""
    add_opened_arguments(parser, FILE)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Fit, and tell what lies next to the border."""
    opened = [item for _, item in opened_cases(arguments.work, arguments.size)]
    rows = [row for item in opened for row in rows_of(item)]
    if len({there for *_, there in rows}) < 2:
        raise OptionError(
            f"{arguments.work}: no judged controls and effects there; run `palpate bench diagnose` first"
        )
    x = np.array([row[2] for row in rows])
    there = np.array([row[3] for row in rows])
    in_time = np.array([effect(row[1]).scope is Scope.TIME for row in rows])
    fitted = weights(x, there, in_time)
    used = (WEIGHTS.border, WEIGHTS.in_time, WEIGHTS.evidence)
    print(table(["", *KEYS], [
        [name, *(f"{v:.2f}" for v in w)] for name, w in (("fitted", fitted), ("in use", used))]))  # fmt: skip
    odds = fitted[2] * (x - np.log10(np.where(in_time, fitted[1], fitted[0])))
    border = sorted(np.flatnonzero(np.abs(odds) < BORDER), key=lambda i: -odds[i])
    lines = [
        [f"{odds[i]:.1f}", "yes" if there[i] else "no", rows[i][1], f"{x[i]:.2f}"] + [rows[i][0]]
        for i in border
    ]
    print(table(["log odds", "there", "effect", "log10 gain", "case"], lines))
    values = "\n".join(f"{n} = {v:.2f}" for n, v in zip(KEYS, fitted, strict=True))
    wrong = [pick for item in opened for pick in sure_picks(item)]
    values += f"\nlapse = {(sum(wrong) + 1) / (len(wrong) + 2):.2f}"  # Laplace's rule of succession
    write_fitted("diagnose_weights", arguments, f"[weights]\n{values}")
    return {
        "cases": len(opened),
        "rows": len(rows),
        "there": int(there.sum()),
        "fitted": fitted.tolist(),
        "in_use": list(used),
        "named_wrongly": int((odds[~there] > 0).sum()),
        "missed": int((odds[there] <= 0).sum()),
    }


def rows_of(opened: dict[str, Any]) -> list[tuple[str, str, float, bool]]:
    """(case, effect, log10 evidence, whether it is there) of one judged case."""
    verdict, found = opened["verdict"], []
    left = {_phenomenon(name) for name in opened["case"]["tested"]}
    steps = [verdict.get("scores", {}), *verdict.get("later_scores", ())]
    for scores, pick in zip_longest(steps, verdict.get("picked", ())):
        for name, (gain, foretold) in (scores or {}).items():
            there = _phenomenon(name) in left
            if np.isfinite(gain) and foretold > 0 and (not left or (there and gain > FOUND)):
                found.append((opened["key"], name, float(np.log10(max(gain, 1.0))), there))
        if pick is None or _phenomenon(pick) not in left:
            break
        left.discard(_phenomenon(pick))
    return found


def sure_picks(opened: dict[str, Any]) -> list[bool]:
    """[whether it was wrong] of one judged case's first pick, where that was sure."""
    verdict = opened["verdict"]
    picks = [p for p in verdict.get("picked", ())[:1] if p in verdict["scores"]]
    true = {_phenomenon(name) for name in opened["case"]["tested"]}
    odds = {p: WEIGHTS.log_odds(verdict["scores"][p][0], WEIGHTS.border_of(effect(p).scope)) for p in picks}
    sure = [p for p in picks if odds[p] > SURE]
    return [_phenomenon(p) not in true for p in sure]


def _phenomenon(name: str) -> str:
    """What an effect is a law of; its own name where it is the only law, or no effect of the library."""
    known = {e.name: e.hints.phenomenon for e in effects()}
    return known.get(name) or name


def weights(x: np.ndarray, there: np.ndarray, in_time: np.ndarray, ridge: float = RIDGE) -> np.ndarray:
    """(3,) border of what acts in space and of what acts in time, nats, and weight. x: (n,) log10 evidence;
    there, in_time: (n,) bool."""
    sign = np.where(there, 1.0, -1.0)

    def loss(w: np.ndarray) -> float:
        odds = w[2] * (x - np.where(in_time, w[1], w[0]))
        return float(np.logaddexp(0.0, -sign * odds).sum() + 0.5 * (w[2] / ridge) ** 2)

    found = minimize(loss, np.array([1.2, 2.0, 8.0])).x
    return np.array([*10.0 ** found[:2], found[2]])


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
