"""A law along the path of a touch: one compiled step, which prediction and renderer both run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class PathLaw:
    """What an effect does to the force along the path of a touch; compiled, allocates nothing.

    step(numbers, memory, depth, deepest, load, most, dt, normal, force): changes force (3,) N on the tool in
    place. numbers: what the effect's keys come to, (k,). memory: (m,), zero when a touch begins. depth,
    deepest of this touch: m, negative above the surface. load: `dent_load` of the depth, most: the greatest
    that the place has felt. dt: s since the last step. normal: (3,) outward.
    order: in which laws follow one another. sharp: changes so fast along the path that a sample which is a
    mean over some time is a mean of the law; such a law keeps no memory. reads_load: it needs `load`.
    memory: how many numbers it keeps. reach: m, how far above the surface it still holds the tip.
    """

    step: Any
    order: int
    sharp: bool = False
    reads_load: bool = False
    memory: Callable[[np.ndarray], int] = lambda numbers: 0
    reach: Callable[[np.ndarray], float] = lambda numbers: 0.0
