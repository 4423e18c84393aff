"""Newton's scene: a soft mesh whose base has no mass (which holds it), and a kinematic sphere.

`palpate replay --renderer newton` runs this file; `palpate export --to newton` writes it into a script.
"""

import newton
import numpy as np
import warp

warp.config.log_level = warp.LOG_WARNING


class Scene:
    """A model with its solver; the sphere's radius is less by the skin that is around the object."""

    def __init__(
        self,
        points: np.ndarray,
        tetrahedra: np.ndarray,
        fixed: np.ndarray,
        up: np.ndarray,
        *,
        radius_m: float,
        young_modulus_pa: float,
        poisson_ratio: float,
        friction: float,
        timestep_s: float,
        sweeps: float,
        contact_n_per_m: float,
        skin_m: float,
        damping_s: float,
        density_kg_m3: float,
    ) -> None:
        young, nu = young_modulus_pa, poisson_ratio
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        hard = newton.ModelBuilder.ShapeConfig(ke=contact_n_per_m, kd=0.0, mu=friction)
        sphere = builder.add_body(is_kinematic=True)
        builder.add_shape_sphere(sphere, radius=radius_m - skin_m, cfg=hard)
        builder.add_soft_mesh(
            pos=warp.vec3(0.0), rot=warp.quat_identity(), scale=1.0, vel=warp.vec3(0.0),
            density=density_kg_m3, particle_radius=skin_m, indices=tetrahedra.ravel().tolist(),
            vertices=[warp.vec3(*point) for point in points.tolist()], k_mu=young / (2 + 2 * nu),
            k_lambda=young * nu / ((1 + nu) * (1 - 2 * nu)), k_damp=damping_s,
        )  # fmt: skip
        for node in fixed:
            builder.particle_mass[node] = 0.0
        builder.color()
        self.model, self.timestep_s = builder.finalize(device="cpu"), timestep_s
        self.model.soft_contact_ke, self.model.soft_contact_kd = contact_n_per_m, 0.0
        self.model.soft_contact_mu = friction
        self.collisions = newton.CollisionPipeline(
            self.model, soft_contact_gap=0.002, enable_rigid_soft_full_surface_contact=True
        )
        self.contacts = self.collisions.contacts()
        self.solver = newton.solvers.SolverVBD(
            self.model, iterations=round(sweeps), integrate_with_external_rigid_solver=True,
            particle_enable_tile_solve=False,
        )  # fmt: skip
        self.seen = self.solver.observables({"contact_f"}, contacts=self.contacts)


class Touch:
    """One touch: two states that take turns."""

    def __init__(self, scene: Scene, tip: np.ndarray) -> None:
        self.scene, self.timestep_s = scene, scene.timestep_s
        self.now, self.then = scene.model.state(), scene.model.state()

    def advance(self, tip: np.ndarray, velocity: np.ndarray) -> None:
        """One step, at whose end the sphere's centre is there; (3,) m, (3,) m/s."""
        scene = self.scene
        was, pose = (
            np.array([[*place, 0.0, 0.0, 0.0, 1.0]], np.float32)
            for place in (tip - velocity * self.timestep_s, tip)
        )
        self.now.body_q.assign(pose)
        self.now.clear_forces()
        scene.collisions.collide(self.now, scene.contacts)
        # friction sees how the sphere moves by the poses of the two states
        self.now.body_q.assign(was)
        self.then.body_q.assign(pose)
        scene.solver.step(self.now, self.then, None, scene.contacts, self.timestep_s, observables=scene.seen)
        self.now, self.then = self.then, self.now

    def force(self) -> np.ndarray:
        """(3,) N on the sphere after the last step."""
        scene = self.scene
        found = scene.seen.contact_f.numpy()[scene.contacts.rigid_contact_max :, :3].sum(axis=0)
        return np.asarray(found, dtype=float)
