"""By how much intervals are too narrow: conformal factors of an effect's parameters, from judged cases.

Of every case that was judged blind and whose effect was named or a candidate: how far the truth lies from
each value, in half intervals as the fit alone has them. The factor is the quantile of 95 % (as split
conformal prediction takes it, Vovk et al. 2005), never below one; that of all effects together stands for
those with few values. Seeds that were fitted to say nothing of coverage.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import defaultdict
from typing import Any

import numpy as np

from benchmarks.timing import table
from palpate.diagnosis.verdict.conclusion import WIDENING_FILE
from palpate.mechanics.errors import OptionError
from tools.judged_cases import add_opened_arguments, opened_cases, write_fitted
from tools.script import script

COVERED = 0.95
LEAST = 39
"""Values from which an effect has a factor of its own: with fewer the quantile is the farthest of them."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the judged cases are."""
    add_opened_arguments(parser, WIDENING_FILE)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Fit, show, and write where that is asked for."""
    found: dict[str, list[float]] = defaultdict(list)
    for _, opened in opened_cases(arguments.work, arguments.size):
        used = opened["verdict"].get("widening", {"all": 1.0})
        for name, far in distances(opened):
            found[name].append(far * used.get(name, used["all"]))
    if not found:
        raise OptionError(f"{arguments.work}: no judged cases there; run `palpate bench diagnose` first")
    chosen = chosen_factors(found)
    print(table(["effect", "values", "inside as fitted", "factor"], [
        [n, str(len(v)), f"{np.mean(np.array(v) <= 1):.2f}", f"{chosen.get(n, chosen['all']):.2f}"]
        for n, v in sorted(found.items())]))  # fmt: skip
    factors = "\n".join(f"{n} = {v:.2f}" for n, v in chosen.items())
    write_fitted("diagnose_widening", arguments, f"[factor]\n{factors}")
    return {"factors": chosen, "values": {n: len(v) for n, v in found.items()}}


def distances(opened: dict[str, Any]) -> list[tuple[str, float]]:
    """(effect, half intervals from value to truth) of every parameter that both state of a tested effect."""
    verdict, found = opened["verdict"], []
    for name in opened["case"]["tested"]:
        if name not in (*verdict.get("effects", ()), *verdict.get("candidates", ())):
            continue
        true = opened["truth"]["parameters"].get(name, {})
        for key, (low, high) in verdict["intervals"].get(name, {}).items():
            if key not in true or isinstance(true[key], bool | str):
                continue
            stated = verdict["parameters"][name][key]
            value, truth = (np.ravel(np.asarray(x, float)) for x in (stated, true[key]))
            if value.shape == truth.shape:
                reach = np.where(truth > value, np.ravel(high) - value, value - np.ravel(low))
                found += [(name, float(x)) for x in np.abs(truth - value) / np.maximum(reach, 1e-12)]
    return found


def chosen_factors(found: dict[str, list[float]]) -> dict[str, float]:
    """{effect or "all": factor}, of the distances of each effect's values."""
    own = {n: quantile(np.sort(v)) for n, v in sorted(found.items()) if len(v) >= LEAST}
    pooled = quantile(np.sort(np.concatenate([np.asarray(v) for v in found.values()])))
    return {n: max(f, 1.0) for n, f in {"all": pooled, **own}.items()}


def quantile(ordered: np.ndarray) -> float:
    """Of (n,) distances in order, that which 95 % of further ones do not exceed."""
    n = len(ordered)
    return float(ordered[min(math.ceil(COVERED * (n + 1)), n) - 1])


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
