"""MuJoCo: a flex of linear tetrahedra, its base pinned, and the tip as a heavy sphere on three slides, which
is put to its place with its velocity at every step: to friction a mocap body, which has no velocity, stands
still.

documented: the contact that its documentation has by default (solref 0.02 1) on the model's own mesh. best:
edges of a third of the tip's radius under it, a contact of solref 0.004 1 and solimp 0.99 0.999, half the
time step, and the stable neo-Hookean material: the one of its files, Saint Venant and Kirchhoff's, is crushed
flat under a deep press and lets the tip through. Poisson's ratio is 0.45 at most in both: nearer to 0.5 its
linear tetrahedra lock.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.render.options import BEST, DOCUMENTED
from palpate.render.simulators.base import SteppedAdapter, SteppedWorld, World, made

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model
    from palpate.render.base import Renderer
    from palpate.render.options import RenderOptions

POISSON_LIMIT = 0.45
"""Beyond it linear tetrahedra lock, and the solver of the elastic forces does not converge at 0.49."""
DENSITY_KG_M3 = 1000.0
HEAVY_KG = 1e3
"""Of the tip: what it gains of speed within a step by what pushes it is nothing."""


@dataclass(frozen=True)
class MujocoSettings:
    """timestep_s; solref_s, damping_ratio: solref of the contact; impedance, impedance_deep: its solimp;
    damping_s: of the flex's elasticity; edge_radii: edges under the tip, in its radii, inf as the model has
    them; skin_m: radius of the flex, by which its surface stands off; material: 1 Saint Venant-Kirchhoff, as
    files have it, 2 stable neo-Hookean (elastic3d of an MjSpec); friction_ratio: impratio, how much harder
    friction holds than the contact pushes: at 1 a tip that rests creeps back."""

    timestep_s: float
    solref_s: float
    damping_ratio: float = 1.0
    damping_s: float = 0.01
    edge_radii: float = np.inf
    impedance: float = 0.9
    impedance_deep: float = 0.95
    skin_m: float = 1e-4
    material: float = 1
    friction_ratio: float = 1.0


SETTINGS = {
    DOCUMENTED: MujocoSettings(2e-3, 0.02),
    BEST: MujocoSettings(1e-3, 0.004, 1.0, 0.002, 0.35, 0.99, 0.999, 1e-5, 2, 10.0),
}


def flex_xml(
    mesh: TetMesh,
    timestep_s: float,
    *,
    young_pa: float,
    poisson: float,
    radius_m: float,
    friction: float = 0.5,
    solref: tuple[float, float] = (0.02, 1.0),
    impedance: tuple[float, float] = (0.9, 0.95),
    damping_s: float = 0.01,
    skin_m: float = 1e-4,
    friction_ratio: float = 1.0,
) -> str:
    """An object as a flex and a sphere whose centre is the first three of qpos. Its cones of friction are
    elliptic: the usual pyramids push back the less the greater the friction is, from 1 on, and at 10 not at
    all."""
    points = " ".join(f"{value:.6g}" for value in mesh.points.ravel())
    elements = " ".join(str(node) for node in mesh.tetrahedra.ravel())
    pins = " ".join(str(node) for node in np.flatnonzero(mesh.fixed))
    mass = DENSITY_KG_M3 * float(mesh.volumes.sum())
    contact = f'solref="{solref[0]:g} {solref[1]:g}" solimp="{impedance[0]:g} {impedance[1]:g} 0.001"'
    return f"""<mujoco>
