"""The far field of places in an object that is not uniform, or not of the stated Poisson's ratio.

The compliance of a place is a sum over elements, C(p, p) = sum_e u_e^T K_e u_e (unit modulus). Elements that
are stiffer by m_e take their share divided by about m_e, so inclusions and gradients are weights on one
array. Another Poisson's ratio or a skin is a new factorisation, done once at a few values and interpolated.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.mechanics.compliance.patch import PatchSampler, half_space_compliance
from palpate.mechanics.compliance.pressed_places import UNIFORM, Places
from palpate.mechanics.compliance.sites import PATCH_WIDTH_IN_EDGES, typical_edge
from palpate.mechanics.elastic.elasticity import element_stiffness
from palpate.mechanics.elastic.membrane import half_space_change
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.shape.tetmesh import TetMesh

_CHUNK, _BATCH = 600, 24
_SIX = np.triu_indices(3)
_UNFELT, _FEW = 1e-6, 0.4
"""Of the greatest weight: as good as none; share of the elements below which only those are summed."""
STRETCHES_M, _STRETCHED_M = (0.0, 0.004, 0.020, 0.152), 0.010
"""Stretch lengths of skins that are solved, m, to that of 8 mm and 20 times the modulus, and the one above
which the change grows with their logarithm."""
_KNOWN = 16
"""Far fields that are remembered: a fit moves first touches many times between two changes of the object."""


@dataclass(frozen=True)
class EnergyFields:
    """energy: (q, m, 3, 3) of q places, local frames, unit modulus, 1/m. centroid: (m, 3) m, device frame.

    volume: (m,) m^3. half_space: (3, 3) taken off the sum, local frame, under a patch of width_m, m. solver:
    of the model's own mesh, bonded. solution: (n, 3, 3 q) its nodal displacements for the unit loads.
    """

    energy: np.ndarray
    centroid: np.ndarray
    volume: np.ndarray
    half_space: np.ndarray
    width_m: float
    solver: Solver
    solution: np.ndarray

    @cached_property
    def whole(self) -> np.ndarray:
        """(q, 3, 3) 1/m, the sum of all elements."""
        return self.energy.sum(axis=1, dtype=float)

    @cached_property
    def _by_element(self) -> np.ndarray:
        """(m, 6 q) of the tensors' six numbers, so that a weighed sum reads no more, and in one go."""
        q, m = self.energy.shape[:2]
        six = np.empty((m, q, 6), dtype=np.float32)
        for k, (i, j) in enumerate(zip(*_SIX, strict=True)):
            six[:, :, k] = self.energy[:, :, i, j].T
        return six.reshape(m, 6 * q)

    def weighed(self, weight: np.ndarray) -> np.ndarray:
        """(q, 3, 3) 1/m, the sum of the elements' energies times weight (m,)."""
        size = np.abs(weight)
        felt = np.flatnonzero(size > _UNFELT * size.max())
        # a ball weighs few elements: the others are not even read
        few = len(felt) < _FEW * len(weight)
        own, by = (weight[felt], self._by_element[felt]) if few else (weight, self._by_element)
        six = (own.astype(np.float32) @ by).reshape(-1, 6)
        tensor = np.empty((len(six), 3, 3), dtype=np.float32)
        tensor[:, _SIX[0], _SIX[1]] = tensor[:, _SIX[1], _SIX[0]] = six
        return tensor


def energy_fields(places: Places) -> EnergyFields:
    """Energies of all places; solved for once."""
    return places.stage("fields", lambda: _energies(places))


def _energies(places: Places) -> EnergyFields:
    model = places.model
    # what the places were solved by serves here too, where their elements are the model's own
    solver: Solver | None = places.stages.pop(UNIFORM, None)
    if solver is None or len(solver.mesh.tetrahedra) != len(model.mesh.tetrahedra):
        solver = Solver(model.mesh.quadratic(), model.material.poisson_ratio)
    mesh = solver.mesh
    sampler = load_sampler(mesh)
    m, q = len(mesh.tetrahedra), len(places.first)
    u = np.zeros((len(mesh.points), 3, 3 * q))
    flat = u.reshape(-1, 3 * q)
    for some in _batches(q):
        right = _unit_loads(places, mesh, sampler, some).reshape(len(flat), -1)[solver.free]
        flat[solver.free, 3 * some.start : 3 * some.stop] = solver.solve_free(right)
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
    half = half_space_compliance(np.array([1.0, 0, 0]), model.material.poisson_ratio, sampler.width_m)
    return EnergyFields(energy, centroid, mesh.volumes, half, sampler.width_m, solver, u)


