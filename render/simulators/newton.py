"""Newton: a soft mesh of linear tetrahedra in vertex block descent (VBD), its base without mass (which holds
it), and a kinematic sphere.

documented: a sixtieth of a second in ten steps, as in its soft-body examples, on the model's own mesh. best:
edges of half the tip's radius under it, more sweeps a step; the contact is what still converges, so it gives.
That is not refined until the force stands still: a light press is a third too hard (`Newton.cannot`).
"""

from __future__ import annotations

import importlib
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

DENSITY_KG_M3 = 1000.0
POISSON_LIMIT = 0.45
"""Beyond it linear tetrahedra lock, and the sweeps do not converge."""


@dataclass(frozen=True)
class NewtonSettings:
    """timestep_s; sweeps: of the solver, a step; contact_n_per_m: of one contact; skin_m: what keeps surfaces
    apart (a particle's radius), by which the sphere is led farther out; damping_s: of the elasticity;
    edge_radii: edges under the tip, in its radii, inf as the model has them."""

    timestep_s: float
    sweeps: float
    contact_n_per_m: float
    skin_m: float = 1e-4
    damping_s: float = 1e-9
    edge_radii: float = np.inf


SETTINGS = {DOCUMENTED: NewtonSettings(1 / 600, 10, 1e3), BEST: NewtonSettings(1e-3, 20, 3e3, edge_radii=0.5)}


class Newton(SteppedAdapter):
    """The adapter."""

    name, extra, units = "newton", "newton", "SI in single precision: m, kg, s, N, Pa"
    settings = SETTINGS
    poisson_limit = POISSON_LIMIT
    presses = 12
    cannot = (
        "a light press: at its best 0.5 mm into a half-space is 1.35 of Hertz's force, 1 mm 1.26",
        "linear tetrahedra alone: they lock near Poisson's ratio 0.5, so it is 0.45 at most",
        "a hard contact: its spring (soft_contact_ke) diverges from some 1e4 N/m on",
        "no tip that sticks for ever: friction is a number",
    )
    advice = {
        "contact_stiffness": "a larger soft_contact_ke, as far as it converges, on a finer mesh (more "
        "contacts side by side): --simulator-settings best",
        "contact_nodes": "refine the mesh under the tip, and keep enable_rigid_soft_full_surface_contact: "
        "--simulator-settings best",
        "contact_offset": "particle_radius is what keeps surfaces apart: take 1e-4, and lead the tip farther "
        "out by it",
        "mesh_stiffness": "refine the mesh, take more iterations of SolverVBD, and a Poisson's ratio of 0.45 "
        "or below",
        "numerical_damping": "k_damp=0 and a smaller step: --simulator-set timestep_s=0.001",
        "time_step": "a smaller step, more iterations of SolverVBD: "
        "--simulator-set timestep_s=0.001,sweeps=20",
        "lost_contact": "a larger soft_contact_gap, a smaller step",
    }

    def __init__(self, model: Model, options: RenderOptions, friction: float) -> None:
        self._newton: Any = importlib.import_module("newton")
        self._warp: Any = importlib.import_module("warp")
        self._warp.config.log_level = self._warp.LOG_WARNING
        super().__init__(model, options, friction)

    def scene(self, mesh: TetMesh, radius_m: float) -> _NewtonScene:
        return _NewtonScene(self._newton, self._warp, mesh, self.own, self.stated, radius_m)

    def touch(self, scene: _NewtonScene, tip: np.ndarray) -> World:
        return _NewtonTouch(scene, tip)


class _NewtonScene:
    """A model with its solver; the sphere's radius is less by the skin that is around the object."""

    def __init__(
        self,
        newton: Any,
        warp: Any,
        mesh: TetMesh,
        own: NewtonSettings,
        given: dict[str, float],
        radius_m: float,
    ) -> None:
        young, nu, mu = given["young_modulus_pa"], given["poisson_ratio"], given["friction"]
        stiff = own.contact_n_per_m
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        hard = newton.ModelBuilder.ShapeConfig(ke=stiff, kd=0.0, mu=mu)
        sphere = builder.add_body(is_kinematic=True)
        builder.add_shape_sphere(sphere, radius=radius_m - own.skin_m, cfg=hard)
        builder.add_soft_mesh(
            pos=warp.vec3(0.0), rot=warp.quat_identity(), scale=1.0, vel=warp.vec3(0.0),
            density=DENSITY_KG_M3, particle_radius=own.skin_m, indices=mesh.tetrahedra.ravel().tolist(),
            vertices=[warp.vec3(*point) for point in mesh.points.tolist()], k_mu=young / (2 + 2 * nu),
            k_lambda=young * nu / ((1 + nu) * (1 - 2 * nu)), k_damp=own.damping_s,
        )  # fmt: skip
        for node in np.flatnonzero(mesh.fixed):
            builder.particle_mass[node] = 0.0
        builder.color()
        self.model, self.timestep_s = builder.finalize(device="cpu"), own.timestep_s
        self.model.soft_contact_ke, self.model.soft_contact_kd = stiff, 0.0
        self.model.soft_contact_mu = mu
        self.collisions = newton.CollisionPipeline(
            self.model, soft_contact_gap=0.002, enable_rigid_soft_full_surface_contact=True
        )
        self.contacts = self.collisions.contacts()
        self.solver = newton.solvers.SolverVBD(
            self.model, iterations=round(own.sweeps), integrate_with_external_rigid_solver=True,
            particle_enable_tile_solve=False,
        )  # fmt: skip
        self.seen = self.solver.observables({"contact_f"}, contacts=self.contacts)


class _NewtonTouch(SteppedWorld):
    """One touch: two states that take turns."""

    def __init__(self, scene: _NewtonScene, tip: np.ndarray) -> None:
        super().__init__(tip, scene.timestep_s)
        self._scene, self._now, self._then = scene, scene.model.state(), scene.model.state()

    def advance(self, tip: np.ndarray, velocity: np.ndarray) -> None:
        scene = self._scene
        was, pose = (
            np.array([[*place, 0.0, 0.0, 0.0, 1.0]], np.float32)
            for place in (tip - velocity * self._timestep_s, tip)
        )
        self._now.body_q.assign(pose)
        self._now.clear_forces()
        scene.collisions.collide(self._now, scene.contacts)
        # friction sees how the sphere moves by the poses of the two states
        self._now.body_q.assign(was)
        self._then.body_q.assign(pose)
        scene.solver.step(
            self._now, self._then, None, scene.contacts, self._timestep_s, observables=scene.seen
        )
        self._now, self._then = self._then, self._now

    def force(self) -> np.ndarray:
        scene = self._scene
        found = scene.seen.contact_f.numpy()[scene.contacts.rigid_contact_max :, :3].sum(axis=0)
        return np.asarray(found, dtype=float)


def create(name: str, model: Model, options: RenderOptions, progress: Progress = silent) -> Renderer:
    """The renderer; raises OptionError where Newton is not installed."""
    return made(Newton, model, options)
