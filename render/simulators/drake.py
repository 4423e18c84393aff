"""Drake: a deformable body of linear tetrahedra, its base behind a wall condition, and a rigid sphere that is
moved by hand between the steps of its SAP solver.

documented: the step, damping and coarse sphere of its deformable example, on the model's own mesh. best:
edges of a third of the tip's radius under it, a finely meshed sphere, a tenth of the step, 4 ms of damping:
with 1 ms the body rings, and contact is lost in a fifth of the samples (6 % with 4; the same force at rest).
What limits it is the mesh under the tip: with edges of half the radius a shallow press was a sixth harder.
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

DENSITY_KG_M3 = 1000.0
HEAVY_KG = 1e6
"""Of the sphere, whose pose and velocity are set at every step: the object does not move it within one."""


@dataclass(frozen=True)
class DrakeSettings:
    """timestep_s; damping_s: stiffness damping of the object; sphere_radii: edges of the sphere's mesh, in
    its radii; edge_radii: edges of the object under the tip, in its radii, inf as the model has them;
    relaxation_s: of the contact, as SAP has it; inf: as documented."""

    timestep_s: float
    damping_s: float
    sphere_radii: float
    edge_radii: float = np.inf
    relaxation_s: float = np.inf


SETTINGS = {DOCUMENTED: DrakeSettings(1e-2, 1e-2, 1.0), BEST: DrakeSettings(1e-3, 4e-3, 0.15, 0.35, 0.1)}


def vtk_text(mesh: TetMesh) -> str:
    """A legacy VTK file of linear tetrahedra, as Drake reads them."""
    points = "\n".join(f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.points)
    cells = "\n".join("4 " + " ".join(map(str, row)) for row in mesh.tetrahedra)
    count = len(mesh.tetrahedra)
    kinds = "\n".join(["10"] * count)
    return (
        "# vtk DataFile Version 3.0\nobject\nASCII\nDATASET UNSTRUCTURED_GRID\n"
        f"POINTS {len(mesh.points)} double\n{points}\nCELLS {count} {5 * count}\n{cells}\n"
        f"CELL_TYPES {count}\n{kinds}\n"
    )


class Drake(SteppedAdapter):
    """The adapter."""

    name, extra, units = "drake", "drake", "SI: m, kg, s, N, Pa"
    settings = SETTINGS
    presses = 12
    cannot = (
        "linear tetrahedra alone, which lock near Poisson's ratio 0.5",
        "one modulus a body",
        "a tip without facets: the sphere is a mesh",
        "no tip that sticks for ever: friction is a number",
    )
    advice = {
        "contact_nodes": "refine the body's mesh under the tip, and the sphere's resolution_hint: "
        "--simulator-settings best",
        "contact_offset": "a smaller resolution_hint of the sphere, whose facets lie inside it: "
        "--simulator-set sphere_radii=0.15",
        "mesh_stiffness": "refine the body's mesh, and take a Poisson's ratio of 0.45 or below",
        "numerical_damping": "lower stiffness_damping_coefficient and the plant's time_step: "
        "--simulator-set damping_s=0.004,timestep_s=0.001",
        "time_step": "a smaller time_step of the plant: --simulator-set timestep_s=0.001",
        "lost_contact": "a smaller time_step, or more stiffness_damping_coefficient, where the body rings",
    }

    def __init__(self, model: Model, options: RenderOptions, friction: float) -> None:
        import pydrake  # noqa: F401

        super().__init__(model, options, friction)

    def scene(self, mesh: TetMesh, radius_m: float) -> _DrakeScene:
        return _DrakeScene(mesh, self.model, self.own, self.stated, radius_m)

    def touch(self, scene: _DrakeScene, tip: np.ndarray) -> World:
        return _DrakeTouch(scene, tip)


class _DrakeScene:
    """A diagram with the body at rest; every touch has a context of its own."""

    def __init__(
        self, mesh: TetMesh, model: Model, own: DrakeSettings, given: dict[str, float], radius_m: float
    ) -> None:
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
        from pydrake.multibody.plant import (
            AddMultibodyPlantSceneGraph,
            CoulombFriction,
            DiscreteContactApproximation,
        )
        from pydrake.multibody.tree import SpatialInertia
        from pydrake.systems.framework import DiagramBuilder

        builder: Any = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, own.timestep_s)
        self.plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
        friction = CoulombFriction(given["friction"], given["friction"])
        rigid, soft = ProximityProperties(), ProximityProperties()
        if np.isfinite(own.relaxation_s):
            self.plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
        for properties in (rigid, soft):
            AddContactMaterial(properties=properties, friction=friction)
            if np.isfinite(own.relaxation_s):
                properties.AddProperty("material", "relaxation_time", 0.5 * own.relaxation_s)
        AddRigidHydroelasticProperties(own.sphere_radii * radius_m, rigid)
        heavy = SpatialInertia.SolidSphereWithMass(HEAVY_KG, radius_m)
        self.tip = self.plant.AddRigidBody("tip", heavy)
        self.plant.RegisterCollisionGeometry(self.tip, RigidTransform(), Sphere(radius_m), "tip", rigid)
        config: Any = DeformableBodyConfig()
        config.set_youngs_modulus(given["young_modulus_pa"])
        config.set_poissons_ratio(given["poisson_ratio"])
        config.set_mass_density(DENSITY_KG_M3)
        config.set_mass_damping_coefficient(0.0)
        config.set_stiffness_damping_coefficient(own.damping_s)
        config.set_material_model(MaterialModel.kLinearCorotated)
        file = InMemoryMesh(mesh_file=MemoryFile(vtk_text(mesh), ".vtk", "object.vtk"))
        shape = GeometryInstance(RigidTransform(), Mesh(file), "object")
        shape.set_proximity_properties(soft)
        bodies = self.plant.deformable_model()
        body = bodies.RegisterDeformableBody(shape, config, 1.0)
        up = model.support.normal
        highest = mesh.points[mesh.fixed][np.argmax(mesh.points[mesh.fixed] @ up)]
        bodies.SetWallBoundaryCondition(body, highest + 1e-6 * up, up)
        self.plant.Finalize()
        self.diagram, self.timestep_s = builder.Build(), own.timestep_s


class _DrakeTouch(SteppedWorld):
    """One touch: the sphere is set to where it was, with the velocity that leads it to where it shall be."""

    def __init__(self, scene: _DrakeScene, tip: np.ndarray) -> None:
        from pydrake.systems.analysis import Simulator

        super().__init__(tip, scene.timestep_s)
        self._scene = scene
        self._simulator: Any = Simulator(scene.diagram)
        self._own = scene.plant.GetMyMutableContextFromRoot(self._simulator.get_mutable_context())
        self._set(self._tip, np.zeros(3))
        self._simulator.Initialize()

    def _set(self, tip: np.ndarray, velocity: np.ndarray) -> None:
        from pydrake.math import RigidTransform
        from pydrake.multibody.math import SpatialVelocity

        plant, body = self._scene.plant, self._scene.tip
        plant.SetFreeBodyPose(self._own, body, RigidTransform(tip))
        plant.SetFreeBodySpatialVelocity(
            context=self._own, body=body, V_JpJc=SpatialVelocity(np.zeros(3), velocity)
        )

    def advance(self, tip: np.ndarray, velocity: np.ndarray) -> None:
        self._set(tip - velocity * self._timestep_s, velocity)
        context = self._simulator.get_context()
        self._simulator.AdvanceTo(context.get_time() + self._timestep_s)

    def force(self) -> np.ndarray:
        seen = self._scene.plant.get_contact_results_output_port().Eval(self._own)
        total = np.zeros(3)
        for k in range(seen.num_deformable_contacts()):
            # of the object, which is always the first of the two
            total -= seen.deformable_contact_info(k).F_Ac_W().translational()
        return total


def create(name: str, model: Model, options: RenderOptions, progress: Progress = silent) -> Renderer:
    """The renderer; raises OptionError where Drake is not installed."""
    return made(Drake, model, options)
