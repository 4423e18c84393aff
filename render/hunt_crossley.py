"""Hunt-Crossley, eq. (2): f = k u^r + b u^r du/dt."""

from __future__ import annotations

from mechanics.model import Model
from mechanics.progress import Progress, silent
from render.one_d import Law, OneDRenderer
from render.options import RenderOptions

NAME = "hunt-crossley"


def create(model: Model, options: RenderOptions, progress: Progress = silent) -> OneDRenderer:
    """The registry's entry."""
    k = model.presses.fits["k_hc"]
    r = model.presses.fits["r_hc"]
    return OneDRenderer(NAME, model, Law(k, model.presses.fits["b_hc"], r, r), options)
