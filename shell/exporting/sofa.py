"""SOFA: one XML scene with nodes and tetrahedra in it, base fixed, pressed by a sphere's force field."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.exporting.subject import DENSITY_KG_M3, Subject

_PLUGINS = (
    "Constraint.Projective", "LinearSolver.Iterative", "Mass", "MechanicalLoad", "ODESolver.Backward",
    "SolidMechanics.FEM.Elastic", "StateContainer", "Topology.Container.Dynamic", "Visual",
)  # fmt: skip


def write(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the scene; what it cannot say."""
    mesh = subject.mesh.linear()
    model = subject.model
    moduli = subject.element_modulus_pa
    young = f"{moduli[0]:.6g}" if np.ptp(moduli) < 1e-9 * moduli[0] else _row(moduli)
    # stiff beside the object: a node's share of the contact gives a hundredth of the depth
    stiffness = 100 * model.material.young_modulus_pa * subject.radius_m
    plugins = "\n".join(f'  <RequiredPlugin name="Sofa.Component.{name}"/>' for name in _PLUGINS)
    path.write_text(
        f"""<?xml version="1.0"?>
<!-- {subject.label} -->
<Node name="root" dt="0.01" gravity="0 0 0">
{plugins}
  <VisualStyle displayFlags="showForceFields showBehaviorModels"/>
  <DefaultAnimationLoop/>
  <Node name="object">
    <EulerImplicitSolver rayleighStiffness="0.01" rayleighMass="0.1"/>
    <CGLinearSolver iterations="200" tolerance="1e-9" threshold="1e-9"/>
    <TetrahedronSetTopologyContainer name="topology" position="{_row(mesh.points.ravel())}"
     tetrahedra="{" ".join(map(str, mesh.tetrahedra.ravel()))}"/>
    <TetrahedronSetGeometryAlgorithms template="Vec3"/>
    <MechanicalObject name="state" template="Vec3" position="@topology.position"/>
    <MeshMatrixMass totalMass="{DENSITY_KG_M3 * float(mesh.volumes.sum()):.6g}" topology="@topology"/>
    <TetrahedronFEMForceField template="Vec3" method="large" topology="@topology" computeGlobalMatrix="false"
     poissonRatio="{model.material.poisson_ratio:.6g}" youngModulus="{young}"/>
    <FixedProjectiveConstraint indices="{" ".join(map(str, np.flatnonzero(mesh.fixed)))}"/>
    <SphereForceField name="tip" template="Vec3" center="{_row(subject.pressed)}"
    radius="{subject.radius_m:.6g}"
     stiffness="{stiffness:.6g}" damping="0.1"/>
  </Node>
</Node>
""",
        encoding="utf-8",
    )
    return (
        "linear tetrahedra, which come out stiffer than the model near nu = 0.5",
        "the tip is a penalty sphere at its pressed place: it stands there from the first step",
    )


def _row(values: np.ndarray) -> str:
    return " ".join(f"{value:.9g}" for value in values)
