"""Standard errors by leaving out stretches of time in turn: what wanders slowly is no independent noise."""

from __future__ import annotations

import numpy as np


def all_but_one(count: int, stretches: int) -> list[np.ndarray]:
    """Indices of `count` rows in time without each of so many stretches."""
    rows = np.arange(count)
    return [np.delete(rows, part) for part in np.array_split(rows, stretches)]


def covariance(each: np.ndarray) -> np.ndarray:
    """(k, k) of an estimate, from those without each stretch, (s, k)."""
    left = each - each.mean(axis=0)
    return (len(each) - 1) / len(each) * left.T @ left
