"""A set of effects weighed: fitted, its own errors' variances estimated beside it, judged place by place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from diagnose.first_touch import first_touches
from diagnose.fit import Descent, Fit, bounds_of, settings_of
from diagnose.forward import Forward
from diagnose.whiten import Whitener as FixedWhitener
from mechanics.effects.base import Effect
from palpate.benchmarks._density_covariance import (
    FLOOR,
    PRESS,
    USUAL,
    Column,
    Terms,
    Weighed,
    estimated,
    field_modes,
    own_errors,
    terms_of,
)
from palpate.benchmarks._density_noise import coloured, whitened
from palpate.benchmarks._density_score import in_sample, predictive

FAR = 20
"""Steps of a parameter within which a linear answer is good."""


@dataclass(frozen=True)
class Judged:
    """A set of effects. held: (g,) log predictive density of each place. within: (g,) in sample."""

    found: Fit
    terms: Terms
    weighed: Weighed
    held: np.ndarray
    within: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects."""
        return self.found.names


class Weighing:
    """Forward model, surface field, and how wrong each place may be; fits sets of effects and judges them."""

    def __init__(self, forward: Forward, site_sd: np.ndarray, modulus: float) -> None:
        self.forward, self.site_sd = forward, site_sd
        self.modes = field_modes(forward)
        self.starts: dict[str, list[np.ndarray]] = {}
        columns = own_errors(forward, forward.ideal(modulus), site_sd)
        self.whitener = Whitener(forward, columns, {}, FLOOR)
        self.onset = first_touches(forward, self.whitener, modulus)
        self.near: Fit | None = None
        self.x: np.ndarray | None = None
        self.modulus = modulus
        self._cache: dict[tuple[str, ...], Judged] = {}

    def settle(self, judged: Judged) -> None:
        """Fit from now on with own errors as large as they are estimated beside this set."""
        found = judged.found
        self.whitener = self.whitened_by(found, judged.weighed)
        self.near, self.onset, self.x = found, found.onset, judged.weighed.x
        self._cache = {}

    def whitened_by(self, found: Fit, weighed: Weighed) -> Whitener:
        """What weighs residuals near a fit, with own errors of estimated sizes."""
        settings = settings_of(self.forward, found.effects, found.values, found.onset)
        columns = own_errors(self.forward, settings, self.site_sd)
        return Whitener(self.forward, columns, weighed.sizes, float(np.exp(weighed.x[0])))

    def judge(self, effects: Sequence[Effect]) -> Judged:
        """Fit a set and judge it; what has been judged since the last `settle` is not judged again."""
        key = tuple(sorted(e.name for e in effects))
        if key not in self._cache:
            self._cache[key] = self.judged(self.fit(effects))
        return self._cache[key]

    def fit(self, effects: Sequence[Effect]) -> Fit:
        """Best of the starts, from first touches as they were settled."""
        near = self.near
        known = () if near is None else near.names
        starts = [np.array([np.log(self.modulus) if near is None else near.values[0]])]
        for effect in effects:
            own = self.starts.get(effect.name) or effect.starts()
            if near is not None and effect.name in known:
                own = [near.of(effect.name)]
            starts = [np.concatenate([s, o]) for s in starts for o in own]
        descent = Descent(self.forward, self.whitener, tuple(effects), None)
        scored = [descent.loss(s, descent.residual(s, self.onset), self.onset) for s in starts]
        runs = (descent.run(starts[i], self.onset, 12) for i in np.argsort(scored)[:2])
        return min(runs, key=lambda f: f.loss)

    def judged(self, found: Fit) -> Judged:
        """A fit judged, at the optimum of its own covariance: it is fitted once more beside its own sizes."""
        first = estimated(self.terms(found, found.jacobian), self.x)
        whitener = self.whitened_by(found, first)
        found = Descent(self.forward, whitener, found.effects, None).run(found.values, found.onset, 4)
        terms = self.terms(found, found.jacobian)
        weighed = estimated(terms, first.x)
        return Judged(found, terms, weighed, predictive(terms, weighed), in_sample(terms, weighed))

    def terms(self, found: Fit, jacobian: np.ndarray) -> Terms:
        """Inner products at a fit, with its own columns or more of them (their priors are flat)."""
        settings = settings_of(self.forward, found.effects, found.values, found.onset)
        columns = own_errors(self.forward, settings, self.site_sd)
        slope = columns[0].change / 0.2e-3
        shown = found.residual + slope * found.onset[self.forward.touches.press][:, None]
        low, high, step, prior, _ = bounds_of(found.effects)
        more = jacobian.shape[2] - len(found.values)
        at = found.values
        gap_low, gap_high = np.minimum(low - at, 0), np.maximum(high - at, 0)
        stuck = (gap_low > -1e-9) | (gap_high < 1e-9)
        gap_low = np.where(stuck, 0.0, np.maximum(gap_low, -FAR * step))
        gap_high = np.where(stuck, 0.0, np.minimum(gap_high, FAR * step))
        return terms_of(
            self.forward, columns, self.modes, shown, jacobian,
            pull=np.concatenate([found.pull, np.zeros(more)]),
            prior=np.concatenate([prior, np.zeros(more)]),
            low=np.concatenate([gap_low, np.full(more, -np.inf)]),
            high=np.concatenate([gap_high, np.full(more, np.inf)]),
        )  # fmt: skip


