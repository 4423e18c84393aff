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

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.render.options import BEST, DOCUMENTED
from palpate.render.simulators.base import SteppedAdapter, Touch
from palpate.render.simulators.tunable import EDGES, Tunable, density

_LOG = logging.getLogger(__name__)
POISSON_LIMIT = 0.45
"""Beyond it linear tetrahedra lock, and the solver of the elastic forces does not converge at 0.49."""
GREY = "0.5 0.5 0.5 1"
HEAVY_KG = 1e3
"""Of the tip: what it gains of speed within a step by what pushes it is nothing."""


@dataclass(frozen=True)
class MujocoSettings:
    """timestep_s; solref_s, damping_ratio: solref of the contact; impedance, impedance_deep: its solimp;
    damping_s: of the flex's elasticity; edge_radii: edges under the tip, in its radii, inf as the model has
    them; skin_m: radius of the flex, by which its surface stands off; material: 1 Saint Venant-Kirchhoff, as
    files have it, 2 stable neo-Hookean (elastic3d of an MjSpec); friction_ratio: impratio, how much harder
    friction holds than the contact pushes: at 1 a tip that rests creeps back; density_kg_m3: of the object,
    which swings the less after a press the lighter it is; cone: of friction, 1 pyramids, 2 elliptic."""

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
    density_kg_m3: float = 1000.0
    cone: float = 2


SETTINGS = {
    DOCUMENTED: MujocoSettings(2e-3, 0.02),
    BEST: MujocoSettings(1e-3, 0.004, 1.0, 0.002, 0.35, 0.99, 0.999, 1e-5, 2, 10.0),
}


_CONES = {1: "pyramidal", 2: "elliptic"}
TUNABLES = (
    Tunable("solref_s", (0.002, 0.004, 0.008, 0.016, 0.032, 0.064), 'the first number of solref="..."',
            ("contact_stiffness", "tunnelling", "lost_contact")),
    EDGES,
    Tunable("material", (1, 2), "elastic3d of an MjSpec, plus 1 (2: stable neo-Hookean)", ("tunnelling",),
            whole=True),
    density('mass="..." of the flexcomp, over its volume'),
    Tunable("damping_s", (0.0005, 0.002, 0.005, 0.01, 0.02, 0.05), 'damping="..." of the elasticity',
            ("numerical_damping",)),
    Tunable("timestep_s", (0.0005, 0.001, 0.002, 0.004, 0.008), 'timestep="..." of the option',
            ("time_step", "numerical_damping", "lost_contact")),
    Tunable("impedance", (0.9, 0.95, 0.99), 'the first number of solimp="..."', ("contact_stiffness",),
            whole=True),
    Tunable("skin_m", (1e-5, 1e-4, 3e-4, 1e-3), 'radius="..." of the flexcomp', ("contact_offset",)),
    Tunable("friction_ratio", (1.0, 3.0, 10.0), 'impratio="..." of the option', ("numerical_drift",)),
    Tunable("cone", (1, 2), 'cone="..." of the option (1 pyramidal, 2 elliptic)', (), whole=True),
)  # fmt: skip


def scene_xml(
    mesh: TetMesh,
    radius_m: float,
    given: Mapping[str, float],
    own: MujocoSettings,
    *,
    start: np.ndarray | None = None,
    beside: str = "",
    colours: tuple[str, str] = (GREY, GREY),
) -> str:
    """An object as a flex, and a sphere whose centre is the first three of qpos, away from `start` (3,) m
    (None: the origin). given: as `Adapter.stated`. beside: more elements of the file. colours: rgba of object
    and sphere.

    All of the scene but `own.material`, which no file can say. Its cones of friction are elliptic unless the
    settings say so: pyramids push back the less the greater the friction is, from 1 on, at 10 not at all.
    """
    points = " ".join(f"{value:.6g}" for value in mesh.points.ravel())
    elements = " ".join(str(node) for node in mesh.tetrahedra.ravel())
    pins = " ".join(str(node) for node in np.flatnonzero(mesh.fixed))
    at = "" if start is None else f' pos="{" ".join(f"{value:.9g}" for value in start)}"'
    slides = "\n".join(
        f'<joint name="tip_{name}" type="slide" axis="{axis}"/>'
        for name, axis in zip("xyz", ("1 0 0", "0 1 0", "0 0 1"), strict=True)
    )
    mass = own.density_kg_m3 * float(mesh.volumes.sum())
    contact = (
        f'condim="3" friction="{given["friction"]:g}" solref="{own.solref_s:g} {own.damping_ratio:g}" '
        f'solimp="{own.impedance:g} {own.impedance_deep:g} 0.001"'
    )
    return f"""<mujoco>
<option timestep="{own.timestep_s:g}" gravity="0 0 0" integrator="discrete" solver="CG"
cone="{_CONES[round(own.cone)]}" impratio="{own.friction_ratio:g}"/>
<size memory="1G"/>
<worldbody>
<body name="tip"{at}>
{slides}
<geom name="tip" type="sphere" size="{radius_m}" mass="{HEAVY_KG:g}" rgba="{colours[1]}" {contact}/></body>
<flexcomp name="object" type="direct" dim="3" mass="{mass}" radius="{own.skin_m:g}" rgba="{colours[0]}"
point="{points}" element="{elements}">
<contact selfcollide="none" {contact}/>
<elasticity young="{given["young_modulus_pa"]}" poisson="{given["poisson_ratio"]}"
damping="{own.damping_s:g}"/>
<pin id="{pins}"/>
</flexcomp></worldbody>
{beside}</mujoco>
"""


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
    needs = ("mujoco",)
    settings = SETTINGS
    tunables = TUNABLES
    poisson_limit = POISSON_LIMIT
    presses = 12
    cannot = (
        "linear tetrahedra alone: they lock near Poisson's ratio 0.5, so it is 0.45 at most",
        "an object of two moduli: a soft body (flex) has one",
        "a contact that gives: it is a constraint with a time constant (solref)",
        "a tip that never slides: friction is a number",
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

    def scene(self, mesh: TetMesh, radius_m: float) -> Any:
        import mujoco

        # it prints them otherwise, and writes a MUJOCO_LOG.TXT beside the user's files
        mujoco.set_mju_user_warning(_LOG.info)
        spec = mujoco.MjSpec.from_string(scene_xml(mesh, radius_m, self.stated, self.own))
        for flex in spec.flexes:
            flex.elastic3d = round(self.own.material) - 1
        return spec.compile()

    def touch(self, scene: Any, tip: np.ndarray) -> Touch:
        return _MujocoTouch(scene)


class _MujocoTouch:
    """One touch."""

    def __init__(self, model: Any) -> None:
        import mujoco

        self._mujoco: Any = mujoco
        self._model, self._data = model, mujoco.MjData(model)
        self.timestep_s = float(model.opt.timestep)

    def advance(self, tip: np.ndarray, velocity: np.ndarray) -> None:
        self._data.qpos[:3], self._data.qvel[:3] = tip - velocity * self.timestep_s, velocity
        self._mujoco.mj_step(self._model, self._data)

    def force(self) -> np.ndarray:
        return force_on_tip(self._mujoco, self._model, self._data)
