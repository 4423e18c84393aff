"""The renderer's interface: one step on plain preallocated arrays, the same for servo, replay, tests and
diagnosis.

A renderer owns read-only `parameters` and a compiled `kernel(parameters, state, tips)`; the state is a
NamedTuple of arrays that belongs to the caller. The kernel allocates nothing, reads no clock and is
deterministic: the same parameters, state and tips give the same bits.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.kernels import kept, loop_kernel, pointer
from palpate.mechanics.model.model import Model
from palpate.render.surface.contact_surface import ContactSurface


class State(NamedTuple):
    """What every renderer's state holds; m tips, device frame, SI units. Renderers that remember have a tuple
    with arrays of their own after these.

    forces: (m, 3) N on the tools. touching: (m,) int64, 1 where the tip is held by the surface.
    points: (m, 3) the material point of the undeformed surface that holds the tip; normals: (m, 3) outward
    there. depths: (m,) m, -n . (tip - point - R n). stiffness: (m,) N/m, change of the normal force with
    depth, 0 in air. radii_m: (m,). dt_s: (1,) time that a step covers; only terms with memory read it.
    unsettled: (1,) int64, steps so far in which a tip's force did not settle and its last one was held.
    """

    forces: np.ndarray
    touching: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    depths: np.ndarray
    stiffness: np.ndarray
    radii_m: np.ndarray
    dt_s: np.ndarray
    unsettled: np.ndarray


def new_state(radii_m: np.ndarray, dt_s: float) -> State:
    """Tips in air."""
    m = len(radii_m)
    return State(
        forces=np.zeros((m, 3)),
        touching=np.zeros(m, dtype=np.int64),
        points=np.zeros((m, 3)),
        normals=np.zeros((m, 3)),
        depths=np.zeros(m),
        stiffness=np.zeros(m),
        radii_m=radii_m.copy(),
        dt_s=np.array([dt_s]),
        unsettled=np.zeros(1, dtype=np.int64),
    )


class Renderer(ABC):
    """Base of the renderers: `start` makes a state, `step` advances it; see the module's words."""

    name: str
    model: Model
    contact: ContactSurface
    parameters: Any
    kernel: Callable[[Any, Any, np.ndarray], None]

    @abstractmethod
    def start(self, radii_m: Sequence[float] | None = None, dt_s: float = 1e-3) -> Any:
        """A fresh state with one entry a tip; radii default to the model's one tip."""

    @abstractmethod
    def with_modulus(self, young_modulus_pa: float) -> Renderer:
        """The same renderer for another global Young's modulus, without any precomputation."""

    def with_friction(self, friction: float) -> Self:
        """The same renderer with another Coulomb coefficient (inf sticks; the 1D models know none)."""
        if not friction >= 0:
            raise OptionError(f"friction is {friction}; it must be 0 or greater (inf sticks)")
        return self._with(friction=np.array([float(friction)]))

    def with_series_compliance(self, compliance_m_per_n: float) -> Renderer:
        """The same renderer felt through a spring of this compliance, m/N, at every tip (virtual
        coupling)."""
        if not (compliance_m_per_n >= 0 and np.isfinite(compliance_m_per_n)):
            raise OptionError(f"series compliance is {compliance_m_per_n}; it must be 0 m/N or greater")
        return self._with(series_compliance=np.array([float(compliance_m_per_n)]))

    def _with(self, **changes: np.ndarray) -> Self:
        copy = object.__new__(type(self))
        copy.__dict__.update(self.__dict__)
        copy.parameters = self.parameters._replace(**changes)
        return copy

    @property
    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, 3) m and outward triangles (k, 3) of the surface that is touched and drawn."""
        return self.contact.arrays.vertices, self.contact.arrays.triangles

    def displacement_of(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        forces_on_tool: np.ndarray,
        radii_m: np.ndarray,
        depths: np.ndarray,
    ) -> np.ndarray:
        """(n, 3) m, displacement of the surface's points under contacts at (c, 3) points; for drawing."""
        moved = self._smooth_displacement(points, forces_on_tool)
        for point, normal, radius, depth in zip(points, normals, radii_m, depths, strict=True):
            _draw_dent(self.contact.arrays.vertices, moved, point, normal, radius, depth)
        return moved

    def _smooth_displacement(self, points: np.ndarray, forces_on_tool: np.ndarray) -> np.ndarray:
        """(n, 3) m, what contacts move far from where they are: nothing, where a renderer knows no more."""
        return np.zeros_like(self.contact.arrays.vertices)

    def step(self, state: Any, tips: np.ndarray) -> tuple[Any, np.ndarray]:
        """Advance by one tick: tips (m, 3) m are centres; returns the state and its forces (m, 3) N on the
        tools.

        The state is changed in place and returned; the forces are its own array, overwritten by the next
        step. A tip that is not finite gets zero force and loses its contact.
        """
        self.kernel(self.parameters, state, _own(tips))
        return state, state.forces

    def follow(self, state: Any, path: np.ndarray, steps_s: np.ndarray) -> np.ndarray:
        """Forces (n, m, 3) N on the tools along a path (n, m, 3) m of centres: `step` n times, in one call.

        steps_s: (n,) s, the time that each step covers.
        """
        path, steps_s = _own(path), _own(steps_s)
        forces = np.zeros_like(path)
        if len(path):
            step = pointer(self.kernel, self.parameters, state, path[0])
            follow = kept(_follow, self.parameters, state)
            follow(step, self.parameters, state, steps_s, path, forces)
        return forces

    def displacement(self, state: Any) -> np.ndarray:
        """(n, 3) m, displacement of the surface's points in this state."""
        held = np.flatnonzero(state.touching)
        return self.displacement_of(
            state.points[held],
            state.normals[held],
            state.forces[held],
            state.radii_m[held],
            state.depths[held],
        )


