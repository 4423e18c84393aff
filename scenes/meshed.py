"""The model of a scene's shape: tetrahedra as small as it asks for and the machine affords, its presses."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.mechanics.compliance.sites import SURFACE_EDGE_M
from palpate.mechanics.errors import PalpateWarning
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.plausible import USUAL_TIP_RADIUS_M
from palpate.mechanics.progress import Progress
from palpate.mechanics.shape.flat_foot import Standing
from palpate.mechanics.shape.refine import typical_edge, typical_wall
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.scenes.scene import Scene
from palpate.scenes.virtual_presses import palpate_model, solver_of

MESH_SIZE_M, LEAST_EDGES, LEAST_ACROSS = 0.010, 8, 2
"""Edge length of the tetrahedra, and the least number of edges along an object and through its wall: one
across the 5 mm of a tube is 3 to 8 % too stiff, two lie within 1 % of three."""
_SIZES = 3
"""How many edge lengths are tried, each 1.3 times the one before, where the mesher takes too long."""


class CoarserMesh(PalpateWarning):
    """Tetrahedra are larger than what was asked for."""


def meshed(
    scene: Scene,
    stood: Standing,
    own: ObjectMaterial,
    provenance: dict[str, Any],
    progress: Progress,
    field: Callable[[TetMesh], np.ndarray] | None = None,
) -> Model:
    """The model of a shape that stands in its own frame; own: its material where the scene says nothing;
    field: (m,) modulus of a mesh's tetrahedra over the global one."""
    # here, and below: a model that is kept or shipped is opened without loading what makes one
    from palpate.reconstruction.shapes.drawing import decimated
    from palpate.reconstruction.steps.s4_surface import Surface
    from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions, mesh_surface
    from palpate.reconstruction.steps.s5_mesh.tetwild import (
        AFFORDABLE,
        AFFORDABLE_ASKED,
        MeshTooDear,
        affordable,
    )

    surface = Surface(
        vertices=stood.vertices,
        triangles=stood.triangles,
        uncertainty_m=np.zeros(len(stood.vertices)),
        support_point=stood.support_point,
        support_normal=stood.support_normal,
        method="known",
        reason="the shape is given",
        redraw=lambda edge_m: decimated(stood, edge_m),
        shape=TrueShape(stood.vertices, stood.triangles),
    )
    asked = scene.mesh_size_m or _usual_edge(stood)
    most = AFFORDABLE_ASKED if scene.mesh_size_m else AFFORDABLE
    edge = affordable(stood.vertices, stood.triangles, asked, most)
    for rest in reversed(range(_SIZES)):
        try:
            sized = MeshingOptions(mesh_size_m=edge)
            meshing = mesh_surface(surface, sized, lambda s, f: progress(s, 0.4 * f))
            break
        except MeshTooDear:
            if not rest:
                raise
            edge *= 1.3
    if edge > asked:
        warnings.warn(
            f"tetrahedra of {1e3 * asked:.3g} mm take too much memory or time for this object: "
            f"{1e3 * edge:.3g} mm are taken, --mesh-size {edge:.2g}",
            CoarserMesh,
            stacklevel=3,
        )
    mesh = meshing.mesh.quadratic()
    material = replace(
        own,
        field=field(mesh) if field else None,
        young_modulus_pa=scene.one_modulus_pa or own.young_modulus_pa,
        poisson_ratio=own.poisson_ratio if scene.poisson_ratio is None else scene.poisson_ratio,
        dent_law="neo-hookean" if scene.finite_strain else "linear",
    )
    model = Model(
        mesh=mesh,
        material=material,
        support=Support(surface.support_point, surface.support_normal),
        tool=Tool(scene.tip_radius_m or USUAL_TIP_RADIUS_M),
        mesh_size_m=edge,
        effects={"finite_strain": {}} if scene.finite_strain else {},
        provenance=provenance,
    )
    solver = solver_of(model)
    _tell_of_coarse_touches(typical_edge(solver.mesh))
    return palpate_model(model, lambda s, f: progress(s, 0.4 + 0.6 * f), solver=solver)


def _tell_of_coarse_touches(edge: float) -> None:
    """Warn where the surface of a large object, of edges of that length, m, is not halved to what a touch
    asks for."""
    if edge > SURFACE_EDGE_M:
        warnings.warn(
            f"the object is large: touches are solved on tetrahedra of {1e3 * edge:.2g} mm at its surface, "
            f"{1e3 * SURFACE_EDGE_M:g} mm on others: near a rim or the base forces may be 3 % off and "
            "more; cut out the part that is touched",
            CoarserMesh,
            stacklevel=4,
        )


def _usual_edge(stood: Standing) -> float:
    """Edge length, m, of the tetrahedra of a shape where none is asked for."""
    length = float(np.ptp(stood.vertices, axis=0).max())
    wall = typical_wall(stood.vertices, stood.triangles)
    return min(MESH_SIZE_M, length / LEAST_EDGES, wall / LEAST_ACROSS)
