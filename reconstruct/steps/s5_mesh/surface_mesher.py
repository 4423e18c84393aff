"""fTetWild on the surface itself: a drawing of it no finer than the tetrahedra need."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from palpate.reconstruction.steps.s5_mesh.registry import Mesher
from palpate.reconstruction.steps.s5_mesh.tetwild import tetrahedralize

if TYPE_CHECKING:
    from palpate.reconstruction.steps.s4_surface import Surface
    from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions


def prepared(surface: Surface, options: MeshingOptions) -> Mesher:
    """As `registry.prepared`."""
    edge_m = options.mesh_size_m
    vertices, triangles = (
        (surface.vertices, surface.triangles) if surface.redraw is None else surface.redraw(edge_m)
    )
    # so narrow an envelope keeps volume and edges
    envelope_m = min(0.15 * options.surface_distance_m, 0.03 * edge_m)
    fill = partial(tetrahedralize, vertices, triangles, edge_m=edge_m, envelope_m=envelope_m, simplify=False)
    return Mesher(fill, envelope_m)
