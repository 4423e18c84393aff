"""SOFA (SofaPython3), UNTESTED: SOFA was not to be had where this was written. Linear tetrahedra, base fixed,
spheres as force fields that know no friction; their force is read from where the nodes are.
"""

import sys

import numpy as np
import Sofa
from kit_files import run, stepped

STEP_S, DENSITY_KG_M3, RAYLEIGH = 1e-3, 1000.0, 1e-3
PENALTY = 30.0  # of a node, N/m over modulus times radius: stiff beside the body
PLUGINS = ("Constraint.Projective", "LinearSolver.Direct", "Mass", "MechanicalLoad", "ODESolver.Backward",
           "SolidMechanics.FEM.Elastic", "StateContainer", "Topology.Container.Dynamic")  # fmt: skip


def scene(body, physics, count):
    """(root, the body's state, the spheres)."""
    points, tetrahedra = body["points"], body["tetrahedra"].astype(int)
    corner = points[tetrahedra]
    volume = float(np.abs(np.linalg.det(corner[:, 1:] - corner[:, :1])).sum()) / 6
    root = Sofa.Core.Node("root")
    root.gravity, root.dt = [0.0, 0.0, 0.0], STEP_S
    for name in PLUGINS:
        root.addObject("RequiredPlugin", name=f"Sofa.Component.{name}")
    root.addObject("DefaultAnimationLoop")
    soft = root.addChild("body")
    soft.addObject("EulerImplicitSolver", rayleighStiffness=RAYLEIGH, rayleighMass=0.0)
    soft.addObject("SparseLDLSolver", template="CompressedRowSparseMatrixMat3x3d")
    soft.addObject(
        "TetrahedronSetTopologyContainer", name="topology",
        position=points.tolist(), tetrahedra=tetrahedra.tolist(),
    )  # fmt: skip
    soft.addObject("TetrahedronSetGeometryAlgorithms", template="Vec3d")
    state = soft.addObject("MechanicalObject", template="Vec3d", position="@topology.position")
    soft.addObject("MeshMatrixMass", totalMass=DENSITY_KG_M3 * volume, topology="@topology")
    soft.addObject(
        "TetrahedronFEMForceField", template="Vec3d", method="large", topology="@topology",
        youngModulus=physics["young_modulus_pa"], poissonRatio=physics["poisson_ratio"],
    )  # fmt: skip
    soft.addObject("FixedProjectiveConstraint", indices=body["fixed"].astype(int).tolist())
    radius = physics["tip_radius_m"]
    tips = [
        soft.addObject(
            "SphereForceField", name=f"tip{k}", template="Vec3d", radius=radius, damping=0.0,
            stiffness=PENALTY * physics["young_modulus_pa"] * radius, center=[0.0, 0.0, 1.0],
        )
        for k in range(count)
    ]  # fmt: skip
    Sofa.Simulation.init(root)
    return root, state, tips


def press(body, physics, t, centres):
    """(n, tips, 3) N."""
    root, state, tips = scene(body, physics, centres.shape[1])
    radius = physics["tip_radius_m"]
    stiffness = PENALTY * physics["young_modulus_pa"] * radius

    def advance(at, velocity):
        for tip, place in zip(tips, at, strict=True):
            tip.center.value = place.tolist()
        Sofa.Simulation.animate(root, STEP_S)
        away = at[:, None] - np.asarray(state.position.value)
        distance = np.linalg.norm(away, axis=2, keepdims=True)
        return (stiffness * np.maximum(radius - distance, 0.0) * away / distance).sum(axis=1)

    return stepped(t, centres, STEP_S, advance)


if __name__ == "__main__":
    sys.exit(run(press))
