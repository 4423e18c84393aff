"""What every format is written from: the mesh, its moduli, and a press that shows that it works."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from palpate.mechanics.effects.friction_slip import EFFECT as SLIP
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.errors import OptionError
from palpate.mechanics.frames import tangents
from palpate.mechanics.model.model import Model
from palpate.mechanics.shape.nearest import closest
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.render.options import BEST, RenderOptions
from palpate.render.simulators.base import MOST_FRICTION, NEAR_M, Adapter, friction_of

A = TypeVar("A", bound=Adapter)
DENSITY_KG_M3 = 1000.0
"""Of soft tissue and silicone; a model states none, and a quasi-static press does not ask."""


@dataclass(frozen=True)
class Subject:
    """A model in the device frame, SI units, and one press: from `start` the tip's centre goes by `depth_m`
    beyond first touch along `direction` (3,).

    element_modulus_pa: (m,). top: (3,) where it touches; normal: (3,) outward there.
    """

    model: Model
    top: np.ndarray
    normal: np.ndarray
    depth_m: float

    @property
    def mesh(self) -> TetMesh:
        """As the model has it, linear or quadratic."""
        return self.model.mesh

    @property
    def element_modulus_pa(self) -> np.ndarray:
        """(m,) Pa."""
        return self.model.material.young_modulus_pa * self.model.element_ratio

    @property
    def mean_modulus_pa(self) -> float:
        """Pa, by volume, for a program that knows one modulus."""
        return float(np.average(self.element_modulus_pa, weights=self.mesh.volumes))

    @property
    def friction(self) -> float:
        """Coulomb's coefficient as other simulators are given it by `palpate replay --renderer`."""
        return min(friction_of(self.model, RenderOptions()), MOST_FRICTION)

    @property
    def friction_note(self) -> str:
        """Where the friction comes from, in words."""
        own = "mu" in self.model.effects.get(SLIP.name, {})
        return f"friction {self.friction:g}, " + ("of the model" if own else "as the model names none")

    def as_run(self, kind: type[A], numbers: str = "", settings: str = BEST) -> A:
        """The adapter that `palpate replay --renderer` runs at its best settings, or others; numbers: those
        changed (`--simulator-set`)."""
        options = RenderOptions(simulator_settings=settings, simulator_set=numbers)
        return kind(self.model, options, friction_of(self.model, options))

    def run_notes(self, kind: type[Adapter], numbers: str = "", settings: str = BEST) -> tuple[str, ...]:
        """Of such a scene: how it is run here, and what of the model it does not hold, a line each."""
        run = f"--renderer {kind.name} --simulator-settings {settings}"
        run += f" --simulator-set {numbers}" if numbers else ""
        notes = [
            f"what palpate replay {run} runs",
            "linear tetrahedra, which come out stiffer than the model near nu = 0.5",
            self.friction_note,
        ]
        if self.model.material.poisson_ratio > kind.poisson_limit:
            notes.append(
                f"Poisson's ratio is {kind.poisson_limit:g} there, beyond which it does not converge"
            )
        if np.ptp(self.model.element_ratio) > 1e-9:
            notes.append("one modulus: the material's own, without what differs from it")
        return tuple(notes)

    @property
    def radius_m(self) -> float:
        """Of the tip."""
        return self.model.tool.tip_radius_m

    @property
    def start(self) -> np.ndarray:
        """(3,) m, the tip's centre a millimetre (or a fifth of its radius) above first touch."""
        return self.top + (self.radius_m + min(1e-3, 0.2 * self.radius_m)) * self.normal

    @property
    def near(self) -> np.ndarray:
        """(3,) m, as `start`, as near as `palpate replay` begins another simulator's scene."""
        return self.top + (self.radius_m + min(0.8 * NEAR_M, 0.2 * self.radius_m)) * self.normal

    @property
    def pressed(self) -> np.ndarray:
        """(3,) m, the tip's centre at depth."""
        return self.top + (self.radius_m - self.depth_m) * self.normal

    @property
    def label(self) -> str:
        """What the file says of itself."""
        material = self.model.material
        return (
            f"Palpate model: E {material.young_modulus_pa:g} Pa, nu {material.poisson_ratio:g}, "
            f"tip radius {self.radius_m:g} m; metres, newtons, device frame"
        )

    @property
    def left_out(self) -> tuple[str, ...]:
        """Effects of the model that no file states."""
        return tuple(name for name in self.model.effects if not effect(name).in_material)


DEPTH_RADII = 0.5
"""Depth of a press that nobody said, in radii of the tip."""


def subject_of(
    model: Model, at: np.ndarray | None = None, depth_m: float | None = None, depth_radii: float = DEPTH_RADII
) -> Subject:
    """The press of a model that shows that it works: at: (3,) m, the surface point nearest to it is
    pressed; None: the middle of the top. depth_m: None is `depth_radii` of the tip. Raises OptionError for a
    place further from the object than that is wide, or a depth beyond its height."""
    up, mesh = model.support.normal, model.mesh
    height = float(model.support.height(mesh.points).max())
    if depth_m is not None and depth_m > height:
        raise OptionError(f"--depth is {depth_m:g} m, and the object is {height:.4g} m high: press less deep")
    surface = mesh.touchable_surface[:, :3]
    if at is None:
        spots = mesh.points[np.unique(surface)]
        u, v = tangents(up)
        middle = np.array([(spots @ a).max() + (spots @ a).min() for a in (u, v)]) / 2
        at = middle[0] * u + middle[1] * v + (spots @ up).max() * up
    spot, triangle, _ = closest(mesh.points, surface, np.asarray(at, dtype=float)[None])
    away, across = float(np.linalg.norm(spot[0] - at)), float(np.ptp(mesh.points, axis=0).max())
    if away > across:
        raise OptionError(
            f"--at lies {away:.4g} m from the object, which is {across:.4g} m across: name a place near its "
            "surface, in metres"
        )
    corners = mesh.points[surface[triangle[0]]]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return Subject(
        model,
        spot[0],
        normal / np.linalg.norm(normal),
        depth_radii * model.tool.tip_radius_m if depth_m is None else float(depth_m),
    )
