"""A new mesher is one file and its line in the registry."""

from __future__ import annotations

import dataclasses
import sys
from types import ModuleType

import numpy as np
import pytest

from palpate.mechanics.errors import MeshError
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions, mesh_surface
from palpate.reconstruction.steps.s5_mesh.registry import AUTO, MESHERS, Mesher


def _module() -> ModuleType:
    """What `steps/s5_mesh/of_boxes.py` would hold: bricks of the surface's box, each cut into tetrahedra."""
    module = ModuleType("palpate.reconstruction.steps.s5_mesh.of_boxes")

    def prepared(surface: Surface, options: MeshingOptions) -> Mesher:
        size = np.ptp(surface.vertices, axis=0)
        made = box_mesh(tuple(np.round(size / options.mesh_size_m).astype(int)), tuple(size))
        return Mesher(lambda take: (made.points.copy(), made.tetrahedra.copy()), 1e-5)

    module.prepared = prepared
    return module


def test_a_mesher_is_added_in_one_file_and_one_line(monkeypatch: pytest.MonkeyPatch):
    (choices,) = (
        f.metadata["choices"] for f in dataclasses.fields(MeshingOptions) if f.name == "mesh_source"
    )
    assert choices == (AUTO, *MESHERS)
    box = box_mesh((3, 3, 2), (0.06, 0.06, 0.04))
    surface = Surface(
        box.points, box.surface, np.full(len(box.points), 1e-4), np.zeros(3), np.array([0, 0, 1.0]),
        method="box", reason="",
    )  # fmt: skip
    options = MeshingOptions(mesh_size_m=0.01, mesh_source="boxes")
    with pytest.raises(MeshError, match="'boxes'; allowed are auto, surface, voxels"):
        mesh_surface(surface, options)
    home = "palpate.reconstruction.steps.s5_mesh.of_boxes"
    monkeypatch.setitem(sys.modules, home, _module())
    monkeypatch.setitem(MESHERS, "boxes", home)
    made = mesh_surface(surface, options)
    assert made.mesh.volumes.sum() == pytest.approx(0.06 * 0.06 * 0.04)
    assert len(made.mesh.tetrahedra) > 5 * 6 * 6 * 3
    assert np.abs(made.mesh.points[made.mesh.fixed][:, 2]).max() < 1e-9
    assert np.allclose(made.shape_uncertainty_m[made.mesh.touchable], 1e-4)
