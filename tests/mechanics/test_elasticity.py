"""Elements: patch test, rigid motion, uniaxial bar, locking, convergence order."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.elastic.dissected import DissectedFactor
from palpate.mechanics.elastic.elasticity import element_stiffness, lame_parameters, stiffness, strain
from palpate.mechanics.elastic.held_base import BaseHold
from palpate.mechanics.elastic.pardiso import Pardiso, available
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import MeshError

from ..support.elements import compliance, mixed_compliance
from .closed_forms import uniaxial_strain_of_stress, volume_strain_of_pressure


def solve_with(mesh, nu, held, values, forces=None, **options):
    """Displacements (n, 3) with the degrees of freedom `held` (n, 3) at `values`."""
    matrix = stiffness(mesh, nu, **options)
    u = np.where(held, values, 0.0).ravel()
    load = np.zeros(u.size) if forces is None else forces.ravel()
    free = ~held.ravel()
    u[free] = spla.spsolve(matrix[free][:, free].tocsc(), (load - matrix @ u)[free])
    return u.reshape(-1, 3)


def on_boundary(mesh):
    nodes = np.zeros(len(mesh.points), dtype=bool)
    nodes[np.unique(mesh.surface)] = True
    return nodes


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.499])
def test_patch_test_to_rounding(box, order, nu):
    mesh = box((3, 2, 2), (0.1, 0.07, 0.05))
    rng = np.random.default_rng(1)
    inner = ~on_boundary(mesh)
    points = mesh.points.copy()
    points[inner] += 0.004 * rng.normal(size=(inner.sum(), 3))
    mesh = type(mesh)(points, mesh.tetrahedra, mesh.fixed, mesh.touchable)
    mesh = mesh if order == 1 else mesh.quadratic()
    gradient = rng.normal(size=(3, 3))
    exact = mesh.points @ gradient.T
    held = np.repeat(on_boundary(mesh)[:, None], 3, axis=1)
    u = solve_with(mesh, nu, held, exact)
    assert np.abs(u - exact).max() < 1e-12 * np.abs(exact).max() / (1 - 2 * nu)
    assert np.abs(strain(mesh, u) - (gradient + gradient.T) / 2).max() < 1e-10


@pytest.mark.parametrize("order", [1, 2])
def test_rigid_motion_makes_no_force(box, order):
    mesh = box((2, 2, 2), (0.1, 0.1, 0.05))
    mesh = mesh if order == 1 else mesh.quadratic()
    matrix = stiffness(mesh, 0.49)
    spin = np.cross(np.array([1.0, 2.0, 3.0]), mesh.points)
    for motion in (np.ones((len(mesh.points), 3)), spin):
        assert np.abs(matrix @ motion.ravel()).max() < 1e-13 * abs(matrix).max()
    assert abs(matrix - matrix.T).max() < 1e-14


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_uniaxial_bar(box, nu):
    mesh = box((2, 2, 4), (0.02, 0.02, 0.08)).quadratic()
    low = mesh.points.min(axis=0)
    held = np.isclose(mesh.points, low)  # three symmetry planes
    stress = 0.01
    top = np.isclose(mesh.points[:, 2], 0.08)
    want = uniaxial_strain_of_stress(stress, 1.0, nu)
    values = np.zeros_like(mesh.points)
    held[top, 2] = True
    values[top, 2] = want[0] * 0.08
    u = solve_with(mesh, nu, held, values)
    expected = (mesh.points - low) * want[[1, 2, 0]]
    assert np.abs(u - expected).max() < 1e-12
    reaction = (stiffness(mesh, nu) @ u.ravel()).reshape(-1, 3)[top, 2].sum()
    assert reaction == pytest.approx(stress * 0.02**2, rel=1e-10)


def test_hydrostatic_pressure_changes_the_volume(box):
    mesh = box((2, 2, 2), (0.1, 0.1, 0.1)).quadratic()
    nu, pressure = 0.3, 0.02
    change = volume_strain_of_pressure(pressure, 1.0, nu)
    u = mesh.points * change / 3
    lam, mu = lame_parameters(1.0, nu)
    force = (stiffness(mesh, nu) @ u.ravel()).reshape(-1, 3)
    top = np.isclose(mesh.points[:, 2], 0.1)
    assert force[top, 2].sum() == pytest.approx(-pressure * 0.01, rel=1e-10)
    assert (lam + 2 * mu / 3) * change == pytest.approx(-pressure, rel=1e-12)


def test_modulus_scales_its_elements_alone(box):
    mesh = box((2, 2, 2), (0.1, 0.1, 0.05))
    ratio = np.ones(len(mesh.tetrahedra))
    ratio[3] = 5.0
    change = stiffness(mesh, 0.4, ratio) - stiffness(mesh, 0.4)
    touched = np.unique(change.nonzero()[0] // 3)
    assert set(touched) == set(mesh.tetrahedra[3])
    block = element_stiffness(mesh.points[mesh.tetrahedra[3]][None], 1, 0.4)[0].reshape(12, 12)
    dofs = (3 * mesh.tetrahedra[3][:, None] + np.arange(3)).ravel()
    assert np.allclose(change[dofs][:, dofs].toarray(), 4 * block)
    with pytest.raises(MeshError):
        stiffness(mesh, 0.4, ratio[1:])


@pytest.mark.parametrize(("order", "rate"), [(1, 1.5), (2, 2.7)])
def test_convergence_order(box, order, rate):
    """A smooth field given on the boundary and as body force is met at order 2 (linear) and 3 (quadratic)."""
    nu = 0.3
    _, mu = lame_parameters(1.0, nu)
    k = 20.0
    errors = []
    for cells in (4, 8) if order == 2 else (8, 16):
        mesh = box((cells, cells, cells), (0.1, 0.1, 0.1))
        mesh = mesh if order == 1 else mesh.quadratic()
        p = mesh.points
        exact = np.zeros_like(p)
        exact[:, 0] = np.sin(k * p[:, 2])  # a shear wave: div sigma = -mu k^2 u
        body = np.zeros_like(p)
        body[:, 0] = mu * k**2 * exact[:, 0]
        held = np.repeat(on_boundary(mesh)[:, None], 3, axis=1)
        u = solve_with(mesh, nu, held, exact, mass_times(mesh, body))
        errors.append(np.sqrt(((u - exact)[:, 0] ** 2).mean()))
    assert np.log2(errors[0] / errors[1]) > rate, errors


def mass_times(mesh, body):
    """Consistent loads of a nodal field: the mass matrix by a collapsed Gauss rule."""
    x, w = np.polynomial.legendre.leggauss(4)
    x, w = (x + 1) / 2, w / 2
    loads = np.zeros_like(body)
    for a, wa in zip(x, w, strict=True):
        for b, wb in zip(x, w, strict=True):
            for c, wc in zip(x, w, strict=True):
                bary = np.array([a, b * (1 - a), c * (1 - a) * (1 - b), 0.0])
                bary[3] = 1 - bary.sum()
                weight = 6 * wa * wb * wc * (1 - a) ** 2 * (1 - b)
                if mesh.order == 1:
                    shape = bary
                else:
                    from palpate.mechanics.shape.tetmesh import EDGES

                    shape = np.concatenate([bary * (2 * bary - 1), 4 * bary[EDGES[:, 0]] * bary[EDGES[:, 1]]])
                value = np.einsum("i,mix->mx", shape, body[mesh.tetrahedra])
                for i, s in enumerate(shape):
                    np.add.at(loads, mesh.tetrahedra[:, i], weight * s * mesh.volumes[:, None] * value)
    return loads


def test_quadratic_elements_do_not_lock(box):
    """A bonded, nearly incompressible block under a pressed top: a coarse mesh against a finer one."""

    def compliance(cells, order):
        mesh = box(cells, (0.1, 0.1, 0.03))
        mesh = mesh if order == 1 else mesh.quadratic()
        solver = Solver(mesh, 0.499)
        nodes, weights = PatchSampler(mesh, 0.015).weights(np.array([0.0, 0.0, 0.03]))
        force = np.zeros_like(mesh.points)
        force[nodes, 2] = weights
        return float((solver.solve(force) * force).sum())

    reference = compliance((13, 13, 4), 2)
    assert compliance((10, 10, 3), 2) == pytest.approx(reference, rel=0.03)
    assert compliance((10, 10, 3), 1) < 0.3 * reference  # the paper's element locks


@pytest.mark.skipif(not available(), reason="the mixed element's system needs an indefinite factorisation")
def test_a_bonded_block_does_not_lock(box):
    """A thin block's compliance on 12 mm elements against a mixed element, which cannot lock, on 8 mm."""
    found, _ = compliance(box((8, 8, 3), (0.1, 0.1, 0.03)).quadratic(), 0.499)
    reference = mixed_compliance(box((12, 12, 4), (0.1, 0.1, 0.03)).quadratic(), 0.499)
    assert found == pytest.approx(reference, rel=0.01)


