"""How much wider an interval is than the fit's own errors say: what cases of known truth left outside.

A fit's covariance knows noise and the sites' scatter; it does not know what the law, the surface and the
search's own choice leave. Conformal factors make up for that: of judged cases the distance of the truth
from the value, in half intervals, and of these the quantile that 95 % do not exceed. They stand in
widening.toml with the seeds that they come from (`python -m tools.diagnose_widening`).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.effects.registry import effect
from mechanics.schema import Key

FILE = Path(__file__).with_name("widening.toml")


@cache
def factors() -> Mapping[str, float]:
    """{effect: factor}; "all": of effects that too few cases tell of."""
    return dict(tomllib.loads(FILE.read_text())["factor"])


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
