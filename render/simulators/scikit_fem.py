"""scikit-fem: small-strain elasticity, statics, and a sphere on nodes by a penalty, with Coulomb's friction.

documented: its examples' linear tetrahedra (`ElementTetP1`) on the model's own mesh. best: quadratic ones
(`ElementTetP2`) with edges of 0.45 of the tip's radius under it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from palpate.mechanics.elastic import pardiso
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.render.options import BEST, DOCUMENTED, RenderOptions
from palpate.render.simulators.base import Adapter, World
from palpate.render.simulators.tunable import EDGES, Tunable


@dataclass(frozen=True)
class ScikitFemSettings:
    """penalty: a node's contact spring over the stiffness of the object under one node, no part of
    scikit-fem. order: 1 or 2, of the elements. edge_radii: edges under the tip, in its radii, inf as the
    model has them."""

    penalty: float
    order: float = 1
    edge_radii: float = math.inf


SETTINGS = {DOCUMENTED: ScikitFemSettings(10.0), BEST: ScikitFemSettings(30.0, 2, 0.45)}
TUNABLES = (
    Tunable("penalty", (0.3, 1.0, 3.0, 10.0, 30.0, 100.0), "spring of the contact, over the stiffness of the "
            "object under one node", ("contact_stiffness",)),
    Tunable("order", (1, 2), "ElementTetP1 or ElementTetP2", ("mesh_stiffness", "contact_nodes"),
            whole=True, dear=True),
    EDGES,
)  # fmt: skip
NEAR_RADII = 1.05
"""Of the tip: nodes so near to its centre may touch, as what it presses moves away from it."""
MOVED_M = 2e-5
"""The tip's travel after which the contact is solved anew; between, the force is held."""
BALANCED_M, GOOD_ENOUGH_M = 1e-8, 2e-6
"""By which springs and object may miss each other; what is taken where no step leads nearer, a tenth of the
travel between two balances."""
ITERATIONS, SHARES = 60, (1.0, 0.5, 0.25, 0.1, 0.03, 0.01)
"""Of Newton's method, and the shares of a step that are tried."""
STIFFENING = (0.01, 0.03, 0.1, 0.3, 1.0)
"""Shares of the springs, one after another, where the last balance leads to none."""


class ScikitFem(Adapter):
    """The adapter. One mesh is factorised for all touches; of `best` one a touch."""

    name, extra, units = "scikit-fem", "scikit-fem", "SI: m, N, Pa"
    needs = ("skfem",)
    cannot = (
        "small strain only",
        "no contact of its own: a sphere on nodes by a penalty is written here",
        "one modulus",
    )
    advice = {
        "contact_nodes": "refine under the tip (`mesh.refined(elements)`) to a third of its radius, and take "
        "`ElementTetP2`: --simulator-settings best",
        "mesh_stiffness": "take `ElementTetP2` instead of `ElementTetP1`: --simulator-settings best",
        "contact_stiffness": "raise the penalty of the contact",
        "contact_offset": "let the nodes on the surface lie on it: refine where it is curved",
    }

    settings = SETTINGS
    tunables = TUNABLES

    def __init__(self, model: Model, options: RenderOptions, friction: float) -> None:
        super().__init__(model, options, friction)
        graded = math.isfinite(self.own.edge_radii)
        self.presses = 12 if graded else None
        self._whole = None if graded else _Solved(self.mesh, model, round(self.own.order))

    def begin(self, tip: np.ndarray, radius_m: float) -> World:
        solved = self._whole
        if solved is None:
            fine = self.mesh_around(tip, radius_m, self.own.edge_radii * radius_m, 1.1 * radius_m)
            solved = _Solved(fine, self.model, round(self.own.order))
        return _ScikitFemTouch(solved, radius_m, self.friction, self.own.penalty)


