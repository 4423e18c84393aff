"""How presses answer to a field of stiffness: by the elements' shares of their compliance, and under the tip.

A press of a share `a` of whose answer is the far field's tells ln E at an element by that element's share of
the far field, and the rest of it right under the tip, where its dent lies. To first order in each element's
compliance, the far field and the modulus under the tip change as mechanics.compliance.far_field says.

The far field of pressed places in a field of the modulus, from few solutions in the elements.

A field f (ln of the modulus, of each element) gives a place the compliance C = b' K(f)^-1 b for loads b along
the axes, K = sum_e exp(f_e) K_e. Beside a field that was solved, with displacements u and the elements'
energies w_e = u' exp(f_e) K_e u, another that differs from it by d is bounded from both sides:

    W (sum_e exp(d_e) w_e)^-1 W  <=  C  <=  sum_e exp(-d_e) w_e,    W = sum_e w_e,

as u is an admissible displacement and its stress an admissible stress (least potential and least
complementary energy; Washizu, Variational Methods in Elasticity and Plasticity, chapter 2). Both are right to
first order in d, and lie apart by the variance of d as the place feels it. C is taken half way, so half of
that is the greatest error. A field whose bounds lie too far apart at any place is solved anew, and others are
then taken beside it: the folds of a comparison, which differ by what a few presses say, need one or two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from palpate.mechanics.compliance.far_field import EnergyFields, energy_fields, far_with_weights
from palpate.mechanics.compliance.patch import PatchSampler, half_space_compliance
from palpate.mechanics.compliance.pressed_places import Places
from palpate.mechanics.compliance.sites import patch_loads, patch_width, surface_edge
from palpate.mechanics.compliance.smooth_field import TIP_DEPTH_IN_RADII, Shares
from palpate.mechanics.elastic.elasticity import element_stiffness
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.shape.refine import refined_near_surface
from palpate.mechanics.shape.tetmesh import TetMesh


def shares_of(places: Places, answer: np.ndarray) -> Shares:
    """By which each press tells of the field at the elements' centres, then at the presses' own tips.

    answer: (p,) m, change of ln E of a press a unit of compliance along its normal, unit modulus.
    """
    fields = energy_fields(places)
    far = answer[:, None] * fields.energy[:, :, 0, 0][places.place]
    own = np.maximum(1 - far.sum(axis=1), 0.0)
    weight = np.hstack([far, np.diag(own)])
    nodes = np.vstack([fields.centroid, tips_of(places)])
    return Shares(nodes, weight / weight.sum(axis=1, keepdims=True))


def shares_in_elements(places: Places, answer: np.ndarray) -> Shares:
    """The same at the elements' centres alone: under a tip are those that its contact meets, as a renderer
    has it."""
    fields = energy_fields(places)
    weight = answer[:, None] * fields.energy[:, :, 0, 0][places.place]
    own = np.maximum(1 - weight.sum(axis=1), 0.0)
    np.add.at(weight.T, places.model.mesh.touchable_elements, (own[:, None] * places.under_tip).T)
    return Shares(fields.centroid, weight / weight.sum(axis=1, keepdims=True))


def tips_of(places: Places) -> np.ndarray:
    """(p, 3) m, where under each press the dent's own modulus is taken."""
    return places.point - TIP_DEPTH_IN_RADII * places.model.tool.tip_radius_m * places.normal