<option timestep="{timestep_s:g}" gravity="0 0 0" integrator="discrete" solver="CG" cone="elliptic"
impratio="{friction_ratio:g}"/>
<size memory="1G"/>
<worldbody>
<body name="tip"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
<joint type="slide" axis="0 0 1"/>
<geom type="sphere" size="{radius_m}" mass="{HEAVY_KG:g}" condim="3" friction="{friction:g}"
{contact}/></body>
<flexcomp name="object" type="direct" dim="3" mass="{mass}" radius="{skin_m:g}"
point="{points}" element="{elements}">
<contact condim="3" selfcollide="none" friction="{friction:g}" {contact}/>
<elasticity young="{young_pa}" poisson="{poisson}" damping="{damping_s:g}"/>
<pin id="{pins}"/>
</flexcomp></worldbody></mujoco>"""


def force_on_tip(mujoco: Any, model: Any, data: Any) -> np.ndarray:
    """(3,) N on the sphere, from all contacts."""
    total, wrench = np.zeros(3), np.zeros(6)
    for c in range(data.ncon):
        contact = data.contact[c]
        mujoco.mj_contactForce(model, data, c, wrench)
        # the frame's first axis points from the first geometry to the second, and so does its force
        sign = -1.0 if contact.geom[0] >= 0 else 1.0
        total += sign * (np.asarray(contact.frame).reshape(3, 3).T @ wrench[:3])
    return total


class MuJoCo(SteppedAdapter):
    """The adapter."""

    name, extra, units = "mujoco", "mujoco", "SI: m, kg, s, N, Pa"
    settings = SETTINGS
    poisson_limit = POISSON_LIMIT
    presses = 12
    cannot = (
        "linear tetrahedra alone: they lock near Poisson's ratio 0.5, so it is 0.45 at most",
        "one modulus a flex",
        "a contact that gives: it is a constraint with a time constant (solref)",
        "no tip that sticks for ever: friction is a number",
    )
    advice = {
        "contact_stiffness": 'a harder contact, solref="0.004 1" on geom and flex (twice timestep or more): '
        "--simulator-set solref_s=0.004,timestep_s=0.001",
        "contact_nodes": "refine the flex to a third of the tip's radius under it: --simulator-settings best",
        "contact_offset": 'margin="0", gap="0" and a small flex radius: --simulator-set skin_m=1e-5',
        "mesh_stiffness": "refine the flex, and stay at poisson 0.45 or below",
        "numerical_damping": 'lower elasticity damping, and solref damping ratio 1; timestep="0.001"',
        "time_step": 'timestep="0.001" or less, more iterations',
        "lost_contact": 'solref="0.004 1" and timestep="0.001"',
        "tunnelling": "the tip sinks through a soft contact, and Saint Venant-Kirchhoff elements are crushed "
        'flat under it: solref="0.004 1", solimp="0.99 0.999 0.001", timestep="0.001", elastic3d=1 of an '
        "MjSpec (stable neo-Hookean), and edges of a third of the tip's radius under it: "
        "--simulator-settings best",
    }

    def __init__(self, model: Model, options: RenderOptions, friction: float) -> None:
        import mujoco

        super().__init__(model, options, friction)
        self._mujoco: Any = mujoco

    def scene(self, mesh: TetMesh, radius_m: float) -> Any:
        given, own = self.stated, self.own
        xml = flex_xml(
            mesh, own.timestep_s, young_pa=given["young_modulus_pa"], poisson=given["poisson_ratio"],
            radius_m=radius_m, friction=self.friction, solref=(own.solref_s, own.damping_ratio),
            impedance=(own.impedance, own.impedance_deep), damping_s=own.damping_s, skin_m=own.skin_m,
            friction_ratio=own.friction_ratio,
        )  # fmt: skip
        spec = self._mujoco.MjSpec.from_string(xml)
        for flex in spec.flexes:
            flex.elastic3d = round(own.material) - 1
        return spec.compile()

    def touch(self, scene: Any, tip: np.ndarray) -> World:
        return _MujocoTouch(self._mujoco, scene, tip)


class _MujocoTouch(SteppedWorld):
    """One touch."""

    def __init__(self, mujoco: Any, model: Any, tip: np.ndarray) -> None:
        super().__init__(tip, float(model.opt.timestep))
        self._mujoco, self._model, self._data = mujoco, model, mujoco.MjData(model)

    def advance(self, tip: np.ndarray, velocity: np.ndarray) -> None:
        self._data.qpos[:3], self._data.qvel[:3] = tip - velocity * self._timestep_s, velocity
        self._mujoco.mj_step(self._model, self._data)

    def force(self) -> np.ndarray:
        return force_on_tip(self._mujoco, self._model, self._data)


def create(name: str, model: Model, options: RenderOptions, progress: Progress = silent) -> Renderer:
    """The renderer; raises OptionError where MuJoCo is not installed."""
    return made(MuJoCo, model, options)
