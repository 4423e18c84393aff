"""Drake's scene: a deformable body on its base, and a rigid sphere that is moved by hand between the steps.

`palpate replay --renderer drake` runs this file; `palpate export --to drake` writes it into a script.
"""

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import (
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    GeometryInstance,
    InMemoryMesh,
    Mesh,
    ProximityProperties,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.fem import DeformableBodyConfig, MaterialModel
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiscreteContactApproximation,
)
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

HEAVY_KG = 1e6
"""Of the sphere, whose pose and velocity are set at every step: the object does not move it within one."""


class Scene:
    """A diagram with the body at rest; every touch has a context of its own."""

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
        damping_s: float,
        sphere_radii: float,
        relaxation_s: float,
        density_kg_m3: float,
    ) -> None:
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, timestep_s)
        self.plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
        coulomb = CoulombFriction(friction, friction)
        rigid, soft = ProximityProperties(), ProximityProperties()
        if np.isfinite(relaxation_s):
            self.plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
        for properties in (rigid, soft):
            AddContactMaterial(properties=properties, friction=coulomb)
            if np.isfinite(relaxation_s):
                properties.AddProperty("material", "relaxation_time", 0.5 * relaxation_s)
        AddRigidHydroelasticProperties(sphere_radii * radius_m, rigid)
        heavy = SpatialInertia.SolidSphereWithMass(HEAVY_KG, radius_m)
        self.tip = self.plant.AddRigidBody("tip", heavy)
        self.plant.RegisterCollisionGeometry(self.tip, RigidTransform(), Sphere(radius_m), "tip", rigid)
        config = DeformableBodyConfig()
        config.set_youngs_modulus(young_modulus_pa)
        config.set_poissons_ratio(poisson_ratio)
        config.set_mass_density(density_kg_m3)
        config.set_mass_damping_coefficient(0.0)
        config.set_stiffness_damping_coefficient(damping_s)
        config.set_material_model(MaterialModel.kLinearCorotated)
        file = InMemoryMesh(mesh_file=MemoryFile(vtk_text(points, tetrahedra), ".vtk", "object.vtk"))
        shape = GeometryInstance(RigidTransform(), Mesh(file), "object")
        shape.set_proximity_properties(soft)
        bodies = self.plant.deformable_model()
        body = bodies.RegisterDeformableBody(shape, config, 1.0)
        highest = points[fixed][np.argmax(points[fixed] @ up)]
        bodies.SetWallBoundaryCondition(body, highest + 1e-6 * up, up)
        self.plant.Finalize()
        self.diagram, self.timestep_s = builder.Build(), timestep_s


def vtk_text(points: np.ndarray, tetrahedra: np.ndarray) -> str:
    """A legacy VTK file of linear tetrahedra, as Drake reads them."""
    rows = "\n".join(f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in points)
    cells = "\n".join("4 " + " ".join(map(str, row)) for row in tetrahedra)
    count = len(tetrahedra)
    kinds = "\n".join(["10"] * count)
    return (
        "# vtk DataFile Version 3.0\nobject\nASCII\nDATASET UNSTRUCTURED_GRID\n"
        f"POINTS {len(points)} double\n{rows}\nCELLS {count} {5 * count}\n{cells}\n"
        f"CELL_TYPES {count}\n{kinds}\n"
    )


class Touch:
    """One touch: the sphere is set to where it was, with the velocity that leads it to where it shall be."""

    def __init__(self, scene: Scene, tip: np.ndarray) -> None:
        self.scene, self.timestep_s = scene, scene.timestep_s
        self.simulator = Simulator(scene.diagram)
        self.own = scene.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self._set(tip, np.zeros(3))
        self.simulator.Initialize()

    def _set(self, tip: np.ndarray, velocity: np.ndarray) -> None:
        plant, body = self.scene.plant, self.scene.tip
        plant.SetFreeBodyPose(self.own, body, RigidTransform(tip))
        plant.SetFreeBodySpatialVelocity(
            context=self.own, body=body, V_JpJc=SpatialVelocity(np.zeros(3), velocity)
        )

    def advance(self, tip: np.ndarray, velocity: np.ndarray) -> None:
        """One step, at whose end the sphere's centre is there; (3,) m, (3,) m/s."""
        self._set(tip - velocity * self.timestep_s, velocity)
        context = self.simulator.get_context()
        self.simulator.AdvanceTo(context.get_time() + self.timestep_s)

    def force(self) -> np.ndarray:
        """(3,) N on the sphere after the last step."""
        seen = self.scene.plant.get_contact_results_output_port().Eval(self.own)
        total = np.zeros(3)
        for k in range(seen.num_deformable_contacts()):
            # of the object, which is always the first of the two
            total -= seen.deformable_contact_info(k).F_Ac_W().translational()
        return total