class Whitener(FixedWhitener):
    """Weighs residuals and sensitivities (n, 3, k) place by place with own errors of settled sizes.

    It stands in for the diagnosis's, of which it keeps the interface and none of the numbers.
    """

    def __init__(self, forward: Forward, columns: list[Column], x: dict[str, float], eta: float) -> None:
        t = self.touches = forward.touches
        self.noise = coloured(t.noise, t.sample_rate_hz)
        self.variance = eta * t.noise_n**2
        self.eta = eta
        size = {c.name: x.get(c.name, 1.0) for c in columns}
        self.onset_sd = USUAL["onset"] * size["onset"]
        self.onset_column = columns[0].change / USUAL["onset"]
        site_of_row = t.site[t.press]
        self.places: list[tuple[np.ndarray, np.ndarray]] = []
        for s in range(t.sites):
            rows = np.flatnonzero((site_of_row == s) & t.counted)
            stack = []
            for c in columns:
                part = size[c.name] * c.change[rows][:, :, None]
                if c.level == PRESS:
                    part = part * (t.press[rows][:, None, None] == np.flatnonzero(t.site == s))
                stack.append(part)
            white = self._white(rows, np.concatenate(stack, axis=2))
            factor = np.linalg.cholesky(np.eye(white.shape[1]) + white.T @ white / eta)
            self.places.append((rows, solve_triangular(factor, white.T, lower=True)))
        self.stiffness_sd = np.full(len(t), USUAL["repeat"] * size["repeat"])

    def _white(self, rows: np.ndarray, x: np.ndarray) -> np.ndarray:
        white = whitened(self.touches, rows, x.reshape(len(rows), -1), self.noise)
        return white.reshape(-1, x.shape[2])

    @property
    def groups(self) -> int:
        """Places."""
        return len(self.places)

    def gram(self, x: np.ndarray) -> np.ndarray:
        """(g, k, k) whitened inner products of the columns of x (n, 3, k) in each group."""
        out = np.empty((self.groups, x.shape[2], x.shape[2]))
        for i, (rows, halved) in enumerate(self.places):
            white = self._white(rows, x[rows])
            side = halved @ white
            out[i] = (white.T @ white - side.T @ side / self.eta) / self.eta
        return out

    def raw_gram(self, x: np.ndarray) -> np.ndarray:
        """(g, k, k) plain inner products, N^2 where x is in N: for gaps."""
        k = x.shape[2]
        return np.array([x[rows].reshape(-1, k).T @ x[rows].reshape(-1, k) for rows, _ in self.places])

    def counts(self) -> np.ndarray:
        """(g,) thinned contact samples of each group."""
        return np.array([len(rows) for rows, _ in self.places])
