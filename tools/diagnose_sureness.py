"""How often what stands in an answer is true: counts of judged cases, from which probabilities are stated.

Of every case that was judged blind and each effect of its answer: how it stands there (named alone, beside a
rival or a remainder, a candidate, not named), its role, and whether it is there. Of what is not named the
counts are set against the sum of the probabilities by its scores. What a drawn tool has beside the question
is not counted. Seeds that were fitted to say nothing of calibration.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import expit

from benchmarks.timing import table
from palpate.diagnosis.search.naming import WEIGHTS
from palpate.diagnosis.verdict.conclusion import SURENESS_FILE, UNNAMED, how_named
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.errors import OptionError
from tools.judged_cases import add_opened_arguments, opened_cases, write_fitted
from tools.script import script


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the judged cases are."""
    add_opened_arguments(parser, SURENESS_FILE)
    parser.add_argument(
        "--earlier",
        metavar="TOML",
        help="counts of cases judged before, to be added (some standings are rare)",
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Count, show, and write where that is asked for."""
    counts: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(lambda: [0.0, 0.0]))
    for _, opened in opened_cases(arguments.work, arguments.size):
        for how, role, there, weight in stood(opened):
            count = counts[how][role]
            count[0] += there
            count[1] += weight
    if not counts:
        raise OptionError(f"{arguments.work}: no judged cases there; run `palpate bench diagnose` first")
    if arguments.earlier:
        for how, known in tomllib.loads(Path(arguments.earlier).read_text(encoding="utf-8")).items():
            for role, (right, of) in known.items():
                count = counts[how][role]
                count[0] += right
                count[1] += of
    print(table(["standing", "role", "true", "of"], [
        [how, role, f"{right:.0f}", f"{of:.1f}"]
        for how, each in sorted(counts.items()) for role, (right, of) in sorted(each.items())]))  # fmt: skip
    lines = []
    for how, each in sorted(counts.items()):
        lines.append(f'["{how}"]')
        lines += [f"{role} = [{right:.0f}, {of:.1f}]" for role, (right, of) in sorted(each.items())]
    write_fitted("diagnose_sureness", arguments, "\n".join(lines))
    return {how: {role: list(c) for role, c in each.items()} for how, each in counts.items()}


def stood(opened: dict[str, Any]) -> list[tuple[str, str, bool, float]]:
    """(standing, role, whether it is there, what it counts) of every effect of one judged case's answer."""
    case, verdict, found = opened["case"], opened["verdict"], []
    for name in verdict.get("probability", {}):
        there = name in case["effects"]
        if not there and name in case["beside"]:
            continue
        how = how_named(name, verdict["effects"], verdict["candidates"], verdict["kind"])
        weight = 1.0
        if how == UNNAMED and name in verdict.get("scores", {}):
            # a law without a number has none of its score
            weight = float(np.nan_to_num(expit(WEIGHTS.log_odds(verdict["scores"][name][0]))))
        found.append((how, effect(name).role.name.lower(), there, weight))
    return found


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
