"""What spatial effects need of the object: each place's elastic energy element by element, and other far
fields.

The give of a place is a sum over elements, C(p, p) = sum_e u_e^T K_e u_e (unit modulus). Elements that are
stiffer
by m_e take their share divided by about m_e, so inclusions, gradients and skins are weights on one array.
Another Poisson's ratio is a new factorisation, done once at a few values and interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from diagnose.forward import Forward, places_of
from diagnose.stages import stored
from mechanics.elasticity import element_stiffness
from mechanics.patch import PatchSampler, half_space_compliance
from mechanics.sites import PATCH_WIDTH_IN_MESH_SIZES, typical_edge
from mechanics.solver import Solver
from mechanics.tetmesh import TetMesh

_CHUNK = 600


@dataclass(frozen=True)
class EnergyFields:
    """energy: (q, m, 3, 3) of q places, local frames, unit modulus, 1/m. place: (p,) place of each press.

    centroid: (m, 3) m, device frame. volume: (m,) m^3. height: (m,) m above the support; top: its greatest
    value.
    depth: (m,) m, distance of the centroid to the touchable surface. half_space: (q, 3, 3) taken off the sum.
    solver: of the model's own mesh, bonded. solution: (n, 3, 3 q) its nodal displacements for the unit loads.
    """

    energy: np.ndarray
    place: np.ndarray
    centroid: np.ndarray
    volume: np.ndarray
    height: np.ndarray
    depth: np.ndarray
    half_space: np.ndarray
    solver: Solver
    solution: np.ndarray


def energy_fields(forward: Forward) -> EnergyFields:
    """Energies of all places; kept in forward.stages['fields']."""
    if "fields" in forward.stages:
        return forward.stages["fields"]
    t, model = forward.touches, forward.model
    mesh = model.mesh.quadratic()
    unique, first, inverse = places_of(t)
    solver = Solver(mesh, model.material.poisson_ratio)
    sampler = PatchSampler(mesh, PATCH_WIDTH_IN_MESH_SIZES * typical_edge(mesh))
    q = len(first)
    forces = np.zeros((len(mesh.points), 3, 3 * q))
    for k, press in enumerate(first):
        nodes, weights = sampler.weights(t.point[press])
        for axis in range(3):
            forces[nodes, :, 3 * k + axis] = weights[:, None] * t.frame[press][axis]
    u = solver.solve(forces)
    m = len(mesh.tetrahedra)
    energy = np.empty((q, m, 3, 3), dtype=np.float32)
    for a in range(0, m, _CHUNK):
        nodes = mesh.tetrahedra[a : a + _CHUNK]
        stiff = element_stiffness(mesh.points[nodes[:, :4]], 2, model.material.poisson_ratio).reshape(
            len(nodes), 30, 30
        )
        local = u[nodes].reshape(len(nodes), 30, 3 * q)
        product = (stiff @ local).reshape(len(nodes), 30, q, 3)
        energy[:, a : a + _CHUNK] = np.einsum(
            "mxqi,mxqj->qmij", local.reshape(len(nodes), 30, q, 3), product, optimize=True
        )
    centroid = mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)
    height = model.support.height(centroid)
    from scipy.spatial import cKDTree

    surface = sampler._positions.reshape(-1, 3)
    depth = cKDTree(surface).query(centroid)[0]
    half = np.array(
        [
            half_space_compliance(np.array([1.0, 0, 0]), model.material.poisson_ratio, sampler.width_m)
            for _ in first
        ]
    )
    fields = EnergyFields(energy, inverse.ravel(), centroid, mesh.volumes, height, depth, half, solver, u)
    forward.stages["fields"] = fields
    return fields


def far_with_weights(forward: Forward, softness: np.ndarray) -> np.ndarray:
    """(p, 3, 3) far field with each element's share of the give multiplied by softness (m,) (1:
    unchanged)."""
    fields = energy_fields(forward)
    change = np.einsum("qmij,m->qij", fields.energy, (softness - 1).astype(np.float32), optimize=True)
    return forward.far + change[fields.place]


def far_at_poisson(forward: Forward, nu: float, ratios: tuple[float, ...] = (0.30, 0.40, 0.46)) -> np.ndarray:
    """(p, 3, 3) far field at another Poisson's ratio, interpolated between factorisations."""
    table = forward.stages.get("poisson")
    if table is None:

        def solve() -> dict[str, np.ndarray]:
            known = sorted({*ratios, forward.nu})
            mesh = forward.model.mesh.quadratic()
            own = energy_fields(forward).solution
            fars = np.array([_far(forward, mesh, r, own if r == forward.nu else None) for r in known])
            return {"ratios": np.array(known), "far": fars - fars[known.index(forward.nu)]}

        kept = stored("poisson", forward.model, forward.touches, solve)
        table = (kept["ratios"], kept["far"])
        forward.stages["poisson"] = table
    return forward.far + _interpolate(*table, nu)


def _solutions(forward: Forward, mesh: TetMesh, nu: float, first: np.ndarray) -> np.ndarray:
    """(n, 3, 3 q) displacement for unit loads along the local axes of q places."""
    sampler = PatchSampler(mesh, PATCH_WIDTH_IN_MESH_SIZES * typical_edge(mesh))
    t = forward.touches
    forces = np.zeros((len(mesh.points), 3, 3 * len(first)))
    for k, press in enumerate(first):
        nodes, weights = sampler.weights(t.point[press])
        for axis in range(3):
            forces[nodes, :, 3 * k + axis] = weights[:, None] * t.frame[press][axis]
    return Solver(mesh, nu).solve(forces)


def _far(forward: Forward, mesh: TetMesh, nu: float, solution: np.ndarray | None = None) -> np.ndarray:
    """(p, 3, 3) local far field of a mesh whose nodes are the model's (its base may differ); solution: known
    displacements for the unit loads."""
    sampler = PatchSampler(mesh, PATCH_WIDTH_IN_MESH_SIZES * typical_edge(mesh))
    t = forward.touches
    unique, first, inverse = places_of(t)
    u = _solutions(forward, mesh, nu, first) if solution is None else solution
    far = np.empty((len(first), 3, 3))
    half = half_space_compliance(np.array([1.0, 0.0, 0.0]), nu, sampler.width_m)
    for k, press in enumerate(first):
        nodes, weights = sampler.weights(t.point[press])
        mean = np.einsum("n,nar->ar", weights, u[nodes][:, :, 3 * k : 3 * k + 3])
        block = t.frame[press] @ mean
        far[k] = (block + block.T) / 2 - half
    return far[inverse.ravel()]


def _interpolate(x: np.ndarray, table: np.ndarray, value: float) -> np.ndarray:
    i = int(np.clip(np.searchsorted(x, value) - 1, 0, len(x) - 2))
    w = (value - x[i]) / (x[i + 1] - x[i])
    return (1 - w) * table[i] + w * table[i + 1]
