"""What judged cases of known truth correct: how sure a name is, and how wide an interval must be.

A name is as sure as those that were named alike were right. sureness.toml holds the counts of judged cases,
by the effect's role and by how it was named, with the seeds that they come from (`python -m
tools.diagnose_sureness`). What is not named is there less often than its score says, as something else
explained the gap better.

A fit's covariance knows noise and the sites' scatter; it does not know what the law, the surface and the
search's own choice leave. Conformal factors make up for that: of judged cases the distance of the truth from
the value, in half intervals, and of these the quantile that 95 % do not exceed (widening.toml, written by
`python -m tools.diagnose_widening`).
"""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.disk.schema import Key
from palpate.mechanics.effects.registry import effect

SURENESS_FILE = Path(__file__).with_name("sureness.toml")
WIDENING_FILE = Path(__file__).with_name("widening.toml")
ALONE, RIVALLED, REMAINDER, BOTH = "alone", "rivalled", "beside a remainder", "rivalled beside a remainder"
CANDIDATE, UNNAMED = "candidate", "not named"
PRIOR = 2.0
"""Cases that the share of all roles counts for, beside those of the effect's own."""


def how_named(name: str, named: Collection[str], candidates: Collection[str], kind: str) -> str:
    """How an effect is named in an answer of that kind, in words."""
    if name not in named:
        return CANDIDATE if name in candidates else UNNAMED
    if "unknown" in kind:
        return BOTH if candidates else REMAINDER
    return RIVALLED if candidates else ALONE


@cache
def counts() -> Mapping[str, Mapping[str, tuple[float, float]]]:
    """{how named: {role: (right, of)}}; of what is not named `of` is the sum of its scores' probabilities."""
    return {
        how: {role: (right, of) for role, (right, of) in each.items()}
        for how, each in tomllib.loads(SURENESS_FILE.read_text()).items()
    }


def sureness(name: str, how: str, scored: float = 1.0) -> float:
    """Probability that an effect is there which is named so. scored: by its own score, used where it is not
    named."""
    own = counts().get(how, {})
    pooled = [sum(c) for c in zip(*own.values(), strict=True)] or [0.0, 0.0]
    usual = (pooled[0] + 1) / (pooled[1] + 2)  # Laplace's rule of succession
    right, of = own.get(effect(name).role.name.lower(), (0.0, 0.0))
    share = (right + PRIOR * usual) / (of + PRIOR)
    return min(scored * share, 1.0) if how == UNNAMED else share


@cache
def factors() -> Mapping[str, float]:
    """{effect: factor}; "all": of effects that too few cases hold."""
    return dict(tomllib.loads(WIDENING_FILE.read_text())["factor"])


def widened(name: str, parameters: Mapping[str, Any], intervals: Mapping[str, Any]) -> dict[str, Any]:
    """{key: [low, high]} of an effect's parameters, about their values, within what their keys allow."""
    factor = factors().get(name, factors()["all"])
    keys = effect(name).keys or {}
    wider = {}
    for key, (low, high) in intervals.items():
        value = np.asarray(parameters[key], float)
        stated = keys.get(key)
        allowed = stated if isinstance(stated, Key) else Key()
        wider[key] = [
            np.clip(value + factor * (np.asarray(end, float) - value), allowed.low, allowed.high).tolist()
            for end in (low, high)
        ]
    return wider