def far_with_weights(places: Places, softness: np.ndarray) -> np.ndarray:
    """(p, 3, 3) far field with each element's share of the compliance multiplied by softness (m,) (1:
    unchanged)."""
    known: dict[bytes, np.ndarray] = places.stage("far with weights", dict)
    key = hashlib.blake2b(softness.tobytes(), digest_size=16).digest()
    if key not in known:
        if len(known) >= _KNOWN:
            del known[next(iter(known))]
        known[key] = places.far + energy_fields(places).weighed(softness - 1)[places.place]
    return known[key].copy()


def far_at_poisson(places: Places, nu: float, ratios: tuple[float, ...] = (0.30, 0.40, 0.46)) -> np.ndarray:
    """(p, 3, 3) far field at another Poisson's ratio, interpolated between factorisations."""

    def solve() -> dict[str, np.ndarray]:
        stated = places.model.material.poisson_ratio
        known = sorted({*ratios, stated})
        mesh, fields = places.model.mesh.quadratic(), energy_fields(places)
        own = (fields.whole - fields.half_space)[places.place]
        fars = np.array([own if r == stated else _far(places, mesh, r) for r in known])
        return {"ratios": np.array(known), "far": fars - fars[known.index(stated)]}

    table = places.stage("poisson", lambda: places.stored("poisson", solve))
    return places.far + _interpolate(table["ratios"], table["far"], nu)


def far_under_skin(places: Places, stretch_m: float) -> np.ndarray:
    """(p, 3, 3) 1/m, change of the far field by a membrane on the surface (mechanics.elastic.membrane), no
    wider than STRETCHES_M: smooth between factorisations."""
    from scipy.interpolate import CubicSpline  # here: what has no skin needs none

    def solve() -> dict[str, np.ndarray]:
        mesh, fields = places.model.mesh.quadratic(), energy_fields(places)
        nu, own = places.model.material.poisson_ratio, fields.whole - fields.half_space
        fars = [_far(places, mesh, nu, stretch) - own[places.place] for stretch in STRETCHES_M[1:]]
        return {"change": np.array([np.zeros_like(places.far), *fars])}

    change = places.stage("skins", lambda: places.stored("skins", solve))["change"]
    at = np.log1p(np.array(STRETCHES_M) / _STRETCHED_M)
    return np.asarray(CubicSpline(at, change)(np.log1p(min(stretch_m, STRETCHES_M[-1]) / _STRETCHED_M)))


def load_sampler(mesh: TetMesh) -> PatchSampler:
    """Of the load that the energies are of, as wide as the mesh bears."""
    return PatchSampler(mesh, PATCH_WIDTH_IN_EDGES * typical_edge(mesh))


def _batches(count: int) -> list[slice]:
    return [slice(a, min(a + _BATCH, count)) for a in range(0, count, _BATCH)]


def _unit_loads(places: Places, mesh: TetMesh, sampler: PatchSampler, some: slice) -> np.ndarray:
    """(n, 3, 3 k) nodal forces of unit loads along the local axes of k of the places that are solved for."""
    chosen = places.first[some]
    forces = np.zeros((len(mesh.points), 3, 3 * len(chosen)))
    for k, press in enumerate(chosen):
        nodes, weights = sampler.weights(places.point[press])
        for axis in range(3):
            forces[nodes, :, 3 * k + axis] = weights[:, None] * places.frame[press][axis]
    return forces


def _far(places: Places, mesh: TetMesh, nu: float, stretch_m: float = 0.0) -> np.ndarray:
    """(p, 3, 3) local far field at another Poisson's ratio, or under a membrane: one factorisation."""
    sampler, solver = load_sampler(mesh), Solver(mesh, nu, stretch_m=stretch_m)
    far = np.empty((len(places.first), 3, 3))
    for some in _batches(len(far)):
        loads = _unit_loads(places, mesh, sampler, some).reshape(3 * len(mesh.points), -1, 3)
        far[some] = solver.quadratic_forms(loads[solver.free])
    along = np.array([1.0, 0.0, 0.0])
    half = half_space_compliance(along, nu, sampler.width_m)
    return (far - half - half_space_change(along, nu, sampler.width_m, stretch_m))[places.place]


def _interpolate(x: np.ndarray, table: np.ndarray, value: float) -> np.ndarray:
    i = int(np.clip(np.searchsorted(x, value) - 1, 0, len(x) - 2))
    w = (value - x[i]) / (x[i + 1] - x[i])
    return (1 - w) * table[i] + w * table[i + 1]
