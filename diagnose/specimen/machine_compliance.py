"""How well each law of the dent, on a machine that is rigid or yields, predicts force that was left out.

A machine of stiffness K adds F / K to the travel, u = u0 + d(F / E) + F / K, where d is the depth at which
the law gives F. For each E the rest is linear, so one search over E fits all curves at once, each with
a first touch u0 of its own (which may be late). What modulus and machine are is told by `elastic_fit`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import minimize_scalar, nnls

from palpate.mechanics.contact.tip import Tip

_POINTS, BLOCKS = 60, 6
_LOWEST = 0.03
"""Share of the peak below which noise and pull decide where the contact is."""
_DECADES = 2.0


@dataclass(frozen=True)
class ThinnedWay:
    """One way in, thinned to even steps of force: travel (n,) m from any zero, push (n,) N over free air."""

    travel: np.ndarray
    push: np.ndarray

    @classmethod
    def thinned(cls, u: np.ndarray, net: np.ndarray) -> ThinnedWay:
        """Of the rows (n,) m, (n,) N over free air that end at the peak."""
        top = float(net[-1])
        edges = np.linspace(_LOWEST * top, top, _POINTS + 1)
        step = np.clip(np.searchsorted(edges, net) - 1, -1, _POINTS - 1)
        kept = np.unique(step[step >= 0])
        mean = [(float(u[step == k].mean()), float(net[step == k].mean())) for k in kept]
        thin_u, thin_f = (np.array(v) for v in zip(*mean, strict=True))
        return cls(thin_u, thin_f)

    def against_push(self, values: np.ndarray) -> np.ndarray:
        """(n,) slope of values (n,) against the push: `np.gradient`, whose weights are worked out once."""
        if len(values) < 3:
            return np.ones(len(values))
        before, here, after, first, last = self._weights
        inner = before * values[:-2] + here * values[1:-1] + after * values[2:]
        return np.hstack([(values[1] - values[0]) / first, inner, (values[-1] - values[-2]) / last])

    @cached_property
    def _weights(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
        step = np.diff(self.push)
        one, two = step[:-1], step[1:]
        own = (two - one) / (one * two)
        return -two / (one * (one + two)), own, one / (two * (one + two)), step[0], step[-1]


def way_of(travel: np.ndarray, force: np.ndarray, onset: float) -> ThinnedWay:
    """The way in to the peak of one press: (n,) m, (n,) N; onset: travel at first touch, m."""
    peak = int(np.argmax(force))
    u, f = travel[: peak + 1], force[: peak + 1]
    air = u < onset - 0.03 * (u[-1] - onset)
    net = f - (float(np.median(f[air])) if air.any() else float(f[0]))
    near = u > onset - 0.1 * (u[-1] - onset)
    return ThinnedWay.thinned(u[near], net[near])


class _YieldingFit:
    """One law, a machine that yields or not: E, c = 1 / K, and each way's first touch, least squares in N."""

    def __init__(self, law: str, poisson_ratio: float, tip: Tip, deepest_m: float) -> None:
        self.depth = np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 400) * deepest_m])
        self.unit = np.maximum.accumulate(tip.force(law, self.depth, 1.0, poisson_ratio))

    def machines_share(self, ways: Sequence[ThinnedWay], log_e: float, c: float) -> float:
        """Of the travel in contact at the greatest force."""
        push = max(float(w.push.max()) for w in ways)
        dent = float(np.interp(push / np.exp(log_e), self.unit, self.depth))
        return c * push / max(c * push + dent, 1e-300)

    def solved(
        self, ways: Sequence[ThinnedWay], kept: Sequence[np.ndarray], log_e: float, yields: bool
    ) -> tuple[float, float, list[np.ndarray]]:
        """(half the squares of what is kept, c, residual N of every row of each way) at one modulus."""
        c = 0.0
        depths = [np.interp(way.push / np.exp(log_e), self.unit, self.depth) for way in ways]
        gives = [np.abs(way.against_push(depth)) for way, depth in zip(ways, depths, strict=True)]
        for _ in range(2 if yields else 1):
            weights = [1 / np.maximum(give + c, 1e-12) for give in gives]
            centred, pushed = [], []
            for way, depth, w, keep in zip(ways, depths, weights, kept, strict=True):
                share = (w * keep) ** 2 / max(float(((w * keep) ** 2).sum()), 1e-300)
                miss = way.travel - depth
                centred.append(miss - share @ miss)
                pushed.append(way.push - share @ way.push)
            if yields:
                a = np.concatenate([w * k * p for w, k, p in zip(weights, kept, pushed, strict=True)])
                b = np.concatenate([w * k * m for w, k, m in zip(weights, kept, centred, strict=True)])
                c = float(nnls(a[:, None], b)[0][0])
        left = [w * (m - c * p) for w, m, p in zip(weights, centred, pushed, strict=True)]
        return sum(float(((r * k) ** 2).sum()) for r, k in zip(left, kept, strict=True)), c, left

    def fitted(
        self, ways: Sequence[ThinnedWay], kept: Sequence[np.ndarray], log_e: float, yields: bool
    ) -> tuple[float, float, list[np.ndarray]]:
        """(log E, c, residuals)."""

        def cost(x: float) -> float:
            return self.solved(ways, kept, x, yields)[0]

        grid = log_e + np.linspace(-_DECADES / 2, _DECADES, 25) * np.log(10)
        start = float(grid[int(np.argmin([cost(x) for x in grid]))])
        step = float(grid[1] - grid[0])
        found = float(minimize_scalar(cost, bounds=(start - step, start + step), method="bounded").x)
        _, c, left = self.solved(ways, kept, found, yields)
        return found, c, left

    def left_out(
        self, ways: Sequence[ThinnedWay], guess: float, yields: bool
    ) -> tuple[tuple[float, float], list[tuple[float, float]], float]:
        """((log E, c) of all rows, those without each block of force, rms N of the blocks left out)."""
        blocks = [
            np.minimum(np.arange(len(w.push)) * BLOCKS // max(len(w.push), 1), BLOCKS - 1) for w in ways
        ]
        log_e, c, _ = self.fitted(ways, [np.ones(len(w.push)) for w in ways], guess, yields)
        missed, again = 0.0, []
        for k in range(BLOCKS):
            kept = [(b != k).astype(float) for b in blocks]
            own, own_c, left = self.fitted(ways, kept, log_e, yields)
            again.append((own, own_c))
            missed += sum(float((r[b == k] ** 2).sum()) for r, b in zip(left, blocks, strict=True))
        return (log_e, c), again, float(np.sqrt(missed / sum(map(len, blocks))))


@dataclass(frozen=True)
class HeldOut:
    """One law on a rigid machine or one that yields. missed: rms of the blocks of force that were left out
    over the rms of the force; share: of the greatest travel in contact that the machine takes."""

    law: str
    missed: float
    share: float


def held_out_laws(
    ways: Sequence[ThinnedWay],
    poisson_ratio: float,
    tip: Tip,
    modulus_pa: float,
    yields: Sequence[bool] = (False, True),
) -> list[HeldOut]:
    """Each law of the tip on a rigid machine (False) and on one that yields (True). modulus_pa: a first
    guess."""
    deepest, guess = _deepest(ways), float(np.log(modulus_pa))
    found, rms = [], _rms(ways)
    for name in tip.laws:
        fit = _YieldingFit(name, poisson_ratio, tip, deepest)
        for each in yields:
            (log_e, c), _, missed = fit.left_out(ways, guess, each)
            found.append(HeldOut(name, missed / rms, fit.machines_share(ways, log_e, c)))
    return found


def _deepest(ways: Sequence[ThinnedWay]) -> float:
    return max(float(w.travel[-1] - w.travel[0]) for w in ways)


def _rms(ways: Sequence[ThinnedWay]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([w.push for w in ways]) ** 2)))
