"""What every format is written from: the mesh, its moduli, and a press that shows that it works."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.effects.friction_slip import EFFECT as SLIP
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.errors import OptionError
from palpate.mechanics.frames import tangents
from palpate.mechanics.model.model import Model
from palpate.mechanics.shape.nearest import closest
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.render.simulators.base import graded

USUAL_FRICTION = 0.5
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
        """Coulomb's coefficient: the model's, else a usual one."""
        mu = self.model.effects.get(SLIP.name, {}).get("mu")
        return USUAL_FRICTION if mu is None or not math.isfinite(mu) else float(mu)

    @property
    def friction_note(self) -> str:
        """Where the friction comes from, in words."""
        own = self.friction != USUAL_FRICTION
        return f"friction {self.friction:g}, " + ("of the model" if own else "as the model names none")

    def graded(self, edge_radii: float = 0.5) -> TetMesh:
        """The linear mesh with edges of at most so many of the tip's radii under it, where the model's are
        longer."""
        return graded(self.mesh.linear(), self.top, edge_radii * self.radius_m, 1.2 * self.radius_m)

    @property
    def radius_m(self) -> float:
        """Of the tip."""
        return self.model.tool.tip_radius_m

    @property
    def start(self) -> np.ndarray:
        """(3,) m, the tip's centre a millimetre (or a fifth of its radius) above first touch."""
        return self.top + (self.radius_m + min(1e-3, 0.2 * self.radius_m)) * self.normal

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


def subject_of(model: Model, at: np.ndarray | None = None, depth_m: float | None = None) -> Subject:
    """The press of a model that shows that it works: at: (3,) m, the surface point nearest to it is
    pressed; None: the middle of the top. depth_m: None is half the tip's radius. Raises OptionError for a
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
        0.5 * model.tool.tip_radius_m if depth_m is None else float(depth_m),
    )
