"""OpenUSD, as text: a TetMesh that is a volume deformable with its material, its base held by an attachment
to a kinematic body, and the tip as a kinematic sphere above its top.

Names follow the proposal of deformable physics for OpenUSD (pull request 111 of OpenUSD-proposals) in the
revision that Newton's importer follows (`REVISION`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.exporting.subject import DENSITY_KG_M3, Subject

_SIMULATED = '["PhysicsVolumeDeformableSimAPI", "PhysicsCollisionAPI", "MaterialBindingAPI"]'
REVISION = "63c74d79aa67dc98d8707af8ad68f2e1a10622b5"


def write(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the stage (.usda); what it cannot say."""
    path.write_text(_stage(subject), encoding="utf-8")
    notes = ["linear tetrahedra, which come out stiffer than the model near nu = 0.5", subject.friction_note]
    if np.ptp(subject.model.element_ratio) > 1e-9:
        notes.append("a material has one modulus: the mean by volume")
    return tuple(notes)


def _stage(subject: Subject) -> str:
    mesh = subject.mesh.linear()
    held = np.flatnonzero(mesh.fixed)
    material = subject.model.material
    return f'''#usda 1.0
(
    defaultPrim = "World"
    doc = """{subject.label}; deformables by OpenUSD-proposals 111, {REVISION}"""
    kilogramsPerUnit = 1
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "World"
{{
    def PhysicsScene "Physics"
    {{
        vector3f physics:gravityDirection = (0, 0, -1)
        float physics:gravityMagnitude = 0
    }}

    def Material "Soft" (
        prepend apiSchemas = ["PhysicsMaterialAPI", "PhysicsVolumeDeformableMaterialAPI"]
    )
    {{
        float physics:density = {DENSITY_KG_M3:g}
        float physics:dynamicFriction = {subject.friction:g}
        float physics:poissonsRatio = {material.poisson_ratio:.6g}
        float physics:staticFriction = {subject.friction:g}
        float physics:youngsModulus = {subject.mean_modulus_pa:.8g}
    }}

    def Xform "Object" (
        prepend apiSchemas = ["PhysicsDeformableBodyAPI"]
    )
    {{
        def TetMesh "Mesh" (
            prepend apiSchemas = {_SIMULATED}
        )
        {{
            rel material:binding:physics = </World/Soft>
            point3f[] points = {_rows(mesh.points)}
            int3[] surfaceFaceVertexIndices = {_rows(mesh.surface)}
            int4[] tetVertexIndices = {_rows(mesh.tetrahedra)}
        }}
    }}

    def Xform "Base" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI"]
    )
    {{
        bool physics:kinematicEnabled = 1
    }}

    def PhysicsAttachment "Held"
    {{
        rel physics:src0 = </World/Object/Mesh>
        rel physics:src1 = </World/Base>
        token physics:type0 = "point"
        token physics:type1 = "xform"
        int[] physics:indices0 = [{", ".join(map(str, held))}]
        point3f[] physics:coords1 = {_rows(mesh.points[held])}
    }}

    def Sphere "Tip" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsCollisionAPI", "MaterialBindingAPI"]
    )
    {{
        rel material:binding:physics = </World/Soft>
        bool physics:kinematicEnabled = 1
        double radius = {subject.radius_m:.9g}
        double3 xformOp:translate = {_row(subject.start)}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
}}
'''


def _row(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.9g}" for value in values) + ")"


def _rows(values: np.ndarray) -> str:
    return "[" + ", ".join(map(_row, values)) + "]"
