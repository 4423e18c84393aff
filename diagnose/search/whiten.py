"""The noise of a comparison: sensor noise, and what our own model gets wrong from press to press and site to
site.

A residual is weighed against the covariance S + N N^T of its site. S is diagonal: sensor noise, and errors
that no name covers, some in proportion to the force, so that a stiff object that is pressed with thousands of
times the noise is not held to a law exact to a thousandth. N holds one column a nuisance: how the force would
change for a plausible error of first touch, of the site's stiffness (shape, mesh), of its normal, of the
stick, of the dent law. So effects in time are judged within presses and effects in space between them,
against what an error of shape could do. Woodbury keeps it to small matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cholesky, solve_triangular

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.forward.touches import FOLLOWED
from palpate.diagnosis.options import NuisanceOptions
from palpate.diagnosis.search.shared import own_onset_sd, shared_sd
from palpate.mechanics.effects.settings import ForwardSettings
from palpate.mechanics.presses.table import Presses

_FEW_COLUMNS = 3
_LEAST = 1e-6
"""Share of a nuisance's variance that the readings tell, at least."""
_MODES = 2
"""Of a Brownian bridge, that hold 76 % of its variance; the rest counts as noise."""


@dataclass
class WhitenedGroup:
    """One group's rows (flat indices of counted samples), the factor L of I + N^T N / sigma^2, and L^-1 N^T,
    N the nuisances over how much louder than sigma their rows are. own: which of them are the place's own
    stiffness and depth law."""

    rows: np.ndarray
    factor: np.ndarray
    halved: np.ndarray
    own: np.ndarray

    @cached_property
    def told(self) -> np.ndarray:
        """Of the place's own nuisances, unit before, the variance that the readings tell."""
        unit = np.eye(len(self.factor))[:, self.own]
        left = (solve_triangular(self.factor, unit, lower=True) ** 2).sum(axis=0)
        return np.maximum(1 - left, _LEAST)

    @property
    def nuisances(self) -> np.ndarray:
        """(k, 3 r) N, the change of force a standard deviation of each, over how much louder its rows are."""
        return self.factor @ self.halved