class _Solved:
    """A mesh with its stiffness factorised. points: (n, 3) m of the nodes that may touch."""

    def __init__(self, mesh: TetMesh, model: Model, order: int) -> None:
        import skfem
        from skfem.models.elasticity import lame_parameters, linear_elasticity

        material = model.material
        linear = skfem.MeshTet(*(np.ascontiguousarray(x.T) for x in (mesh.points, mesh.tetrahedra)))
        element = skfem.ElementTetP1() if order == 1 else skfem.ElementTetP2()
        basis = skfem.Basis(linear, skfem.ElementVector(element))
        lame = lame_parameters(material.young_modulus_pa, material.poisson_ratio)
        stiffness = csc_matrix(linear_elasticity(*lame).assemble(basis))
        base = mesh.points[mesh.fixed]
        height = model.support.height(basis.doflocs.T)
        # what lies on the base is held: its own nodes, and the middles of its edges
        held = height < model.support.height(base).max() + 1e-9
        free = np.flatnonzero(~held)
        self._factor, self._free, self._size = _factorised(stiffness[free][:, free]), free, stiffness.shape[0]
        where = basis.doflocs
        surface = basis.get_dofs(linear.boundary_facets()).flatten()
        # the components of a node share its place
        order_of = np.lexsort(np.round(where[:, surface], 9))
        nodes = surface[order_of].reshape(-1, 3)
        nodes = nodes[~held[nodes[:, 0]]]
        self.nodes, self.points = np.sort(nodes, axis=1), where[:, nodes[:, 0]].T
        self._columns: dict[int, np.ndarray] = {}

    def compliance(self, chosen: np.ndarray) -> np.ndarray:
        """(3 c, 3 c) m/N of chosen surface nodes (c,), components x, y, z a node."""
        new = [int(k) for k in chosen if int(k) not in self._columns]
        if new:
            dofs = self.nodes[new].ravel()
            loads = np.zeros((self._size, len(dofs)))
            loads[dofs, np.arange(len(dofs))] = 1.0
            solved = self._factor.solve(loads[self._free])
            moved = np.zeros((self._size, len(dofs)))
            moved[self._free] = solved
            on_surface = moved[self.nodes.ravel()]
            for i, k in enumerate(new):
                self._columns[k] = on_surface[:, 3 * i : 3 * i + 3]
        rows = (3 * chosen[:, None] + np.arange(3)).ravel()
        return np.concatenate([self._columns[int(k)][rows] for k in chosen], axis=1)


def _factorised(matrix: Any) -> Any:
    """Whatever solves it, by `solve`."""
    if pardiso.available():
        return pardiso.Pardiso(matrix)
    return splu(csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})


