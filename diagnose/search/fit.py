"""The optimum of one set of effects, and what its values mean to a prediction.

How sure a fit is of its parameters: intervals of the contract's keys, drawn from its covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.search.shared import SHARED
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.settings import ForwardSettings

MODULUS_STEP = 0.01


@dataclass(frozen=True)
class Fit:
    """The optimum of one set of effects.

    values: log modulus, each effect's parameters in order, then errors that all presses share. loss: half the
    whitened sum of squares, prior included. residual: (n, 3) N, measured less predicted. jacobian: (n, 3, k)
    of the prediction by the values.
    gram, raw: (g, 1 + k, 1 + k) inner products of [residual, jacobian], whitened and plain. onset: (p,) m,
    first touches as the descent moved them. likeliest: (p,) m, the same where each press's
    plain misfit is least, for residual and raw.
    """

    effects: tuple[Effect, ...]
    values: np.ndarray
    loss: float
    residual: np.ndarray
    jacobian: np.ndarray
    gram: np.ndarray
    raw: np.ndarray
    prior: np.ndarray
    pull: np.ndarray
    onset: np.ndarray
    likeliest: np.ndarray

    @property
    def modulus(self) -> float:
        """Pa."""
        return float(np.exp(self.values[0]))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(e.name for e in self.effects)

    @property
    def shared(self) -> np.ndarray:
        """(s,) the errors that all presses share (search.shared)."""
        return self.values[1 + sum(len(e.parameters) for e in self.effects) :]

    def of(self, name: str) -> np.ndarray:
        """One effect's values."""
        return self.values[self.place_of(name)]

    def place_of(self, name: str) -> slice:
        """Where one effect's parameters lie among the values."""
        i = 1
        for effect in self.effects:
            k = len(effect.parameters)
            if effect.name == name:
                return slice(i, i + k)
            i += k
        raise KeyError(name)


def settings_of(
    forward: Forward, effects: Sequence[Effect], values: np.ndarray, onset: np.ndarray | None = None
) -> ForwardSettings:
    """The forward model's settings for a vector of log modulus, effect parameters and shared errors (or none
    of these), first touches moved."""
    settings = forward.ideal(float(np.exp(values[0])))
    if onset is not None:
        settings.onset = settings.onset + onset
    i = 1
    for effect in effects:
        k = len(effect.parameters)
        effect.act(settings, values[i : i + k], forward)
        i += k
    for shared, value in zip(SHARED, values[i:], strict=False):
        shared.act(settings, float(value))
    return settings


def bounds_of(
    effects: tuple[Effect, ...], shared_sd: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(k,) each of all values: least, greatest, step, weight of the prior, and its centre. shared_sd: (s,) of
    errors that all presses share; what is known stays 0."""
    low, high, step, prior, centre = [-np.inf], [np.inf], [MODULUS_STEP], [0.0], [0.0]
    for effect in effects:
        for p in effect.parameters:
            low.append(p.low)
            high.append(p.high)
            step.append(p.step)
            prior.append(0.0 if p.prior_std is None else 1 / p.prior_std**2)
            centre.append(p.ideal)
    for shared, sd in zip(SHARED, shared_sd, strict=False):
        low.append(-shared.most if sd > 0 else 0.0)
        high.append(shared.most if sd > 0 else 0.0)
        step.append(shared.step)
        prior.append(1 / sd**2 if sd > 0 else 1.0)
        centre.append(0.0)
    return np.array(low), np.array(high), np.array(step), np.array(prior), np.array(centre)


DRAWS = 200


def covariance(found: Fit, dof: float) -> np.ndarray:
    """(k, k) of the fit's values: the whitened curvature, widened by the lack of fit, and to what the sites'
    own pulls scatter (cluster-robust, sites as clusters)."""
    total = found.gram.sum(axis=0)
    hessian = total[1:, 1:] + np.diag(found.prior)
    hessian = hessian + 1e-9 * np.diag(np.maximum(np.diag(hessian), 1e-12))
    inverse = np.linalg.inv(hessian)
    chi = max(1.0, float(total[0, 0] / dof))
    formal = inverse * chi
    pulls = found.gram[:, 0, 1:]
    groups = len(pulls)
    pulls = pulls - pulls.mean(axis=0)
    robust = inverse @ (pulls.T @ pulls) @ inverse * groups / max(groups - 1, 1)
    ratio = np.sqrt(np.maximum(np.diag(robust) / np.maximum(np.diag(formal), 1e-300), 1.0))
    return formal * ratio[:, None] * ratio[None, :]


def parameter_intervals(
    found: Fit, name: str, forward: Forward, dof: float, rng: np.random.Generator
) -> dict[str, list[Any]]:
    """{key: [low, high]} at 95 % for every number (or list of numbers) that the effect reports.

    An effect's `systematic` (standard deviations of its parameters that noise does not hold) is added. Where
    the bounds cut the draws off, the interval ends at the bound.
    """
    effect = next(e for e in found.effects if e.name == name)
    k = len(effect.parameters)
    if k == 0:
        return {}
    own = found.place_of(name)
    spread = covariance(found, dof)[own, own]
    systematic = np.array(effect.hints.systematic or np.zeros(k))
    share = np.array(effect.hints.systematic_share or np.zeros(k))
    spread = spread + np.diag(systematic**2 + (share * found.values[own]) ** 2)
    low, high = effect.bounds
    draws = rng.multivariate_normal(found.values[own], spread, DRAWS, check_valid="ignore")
    draws *= 1 + effect.hints.common_factor * rng.standard_normal((DRAWS, 1))
    for i in effect.hints.signed:
        # what was named is known to be harder or softer; how much is what the interval says
        draws[:, i] = np.sign(found.values[own][i]) * np.abs(draws[:, i])
    reports = [effect.report(v, forward, found.modulus) for v in np.clip(draws, low, high)]
    stated = effect.report(found.values[own], forward, found.modulus)
    intervals = {}
    for key, value in stated.items():
        if isinstance(value, (bool, str)):
            continue
        shape = np.shape(value)
        alike = [r[key] for r in reports if np.shape(r[key]) == shape]
        if len(alike) > DRAWS // 4:
            intervals[key] = np.quantile(np.asarray(alike, float), [0.025, 0.975], axis=0).tolist()
    return intervals
