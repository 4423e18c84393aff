"""Stiff balls inside an object, as a modulus ratio a tetrahedron."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mechanics.inclusion import inclusion_ratio
from mechanics.tetmesh import TetMesh
from scenes.phantoms import Region


def modulus_ratio(mesh: TetMesh, regions: Iterable[Region]) -> np.ndarray:
    """(m,) modulus of each tetrahedron over the object's: 1 outside; balls that overlap multiply.

    Region centres: the mesh's frame.
    """
    ratio = np.ones(len(mesh.tetrahedra))
    for region in regions:
        ratio *= inclusion_ratio(mesh, np.array(region.centre_m), region.radius_m, region.modulus_ratio)
    return ratio
