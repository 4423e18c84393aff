"""Hunt-Crossley without damping, eq. (6): f = k u^r."""

from __future__ import annotations

import numpy as np

from mechanics.model import Model
from mechanics.progress import Progress, silent
from render.one_d import Law, OneDRenderer
from render.options import RenderOptions

NAME = "hunt-crossley-undamped"


def create(model: Model, options: RenderOptions, progress: Progress = silent) -> OneDRenderer:
    """The registry's entry."""
    k = model.presses.fits["k_c"]
    r = model.presses.fits["r_c"]
    return OneDRenderer(NAME, model, Law(k, np.zeros_like(k), r, np.zeros_like(k)), options)