def far_of(
    places: Places, fields: EnergyFields, ratio: np.ndarray, softness: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(far (p, 3, 3) 1/m in local frames, dent_ratio (p,)) of presses on an object whose elements are of
    ratios (m,) and whose softness under each tip is (p,)."""
    # what the far field takes off is of the modulus under the tip: the half-space, and what the energies'
    # elements are too wide for, so that the same ratio everywhere is another modulus
    taken = fields.whole[places.place] - places.far
    return far_with_weights(places, 1 / ratio) + (1 - softness)[:, None, None] * taken, 1 / softness


APART = 0.015
"""Share of a place's compliance along its normal by which its bounds may lie apart. Half way the error is at
most half of it; on a slab of tissue whose ln E has a standard deviation of 0.35 it was a tenth."""
KEPT = 4
"""Solved fields that are kept beside a set of places."""
_BATCH, _CHUNK = 24, 600
_NAME = "solved fields"


@dataclass(frozen=True)
class SolvedField:
    """log_ratio: (m,) of the elements of the model's mesh. energy: (q, m, 3, 3) of q places, device frame,
    unit modulus of the object, 1/m; it sums to the compliance under the patch, half_space (q, 3, 3) included.
    """

    log_ratio: np.ndarray
    energy: np.ndarray
    half_space: np.ndarray
    patch_width_m: float

    def bounds(self, log_ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(least, most) (q, 3, 3) 1/m, of the compliance in another field."""
        other = log_ratio - self.log_ratio
        weights = np.stack([np.exp(-other), np.exp(other), np.ones(len(other))]).astype(np.float32)
        q, m = self.energy.shape[:2]
        sums = np.array([weights @ each.reshape(m, 9) for each in self.energy], dtype=float)
        most, stiff, whole = sums.reshape(q, 3, 3, 3).transpose(1, 0, 2, 3)
        least = whole @ np.linalg.solve(stiff, whole)
        return 0.5 * (least + least.transpose(0, 2, 1)), most


def far_in_field(places: Places, log_ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """(far (q, 3, 3), half_space (q, 3, 3), patch_width_m) of the places that are solved for, 1/m, device
    frame, in the field log_ratio (m,) of the mesh's elements: beside one that was solved, or solved here."""
    solved: list[SolvedField] = places.stage(_NAME, list)
    normal = places.normal[places.first]
    best: tuple[float, np.ndarray, SolvedField] | None = None
    for near in solved:
        least, most = near.bounds(log_ratio)
        apart, size = (np.einsum("qi,qij,qj->q", normal, x, normal) for x in (most - least, least))
        error = float((apart / size).max())
        if best is None or error < best[0]:
            best = error, 0.5 * (least + most), near
    if best is None or best[0] > APART:
        near = solve_field(places, log_ratio)
        solved.append(near)
        del solved[:-KEPT]
        best = 0.0, near.energy.sum(axis=1, dtype=float), near
    _, compliance, near = best
    return compliance - near.half_space, near.half_space, near.patch_width_m


def solve_field(places: Places, log_ratio: np.ndarray) -> SolvedField:
    """The places' energies with the field in the elements: one factorisation, three solutions a place."""
    model = places.model
    nu, coarse = model.material.poisson_ratio, model.mesh.quadratic()
    fine, parent = refined_near_surface(coarse, surface_edge(coarse))
    mesh = fine.quadratic()
    ratio = np.exp(log_ratio)[parent]
    width = patch_width(mesh)
    moved = _moved(Solver(mesh, nu, ratio), places, PatchSampler(mesh, width))
    energy = _energies(mesh, nu, ratio, moved, parent, len(coarse.tetrahedra))
    half = half_space_compliance(places.normal[places.first], nu, width)
    return SolvedField(log_ratio, energy, half, width)


def _moved(solver: Solver, places: Places, sampler: PatchSampler) -> np.ndarray:
    """(n, 3, 3 q) float32, m Pa: displacements for unit forces x, y, z on the patch of each place."""
    mesh, points = solver.mesh, places.point[places.first]
    moved = np.zeros((len(mesh.points), 3, 3 * len(points)), dtype=np.float32)
    flat = moved.reshape(3 * len(mesh.points), -1)
    for start in range(0, len(points), _BATCH):
        loads = patch_loads(mesh, [sampler.weights(p) for p in points[start : start + _BATCH]])
        right = loads.reshape(3 * len(mesh.points), -1)[solver.free]
        flat[solver.free, 3 * start : 3 * start + right.shape[1]] = solver.solve_free(right)
    return moved


def _energies(
    mesh: TetMesh, nu: float, ratio: np.ndarray, moved: np.ndarray, parent: np.ndarray, count: int
) -> np.ndarray:
    """(q, count, 3, 3) float32 of the elements that `parent` names."""
    q = moved.shape[2] // 3
    energy = np.zeros((q, count, 3, 3), dtype=np.float32)
    order = np.argsort(parent, kind="stable")
    cuts = np.searchsorted(parent[order], np.arange(0, count, _CHUNK))
    for first, rows in zip(range(0, count, _CHUNK), np.split(order, cuts[1:]), strict=True):
        nodes = mesh.tetrahedra[rows]
        stiff = element_stiffness(mesh.points[nodes[:, :4]], 2, nu) * ratio[rows, None, None, None, None]
        local = moved[nodes].reshape(len(rows), 30, 3 * q)
        forces = stiff.reshape(len(rows), 30, 30).astype(np.float32) @ local
        one, other = (x.reshape(len(rows), 30, q, 3).transpose(0, 2, 3, 1) for x in (local, forces))
        each = one @ other.transpose(0, 1, 3, 2)
        last = min(first + _CHUNK, count)
        if len(rows) == last - first:
            energy[:, first:last] = each.transpose(1, 0, 2, 3)
            continue
        where = parent[rows] - first, np.arange(len(rows))
        own = sp.csr_matrix((np.ones(len(rows)), where), shape=(last - first, len(rows)))
        energy[:, first:last] = (own @ each.reshape(len(rows), -1)).reshape(-1, q, 3, 3).transpose(1, 0, 2, 3)
    return energy
