"""Orders of touching to compare guidance with: where a hand goes that is not guided."""

from __future__ import annotations

import numpy as np

from palpate.diagnosis.explore.explorer import Order

NEAR_M = 0.025
"""How far a person's next press usually is from the last."""


def spread(places: np.ndarray, touched: np.ndarray, here: np.ndarray, rng: np.random.Generator) -> int:
    """The place farthest from all that were touched."""
    away = np.linalg.norm(places[:, None] - touched[None], axis=2).min(axis=1)
    return int(np.argmax(away))


def at_random(places: np.ndarray, touched: np.ndarray, here: np.ndarray, rng: np.random.Generator) -> int:
    """Any place."""
    return int(rng.integers(len(places)))


def person(places: np.ndarray, touched: np.ndarray, here: np.ndarray, rng: np.random.Generator) -> int:
    """As people explore: mostly a neighbour of the last place, now and then somewhere else."""
    away = np.linalg.norm(places - here, axis=1)
    weight = np.exp(-((away / NEAR_M) ** 2) / 2) + 0.02
    return int(rng.choice(len(places), p=weight / weight.sum()))


ORDERS: dict[str, Order] = {"spread": spread, "person": person, "random": at_random}
