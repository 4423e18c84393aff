"""Drake: a deformable body of the kit's tetrahedra behind a wall condition, rigid spheres moved by hand."""

import sys

import numpy as np
import pydrake.geometry as geometry
import pydrake.multibody.plant as plants
from kit_files import run, stepped
from pydrake.common import MemoryFile
from pydrake.math import RigidTransform
from pydrake.multibody.fem import DeformableBodyConfig, MaterialModel
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

STEP_S, DAMPING_S, RELAXATION_S, SPHERE, HEAVY_KG = 1e-3, 4e-3, 0.1, 0.15, 1e6


def vtk(body):
    """A legacy VTK file, as Drake reads them."""
    tets, points = body["tetrahedra"].astype(int), body["points"]
    lines = ["# vtk DataFile Version 3.0", "body", "ASCII", "DATASET UNSTRUCTURED_GRID"]
    lines += [f"POINTS {len(points)} double", *(f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in points)]
    lines += [f"CELLS {len(tets)} {5 * len(tets)}", *("4 " + " ".join(map(str, row)) for row in tets)]
    return "\n".join([*lines, f"CELL_TYPES {len(tets)}", *["10"] * len(tets)]) + "\n"


def press(body, physics, t, centres):
    """(n, tips, 3) N."""
    builder, radius = DiagramBuilder(), physics["tip_radius_m"]
    plant, _ = plants.AddMultibodyPlantSceneGraph(builder, STEP_S)
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.set_discrete_contact_approximation(plants.DiscreteContactApproximation.kSap)
    rigid, soft = geometry.ProximityProperties(), geometry.ProximityProperties()
    for properties in (rigid, soft):
        mu = plants.CoulombFriction(physics["friction"], physics["friction"])
        geometry.AddContactMaterial(properties=properties, friction=mu)
        properties.AddProperty("material", "relaxation_time", 0.5 * RELAXATION_S)
    geometry.AddRigidHydroelasticProperties(SPHERE * radius, rigid)
    heavy, ball = SpatialInertia.SolidSphereWithMass(HEAVY_KG, radius), geometry.Sphere(radius)
    tips = [plant.AddRigidBody(f"tip{k}", heavy) for k in range(centres.shape[1])]
    for tip in tips:
        plant.RegisterCollisionGeometry(tip, RigidTransform(), ball, tip.name(), rigid)
    config = DeformableBodyConfig()
    config.set_youngs_modulus(physics["young_modulus_pa"])
    config.set_poissons_ratio(physics["poisson_ratio"])
    config.set_mass_density(1000.0)
    config.set_stiffness_damping_coefficient(DAMPING_S)
    config.set_material_model(MaterialModel.kLinearCorotated)
    mesh = geometry.Mesh(geometry.InMemoryMesh(mesh_file=MemoryFile(vtk(body), ".vtk", "body.vtk")))
    shape = geometry.GeometryInstance(RigidTransform(), mesh, "body")
    shape.set_proximity_properties(soft)
    bodies, over_base = plant.deformable_model(), np.array([0.0, 0.0, 1e-6])
    made = bodies.RegisterDeformableBody(shape, config, 1.0)
    bodies.SetWallBoundaryCondition(made, over_base, np.array(physics["up"]))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    own = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())

    def advance(at, velocity):
        for tip, place, speed in zip(tips, at - velocity * STEP_S, velocity, strict=True):
            plant.SetFreeBodyPose(own, tip, RigidTransform(place))
            moves = SpatialVelocity(np.zeros(3), speed)
            plant.SetFreeBodySpatialVelocity(context=own, body=tip, V_JpJc=moves)
        simulator.AdvanceTo(simulator.get_context().get_time() + STEP_S)
        seen, total = plant.get_contact_results_output_port().Eval(own), np.zeros(centres.shape[1:])
        for k in range(seen.num_deformable_contacts()):
            info = seen.deformable_contact_info(k)
            # of the body, which is always the first; the nearest sphere is the other
            near = np.argmin(np.linalg.norm(at - info.contact_mesh().vertex(0), axis=1))
            total[near] -= info.F_Ac_W().translational()
        return total

    return stepped(t, centres, STEP_S, advance)


if __name__ == "__main__":
    sys.exit(run(press))
