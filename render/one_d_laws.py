"""The 1D models of Goksel et al. as renderers: which law stands at each palpation. u: depth."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from mechanics.model import Model
from mechanics.progress import Progress, silent
from render.one_d import Law, OneDRenderer
from render.options import RenderOptions

Fits = Mapping[str, np.ndarray]
"""Parameters of single presses by the name of their column."""


def _kelvin_voigt(fits: Fits) -> Law:
    """Eq. (1): f = k u + b du/dt."""
    k = fits["k_kv"]
    return Law(k, fits["b_kv"], np.ones_like(k), np.zeros_like(k))


def _hunt_crossley(fits: Fits) -> Law:
    """Eq. (2): f = k u^r + b u^r du/dt."""
    r = fits["r_hc"]
    return Law(fits["k_hc"], fits["b_hc"], r, r)


def _undamped(fits: Fits) -> Law:
    """Hunt-Crossley without damping, eq. (6): f = k u^r."""
    k = fits["k_c"]
    return Law(k, np.zeros_like(k), fits["r_c"], np.zeros_like(k))


def _one_exponent(fits: Fits) -> Law:
    """f = k_H u^r with one exponent for the whole object, eq. (6) fitted again at the mean exponent."""
    k = fits["k_h"]
    r = np.full_like(k, np.nanmean(fits["r_c"])) if len(k) else k
    return Law(k, np.zeros_like(k), r, np.zeros_like(k))


LAWS: dict[str, Callable[[Fits], Law]] = {
    "kelvin-voigt": _kelvin_voigt,
    "hunt-crossley": _hunt_crossley,
    "hunt-crossley-undamped": _undamped,
    "hunt-crossley-kh": _one_exponent,
}


def create(name: str, model: Model, options: RenderOptions, progress: Progress = silent) -> OneDRenderer:
    """The registry's entry."""
    return OneDRenderer(name, model, LAWS[name](model.presses.fits), options)
