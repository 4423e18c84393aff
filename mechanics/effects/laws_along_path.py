"""The laws along the path of a touch, woven into one kernel that prediction and renderer both step.

Each touch has a memory (laws, m) of its own, zero when it begins, and is forgotten once nothing presses and
nothing reaches: `depth <= -reach_m`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.mechanics.effects.law import PathLaw
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.effects.settings import TouchTerms
from palpate.mechanics.kernels import fresh_part

LAWS: tuple[PathLaw, ...] = tuple(
    sorted((e.law for e in effects() if e.law is not None), key=lambda x: x.order)
)
"""In the order in which they follow one another."""


class PathNumbers(NamedTuple):
    """For the kernels. numbers: (laws, 1 + k), a 1 in front where the law holds. reach_m: (1,). loads: (1,)
    1 where a law asks what load a place has felt. memory: (1,) numbers that a law keeps, at most."""

    numbers: np.ndarray
    reach_m: np.ndarray
    loads: np.ndarray
    memory: np.ndarray


def path_numbers(touch: TouchTerms) -> PathNumbers:
    """The kernels' numbers of a touch."""
    own = touch.numbers
    numbers = np.zeros((len(LAWS), 1 + max((len(v) for v in own.values()), default=0)))
    for i, law in enumerate(LAWS):
        if law in own:
            numbers[i, 0] = 1.0
            numbers[i, 1 : 1 + len(own[law])] = own[law]
    return PathNumbers(
        numbers,
        np.array([max((law.reach(v) for law, v in own.items()), default=0.0)]),
        np.array([int(any(law.reads_load for law in own))]),
        np.array([max((law.memory(v) for law, v in own.items()), default=0)]),
    )


def new_memory(numbers: PathNumbers, touches: int) -> np.ndarray:
    """(touches, laws, m) zeros."""
    return np.zeros((touches, len(LAWS), int(numbers.memory[0])))


@fresh_part
def _nothing(numbers, memory, depth, deepest, load, most, dt, normal, force):
    pass


def _woven(laws: Sequence[tuple[int, Any]]) -> Any:
    """One kernel of the laws (row, step). Not cached: it becomes part of the cached kernels that call it."""
    if not laws:
        return _nothing
    (row, own), rest = laws[0], _woven(laws[1:])

    @fresh_part
    def step(numbers, memory, depth, deepest, load, most, dt, normal, force):
        if numbers[row, 0] != 0.0:
            own(numbers[row, 1:], memory[row], depth, deepest, load, most, dt, normal, force)
        rest(numbers, memory, depth, deepest, load, most, dt, normal, force)

    return step


smooth_laws = _woven([(i, law.step) for i, law in enumerate(LAWS) if not law.sharp])
sharp_laws = _woven([(i, law.step) for i, law in enumerate(LAWS) if law.sharp])
