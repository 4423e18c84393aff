"""How sure a name is: how often one that stood like it was right where the truth was known.

Counts of judged cases, by the effect's role and by how the name stands, are in sureness.toml with the seeds
that they come from (`python -m tools.diagnose_sureness`). What is not named is there less often than its
score says, as something else explained the gap better.
"""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Mapping
from functools import cache
from pathlib import Path

from mechanics.effects.registry import effect

FILE = Path(__file__).with_name("sureness.toml")
ALONE, RIVALLED, REMAINDER, BOTH = "alone", "rivalled", "beside a remainder", "rivalled beside a remainder"
CANDIDATE, UNNAMED = "candidate", "not named"
PRIOR = 2.0
"""Cases that the share of all roles counts for, beside those of the effect's own."""


def standing(name: str, named: Collection[str], candidates: Collection[str], kind: str) -> str:
    """How an effect stands in an answer of that kind, in words."""
    if name not in named:
        return CANDIDATE if name in candidates else UNNAMED
    if "unknown" in kind:
        return BOTH if candidates else REMAINDER
    return RIVALLED if candidates else ALONE


@cache
def counts() -> Mapping[str, Mapping[str, tuple[float, float]]]:
    """{standing: {role: (right, of)}}; of what is not named `of` is the sum of its scores' probabilities."""
    return {
        how: {role: (right, of) for role, (right, of) in each.items()}
        for how, each in tomllib.loads(FILE.read_text()).items()
    }


def sureness(name: str, how: str, scored: float = 1.0) -> float:
    """Probability that an effect is there which stands so. scored: by its own score, used where it is not
    named."""
    own = counts().get(how, {})
    pooled = [sum(c) for c in zip(*own.values(), strict=True)] or [0.0, 0.0]
    usual = (pooled[0] + 1) / (pooled[1] + 2)  # Laplace's rule of succession
    right, of = own.get(effect(name).role.name.lower(), (0.0, 0.0))
    share = (right + PRIOR * usual) / (of + PRIOR)
    return min(scored * share, 1.0) if how == UNNAMED else share
