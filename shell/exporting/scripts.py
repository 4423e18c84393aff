"""Scripts that build the object and press it, one file each: for Newton and for Drake. They print the tip's
way in, m, and the force on it, N."""

from __future__ import annotations

from pathlib import Path
from string import Template

import numpy as np

from palpate.exporting.subject import DENSITY_KG_M3, Subject
from palpate.render.simulators.drake import vtk_text

_HEAD = Template("""# $label
# $how
import numpy as np

YOUNG_PA, POISSON, DENSITY_KG_M3, FRICTION = $young, $poisson, $density, $friction
RADIUS_M = $radius
START, PRESSED, NORMAL = np.array($start), np.array($pressed), np.array($normal)
STEP_S, STEPS = 0.001, 400
""")

_NEWTON = Template("""import newton
import warp as wp

POINTS = np.array($points).reshape(-1, 3)
TETRAHEDRA = $tetrahedra
FIXED = $fixed
SKIN_M, CONTACT_N_PER_M, SWEEPS = 1e-4, 10 * YOUNG_PA * RADIUS_M, 20

builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
tip = builder.add_body(is_kinematic=True)
hard = newton.ModelBuilder.ShapeConfig(ke=CONTACT_N_PER_M, kd=0.0, mu=FRICTION)
builder.add_shape_sphere(tip, radius=RADIUS_M - SKIN_M, cfg=hard)
builder.add_soft_mesh(
    pos=wp.vec3(0.0), rot=wp.quat_identity(), scale=1.0, vel=wp.vec3(0.0), density=DENSITY_KG_M3,
    particle_radius=SKIN_M, vertices=[wp.vec3(*p) for p in POINTS.tolist()], indices=TETRAHEDRA,
    k_mu=YOUNG_PA / (2 + 2 * POISSON), k_damp=1e-9,
    k_lambda=YOUNG_PA * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)),
)
for node in FIXED:
    builder.particle_mass[node] = 0.0
builder.color()
model = builder.finalize(device="cpu")
model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_mu = CONTACT_N_PER_M, 0.0, FRICTION
collisions = newton.CollisionPipeline(
    model, soft_contact_gap=0.002, enable_rigid_soft_full_surface_contact=True
)
contacts = collisions.contacts()
solver = newton.solvers.SolverVBD(
    model, iterations=SWEEPS, integrate_with_external_rigid_solver=True, particle_enable_tile_solve=False
)
seen = solver.observables({"contact_f"}, contacts=contacts)
now, then = model.state(), model.state()
for k in range(STEPS):
    at = START + (PRESSED - START) * min(1.0, 2 * (k + 1) / STEPS)
    for state in (now, then):
        state.body_q.assign(np.array([[*at, 0.0, 0.0, 0.0, 1.0]], np.float32))
    now.clear_forces()
    collisions.collide(now, contacts)
    solver.step(now, then, None, contacts, STEP_S, observables=seen)
    now, then = then, now
    if (k + 1) % 20 == 0:
        force = seen.contact_f.numpy()[contacts.rigid_contact_max :, :3].sum(axis=0)
        print(f"{float((START - at) @ NORMAL):.6f} {float(force @ NORMAL):.6f}")
""")

