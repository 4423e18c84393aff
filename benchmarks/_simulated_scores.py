"""Scores of sealed cases with planted flaws: what was named, how far the gap was said to shrink, and did.

A row is a case: "truth" what was planted, "sizes_n" N rms by which each flaw changes the force, "named" and
"candidates" of numerics and parameters. "right": by flaw the names that say it, where that is not its own
name. "own": names that the same simulator gets with nothing planted, against which it is judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.evidence import Figure, rates
from benchmarks.timing import table

FAR = 4.0
"""Times what can be seen at all, from which the targets hold."""


def _false(row: dict[str, Any]) -> bool:
    """Whether a control is given a name that it has not: the difference that a simulator has of its own is
    none."""
    return bool(row.get("false_alarm", row["named"]))


def print_cases(rows: Sequence[dict[str, Any]]) -> None:
    """One line a case."""
    lines = []
    for number, row in enumerate(rows):
        said = " ".join(f"{name}={x:.3g}" for name, x in row["truth"]["flaws"]) or "none"
        left = row["said_left_n"]
        lines.append(
            [number, said, f"{row['times_visible']:.1f}", " ".join(row["named"]) or "none",
             " ".join(row["candidates"]), f"{row['gap_n']:.3f}", "-" if left is None else f"{left:.3f}",
             f"{row['left_n']:.3f}"]
        )  # fmt: skip
    print(table(["case", "planted", "times visible", "named", "or", "gap [N]", "said left", "left"], lines))


def truth_of(row: dict[str, Any]) -> list[str]:
    """Names of what was planted, the largest first."""
    return sorted(row["sizes_n"], key=lambda n: -row["sizes_n"][n])


def right_of(row: dict[str, Any], flaw: str) -> set[str]:
    """The names that say a flaw."""
    return set(row.get("right", {}).get(flaw, [flaw]))


def _strictly(row: dict[str, Any]) -> bool:
    """Whether the largest flaw is named first."""
    return bool({*row["named"][:1]} & right_of(row, truth_of(row)[0]))


def _first(row: dict[str, Any]) -> bool:
    """The same, or it is a candidate beside what is named."""
    right = right_of(row, truth_of(row)[0])
    return _strictly(row) or (bool(row["named"]) and bool(right & {*row["candidates"]}))


def _all_of(row: dict[str, Any]) -> bool:
    """Whether everything planted is named or a candidate."""
    return all(right_of(row, flaw) & {*row["named"], *row["candidates"]} for flaw in truth_of(row))


def _only(row: dict[str, Any]) -> bool:
    """Whether nothing else is named."""
    return _strictly(row) and set(row["named"]) <= right_of(row, truth_of(row)[0])


def figures_of(rows: Sequence[dict[str, Any]], of: str = "") -> list[Figure]:
    """Counts with 95 % intervals, and the shrinkage. of: whose, in words."""
    single = [r for r in rows if len(r["sizes_n"]) == 1]
    far = [r for r in single if r["times_visible"] >= FAR]
    pairs = [r for r in rows if len(r["sizes_n"]) == 2]
    controls = [r for r in rows if not r["sizes_n"]]
    counted = {
        f"first place, one flaw of {FAR:g} times what can be seen": (sum(map(_first, far)), len(far)),
        "first place strictly, the same": (sum(map(_strictly, far)), len(far)),
        "in names or candidates, the same": (sum(map(_all_of, far)), len(far)),
        "only that flaw named, the same": (sum(map(_only, far)), len(far)),
        "first place, one flaw of any size": (sum(map(_first, single)), len(single)),
        "dominant of pairs": (sum(map(_first, pairs)), len(pairs)),
        "both of pairs in names or candidates": (sum(map(_all_of, pairs)), len(pairs)),
        "false alarms on controls": (sum(map(_false, controls)), len(controls)),
        "parts and the rest add up to 1": (sum(r["adds_up"] for r in rows), len(rows)),
    }
    targets = {"first place, one flaw of 4": 85.0, "dominant of pairs": 90.0, "parts and": 100.0}
    figures = []
    for figure in rates(counted):
        least = next((t for name, t in targets.items() if figure.what.startswith(name)), None)
        if figure.what.startswith("false alarms"):
            figure = figure.at_most(2.0)
        figures.append(figure if least is None else figure.at_least(least))
    off = []
    for r in rows:
        measured = r["gap_n"] ** 2 - r["left_n"] ** 2
        # where mending it changes nothing to speak of there is no shrinkage to predict
        if r["said_left_n"] is not None and measured > 0.1 * r["gap_n"] ** 2:
            off.append(abs((r["gap_n"] ** 2 - r["said_left_n"] ** 2) / measured - 1))
    if off:
        low, high = np.quantile(off, [0.25, 0.75])
        what = f"shrinkage predicted against measured, median of {len(off)} (quartiles)"
        spread = (100 * float(low), 100 * float(high))
        figures.append(Figure(what, 100 * float(np.median(off)), spread, "%").at_most(15.0))
    return [replace(f, what=f"{of}{f.what}") for f in figures]
