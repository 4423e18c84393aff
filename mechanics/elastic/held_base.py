"""How the base is held: bonded (the ideal model), bonded in part, or on springs.

Which triangles are the base is the mesh's business (TetMesh.fixed); this says what they feel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from palpate.mechanics.elastic.elasticity import triangle_mass
from palpate.mechanics.errors import OptionError
from palpate.mechanics.shape.nearest import triangle_areas
from palpate.mechanics.shape.tetmesh import TetMesh

FLOOR = 1e5  # 1/m, stiffness a unit of area over the modulus: far stiffer than an object of centimetres


@dataclass(frozen=True)
class BaseHold:
    """normal: (3,) unit, out of the support into the object.

    springs: (normal, tangential) stiffness a unit of area over Young's modulus, 1/m; None: rigid.
    bonded_fraction: share of the base's area that is held; the rest, towards `direction` (3,), may lift
    and slip (mechanics.elastic.floor says what the floor carries of it), or with `resting` slip but not lift.
    """

    normal: np.ndarray
    springs: tuple[float, float] | None = None
    bonded_fraction: float = 1.0
    direction: np.ndarray | None = None
    resting: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.bonded_fraction <= 1:
            raise OptionError(f"bonded_fraction is {self.bonded_fraction}; it must lie in (0, 1]")
        if self.bonded_fraction < 1 and self.direction is None:
            raise OptionError("a base that is bonded in part needs the direction of its free part")
        if self.springs is not None and not min(self.springs) > 0:
            raise OptionError(f"base springs are {self.springs} 1/m; both must be greater than 0")

    def held_triangles(self, mesh: TetMesh) -> np.ndarray:
        """The base triangles (k, 3 or 6) that are held."""
        base = base_triangles(mesh)
        if self.bonded_fraction >= 1:
            return base
        p = mesh.points[base[:, :3]]
        area = triangle_areas(mesh.points, base)
        order = np.argsort(p.mean(axis=1) @ np.asarray(self.direction), kind="stable")
        share = np.cumsum(area[order]) / area.sum()
        return base[order[share <= self.bonded_fraction + 1e-9]]

    def held_nodes(self, mesh: TetMesh) -> np.ndarray:
        """(n,) bool: nodes without any motion."""
        held = np.zeros(len(mesh.points), dtype=bool)
        if self.springs is None:
            held[np.unique(self.held_triangles(mesh))] = True
        return held

    def stiffness(self, mesh: TetMesh) -> sp.csr_matrix | None:
        """What springs, and a floor that holds on, add to the stiffness for unit modulus, (3n, 3n) m, or
        None."""
        nn = np.outer(self.normal, self.normal)
        total = None
        if self.springs is not None:
            per_area = self.springs[0] * nn + self.springs[1] * (np.eye(3) - nn)
            total = _spread(mesh, self.held_triangles(mesh), per_area)
        if self.resting and self.bonded_fraction < 1:
            base = base_triangles(mesh)
            held = {tuple(t) for t in self.held_triangles(mesh)}
            loose = np.array([t for t in base if tuple(t) not in held]).reshape(-1, base.shape[1])
            floor = _spread(mesh, loose, FLOOR * nn)
            total = floor if total is None else total + floor
        return total


def _spread(mesh: TetMesh, triangles: np.ndarray, per_area: np.ndarray) -> sp.csr_matrix:
    """(3n, 3n) of springs (3, 3) a unit of area over triangles."""
    mass = triangle_mass(mesh.points, triangles)
    k = triangles.shape[1]
    rows = np.repeat(triangles, k, axis=1).ravel()
    columns = np.tile(triangles, (1, k)).ravel()
    nodal = sp.csr_matrix((mass.ravel(), (rows, columns)), shape=(len(mesh.points),) * 2)
    return sp.kron(nodal, per_area, format="csr")


def base_triangles(mesh: TetMesh) -> np.ndarray:
    """(k, 3 or 6): the boundary triangles all of whose corners are fixed."""
    return mesh.surface[mesh.fixed[mesh.surface[:, :3]].all(axis=1)]
