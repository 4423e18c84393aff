"""Newton: a soft mesh of the kit's tetrahedra in vertex block descent, its base held, kinematic spheres."""

import sys

import newton
import numpy as np
import warp
from kit_files import run, stepped

STEP_S, SWEEPS, CONTACT_N_PER_M, SKIN_M, DENSITY_KG_M3 = 1e-3, 20, 3e2, 1e-4, 1000.0
warp.config.log_level = warp.LOG_WARNING


def scene(body, physics, count):
    """The model, its shapes the spheres in their order: their radius is less by the skin around the body."""
    young, nu = physics["young_modulus_pa"], physics["poisson_ratio"]
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    hard = newton.ModelBuilder.ShapeConfig(ke=CONTACT_N_PER_M, kd=0.0, mu=physics["friction"])
    for _ in range(count):
        ball = builder.add_body(is_kinematic=True)
        builder.add_shape_sphere(ball, radius=physics["tip_radius_m"] - SKIN_M, cfg=hard)
    builder.add_soft_mesh(
        pos=warp.vec3(0.0), rot=warp.quat_identity(), scale=1.0, vel=warp.vec3(0.0), density=DENSITY_KG_M3,
        particle_radius=SKIN_M, indices=body["tetrahedra"].astype(int).ravel().tolist(),
        vertices=[warp.vec3(*point) for point in body["points"].tolist()], k_mu=young / (2 + 2 * nu),
        k_lambda=young * nu / ((1 + nu) * (1 - 2 * nu)), k_damp=1e-9,
    )  # fmt: skip
    for node in body["fixed"]:
        builder.particle_mass[int(node)] = 0.0
    builder.color()
    model = builder.finalize(device="cpu")
    model.soft_contact_ke, model.soft_contact_kd = CONTACT_N_PER_M, 0.0
    model.soft_contact_mu = physics["friction"]
    return model


def press(body, physics, t, centres):
    """(n, tips, 3) N."""
    count = centres.shape[1]
    model = scene(body, physics, count)
    collisions = newton.CollisionPipeline(
        model, soft_contact_gap=0.002, enable_rigid_soft_full_surface_contact=True
    )
    contacts = collisions.contacts()
    solver = newton.solvers.SolverVBD(
        model, iterations=SWEEPS, integrate_with_external_rigid_solver=True, particle_enable_tile_solve=False
    )
    seen = solver.observables({"contact_f"}, contacts=contacts)
    states = [model.state(), model.state()]

    def pose(at):
        return np.column_stack([at, np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))]).astype(np.float32)

    def advance(at, velocity):
        now, then = states
        now.body_q.assign(pose(at))
        now.clear_forces()
        collisions.collide(now, contacts)
        # friction sees how a sphere moves by the poses of the two states
        now.body_q.assign(pose(at - velocity * STEP_S))
        then.body_q.assign(pose(at))
        solver.step(now, then, None, contacts, STEP_S, observables=seen)
        states.reverse()
        on, force = contacts.soft_contact_shape.numpy(), seen.contact_f.numpy()
        force = force[contacts.rigid_contact_max :, :3]
        return np.array([force[on == ball].sum(axis=0, dtype=float) for ball in range(count)])

    return stepped(t, centres, STEP_S, advance)


if __name__ == "__main__":
    sys.exit(run(press))
