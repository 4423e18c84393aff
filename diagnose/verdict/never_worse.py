"""A verdict never names effects that make the held-out gap larger: the weakest go until it does not grow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from diagnose.search.gaps import resampled


@dataclass(frozen=True)
class Kept:
    """names: what may be named, strongest first. dropped: weakest first. after: (g,) N^2, held out so.

    unexplained: what was dropped had stood for a gap that is there all the same.
    """

    names: tuple[str, ...]
    dropped: tuple[str, ...]
    after: np.ndarray
    unexplained: bool


def never_worse(
    names: Sequence[str],
    before: np.ndarray,
    after: Callable[[tuple[str, ...]], np.ndarray],
    counts: np.ndarray,
    explained: float,
    *,
    beyond_chance: bool = True,
    resamples: int = 1000,
    seed: int = 0,
) -> Kept:
    """The longest run of the strongest `names` with which the held-out gap does not grow.

    before: (g,) N^2, held-out sums of squares of each site with nothing named; after(names): the same with
    these, asked for fewer names only where more made it worse. counts: (g,) samples. explained: N^2, the
    mean square a sample that noise, first touch and shape explain. beyond_chance: growth counts only where
    the 95 % interval by resampled sites lies wholly above zero (a lump in one place cannot be confirmed in
    the others); else any growth does.
    """
    kept = tuple(names)
    dropped: list[str] = []
    left = after(kept) if kept else before
    while kept and _grows(before, left, beyond_chance, resamples, seed):
        dropped.append(kept[-1])
        kept = kept[:-1]
        left = after(kept) if kept else before
    unexplained = bool(dropped) and left.sum() / counts.sum() > explained
    return Kept(kept, tuple(dropped), left, bool(unexplained))


def _grows(before: np.ndarray, after: np.ndarray, beyond_chance: bool, resamples: int, seed: int) -> bool:
    growth = after - before
    if not beyond_chance or growth.sum() <= 0:
        return bool(growth.sum() > 0)
    drawn = resampled((growth,), np.sum, resamples, np.random.default_rng(seed))
    return bool(np.quantile(drawn, 0.025) > 0)