class Whitener:
    """Weighs residuals and sensitivities (n, 3, k) group by group; groups are sites with their repeats.

    air: (n,) N^2, variance of a component by free air that was followed through the touch. variance, louder:
    of noise as it adds up along a press; sample_variance: (n,) N^2, of one sample.
    """

    def __init__(
        self,
        forward: Forward,
        settings: ForwardSettings,
        options: NuisanceOptions,
        site_sd: np.ndarray | None = None,
        onset_sd: np.ndarray | None = None,
        slow: float = 1.0,
    ) -> None:
        """site_sd: (p,) share by which each press's stiffness may be off; by default the options'. onset_sd:
        (p,) m, of each first touch; by default search.shared.own_onset_sd. slow: by how
        much more than white the noise counts (its variance), as slow noise adds up along a press."""
        self.touches = forward.touches
        self.variance = slow * self.touches.noise_n**2 + options.floor_n**2
        before = np.nan_to_num(forward.predict(settings))
        unnamed = (options.floor_share * np.linalg.norm(before, axis=1)) ** 2
        aside = np.linalg.norm(before[:, 1:], axis=1) - np.abs(before[:, 0])
        unnamed += (options.leaning * np.maximum(aside, 0.0)) ** 2
        bridges, self.air, unbridged = _bridges(self.touches)
        self.louder = np.sqrt(1 + (options.floor_along * unnamed + unbridged) / self.variance)
        self.sample_variance = self.touches.noise_n**2 + options.floor_n**2 + unnamed + unbridged
        self.blocks: list[WhitenedGroup] = []
        presses = len(self.touches)
        self.shared_sd = shared_sd(forward, options)
        self.onset_sd = own_onset_sd(forward, options) if onset_sd is None else onset_sd
        columns = nuisance_columns(forward, settings, before, options, site_sd, self.onset_sd)
        columns += [("press", bridge) for bridge in bridges]
        self.onset_column = columns[0][1] / self.onset_sd[self.touches.press][:, None]
        if settings.unsure_m is not None:
            slope = np.linalg.norm(self.onset_column, axis=1)
            self.louder = np.sqrt(self.louder**2 + (slope * settings.unsure_m) ** 2 / self.variance)
            self.sample_variance = self.sample_variance + (slope * settings.unsure_m) ** 2
        site = options.site_stiffness if site_sd is None else site_sd
        self.stiffness_sd = np.hypot(site, options.press_stiffness) * np.ones(presses)
        brought = 0.0
        for rows, matrix, own in _by_site(self.touches, columns):
            brought += float((matrix**2).sum() + 3 * self.sample_variance[rows].sum())
            matrix /= np.repeat(self.louder[rows], 3)[:, None]
            small = np.eye(matrix.shape[1]) + matrix.T @ matrix / self.variance
            factor = cholesky(small, lower=True)
            halved = solve_triangular(factor, matrix.T, lower=True)
            self.blocks.append(WhitenedGroup(rows, factor, halved, own))
        self.explained = brought / float(self.counts().sum())
        """N^2, the mean square of a sample's 3-vector that noise and nuisances bring about."""

    def place_chi(self, residual: np.ndarray) -> float:
        """Mean square of what a residual (n, 3) N asks of each place's own stiffness and depth law, in
        standard deviations of what the covariance expects: about 1 where our own errors are as wide as said.
        The place that misses most is left out: a touch there may have slipped."""
        each = []
        for block in self.blocks:
            found = self._likeliest(block, residual)[block.own]
            each.append(np.mean(found**2 / block.told))
        return float((np.sum(each) - np.max(each)) / max(len(each) - 1, 1))

    def misfit(self, residual: np.ndarray) -> np.ndarray:
        """(g,) squares of what a residual (n, 3) N leaves of each group beside its likeliest nuisances, over
        the variance of one sample, and of these: about three a sample where the noise is as said."""
        squares = []
        for block in self.blocks:
            found, loud = self._likeliest(block, residual), self.louder[block.rows]
            moved = block.nuisances.T @ found
            left = residual[block.rows] - moved.reshape(-1, 3) * loud[:, None]
            each = (left**2).sum(axis=1) / self.sample_variance[block.rows]
            squares.append(each.sum() + found @ found)
        return np.array(squares)

    def _likeliest(self, block: WhitenedGroup, residual: np.ndarray) -> np.ndarray:
        """(k,) nuisances, in standard deviations."""
        loud = self.louder[block.rows][:, None]
        pulled = block.halved @ (residual[block.rows] / loud).reshape(-1) / self.variance
        return solve_triangular(block.factor, pulled, lower=True, trans="T")

    @property
    def groups(self) -> int:
        """How many groups."""
        return len(self.blocks)

    def gram(self, x: np.ndarray) -> np.ndarray:
        """(g, k, k) whitened inner products of the columns of x (n, 3, k) in each group."""
        k = x.shape[2]
        if self._at_once(k):
            part = (x[self._rows] / self.louder[self._rows][:, None, None]).reshape(-1, k)
            side = self._halved @ part
            products = _inner(part, self._starts) - _inner(side, self._sides) / self.variance
            return products / self.variance
        out = np.empty((self.groups, k, k))
        for i, block in enumerate(self.blocks):
            part = (x[block.rows] / self.louder[block.rows][:, None, None]).reshape(-1, k)
            side = block.halved @ part
            out[i] = (part.T @ part - side.T @ side / self.variance) / self.variance
        return out

    def drawn(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """(n, 3, count) N, residuals drawn from the covariance; 0 at rows that do not count."""
        out = np.zeros((len(self.louder), 3, count))
        for block in self.blocks:
            nuisances = block.nuisances
            sizes = (len(nuisances), count)
            noise = np.sqrt(self.variance) * rng.normal(size=(3 * len(block.rows), count))
            noise += nuisances.T @ rng.normal(size=sizes)
            out[block.rows] = noise.reshape(-1, 3, count) * self.louder[block.rows][:, None, None]
        return out

    def raw_gram(self, x: np.ndarray) -> np.ndarray:
        """(g, k, k) plain inner products, N^2 where x is in N: for gaps."""
        k = x.shape[2]
        if self._at_once(k):
            return _inner(x[self._rows].reshape(-1, k), self._starts)
        return np.array([x[b.rows].reshape(-1, k).T @ x[b.rows].reshape(-1, k) for b in self.blocks])

    def _at_once(self, columns: int) -> bool:
        """Whether all groups are done in one step: many small ones, each with rows."""
        return columns <= _FEW_COLUMNS and all(len(b.rows) for b in self.blocks)

    @cached_property
    def _rows(self) -> np.ndarray:
        return np.concatenate([b.rows for b in self.blocks])

    @cached_property
    def _starts(self) -> np.ndarray:
        return 3 * np.cumsum([0, *(len(b.rows) for b in self.blocks[:-1])])

    @cached_property
    def _sides(self) -> np.ndarray:
        return np.cumsum([0, *(len(b.halved) for b in self.blocks[:-1])])

    @cached_property
    def _halved(self) -> sp.csr_matrix:
        return sp.block_diag([b.halved for b in self.blocks], format="csr")

    @cached_property
    def volume(self) -> np.ndarray:
        """(g,) half the logarithm of the determinant of each group's covariance, N^2."""
        loud = np.log(self.louder * np.sqrt(self.variance))
        each = [3 * loud[b.rows].sum() + np.log(np.diag(b.factor)).sum() for b in self.blocks]
        return np.array(each)

    def counts(self) -> np.ndarray:
        """(g,) thinned contact samples of each group."""
        return np.array([len(b.rows) for b in self.blocks])


def _inner(x: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """(g, k, k) inner products of the columns of x (r, k) over the rows from each start to the next."""
    return np.add.reduceat(x[:, :, None] * x[:, None, :], starts, axis=0)


def nuisance_columns(
    forward: Forward,
    settings: ForwardSettings,
    before: np.ndarray,
    options: NuisanceOptions,
    site_sd: np.ndarray | None,
    onset_sd: np.ndarray,
) -> list[tuple[str, np.ndarray]]:
    """('press', 'site' or, of a place's own law, 'place', (n, 3)) pairs: the change of force for one standard
    deviation of each nuisance.
    before: (n, 3) N, what is predicted."""
    t, f = forward.touches, before
    moved = forward.ideal(settings.modulus)
    moved.__dict__.update(settings.__dict__)
    small = 2e-5
    moved.onset = settings.onset + small
    site_sd = np.full(len(t), options.site_stiffness) if site_sd is None else site_sd
    deepest = np.maximum(t.deepest[t.press], 1e-4)
    bend = np.clip(t.travel[:, 0], 0, None) / deepest - 0.7
    normal = f[:, 0]
    zero = np.zeros_like(normal)
    tangential = np.column_stack([zero, f[:, 1], f[:, 2]])
    late = np.zeros_like(f)
    if options.latency_s > 0 and not t.quasi_static:
        for part in t.parts:
            if part.stop - part.start > 1:
                late[part] = options.latency_s * np.gradient(f[part], t.t[part], axis=0)
    return [
        ("press", (np.nan_to_num(forward.predict(moved)) - f) * (onset_sd / small)[t.press][:, None]),
        ("place", f * site_sd[t.press][:, None]),
        ("press", f * options.press_stiffness),
        ("site", np.column_stack([zero, normal, zero]) * options.tilt),
        ("site", np.column_stack([zero, zero, normal]) * options.tilt),
        ("press", tangential * options.stick),
        ("press", late),
        ("place", f * (bend * forward.law_error(options.law)[t.press])[:, None]),
    ]


def _bridges(t: Presses) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """((n, 3) N each, (n,) N^2, (n,) N^2): what free air that was followed straight through a touch may have
    done in between.

    A random walk from its value before to its value after, as fast as these two tell, or one step at any
    time: a Brownian bridge by its first modes, along each axis of the device, its variance in each component,
    and what of that the modes leave.
    """
    bumps, air = np.zeros((_MODES, len(t.t))), np.zeros(len(t.t))
    followed = t.columns.get(FOLLOWED)
    if followed is None:
        return [], air, air
    for part in t.parts:
        if part.stop - part.start < 2:
            continue
        walked = float(np.linalg.norm(followed[part.stop - 1] - followed[part.start])) / np.sqrt(3)
        along = (t.t[part] - t.t[part.start]) / (t.t[part.stop - 1] - t.t[part.start])
        air[part] = walked**2 * along * (1 - along)
        for k, bump in enumerate(bumps, start=1):
            bump[part] = walked * np.sqrt(2) / (k * np.pi) * np.sin(k * np.pi * along)
    axes = t.frame[t.press]
    left = np.clip(air - (bumps**2).sum(axis=0), 0.0, None)
    return [axes[:, :, k] * bump[:, None] for bump in bumps for k in range(3)], air, left


def _by_site(
    t: Presses, columns: list[tuple[str, np.ndarray]]
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(rows, (3 r, k) nuisances, those of the place's own law) of each site."""
    result = []
    site_of_row = t.site[t.press]
    for site in range(t.sites):
        rows = np.flatnonzero((site_of_row == site) & t.counted)
        matrix: list[np.ndarray] = []
        own_law: list[int] = []
        for level, column in columns:
            part = column[rows]
            if level != "press":
                own_law += [len(matrix)] * (level == "place")
                matrix.append(part.reshape(-1))
                continue
            for press in np.flatnonzero(t.site == site):
                own = part * (t.press[rows] == press)[:, None]
                matrix.append(own.reshape(-1))
        result.append((rows, np.stack(matrix, axis=1), np.array(own_law)))
    return result
