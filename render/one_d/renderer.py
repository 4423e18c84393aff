"""The 1D models of Goksel et al. as renderers: laws of single presses, spread over the surface
(mechanics.model.one_d_laws)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.model.one_d_laws import LAWS, Law, spread_law
from palpate.mechanics.progress import Progress, silent
from palpate.render.base import Renderer, check_radii
from palpate.render.one_d.kernel import OneDParameters, OneDState, new_one_d_state, one_d_step
from palpate.render.options import RenderOptions
from palpate.render.surface.snapping import touched_surface


class OneDRenderer(Renderer):
    """A 1D law whose parameters vary over the surface; `law` holds one entry a palpation."""

    kernel = staticmethod(one_d_step)

    def __init__(self, name: str, model: Model, law: Law, options: RenderOptions) -> None:
        self.name = name
        self.model = model
        self.options = options
        self.contact = touched_surface(model, options)
        presses = model.presses
        spread = spread_law(
            presses.point, presses.site, law, self.contact.arrays.vertices, options.interpolation
        )
        self.parameters = OneDParameters(
            surface=self.contact.arrays,
            law=np.ascontiguousarray(np.column_stack(spread)),
            scale=np.ones(1),
            friction=np.array([np.inf]),
            series_compliance=np.zeros(1),
        )

    def start(self, radii_m: Sequence[float] | None = None, dt_s: float = 1e-3) -> OneDState:
        return new_one_d_state(check_radii(radii_m, self.model), dt_s)

    def with_modulus(self, young_modulus_pa: float) -> Renderer:
        if not young_modulus_pa > 0:
            raise OptionError(f"young_modulus_pa is {young_modulus_pa}; it must be greater than 0")
        return self._with(scale=np.array([young_modulus_pa / self.model.material.young_modulus_pa]))


def create(name: str, model: Model, options: RenderOptions, progress: Progress = silent) -> OneDRenderer:
    """The registry's entry."""
    return OneDRenderer(name, model, LAWS[name](model.presses.fits), options)
