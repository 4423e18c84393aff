"""How evidence and closure weigh in naming an effect: fitted to judged cases, beside the weights in use.

Of every case that was judged blind: each effect of the first step with its evidence (log10 of the gain in log
likelihood of held-out places) and its closure (share of the held-out gap). What is there is told from what is
not by a logistic regression with a ridge; a control's effects are all false, of a case with effects only the
true ones count, where the fit found them at all (evidence above 10, something closed).
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize

from diagnose.naming import WEIGHTS
from mechanics.errors import OptionError
from palpate.benchmarks._diagnosis_blind import opened_case, verdict_path
from palpate.benchmarks._diagnosis_cases import SEEDS, cases
from palpate.benchmarks.timing import table

SUMMARY = "weights of evidence and closure in naming an effect, fitted to judged cases"

RIDGE = (5.0, 15.0)
"""One standard deviation of the two weights' prior."""
FOUND = 10.0
"""Gain in log likelihood below which a fit has not found an effect."""


BORDER = 4.0
"""Log odds within which a row is shown."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the judged cases are."""
    parser.add_argument("--work", required=True, help="work folder of `palpate bench diagnose`")
    parser.add_argument("--size", choices=("quick", "medium", "full"), default="medium", help="of its cases")
    parser.add_argument("--cases", choices=tuple(SEEDS), default="development", help="whose seeds")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Fit, and tell what lies next to the border."""
    work = Path(arguments.work)
    judged = [
        c for c in cases(arguments.size, None, SEEDS[arguments.cases]) if verdict_path(c, work).exists()
    ]
    rows = [row for case in judged for row in rows_of(opened_case(case, work))]
    if len({there for *_, there in rows}) < 2:
        raise OptionError(f"{work}: no judged controls and effects there; run `palpate bench diagnose` first")
    x = np.array([row[2] for row in rows])
    there = np.array([row[3] for row in rows])
    fitted = weights(x, there)
    used = (WEIGHTS.offset, WEIGHTS.evidence, WEIGHTS.closure)
    print(table(["", "offset", "evidence", "closure"], [
        [name, *(f"{v:.2f}" for v in w)] for name, w in (("fitted", fitted), ("in use", used))]))  # fmt: skip
    odds = x @ np.asarray(used)[1:] + used[0]
    border = sorted(np.flatnonzero(np.abs(odds) < BORDER), key=lambda i: -odds[i])
    lines = [
        [f"{odds[i]:.1f}", "yes" if there[i] else "no", rows[i][1], f"{x[i, 0]:.2f}", f"{x[i, 1]:.2f}"]
        + [rows[i][0]]
        for i in border
    ]
    print(table(["log odds", "there", "effect", "log10 gain", "closure", "case"], lines))
    return {
        "cases": len(judged),
        "rows": len(rows),
        "there": int(there.sum()),
        "fitted": fitted.tolist(),
        "in_use": list(used),
        "named_wrongly": int((odds[~there] > 0).sum()),
        "missed": int((odds[there] <= 0).sum()),
    }


def rows_of(opened: dict[str, Any]) -> list[tuple[str, str, tuple[float, float], bool]]:
    """(case, effect, (log10 evidence, closure), whether it is there) of one judged case."""
    asked = set(opened["case"]["tested"])
    found = []
    for name, (gain, closes) in opened["verdict"].get("scores", {}).items():
        x = (float(np.log10(max(gain, 1.0))), float(np.clip(closes, -1, 1)))
        if not asked or (name in asked and gain > FOUND and closes > 0):
            found.append((opened["key"], name, x, name in asked))
    return found


def weights(x: np.ndarray, there: np.ndarray, ridge: Sequence[float] = RIDGE) -> np.ndarray:
    """(3,) offset and weights. x: (n, 2) log10 evidence and closure; there: (n,) bool."""
    sign = np.where(there, 1.0, -1.0)

    def loss(w: np.ndarray) -> float:
        odds = w[0] + x @ w[1:]
        return float(np.logaddexp(0.0, -sign * odds).sum() + 0.5 * ((w[1:] / np.asarray(ridge)) ** 2).sum())

    return np.asarray(minimize(loss, np.array([-10.0, 3.0, 8.0])).x)