class _ScikitFemTouch:
    """A sphere on nodes: springs along the sphere's normal, and across it until they slip."""

    def __init__(self, solved: _Solved, radius_m: float, friction: float, penalty: float) -> None:
        self.solved, self.radius_m, self.friction = solved, radius_m, friction
        self.penalty = penalty
        self._at: np.ndarray | None = None
        self._force = np.zeros(3)
        self._chosen = np.zeros(0, dtype=int)
        self._stuck: dict[int, np.ndarray] = {}
        self._u, self._pushed = np.zeros((0, 3)), np.zeros((0, 3))

    def step(self, dt_s: float, tip: np.ndarray) -> np.ndarray:
        if self._at is None or np.linalg.norm(tip - self._at) > MOVED_M:
            self._at, self._force = tip.copy(), self._solve(tip)
        return self._force

    def _solve(self, tip: np.ndarray) -> np.ndarray:
        points = self.solved.points
        near = np.flatnonzero(np.linalg.norm(points - tip, axis=1) < NEAR_RADII * self.radius_m)
        if not len(near):
            self._stuck, self._chosen, self._u, self._pushed = {}, near, np.zeros((0, 3)), np.zeros((0, 3))
            return np.zeros(3)
        if not np.array_equal(near, self._chosen):
            old = dict(zip(self._chosen.tolist(), self._pushed, strict=True))
            self._chosen, self._matrix = near, self.solved.compliance(near)
            self._lower = np.linalg.cholesky(self._matrix + self._matrix.T)
            # a node that comes near has been moved along by those that are pressed
            pushed = np.array([old.get(int(k), np.zeros(3)) for k in near])
            self._u = (self._matrix @ pushed.ravel()).reshape(-1, 3)
        own = np.median(np.diag(self._matrix).reshape(-1, 3).mean(axis=1))
        spring = self.penalty / own
        force, u = self._balanced(tip, near, spring)
        self._u, self._pushed = u, force
        relative = points[near] + u - tip
        kept = {}
        for k in np.flatnonzero(force.any(axis=1)):
            first = self._stuck.get(int(near[k]), relative[k])
            n = relative[k] / np.linalg.norm(relative[k])
            push = float(force[k] @ n)
            slid = relative[k] - first
            slid = slid - (slid @ n) * n
            length, most = float(np.linalg.norm(slid)), self.friction * push / spring
            # an anchor that slips follows until its spring is on the cone
            kept[int(near[k])] = relative[k] - slid * most / length if length > most and length > 0 else first
        self._stuck = kept
        return -force.sum(axis=0)

    def _balanced(self, tip: np.ndarray, near: np.ndarray, spring: float) -> tuple[np.ndarray, np.ndarray]:
        """((c, 3) N on the nodes, (c, 3) m): where springs and object balance, from the last balance, else
        from rest by springs that stiffen. Raises OptionError where neither leads to one."""
        anchor = np.full((len(near), 3), np.nan)
        for k, node in enumerate(near):
            anchor[k] = self._stuck.get(int(node), anchor[k])
        force, u, left = self._descended(self._u, tip, anchor, spring)
        if left > GOOD_ENOUGH_M:
            u = np.zeros_like(u)
            for share in STIFFENING:
                force, u, left = self._descended(u, tip, anchor, share * spring)
        if left > GOOD_ENOUGH_M:
            raise OptionError(
                f"scikit-fem: the contact finds no balance with the tip at {np.round(tip, 4).tolist()} m "
                f"({1e3 * left:.2g} mm are left): lower --simulator-set penalty={self.penalty:g}"
            )
        return force, u

    def _descended(
        self, u: np.ndarray, tip: np.ndarray, anchor: np.ndarray, spring: float
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """((c, 3) N, (c, 3) m, m by which springs and object miss each other): Newton's steps from u."""
        points = self.solved.points[self._chosen]

        def missed(u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
            force, slope = self._springs(points + u - tip, anchor, spring)
            residual = u.ravel() - self._matrix @ force.ravel()
            # in the norm of the object's energy, in which Newton's direction leads downwards
            whitened = solve_triangular(self._lower, residual, lower=True, check_finite=False)
            return force, slope, residual, float(np.linalg.norm(whitened))

        now = missed(u)
        for _ in range(ITERATIONS):
            force, slope, residual, miss = now
            if np.abs(residual).max() < BALANCED_M:
                break
            step = self._newton(slope, residual).reshape(u.shape)
            for share in SHARES:
                then = missed(u - share * step)
                if then[3] < (1 - 0.1 * share) * miss:
                    break
            u, now = u - share * step, then
        return now[0], u, float(np.abs(now[2]).max())

    def _newton(self, slope: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """(3 c,) m: Newton's step. Only springs that are pressed have a slope, so only their nodes' steps are
        coupled; the others follow from them."""
        pressed = np.flatnonzero(slope.any(axis=(1, 2)))
        if not len(pressed):
            return residual
        size = len(self._matrix)
        by_node = self._matrix.reshape(size, -1, 3)[:, pressed].transpose(1, 0, 2)
        moved = np.matmul(by_node, slope[pressed]).transpose(1, 0, 2).reshape(size, -1)
        own = (3 * pressed[:, None] + np.arange(3)).ravel()
        return residual + moved @ np.linalg.solve(np.eye(len(own)) - moved[own], residual[own])

    def _springs(
        self, relative: np.ndarray, anchor: np.ndarray, spring: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """((c, 3) N on nodes at `relative` to the tip's centre, (c, 3, 3) N/m their slopes). anchor: (c, 3) m
        where each holds on to the tip, nan where it does not."""
        distance = np.maximum(np.linalg.norm(relative, axis=1), 1e-9)
        n, deep = relative / distance[:, None], np.maximum(self.radius_m - distance, 0.0)
        along = n[:, :, None] * n[:, None]
        across = np.eye(3) - along
        slope = spring * ((deep / distance)[:, None, None] * across - along)
        pull = -spring * np.einsum("cij,cj->ci", across, np.nan_to_num(relative - anchor))
        size, most = np.linalg.norm(pull, axis=1), spring * deep * min(self.friction, 1e9)
        share = np.minimum(1.0, most / np.maximum(size, 1e-12))
        holds = np.isfinite(anchor[:, 0])
        slope -= (spring * holds * share)[:, None, None] * across
        slips = np.flatnonzero(holds & (share < 1))
        to = pull[slips] / size[slips, None]
        turned = (spring * share[slips])[:, None, None] * to[:, :, None] * to[:, None]
        slope[slips] += turned - spring * self.friction * to[:, :, None] * n[slips, None]
        touching = deep > 0
        force = spring * deep[:, None] * n + share[:, None] * pull
        return force * touching[:, None], slope * touching[:, None, None]
