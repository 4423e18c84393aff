"""What the 1D renderers share: parameters of single presses, spread over the surface.

Equation numbers: Goksel et al., Deformable Haptic Model Generation Through Manual Exploration. As there, the
parameters that were fitted at the palpated points are interpolated by radial basis functions. The exponent r
and the *force at 5 mm* are interpolated, and k follows from them: k itself has the unit N/m^r, so its values
at places of different r cannot be averaged.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from mechanics.errors import ModelError, OptionError
from mechanics.model import Model
from render.base import Renderer, check_radii
from render.one_d_kernel import OneDParameters, OneDState, new_one_d_state, one_d_step
from render.options import RenderOptions
from render.snapping import touched_surface

REFERENCE_DEPTH_M = 5e-3


class Law(NamedTuple):
    """f = k u^r + b u^s du/dt of each palpation: all (n,); see render.one_d_kernel."""

    k: np.ndarray
    b: np.ndarray
    r: np.ndarray
    s: np.ndarray


def spread_law(
    points: np.ndarray, site: np.ndarray, law: Law, at: np.ndarray, interpolation: str = "rbf"
) -> Law:
    """The law at places `at` (q, 3) m from presses at `points` (n, 3) m, of sites (n,); those with a NaN are
    left out.

    interpolation: 'rbf' (linear kernel, the biharmonic spline of space; repeats at a site are averaged
    first) or 'nearest'. Values are kept within the range of the palpations'. Raises ModelError where none is
    usable.
    """
    u = REFERENCE_DEPTH_M
    with np.errstate(invalid="ignore"):
        columns = np.column_stack([law.k * u**law.r, law.b * u**law.s, law.r, law.s])
    good = np.isfinite(columns).all(axis=1) & np.isfinite(points).all(axis=1)
    if not good.any():
        raise ModelError("the model's palpations hold no parameters of this 1D model: reconstruct it again")
    points, site, columns = points[good], site[good], columns[good]
    if interpolation == "nearest":
        values = columns[cKDTree(points).query(at)[1]]
    else:
        places, means = _averaged(points, columns, site=site)
        if len(places) == 1:
            values = np.tile(means, (len(at), 1))
        else:
            values = RBFInterpolator(places, means, kernel="linear", degree=0)(at)
            values = np.clip(values, columns.min(axis=0), columns.max(axis=0))
    force, damping, r, s = values.T
    return Law(force / u**r, damping / u**s, r, s)


def _averaged(*arrays: np.ndarray, site: np.ndarray) -> tuple[np.ndarray, ...]:
    """Means (s, c) of each array (n, c) over the presses of every site."""
    group = np.unique(site, return_inverse=True)[1]
    size = np.bincount(group)[:, None]
    return tuple(np.column_stack([np.bincount(group, weights=c) for c in a.T]) / size for a in arrays)


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
