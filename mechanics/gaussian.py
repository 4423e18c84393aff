"""Covariances of Gaussian processes by distance: how alike a field is at two places.

Rasmussen and Williams, Gaussian Processes for Machine Learning, eqs. 4.9 and 4.17.
"""

from __future__ import annotations

import numpy as np


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
