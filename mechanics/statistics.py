"""Robust statistics: the scaled median deviation, and regression that lets outliers go (Tukey's biweight).

Source: Huber and Ronchetti, Robust Statistics, chapters 5 and 7; 4.7 scales is 95 % efficient on Gaussian
errors.

Standard errors by leaving out stretches of time in turn (the jackknife): what wanders slowly is no
independent noise.

Covariances of Gaussian processes by distance: how alike a field is at two places.

Rasmussen and Williams, Gaussian Processes for Machine Learning, eqs. 4.9 and 4.17.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from scipy.special import ndtri

EFFICIENT = 4.7
GAUSSIAN = 1 / float(ndtri(0.75))
Fitted = TypeVar("Fitted")


@dataclass(frozen=True)
class Robust(Generic[Fitted]):
    """fitted: as the last round gave it. residual, weight: (n,), weights 0 (left out) to 1. scale: of the
    residuals."""

    fitted: Fitted
    residual: np.ndarray
    weight: np.ndarray
    scale: float


def are_read(values: np.ndarray) -> np.ndarray:
    """(k,) bool: which columns of (n, k) readings ever change: the others are none that is read, as of a
    machine of one axis, and say nothing of the noise."""
    return np.ptp(values, axis=0) > 0


def spread(values: np.ndarray, axis: int | None = None) -> np.ndarray | float:
    """Standard deviation of Gaussian values (n, ...) from their median deviation from their median."""
    # not scipy.stats's: to load that takes a third of what a program takes to start
    middle = np.median(values, axis=axis, keepdims=True)
    return np.median(np.abs(values - middle), axis=axis) / float(ndtri(0.75))


def spread_about_zero(values: np.ndarray) -> float:
    """Standard deviation of Gaussian values (n,) about zero from their median size."""
    # not scipy's: it centres on the median, and takes 0.6 ms where this takes 0.04, in every round of a fit
    return GAUSSIAN * float(np.median(np.abs(values)))


def weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    """The least of the values (n,) up to which half of their weights (n,) lie."""
    return weighted_quantile(values, weights, 0.5)


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> float:
    """The least of the values (n,) up to which this share of their weights (n,) lies."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, share * total[-1])])


def biweight(
    fit: Callable[[np.ndarray], tuple[Fitted, np.ndarray]],
    count: int,
    *,
    least: float,
    reach: float = EFFICIENT,
    rounds: int = 20,
) -> Robust[Fitted]:
    """Regression by iteratively reweighted least squares with Tukey's biweight.

    fit(weight (n,)) -> (parameters, residual (n,)); least: the smallest scale that is believed, in the
    residual's unit; reach: scales beyond which a row loses its weight. The first round weighs all rows alike;
    it ends early where the weights stand still.
    """
    weight = np.ones(count)
    for _ in range(rounds):
        fitted, residual = fit(weight)
        scale = max(spread_about_zero(residual), least)
        before, weight = weight, tukey(residual / (reach * scale))
        if np.abs(weight - before).max() < 1e-12:
            break
    return Robust(fitted, residual, weight, scale)


def tukey(share: np.ndarray) -> np.ndarray:
    """Weights (n,) of residuals as a share of the distance beyond which they count nothing."""
    return np.clip(1 - share**2, 0, None) ** 2


def squared_exponential(squared_m2: np.ndarray, length_m: float) -> np.ndarray:
    """exp(-r^2 / (2 L^2)) at squared distances r^2, m^2: all derivatives exist."""
    return np.exp(-squared_m2 / (2 * length_m**2))


def matern_3_2(
    squared_m2: np.ndarray,
    length_m: float,
    *,
    variance: np.ndarray | float = 1.0,
    fall: np.ndarray | float = 0.0,
) -> np.ndarray:
    """variance (1 + s) exp(-s - fall), s = sqrt(3) r / L, at squared distances r^2, m^2: differentiable once.

    fall: the exponent of another factor, as of the turn between two normals.
    """
    s = np.sqrt(3 * (squared_m2 / length_m**2))
    return variance * (1 + s) * np.exp(-s - fall)


def matern_5_2(distance_m: np.ndarray, length_m: float) -> np.ndarray:
    """(1 + s + s^2 / 3) exp(-s), s = sqrt(5) r / L, at distances r, m: differentiable twice."""
    s = np.sqrt(5.0) * distance_m / length_m
    return (1 + s + s**2 / 3) * np.exp(-s)


def all_but_one(count: int, stretches: int) -> list[np.ndarray]:
    """Indices of `count` rows in time without each of so many stretches."""
    rows = np.arange(count)
    return [np.delete(rows, part) for part in np.array_split(rows, stretches)]


def jackknife_covariance(each: np.ndarray) -> np.ndarray:
    """(k, k) of an estimate, from those without each stretch, (s, k)."""
    left = each - each.mean(axis=0)
    return (len(each) - 1) / len(each) * left.T @ left
