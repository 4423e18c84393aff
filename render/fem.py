"""The finite-element renderer (its step: render.fem_kernel): model and compliance made ready for 1 kHz."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mechanics.compliance import Compliance, load_or_condense

from mechanics.dent import dent_law
from mechanics.errors import OptionError
from mechanics.model import Model
from mechanics.progress import Progress, silent
from render.base import Renderer, check_radii
from render.bvh import STACK, closest_triangle
from render.fem_kernel import FemParameters, FemState, fem_step, new_fem_state
from render.field import far_field
from render.options import RenderOptions
from render.surface import contact_surface

NAME = "fem"


class FemRenderer(Renderer):
    """Contact, stick and slip of several spherical tips with a linear elastic object; see
    render.fem_kernel."""

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
        self.compliance = compliance or load_or_condense(model, progress=progress)
        self.contact = contact_surface(model.mesh, edge_m=self.options.surface_edge_m)
        field = far_field(model, self.contact, self.compliance, progress)
        self.parameters = FemParameters(
            surface=self.contact.arrays,
            far=field.far,
            curvature=field.curvature,
            parents=field.parents,
            parent_weights=self.contact.parent_weights,
            smoothed=self.compliance.smoothed,
            table=np.array(dent_law(self.options.dent_law).table),
            young_modulus_pa=np.array([model.young_modulus_pa]),
            poisson_ratio=np.array([model.poisson_ratio]),
            friction=np.array([_friction(model, self.options)]),
            series_compliance=np.zeros(1),
        )

    def start(self, radii_m: Sequence[float] | None = None, dt_s: float = 1e-3) -> FemState:
        return new_fem_state(check_radii(radii_m, self.model), dt_s)

    def with_modulus(self, young_modulus_pa: float) -> FemRenderer:
        if not young_modulus_pa > 0:
            raise OptionError(f"young_modulus_pa is {young_modulus_pa}; it must be greater than 0")
        changed = self._with(young_modulus_pa=np.array([float(young_modulus_pa)]))
        changed.model = self.model.replaced(young_modulus_pa=float(young_modulus_pa))
        return changed

    def with_friction(self, friction: float) -> FemRenderer:
        """The same renderer with another Coulomb coefficient (inf sticks)."""
        if not friction >= 0:
            raise OptionError(f"friction is {friction}; it must be 0 or greater (inf sticks)")
        return self._with(friction=np.array([float(friction)]))

    def with_series_compliance(self, compliance_m_per_n: float) -> FemRenderer:
        """The same renderer felt through a spring of this compliance, m/N, at every tip (a virtual
        coupling)."""
        if not compliance_m_per_n >= 0:
            raise OptionError(f"series compliance is {compliance_m_per_n}; it must be 0 m/N or greater")
        return self._with(series_compliance=np.array([float(compliance_m_per_n)]))

    def _with(self, **changes: np.ndarray) -> FemRenderer:
        copy = object.__new__(FemRenderer)
        copy.__dict__.update(self.__dict__)
        copy.parameters = self.parameters._replace(**changes)
        return copy

    @property
    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        return self.contact.arrays.vertices, self.contact.arrays.triangles

    def displacement_of(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        forces_on_tool: np.ndarray,
        radii_m: np.ndarray,
        depths: np.ndarray,
    ) -> np.ndarray:
        p, arrays = self.parameters, self.contact.arrays
        young = float(p.young_modulus_pa[0])
        nodal = np.zeros((len(self.compliance.nodes), 3))
        weights, stack = np.zeros(3), np.zeros(STACK, dtype=np.int64)
        for point, force in zip(points, forces_on_tool, strict=True):
            t, _ = closest_triangle(arrays.bvh, arrays.vertices, arrays.triangles, point, 1e9, weights, stack)
            for node, weight in zip(p.parents[t], weights @ p.parent_weights[t], strict=True):
                if node >= 0:
                    nodal += (p.smoothed[:, 3 * node : 3 * node + 3] @ (-weight * force / young)).reshape(
                        -1, 3
                    )
        number = np.full(len(self.model.mesh.points), -1)
        number[self.compliance.nodes] = np.arange(len(self.compliance.nodes))
        padded = np.vstack([nodal, np.zeros(3)])
        moved = np.einsum("vc,vcx->vx", self.contact.node_weights, padded[number[self.contact.nodes]])
        for point, normal, radius, depth in zip(points, normals, radii_m, depths, strict=True):
            _dent(arrays.vertices, moved, point, normal, radius, depth)
        return moved


def _dent(
    vertices: np.ndarray,
    moved: np.ndarray,
    point: np.ndarray,
    normal: np.ndarray,
    radius: float,
    depth: float,
) -> None:
    """Add what the smooth field lacks under a tip, and clear the tip's sphere, for drawing."""
    offset = vertices - point
    near = np.flatnonzero(np.einsum("ij,ij->i", offset, offset) < (4 * radius) ** 2)
    squared = np.einsum("ij,ij->i", offset[near], offset[near])
    lacks = depth + float(moved[near[squared.argmin()]] @ normal) if len(near) else 0.0
    moved[near] -= lacks * np.exp(-squared / (2 * radius**2))[:, None] * normal
    centre = point + (radius - depth) * normal
    away = vertices[near] + moved[near] - centre
    height = away @ normal
    flat = np.einsum("ij,ij->i", away, away) - height**2
    inside = flat < radius**2
    floor = -np.sqrt(np.maximum(radius**2 - flat, 0.0))
    push = np.where(inside & (height > floor) & (height < radius), floor - height, 0.0)
    moved[near] += push[:, None] * normal


def _friction(model: Model, options: RenderOptions) -> float:
    if options.friction is not None:
        return float(options.friction)
    if options.effects and "friction_slip" in model.effects:
        return float(model.effects["friction_slip"]["mu"])
    return float("inf")


def create(model: Model, options: RenderOptions, progress: Progress = silent) -> FemRenderer:
    """The registry's entry."""
    return FemRenderer(model, options, progress=progress)
