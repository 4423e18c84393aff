"""Kelvin-Voigt, eq. (1): f = k u + b du/dt."""

from __future__ import annotations

import numpy as np

from mechanics.model import Model
from mechanics.progress import Progress, silent
from render.one_d import Law, OneDRenderer
from render.options import RenderOptions

NAME = "kelvin-voigt"


def create(model: Model, options: RenderOptions, progress: Progress = silent) -> OneDRenderer:
    """The registry's entry."""
    k = model.presses.fits["k_kv"]
    r = np.ones_like(k)
    return OneDRenderer(NAME, model, Law(k, model.presses.fits["b_kv"], r, np.zeros_like(k)), options)
