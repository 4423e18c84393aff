"""The optimum of one set of effects, and what its values mean to a prediction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.settings import Settings

MODULUS_STEP = 0.01


@dataclass(frozen=True)
class Fit:
    """The optimum of one set of effects.

    values: log modulus, then each effect's parameters in order. loss: half the whitened sum of squares, prior
    included. residual: (n, 3) N, measured less predicted. jacobian: (n, 3, k) of the prediction by the
    values.
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
) -> Settings:
    """The forward model's settings for a vector of log modulus and effect parameters, first touches moved."""
    settings = forward.ideal(float(np.exp(values[0])))
    if onset is not None:
        settings.onset = settings.onset + onset
    i = 1
    for effect in effects:
        k = len(effect.parameters)
        effect.act(settings, values[i : i + k], forward)
        i += k
    return settings


def bounds_of(
    effects: tuple[Effect, ...],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(k,) each of all values: least, greatest, step, weight of the prior, and its centre."""
    low, high, step, prior, centre = [-np.inf], [np.inf], [MODULUS_STEP], [0.0], [0.0]
    for effect in effects:
        for p in effect.parameters:
            low.append(p.low)
            high.append(p.high)
            step.append(p.step)
            prior.append(0.0 if p.prior_std is None else 1 / p.prior_std**2)
            centre.append(p.ideal)
    return np.array(low), np.array(high), np.array(step), np.array(prior), np.array(centre)
