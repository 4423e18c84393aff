"""The meshers by name, and the module whose `prepared(surface, options)` returns a `Mesher`.

To add one: a file in this folder, and its line here; `--mesh-source` takes its name.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from palpate.mechanics.errors import MeshError

if TYPE_CHECKING:
    from palpate.reconstruction.steps.s4_surface import Surface
    from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions

MESHERS = {
    "surface": "palpate.reconstruction.steps.s5_mesh.surface_mesher",
    "voxels": "palpate.reconstruction.steps.s5_mesh.voxel_mesher",
}
AUTO, USUAL = "auto", "surface"
"""The method chooses; where it does not, the usual one."""


class Mesher(NamedTuple):
    """A mesher with its input. fill(take=0): nodes (n, 3) m and positive tetrahedra (m, 4), VTK order, device
    frame; another take may be another mesh; raises MeshError. envelope_m: how far from its input it may
    lay the mesh's surface."""

    fill: Callable[..., tuple[np.ndarray, np.ndarray]]
    envelope_m: float


def prepared(surface: Surface, options: MeshingOptions) -> Mesher:
    """The mesher that the options name, for a surface. Raises MeshError for a name that is not there."""
    name = USUAL if options.mesh_source == AUTO else options.mesh_source
    if name not in MESHERS:
        raise MeshError(f"--mesh-source is '{name}'; allowed are {', '.join((AUTO, *MESHERS))}")
    made: Mesher = importlib.import_module(MESHERS[name]).prepared(surface, options)
    return made