@pytest.mark.skipif(not available(), reason="MKL Pardiso is not there")
def test_nodes_eliminated_together_move_as_unknowns_one_by_one(box):
    matrix = Solver(box((5, 4, 3), (0.1, 0.07, 0.05)).quadratic(), 0.49).matrix
    loads = np.random.default_rng(2).normal(size=(matrix.shape[0], 4))
    together, apart = Pardiso(matrix, group=3), Pardiso(matrix)
    assert np.allclose(together.solve(loads), apart.solve(loads), rtol=1e-9, atol=0)
    one, other = together.half_solve(loads), apart.half_solve(loads)
    assert np.allclose(one.T @ one, other.T @ other, rtol=1e-10)


@pytest.mark.skipif(not available(), reason="MKL Pardiso is not there")
def test_a_load_gives_the_same_bits_alone_and_among_others(box):
    """A processor takes columns by four or eight; those that were left over were rounded otherwise."""
    factor = Pardiso(Solver(box((5, 4, 3), (0.1, 0.07, 0.05)).quadratic(), 0.49).matrix)
    loads = np.random.default_rng(3).normal(size=(factor.size, 40))
    halves = factor.half_solve(loads)
    for count in (1, 2, 3, 6, 11, 34):
        assert (factor.half_solve(loads[:, 5 : 5 + count]) == halves[:, 5 : 5 + count]).all()


