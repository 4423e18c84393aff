"""Hunt-Crossley with one exponent for the whole object: f = k_H u^r, eq. (6) fitted again at the mean
exponent."""

from __future__ import annotations

import numpy as np

from mechanics.model import Model
from mechanics.progress import Progress, silent
from render.one_d import Law, OneDRenderer
from render.options import RenderOptions

NAME = "hunt-crossley-kh"


def create(model: Model, options: RenderOptions, progress: Progress = silent) -> OneDRenderer:
    """The registry's entry."""
    k = model.presses.fits["k_h"]
    r = np.full_like(k, np.nanmean(model.presses.fits["r_c"])) if len(k) else k
    return OneDRenderer(NAME, model, Law(k, np.zeros_like(k), r, np.zeros_like(k)), options)
