"""One way in of a machine's curve, fitted by one law of the dent at a stated share of the machine.

The force is level + slope u + f(u - u0 - c f): see `elastic_fit`, which weighs the laws and machines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.machine_compliance import BLOCKS
from palpate.mechanics.contact.tip import Tip

_BINS = 120
"""Readings of a way in: means of rows."""
_AIR = 1.0
"""Of the depth: how far before the touch free air counts."""
_MOST = 1.0
"""Limit of the log of a pull over the one that was read on the way out."""
_TABLE, _DEEPEST = 600, 3.0
_TOUCHES = (0.0, 0.2, 0.5)
"""Of the depth after the touch that was told."""
_TURNS, _STEP = 30, 1e-4
_DECADES = 6 * np.log(10)
"""How far ln E is looked for: a machine that takes all leaves it open."""
JKR = "jkr"


@dataclass(frozen=True)
class WayReadings:
    """Readings (b,) of one way in: travel m from the first touch as it was told, force N over the level;
    weight: rows a reading is the mean of. level: whether it is fitted."""

    travel: np.ndarray
    force: np.ndarray
    weight: float
    level: bool


class DentTables:
    """One law of the dent at any modulus: (dent, force) tables that grow."""

    def __init__(self, name: str, tip: Tip, poisson_ratio: float, deepest_m: float, pull_n: float) -> None:
        self.name, self.tip, self.nu, self.pull = name, tip, poisson_ratio, pull_n
        self.deepest = deepest_m
        self.dent = np.linspace(0.0, 1.0, _TABLE) ** 2 * _DEEPEST * deepest_m
        if name != JKR:
            self.unit = np.maximum.accumulate(tip.force(name, self.dent, 1.0, poisson_ratio))

    def at(self, modulus: float, pull: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """(dent m, force N), of the way in; pull: over the one that was read."""
        if self.name != JKR:
            return self.dent, modulus * self.unit
        plane, radius = modulus / (1 - self.nu**2), float(self.tip.radius_m or 0.0)
        top = 4 / 3 * plane * np.sqrt(radius) * (_DEEPEST * self.deepest) ** 1.5
        pull = pull * self.pull
        push = -pull + (top + pull) * np.linspace(0.0, 1.0, _TABLE) ** 2
        hertz = push + 2 * pull + 2 * np.sqrt(pull * (push + pull))
        a = np.cbrt(0.75 * radius * hertz / plane)
        dent = a**2 / radius - np.sqrt(4 * pull * a / (3 * radius * plane))
        kept = dent > 0  # in contact on the way in
        return np.append(0.0, dent[kept]), np.append(push[kept][0], push[kept])


@dataclass(frozen=True)
class WayFitted:
    """values: log E, touch m, slope (peak over depth), level (peak), log of the pull over the one that was
    read, of those that are fitted; covariance over the variance; squares and residuals, weighed."""

    values: np.ndarray
    covariance: np.ndarray
    squares: float
    left: np.ndarray


class WayFit:
    """One way in by one law, its free air flat or sloped."""

    def __init__(
        self, way: WayReadings, law: DentTables, sloped: bool, deep: float, peak: float, guess: float
    ) -> None:
        self.low = float(np.log(guess)) - _DECADES / 2
        self.way, self.law, self.sloped, self.deep, self.peak = way, law, sloped, deep, peak
        self.root = np.sqrt(way.weight)
        columns = [way.travel / deep * peak] * sloped + [np.full(len(way.travel), peak)] * way.level
        self.air = np.array(columns).reshape(len(columns), len(way.travel)).T

    def start(self, share: float) -> np.ndarray:
        """Values to begin with: the best of some first touches, as a slope may have been taken for one."""
        rest = np.zeros(self.air.shape[1] + (self.law.name == JKR))
        begun = [np.append([self.low + _DECADES / 2, each * self.deep], rest) for each in _TOUCHES]
        return min((self.at(share, each) for each in begun), key=lambda found: found.squares).values

    def curve(self, values: np.ndarray, share: float) -> tuple[np.ndarray, np.ndarray]:
        """(travel of dent and machine m, force N)."""
        pull = float(np.exp(np.clip(values[-1], -_MOST, _MOST))) if self.law.name == JKR else 1.0
        dent, force = self.law.at(float(np.exp(values[0])), pull)
        return dent + share * self.deep / self.peak * (force - force[0]), force

    def push(self, values: np.ndarray, share: float, step: float = 0.0) -> np.ndarray:
        """(n,) N of the dent, at a step beyond the travel."""
        along, force = self.curve(values, share)
        u = self.way.travel - values[1]
        return np.where(u > 0, np.interp(np.maximum(u + step, 0.0), along, force), 0.0)

    def left(self, values: np.ndarray, share: float) -> np.ndarray:
        """(n,) N, weighed."""
        rest = self.air @ values[2 : 2 + self.air.shape[1]]
        return self.root * (self.way.force - self.push(values, share) - rest)

    def _jacobian(self, values: np.ndarray, share: float) -> np.ndarray:
        push, step = self.push(values, share), _STEP * self.deep
        steep = (self.push(values, share, step) - self.push(values, share, -step)) / (2 * step)

        def by(k: int) -> np.ndarray:
            more = values.copy()
            more[k] += _STEP
            return (self.push(more, share) - push) / _STEP

        pulled = [by(-1)] if self.law.name == JKR else []
        return self.root * np.column_stack([by(0), -steep, self.air, *pulled])

    def at(self, share: float, values: np.ndarray, seen: np.ndarray | None = None) -> WayFitted:
        """Least squares (Levenberg and Marquardt) of one share. seen: (n,) 1 for readings that count."""
        kept = np.ones(len(self.way.force)) if seen is None else seen
        left = kept * self.left(values, share)
        squares, damping = float(left @ left), 1e-3
        jacobian = kept[:, None] * self._jacobian(values, share)
        for _ in range(_TURNS):
            normal = jacobian.T @ jacobian
            damped = normal + damping * np.diag(np.diag(normal) + 1e-300)
            step = np.linalg.solve(damped, jacobian.T @ left)
            step[0] = min(max(step[0], -1.0, self.low - values[0]), 1.0, self.low + _DECADES - values[0])
            tried = kept * self.left(values + step, share)
            better = float(tried @ tried)
            if better < squares:
                gain = squares - better
                values, left, squares, damping = values + step, tried, better, max(damping / 5, 1e-12)
                jacobian = kept[:, None] * self._jacobian(values, share)
                if gain < 1e-6 * squares:
                    break
            else:
                damping *= 10
                if damping > 1e6:
                    break
        scale = np.sqrt(np.maximum((jacobian**2).sum(axis=0), 1e-40))
        own, ways = np.linalg.eigh((jacobian / scale).T @ (jacobian / scale))
        inverse = (ways / np.maximum(own, 1e-10)) @ ways.T
        return WayFitted(values, inverse / np.outer(scale, scale), squares, left)

    def left_out(self, share: float, values: np.ndarray) -> tuple[float, float]:
        """(squares N^2 of blocks of force that were left out, squares of the force), in contact."""
        force, top = self.way.force, float(self.way.force.max())
        block = np.where(force > 0, np.minimum(force / top * BLOCKS, BLOCKS - 1), -1).astype(int)
        missed = np.zeros(len(force))
        for k in range(BLOCKS):
            again = self.at(share, values, (block != k).astype(float))
            missed[block == k] = (self.left(again.values, share) / self.root)[block == k]
        contact = block >= 0
        return float((missed[contact] ** 2).sum()), float((force[contact] ** 2).sum())


def way_of(curve: MachineCycle, onset: float) -> WayReadings:
    """Of a curve, the rows from some air to the peak, as means of as many rows each."""
    peak = int(np.argmax(curve.force))
    u, force = curve.travel[: peak + 1] - onset, curve.force[: peak + 1]
    first = int(np.argmax(u > -_AIR * u[-1]))
    u, force = u[first:], force[first:]
    block = max(1, len(u) // _BINS)
    count = len(u) // block
    u, force = (v[len(v) - count * block :].reshape(count, block).mean(axis=1) for v in (u, force))
    if curve.level_n is not None:
        return WayReadings(u, force - curve.level_n, float(block), False)
    air = u < 0
    level = float(np.median(force[air])) if air.any() else float(force[0])
    return WayReadings(u, force - level, float(block), True)


def lasting(left: np.ndarray) -> float:
    """How many readings err alike, from what neighbours leave: 1 for white noise."""
    alike = float((left[1:] * left[:-1]).sum() / max((left[1:] ** 2).sum(), 1e-300))
    return max(1.0, (1 + alike) / max(1 - alike, 0.02))