_DRAKE = Template('''from pydrake.common import MemoryFile
from pydrake.geometry import (
    AddContactMaterial, AddRigidHydroelasticProperties, GeometryInstance, InMemoryMesh, Mesh,
    ProximityProperties, Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.fem import DeformableBodyConfig
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

MESH = """$vtk"""
BASE = np.array($base)
UP = np.array($up)
DAMPING_S = 0.001

builder = DiagramBuilder()
plant, _ = AddMultibodyPlantSceneGraph(builder, STEP_S)
plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
friction = CoulombFriction(FRICTION, FRICTION)
rigid, soft = ProximityProperties(), ProximityProperties()
AddContactMaterial(properties=rigid, friction=friction)
AddContactMaterial(properties=soft, friction=friction)
AddRigidHydroelasticProperties(0.15 * RADIUS_M, rigid)
tip = plant.AddRigidBody("tip", SpatialInertia.SolidSphereWithMass(1e6, RADIUS_M))
plant.RegisterCollisionGeometry(tip, RigidTransform(), Sphere(RADIUS_M), "tip", rigid)
config = DeformableBodyConfig()
config.set_youngs_modulus(YOUNG_PA)
config.set_poissons_ratio(POISSON)
config.set_mass_density(DENSITY_KG_M3)
config.set_stiffness_damping_coefficient(DAMPING_S)
mesh = Mesh(InMemoryMesh(mesh_file=MemoryFile(MESH, ".vtk", "object.vtk")))
shape = GeometryInstance(RigidTransform(), mesh, "object")
shape.set_proximity_properties(soft)
bodies = plant.deformable_model()
bodies.SetWallBoundaryCondition(bodies.RegisterDeformableBody(shape, config, 1.0), BASE, UP)
plant.Finalize()
simulator = Simulator(builder.Build())
context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
last = START
plant.SetFreeBodyPose(context, tip, RigidTransform(START))
simulator.Initialize()
for k in range(STEPS):
    at = START + (PRESSED - START) * min(1.0, 2 * (k + 1) / STEPS)
    plant.SetFreeBodyPose(context, tip, RigidTransform(last))
    speed = SpatialVelocity(np.zeros(3), (at - last) / STEP_S)
    plant.SetFreeBodySpatialVelocity(context=context, body=tip, V_JpJc=speed)
    simulator.AdvanceTo((k + 1) * STEP_S)
    last = at
    if (k + 1) % 20 == 0:
        found = plant.get_contact_results_output_port().Eval(context)
        pushes = [
            found.deformable_contact_info(i).F_Ac_W().translational()
            for i in range(found.num_deformable_contacts())
        ]
        force = -np.sum([np.zeros(3), *pushes], axis=0)
        print(f"{float((START - at) @ NORMAL):.6f} {float(force @ NORMAL):.6f}")
''')


def write_newton(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the script for Newton; what it cannot say."""
    mesh = subject.graded()
    body = _NEWTON.substitute(
        points=_list(mesh.points.ravel()),
        tetrahedra=_list(mesh.tetrahedra.ravel()),
        fixed=_list(np.flatnonzero(mesh.fixed)),
    )
    path.write_text(_head(subject, "pip install newton; python FILE", _NU) + body, encoding="utf-8")
    return (*_notes(subject, _NU), "its contact gives: a spring of 10 E R each, as far as it converges")


def write_drake(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the script for Drake; what it cannot say."""
    mesh, up = subject.graded(), subject.model.support.normal
    base = mesh.points[mesh.fixed]
    body = _DRAKE.substitute(
        vtk=vtk_text(mesh), up=_list(up), base=_list(base[np.argmax(base @ up)] + 1e-6 * up)
    )
    path.write_text(_head(subject, "pip install drake; python FILE", 0.4999) + body, encoding="utf-8")
    return _notes(subject, 0.4999)


_NU = 0.45
"""Beyond it Newton's sweeps do not converge."""


def _head(subject: Subject, how: str, most: float) -> str:
    return _HEAD.substitute(
        label=subject.label,
        how=how,
        young=f"{subject.mean_modulus_pa:.8g}",
        poisson=f"{min(subject.model.material.poisson_ratio, most):g}",
        density=f"{DENSITY_KG_M3:g}",
        friction=f"{subject.friction:g}",
        radius=f"{subject.radius_m:.9g}",
        start=_list(subject.start),
        pressed=_list(subject.pressed),
        normal=_list(subject.normal),
    )


def _notes(subject: Subject, most: float) -> tuple[str, ...]:
    notes = ["linear tetrahedra, which come out stiffer than the model near nu = 0.5", subject.friction_note]
    if subject.model.material.poisson_ratio > most:
        notes.append(f"Poisson's ratio is {most:g} there, beyond which it does not converge")
    if np.ptp(subject.model.element_ratio) > 1e-9:
        notes.append("one modulus: the mean by volume")
    return tuple(notes)


def _list(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.9g}" for value in values) + "]"