def _draw_dent(
    vertices: np.ndarray,
    moved: np.ndarray,
    point: np.ndarray,
    normal: np.ndarray,
    radius: float,
    depth: float,
) -> None:
    """Add to `moved` (v, 3) m the dent as it is drawn, not felt: what it lacks of `depth` under a tip held at
    `point`, and what clears the tip's sphere."""
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


def _own(array: np.ndarray) -> np.ndarray:
    """Contiguous and writable floats: kernels are compiled for these alone."""
    return np.require(array, float, ["C", "W"])


@loop_kernel
def _follow(step, parameters, state, steps_s, path, forces):
    """`step` along the path (n, m, 3) m, steps_s (n,) apart; writes the forces (n, m, 3) N."""
    for i in range(path.shape[0]):
        state.dt_s[0] = steps_s[i]
        step(parameters, state, path[i])
        for t in range(path.shape[1]):
            for k in range(3):
                forces[i, t, k] = state.forces[t, k]


class Grip(NamedTuple):
    """The part of a state that says where each tip is held (render.surface.contact): m tips.

    triangle: (m,) of the contact surface, -1 in air; weights: (m, 3) barycentric. armed: (m,) the tip has
    been outside, so an entry counts. previous: (m, 3) m, where the sweep for the next entry starts, and
    clearance: (m,) m, how far from there it may move unseen.
    """

    triangle: np.ndarray
    weights: np.ndarray
    armed: np.ndarray
    previous: np.ndarray
    clearance: np.ndarray


def new_grip(tips: int) -> Grip:
    """Nobody touches anything yet."""
    return Grip(
        np.full(tips, -1, dtype=np.int64),
        np.zeros((tips, 3)),
        np.zeros(tips, dtype=np.int64),
        np.zeros((tips, 3)),
        np.zeros(tips),
    )


def check_radii(radii_m: Sequence[float] | None, model: Model) -> np.ndarray:
    """Radii as an array; raises OptionError where one is not positive and finite."""
    radii = np.atleast_1d(np.asarray([model.tool.tip_radius_m] if radii_m is None else radii_m, dtype=float))
    if radii.ndim != 1 or not len(radii) or not (np.isfinite(radii) & (radii > 0)).all():
        raise OptionError(f"tip radii are {radii.tolist()}; each must be a finite number greater than 0 m")
    return radii
