"""Which tetrahedron: linear, quadratic, its volume at every point, by its mean, or shared, on a thin bonded
block near nu = 0.5.

The compliance of a 100 x 100 x 30 mm block, bonded below, under a Gaussian patch of 15 mm amid its top,
over that of a mixed element (Taylor-Hood: quadratic displacement, linear pressure; scikit-fem), which
cannot lock, on a finer mesh; and degrees of freedom. An element that locks is too stiff: a ratio below 1.
"""

from __future__ import annotations

import argparse

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import Basis, BilinearForm, ElementTetP1, ElementTetP2, ElementVector, MeshTet
from skfem.helpers import ddot, div, sym_grad

from benchmarks.timing import table
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.elastic.elasticity import LOCAL_BULK, lame_parameters
from palpate.mechanics.elastic.pardiso import Pardiso, available
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import OptionError
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh

KINDS = {
    "linear": (1, LOCAL_BULK),
    "quadratic, at every point": (2, np.inf),
    "quadratic, by its mean": (2, 0.0),
    "quadratic, shared": (2, LOCAL_BULK),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Poisson's ratios."""
    parser.add_argument("--poisson-ratio", type=float, nargs="+", default=[0.3, 0.49, 0.499])


def patch_load(mesh: TetMesh) -> np.ndarray:
    """(n, 3) nodal forces of a unit load on the patch."""
    nodes, weights = PatchSampler(mesh, 0.015).weights(np.array([0.0, 0.0, 0.03]))
    force = np.zeros_like(mesh.points)
    force[nodes, 2] = weights
    return force


def compliance(mesh: TetMesh, nu: float, local_bulk: float = LOCAL_BULK) -> tuple[float, int]:
    """(compliance of the patch for unit modulus 1/m, degrees of freedom)."""
    solver = Solver(mesh, nu, local_bulk=local_bulk)
    force = patch_load(mesh)
    return float((solver.solve(force) * force).sum()), len(solver.free)


def mixed_compliance(mesh: TetMesh, nu: float) -> float:
    """The same by Taylor-Hood elements; mesh: quadratic."""
    lam, mu = lame_parameters(1.0, nu)
    linear = mesh.linear()
    skfem_mesh = MeshTet(np.ascontiguousarray(linear.points.T), np.ascontiguousarray(linear.tetrahedra.T))
    u = Basis(skfem_mesh, ElementVector(ElementTetP2()), intorder=4)
    p = u.with_element(ElementTetP1())
    a = BilinearForm(lambda v, w, _: 2 * mu * ddot(sym_grad(v), sym_grad(w))).assemble(u)
    b = BilinearForm(lambda v, q, _: -q * div(v)).assemble(u, p)
    c = BilinearForm(lambda q, r, _: -q * r / lam).assemble(p)
    place = cKDTree(mesh.points).query(u.doflocs.T)[1]
    axis = np.zeros(u.N, dtype=np.int64)
    for k in range(3):
        axis[np.concatenate([u.nodal_dofs[k], u.edge_dofs[k]])] = k
    force = patch_load(mesh)[place, axis]
    free = np.flatnonzero(np.concatenate([~mesh.fixed[place], np.ones(p.N, dtype=bool)]))
    matrix = sp.bmat([[a, b.T], [b, c]], format="csr")[free][:, free]
    right = np.concatenate([force, np.zeros(p.N)])[free]
    solution = Pardiso(matrix, definite=False).solve(right)
    return float(solution @ right)


def run(arguments: argparse.Namespace) -> dict:
    """Print compliance over the mixed element's, element by element and mesh by mesh."""
    if not available():
        raise OptionError("the mixed element's system is factorised by MKL Pardiso, which is not here")
    sizes = {"15 mm": (7, 7, 2), "10 mm": (10, 10, 3), "7.5 mm": (13, 13, 4), "6 mm": (17, 17, 5)}
    finest = box_mesh((18, 18, 6), (0.1, 0.1, 0.03)).quadratic()
    result: dict = {}
    for nu in arguments.poisson_ratio:
        reference = mixed_compliance(finest, nu)
        coarser = mixed_compliance(box_mesh((13, 13, 4), (0.1, 0.1, 0.03)).quadratic(), nu)
        rows = []
        for kind, (order, local_bulk) in KINDS.items():
            row: list = [kind]
            for name, cells in sizes.items():
                mesh = box_mesh(cells, (0.1, 0.1, 0.03))
                value, dofs = compliance(mesh if order == 1 else mesh.quadratic(), nu, local_bulk)
                row += [value / reference, dofs]
                result[f"{nu} {kind} {name}"] = value / reference
            rows.append(row)
        result[f"{nu} mixed 7.5 mm"] = coarser / reference
        print(f"Poisson's ratio {nu}; mixed element on 7.5 mm: {coarser / reference:.4f} of that on 5.6 mm")
        print(table(["element"] + [h for name in sizes for h in (name, "unknowns")], rows), flush=True)
    return result
