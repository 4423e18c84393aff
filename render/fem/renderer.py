"""The finite-element renderer (its step: render.fem.kernel): model and compliance made ready for 1 kHz."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from palpate.mechanics.compliance.coarse_table import CoarseCompliance
from palpate.mechanics.compliance.on_demand import OnDemandCompliance
from palpate.mechanics.compliance.stored_compliance import load_coarse, load_or_condense, load_or_solve
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.render.base import Renderer, check_radii
from palpate.render.effects import effect_arrays, rendered_touch
from palpate.render.fem.fine_surface import Compliance, FineSurface
from palpate.render.fem.kernel import fem_step
from palpate.render.fem.state import FemParameters, FemState, new_fem_state
from palpate.render.options import RenderOptions
from palpate.render.surface.bvh import STACK, closest_triangle
from palpate.render.surface.snapping import touched_surface

NAME = "fem"


class FemRenderer(Renderer):
    """Contact, stick and slip of several spherical tips with a linear elastic object; see render.fem.kernel.

    With an OnDemandCompliance the far field is known only where a tip has come: `step` and `follow` find what
    is missing, solve it, and go the same ticks again. A kernel that is run by itself needs `condensed()`.
    With a CoarseCompliance every place is felt at once, by what the solved ones tell (`coarse`).
    """

    name = NAME
    kernel = staticmethod(fem_step)

    def __init__(
        self,
        model: Model,
        options: RenderOptions | None = None,
        *,
        compliance: Compliance | None = None,
        progress: Progress = silent,
    ) -> None:
        self.model = model
        self.options = options or RenderOptions()
        self.contact = touched_surface(model, self.options)  # seconds before minutes
        self.compliance = compliance or load_or_condense(model, progress=progress)
        touch = rendered_touch(model, self.options)
        law = touch.law_of_dent(model.material.poisson_ratio)
        self._fine = field = FineSurface(model, self.contact, self.compliance, law)
        number = np.full(len(model.mesh.points), len(self.compliance.nodes))
        number[self.compliance.nodes] = np.arange(len(self.compliance.nodes))
        self._drawn = number[self.contact.nodes]
        self.parameters = FemParameters(
            surface=self.contact.arrays,
            far=field.far,
            far_before=field.far,
            curvature=field.curvature,
            bracing=field.bracing,
            softness=field.softness,
            parents=field.parents,
            parent_weights=self.contact.parent_weights,
            blocks=np.array(self.compliance.blocks),
            factor=np.array(self.compliance.factor),
            table=np.array(law.table),
            young_modulus_pa=np.array([model.material.young_modulus_pa]),
            poisson_ratio=np.array([model.material.poisson_ratio]),
            friction=np.array([touch.friction]),
            series_compliance=np.zeros(1),
            series_before=np.zeros(1),
            edition=np.zeros(1, dtype=np.int64),
            effects=effect_arrays(touch),
        )

    def start(self, radii_m: Sequence[float] | None = None, dt_s: float = 1e-3) -> FemState:
        radii = check_radii(radii_m, self.model)
        if len(radii) > 1:  # one tip moves the places of the others
            self.condensed()
        return new_fem_state(self.parameters, radii, dt_s)

    def step(self, state: FemState, tips: np.ndarray) -> tuple[FemState, np.ndarray]:
        return self._where_solved(state, partial(super().step, state, tips))

    def follow(self, state: FemState, path: np.ndarray, steps_s: np.ndarray) -> np.ndarray:
        return self._where_solved(state, partial(super().follow, state, path, steps_s))

    def _where_solved(self, state: FemState, ticks: Callable[[], Any]) -> Any:
        """What `ticks` gives once no tip comes to a place that is not solved; the state is put back before
        each further try."""
        if not isinstance(self.compliance, OnDemandCompliance):
            return ticks()
        while True:
            before = [array.copy() for array in _arrays(state)]
            result = ticks()
            missing = np.flatnonzero(state.unsolved)
            if not len(missing):
                return result
            for array, value in zip(_arrays(state), before, strict=True):
                array[:] = value
            self.far_at(missing)

    def far_at(self, vertices: np.ndarray | slice) -> np.ndarray:
        """(k, 3, 3) 1/m, the far field at vertices of the contact surface; solved where it is not yet."""
        self._fine.solve(self.compliance, np.arange(len(self._fine.far))[vertices])
        return self.parameters.far[vertices]

    def condensed(self) -> FemRenderer:
        """This renderer with every place, and what lies between them: for several tips, and for a free
        hand."""
        if not isinstance(self.compliance, SurfaceCompliance):
            coarse, self.compliance = self.coarse, load_or_condense(self.model)
            blocks, factor = np.array(self.compliance.blocks), np.array(self.compliance.factor)
            self.parameters = self.parameters._replace(blocks=blocks, factor=factor)
            if coarse:
                far, bracing = self.field_of(self.compliance)
                self.parameters = self.parameters._replace(far=far, bracing=bracing)
            self.far_at(slice(None))
        return self

    @property
    def coarse(self) -> bool:
        """Whether what it renders is what solved places tell of the others."""
        return isinstance(self.compliance, CoarseCompliance)

    def field_of(self, compliance: Compliance) -> tuple[np.ndarray, np.ndarray]:
        """(far (v, 3, 3), bracing (v,)), 1/m, by another compliance of the same object, for `with_field`."""
        return self._fine.field_of(compliance)

    @property
    def whole_compliance(self) -> SurfaceCompliance:
        """The table of the whole surface; condensed first where it is not yet."""
        whole = self.condensed().compliance
        assert isinstance(whole, SurfaceCompliance)
        return whole

    def with_modulus(self, young_modulus_pa: float) -> FemRenderer:
        if not young_modulus_pa > 0:
            raise OptionError(f"young_modulus_pa is {young_modulus_pa}; it must be greater than 0")
        changed = self._with(young_modulus_pa=np.array([float(young_modulus_pa)]))
        changed.model = self.model.with_modulus(float(young_modulus_pa))
        return changed

    def with_friction(self, friction: float) -> FemRenderer:
        changed = super().with_friction(friction)
        touch = rendered_touch(self.model, replace(self.options, friction=float(friction)))
        table = np.array(touch.law_of_dent(self.model.material.poisson_ratio).table)
        changed.parameters = changed.parameters._replace(table=table)
        return changed

    def with_field(
        self, far: np.ndarray, blocks: np.ndarray | None = None, bracing: np.ndarray | None = None
    ) -> FemRenderer:
        """The same renderer with another far field (v, 3, 3), mutual table (t, t, 3, 3), bracing (v,), 1/m,
        unit modulus.

        For an object that changes inside, or is known better, while it is touched: a state that goes on comes
        to it within held_tips.BLEND_S. None keeps what is there.
        """
        if not self.coarse:
            self.condensed()
        if far.shape != self.parameters.far.shape or (
            blocks is not None and blocks.shape != self.parameters.blocks.shape
        ):
            raise OptionError("a changed field must have the shape of the renderer's own")
        # the compiled loop knows only arrays in C order that may be written to
        given = self.parameters
        changed = self._with(
            far=np.array(far, order="C"),
            far_before=given.far,
            series_before=given.series_compliance,
            edition=given.edition + 1,
        )
        if bracing is not None:
            changed.parameters = changed.parameters._replace(bracing=np.array(bracing, order="C"))
        if blocks is not None:
            table = np.array(blocks, dtype=np.float32, order="C")
            changed.parameters = changed.parameters._replace(blocks=table)
            changed.compliance = replace(self.whole_compliance, blocks=table.copy())
        return changed

    def _smooth_displacement(self, points: np.ndarray, forces_on_tool: np.ndarray) -> np.ndarray:
        p, arrays = self.parameters, self.contact.arrays
        weights, stack = np.zeros(3), np.zeros(STACK, dtype=np.int64)
        corners = np.zeros((len(self.compliance.nodes) + 1, 3))  # the last one stands for the base
        for point, force in zip(points, forces_on_tool, strict=True):
            t, _ = closest_triangle(
                arrays.bvh, arrays.vertices, arrays.triangles, np.asarray(point), np.inf, weights, stack
            )
            for corner, weight in zip(p.parents[t], weights @ p.parent_weights[t], strict=True):
                if corner >= 0:
                    compliance = weight / p.young_modulus_pa[0]
                    corners[:-1] -= compliance * self.compliance.displacement(corner, force)
        return np.einsum("vc,vcx->vx", self.contact.node_weights, corners[self._drawn])


def create(
    name: str,
    model: Model,
    options: RenderOptions,
    progress: Progress = silent,
    *,
    on_demand: bool = False,
    coarse: bool = False,
) -> FemRenderer:
    """The registry's entry. on_demand: it solves the places that a tip comes to, unless all are known.
    coarse: it renders at once what is kept of the compliance, its first places at least; condensed where that
    is not there."""
    kept: Compliance | None = None
    if on_demand:
        kept = load_or_solve(model, progress)
    elif coarse:
        kept = load_coarse(model)
    return FemRenderer(model, options, compliance=kept, progress=progress)


def _arrays(state: Any) -> list[np.ndarray]:
    """All arrays of a state."""
    if isinstance(state, np.ndarray):
        return [state]
    return [array for part in state for array in _arrays(part)]
