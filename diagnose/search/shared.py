"""Errors of our own that all presses share, fitted beside the modulus within their widths, and those of each
first touch.

The covariance of a comparison (search.whiten) holds what each press or place has of its own; in it an error
of all at once would count as often as there are presses. So these are values of every fit, after those of the
effects, with priors about 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.options import NuisanceOptions
from palpate.mechanics.contact.dent import grid
from palpate.mechanics.effects.settings import ForwardSettings
from palpate.mechanics.law_errors import Slip


@dataclass(frozen=True)
class SharedError:
    """step: of its value, for a slope. most: of its value either way. act(settings, value)."""

    step: float
    most: float
    act: Callable[[ForwardSettings, float], None]


def _touch_early(settings: ForwardSettings, value: float) -> None:
    settings.onset = settings.onset + value


def _hold_less(settings: ForwardSettings, value: float) -> None:
    _sideways(settings, np.full_like(grid(), -value))


def _shallow_hold_less(settings: ForwardSettings, value: float) -> None:
    _sideways(settings, -value * np.exp(-grid() / Slip.shallow_over.value))


def _sideways(settings: ForwardSettings, log: np.ndarray) -> None:
    """log: (k,) ln of the factor at `grid()`."""
    same = np.ones_like(log)
    settings.touch.factors.append(lambda poisson_ratio: (same, np.exp(log), 0.0 * log))


SHARED = (
    SharedError(2e-5, 2e-3, _touch_early),
    SharedError(0.02, 1.0, _hold_less),
    SharedError(0.02, 1.5, _shallow_hold_less),
)
"""By how much all presses met the surface earlier than it says, m; by how much less all dents hold sideways,
ln of the factor; and by how much less than that shallow ones."""


def shared_sd(forward: Forward, options: NuisanceOptions) -> np.ndarray:
    """(s,) standard deviations of SHARED, 0 of what is known; (0,) where a simulator's force is compared,
    which begins on the very surface, or where no such error is allowed for."""
    early = 0.0
    if options.common_onset_m > 0 and _on_fitted(forward):
        early = float(np.hypot(options.common_onset_m, np.median(surface_sd(forward))))
    sd = np.array([early, options.common_stick, options.shallow_stick])
    return sd if forward.measured and sd.any() else np.zeros(0)


def own_onset_sd(forward: Forward, options: NuisanceOptions) -> np.ndarray:
    """(p,) m, standard deviation of each first touch by itself.

    On a surface that was fitted to these presses it is that of the surface, from place to place: noise in the
    touches is in its fit. On any other it is the touch's own.
    """
    if _on_fitted(forward):
        return np.hypot(options.fitted_onset_m, options.fitted_onset_share * surface_sd(forward))
    return np.hypot(options.onset_m, forward.touches.onset_error_m)


def _on_fitted(forward: Forward) -> bool:
    return forward.measured and forward.model.fitted_to(forward.touches)


def surface_sd(forward: Forward) -> np.ndarray:
    """(p,) m, what the model states of its surface where each press first met it; 0 where it states none."""
    touches, model = forward.touches, forward.model
    if model.shape_uncertainty_m is None:
        return np.zeros(len(touches))
    surface = np.flatnonzero(model.mesh.touchable)
    _, near = cKDTree(model.mesh.points[surface]).query(touches.point)
    return np.asarray(model.shape_uncertainty_m)[surface][near]