@pytest.fixture(scope="module")
def dissected(box):
    """A block's stiffness, beside a small one that nothing joins to it, in one factor and in many."""
    parts = [
        Solver(box(count, (0.1, 0.07, 0.05)).quadratic(), 0.49).matrix for count in ((6, 5, 4), (2, 2, 1))
    ]
    matrix = sp.block_diag(parts, format="csr")
    return matrix, Pardiso(matrix), DissectedFactor(matrix, part=60)


@pytest.mark.skipif(not available(), reason="MKL Pardiso is not there")
def test_a_dissected_mesh_solves_as_a_whole(dissected):
    matrix, whole, parts = dissected
    loads = np.random.default_rng(4).normal(size=(matrix.shape[0], 5))
    expected = whole.solve(loads)
    np.testing.assert_allclose(parts.solve(loads), expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(parts.solve(loads[:, 0]), parts.solve(loads)[:, 0], rtol=1e-12)
    # what a part takes from its border may exceed 1: of a stiffer object the library found no factor
    stiff = DissectedFactor((1e6 * matrix).tocsr(), part=60)
    np.testing.assert_allclose(1e6 * stiff.solve(loads), expected, atol=1e-9 * np.abs(expected).max())
    nearly = matrix - 1.5 * sp.diags(matrix.diagonal())
    with pytest.raises(ArithmeticError):
        DissectedFactor(nearly.tocsr(), part=60)


@pytest.mark.skipif(not available(), reason="MKL Pardiso is not there")
def test_loads_on_few_nodes_of_a_dissected_mesh_give_its_forms(dissected):
    """The same bits alone and among others; loads on parts, on separators and on both."""
    matrix, whole, parts = dissected
    rng = np.random.default_rng(5)
    loads = np.zeros((matrix.shape[0], 3 * 40))
    for k in range(40):
        near = 3 * rng.integers(0, matrix.shape[0] // 3 - 8) + np.arange(24)
        loads[near, 3 * k : 3 * k + 3] = rng.normal(size=(24, 3))
    half = whole.half_solve(loads).reshape(-1, 40, 3)
    found = parts.quadratic_forms(sp.csr_matrix(loads))
    np.testing.assert_allclose(
        found, np.einsum("fri,frj->rij", half, half), rtol=1e-9, atol=1e-9 * found.max()
    )
    for some in ([0], [7, 8], [39, 3, 20]):
        alone = sp.csr_matrix(loads.reshape(-1, 40, 3)[:, some].reshape(len(loads), -1))
        assert (parts.quadratic_forms(alone) == found[some]).all()


def test_a_solver_has_the_stiffness_of_what_is_free(box):
    """Blocks of nodes are chosen, not numbers; springs under the base are added to them."""
    mesh = box((3, 2, 2), (0.1, 0.07, 0.05)).quadratic()
    for hold in (None, BaseHold(np.array([0.0, 0.0, 1.0]), springs=(30.0, 20.0))):
        solver = Solver(mesh, 0.45, hold=hold)
        whole = stiffness(mesh, 0.45).toarray()
        if hold is not None:
            whole += hold.stiffness(mesh).toarray()
        expected = whole[np.ix_(solver.free, solver.free)]
        assert np.abs(solver.matrix.toarray() - expected).max() < 1e-14 * np.abs(expected).max()
        assert np.abs(expected - expected.T).max() < 1e-14 * np.abs(expected).max()


@pytest.mark.parametrize(("said", "taken"), [(None, "0"), ("50", "50")])
def test_threads_of_the_factorisation_wait_without_work_of_the_processor(said, taken):
    """A thirteenth of the demo's time of the processor was spent in waiting, which slowed what ran beside."""
    code = (
        "import os\nfrom palpate.mechanics.elastic import pardiso\n"
        "pardiso.available()\nprint(os.environ['KMP_BLOCKTIME'])"
    )
    given = {key: value for key, value in os.environ.items() if key != "KMP_BLOCKTIME"}
    environment = given if said is None else given | {"KMP_BLOCKTIME": said}
    told = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert told.stdout.strip() == taken
