"""Each group left out of a fit in turn, by one damped step of Gauss-Newton from the optimum of all: quick
enough for every effect tried.

The gaps that are reported are fitted again instead (diagnose.verdict.held_out).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.search.descent import Descent
from palpate.diagnosis.search.fit import Fit

DAMPINGS = (1e-9, 1e-3, 1e-2, 0.1, 1.0)
"""Of a step, as shares of the curvature, the least first: where two branches of one time are thrown by the
linear answer is no place that the other groups would choose."""

STATED = 10.0
"""As many places stand for the stated widths of our own errors."""


@dataclass(frozen=True)
class JudgedSet:
    """A set of effects judged: its fit, losses and plain sums of squares of held-out groups, and `misfit` and
    `place_chi` of what it leaves (search.whiten): by so much our own errors are wider than said, if that is
    all."""

    found: Fit
    held: np.ndarray
    plain: np.ndarray
    misfit: np.ndarray
    dof: float
    place_chi: float

    @property
    def over(self) -> float:
        """Of what differs from place to place: the set's own lack of fit. Where the places scatter less than
        our own errors are said to be, these are as small as so many places tell."""
        places = len(self.held)
        told = (STATED + places * self.place_chi) / (STATED + places)
        return max(told, self.place_chi, self.chi if self.chi > 1 else 0.0)

    def over_of(self, *, between_places: bool) -> float:
        """By what gains are divided: of an effect that differs from place to place, or acts in time."""
        return self.over if between_places else max(1.0, self.chi)

    @property
    def residual(self) -> np.ndarray:
        """(n, 3) N, measured less predicted, with the modulus of the plain fit."""
        return levelled(self.found)[0]

    @property
    def fitted_plain(self) -> np.ndarray:
        """(g,) N^2, sums of squares of the places as fitted, with the modulus of the plain fit."""
        return levelled(self.found)[1]

    @property
    def chi(self) -> float:
        """Mean square per component over that of the noise: about 1 where the noise model holds."""
        return float(self.misfit.sum() / self.dof)

    def chi_but_for_one(self, counts: np.ndarray) -> tuple[float, int]:
        """(chi without the site that misses most, that site); counts: (g,) samples of each site."""
        each = self.misfit
        worst = int(np.argmax(each / counts))
        return float((each.sum() - each[worst]) / (3.0 * (counts.sum() - counts[worst]))), worst


def held_out(found: Fit, descent: Descent) -> tuple[np.ndarray, np.ndarray]:
    """Leave one group out: (whitened loss, plain sum of squares N^2), (g,) each, of the group not fitted.

    Each group's share of the normal equations is taken out again, and a step is taken only where the model
    itself says that the other groups lose nothing by it. For the plain gap the modulus is refitted to the
    other groups' plain residual, so that a gap is never one that a modulus would close.
    """
    here = 0.5 * found.gram[:, 0, 0]
    total, pulled = found.gram.sum(axis=0), descent.pulled(found.values)
    whitened, plain = np.empty(len(here)), np.empty(len(here))
    for g in range(len(here)):
        residual, loss = found.residual, here
        others = pulled + here.sum() - here[g]
        for damping in DAMPINGS:
            values = _chosen(found, total - found.gram[g], damping, descent)
            there = descent.residual(values, found.onset)
            if not np.isfinite(there).all():
                continue
            loss_there = descent.group_loss(there, found.onset)
            if descent.pulled(values) + loss_there.sum() - loss_there[g] > others:
                continue
            # a law may reach to one first touch and not to the other
            plainly = descent.residual(values, found.likeliest)
            if np.isfinite(plainly).all():
                residual, loss = plainly, loss_there
                break
        whitened[g] = loss[g]
        raw = descent.whitener.raw_gram(np.stack([residual, found.jacobian[:, :, 0]], axis=2))
        rest = raw.sum(axis=0) - raw[g]
        coefficients = np.array([1.0, -rest[0, 1] / max(rest[1, 1], 1e-12)])
        plain[g] = coefficients @ raw[g] @ coefficients
    return whitened, plain


def _chosen(found: Fit, rest: np.ndarray, damping: float, descent: Descent) -> np.ndarray:
    """(k,) values that groups with the inner products `rest` would choose, by one step."""
    values, low, high = found.values.copy(), descent.low, descent.high
    gradient = rest[1:, 0] - found.pull
    outward = ((values <= low + 1e-9) & (gradient <= 0)) | ((values >= high - 1e-9) & (gradient >= 0))
    free = ~outward
    hessian = (rest[1:, 1:] + np.diag(found.prior))[np.ix_(free, free)]
    # a parameter that nothing here moves (a slip where no motion is sideways) has no curvature at all
    hessian = hessian + damping * np.diag(np.maximum(np.diag(hessian), 1e-12))
    values[free] += np.linalg.solve(hessian, gradient[free])
    return np.clip(values, low, high)


def levelled(found: Fit) -> tuple[np.ndarray, np.ndarray]:
    """((n, 3) N, (g,) N^2): the residual after the modulus is refitted to it plainly (linearised), and each
    group's sum of squares of it."""
    raw = found.raw.sum(axis=0)
    level = raw[0, 1] / max(raw[1, 1], 1e-12)
    squares = found.raw[:, 0, 0] - 2 * level * found.raw[:, 0, 1] + level**2 * found.raw[:, 1, 1]
    return found.residual - level * found.jacobian[:, :, 0], squares
