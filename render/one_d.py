"""The step of the 1D renderers: f = k u^r + b u^s du/dt along the contact normal, parameters by place.

u is the depth of the tip below the undeformed surface, at the surface point whose normal points at the tip:
the 1D models know no tangential force. Equations (1), (2), (5), (6) of Goksel et al. differ in r, s and b
alone.

The 1D models of Goksel et al. as renderers: laws of single presses, spread over the surface
(mechanics.model.one_d_laws).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.kernels import inner, step_kernel
from palpate.mechanics.model.model import Model
from palpate.mechanics.model.one_d_laws import LAWS, OneDLaws, spread_law
from palpate.mechanics.progress import Progress, silent
from palpate.render.base import Grip, Renderer, check_radii, new_grip, new_state
from palpate.render.options import RenderOptions
from palpate.render.surface.bvh import STACK
from palpate.render.surface.contact import approach, lose, release
from palpate.render.surface.contact_surface import SurfaceArrays
from palpate.render.surface.snapping import touched_surface
from palpate.render.surface.walking import foot

RATE_FILTER_S = 0.01  # positions come in steps of some 30 um: a raw difference is no velocity
_NEWTON = 20


class OneDParameters(NamedTuple):
    """law: (v, 4) columns k (N/m^r), b (N s/m^(s+1)), r, s at the fine vertices. scale: (1,) on k and b."""

    surface: SurfaceArrays
    law: np.ndarray
    scale: np.ndarray
    friction: np.ndarray
    series_compliance: np.ndarray


class OneDState(NamedTuple):
    """render.base.State, and: grip; rate (m,) m/s filtered; before (m,) m depth one step ago; scratch."""

    forces: np.ndarray
    touching: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    depths: np.ndarray
    stiffness: np.ndarray
    radii_m: np.ndarray
    dt_s: np.ndarray
    unsettled: np.ndarray
    grip: Grip
    rate: np.ndarray
    before: np.ndarray
    vectors: np.ndarray
    stack: np.ndarray


def new_one_d_state(radii: np.ndarray, dt_s: float) -> OneDState:
    """A state of len(radii) tips in air."""
    m = len(radii)
    return OneDState(
        *new_state(radii, dt_s),
        grip=new_grip(m),
        rate=np.zeros(m),
        before=np.zeros(m),
        vectors=np.zeros((3, 3)),
        stack=np.zeros(STACK, dtype=np.int64),
    )


@inner
def law_force(k, b, r, s, depth, rate):
    """(force N, stiffness N/m) along the normal at a depth, m, and its rate, m/s; never pulls."""
    if not depth > 0.0:
        return 0.0, 0.0
    elastic = k * depth**r
    damping = b * depth**s
    return max(elastic + damping * rate, 0.0), r * elastic / depth + max(s * damping / depth * rate, 0.0)


@inner
def _through_spring(k, b, r, s, depth, rate, compliance):
    """`law_force` behind a spring in series: depth = u + compliance f(u)."""
    if compliance == 0.0:
        return law_force(k, b, r, s, depth, rate)
    low, high, u = 0.0, depth, depth
    force = stiffness = 0.0
    for _ in range(_NEWTON):
        force, stiffness = law_force(k, b, r, s, u, rate)
        excess = u + compliance * force - depth
        if excess > 0.0:
            high = u
        else:
            low = u
        u -= excess / (1.0 + compliance * stiffness)
        if not (low < u < high):
            u = 0.5 * (low + high)
    return force, stiffness / (1.0 + compliance * stiffness)


@step_kernel
def one_d_step(p, state, tips):
    """One tick: tips (m, 3) m; writes the state's forces on the tools, N. See render.base.Renderer.step."""
    grip = state.grip
    dt = state.dt_s[0]
    for i in range(tips.shape[0]):
        point, normal = state.points[i], state.normals[i]
        radius = state.radii_m[i]
        fresh = False
        if not (np.isfinite(tips[i, 0]) and np.isfinite(tips[i, 1]) and np.isfinite(tips[i, 2])):
            lose(grip, i)
        elif grip.triangle[i] < 0:
            fresh = (
                approach(p.surface, grip, tips[i], i, radius, point, normal, state.vectors, state.stack) > 0
            )
        force = stiffness = depth = 0.0
        if grip.triangle[i] >= 0:
            grip.triangle[i], height = foot(
                p.surface, grip.triangle[i], grip.weights[i], tips[i], point, normal, state.vectors[0]
            )
            depth = radius - height
            if not depth > 0.0:
                depth = 0.0
                release(grip, i, tips[i])
        if grip.triangle[i] >= 0:
            if fresh:
                state.rate[i] = 0.0
                state.before[i] = depth
            share = dt / (dt + RATE_FILTER_S)
            state.rate[i] += share * ((depth - state.before[i]) / dt - state.rate[i])
            state.before[i] = depth
            k = b = r = s = 0.0
            for c in range(3):
                v, w = p.surface.triangles[grip.triangle[i], c], grip.weights[i, c]
                k += w * p.law[v, 0]
                b += w * p.law[v, 1]
                r += w * p.law[v, 2]
                s += w * p.law[v, 3]
            k *= p.scale[0]
            b *= p.scale[0]
            force, stiffness = _through_spring(k, b, r, s, depth, state.rate[i], p.series_compliance[0])
        state.touching[i] = 1 if force > 0.0 else 0
        state.depths[i] = depth
        state.stiffness[i] = stiffness
        for c in range(3):
            state.forces[i, c] = force * normal[c] if force > 0.0 else 0.0


class OneDRenderer(Renderer):
    """A 1D law whose parameters vary over the surface; `law` holds one entry a palpation."""

    kernel = staticmethod(one_d_step)

    def __init__(self, name: str, model: Model, law: OneDLaws, options: RenderOptions) -> None:
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
