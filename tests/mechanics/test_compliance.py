"""The servo's tables, and the solver behind them."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.compliance import stored_compliance
from palpate.mechanics.compliance.sites import LoadPatch, touch_sites
from palpate.mechanics.compliance.surface_compliance import patch_blocks, surface_compliance
from palpate.mechanics.elastic.pardiso import available
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import MeshError, OptionError
from palpate.mechanics.shape.nearest import closest
from palpate.mechanics.shape.tetmesh import TetMesh


def test_an_unknown_backend_is_refused(box):
    mesh = box((2, 2, 2), (0.1, 0.1, 0.05))
    with pytest.raises(OptionError, match="pardiso, superlu"):
        Solver(mesh, 0.4, backend="cholmod")


def test_a_mesh_that_nothing_holds_is_refused(box):
    mesh = box((2, 2, 2), (0.1, 0.1, 0.05))
    nobody = np.zeros(len(mesh.points), dtype=bool)
    with pytest.raises(MeshError, match="rigid body"):
        Solver(TetMesh(mesh.points, mesh.tetrahedra, nobody, mesh.touchable), 0.4)


@pytest.mark.skipif(not available(), reason="needs both backends")
def test_backends_agree(box):
    mesh = box((3, 3, 2), (0.1, 0.1, 0.05)).quadratic()
    force = np.random.default_rng(1).normal(size=(len(mesh.points), 3, 2))
    one, other = (Solver(mesh, 0.49, backend=b).solve(force) for b in ("pardiso", "superlu"))
    assert np.abs(one - other).max() < 1e-10 * np.abs(one).max()
    loads = np.random.default_rng(2).normal(size=(3 * (~mesh.fixed).sum(), 4, 3))
    forms = [Solver(mesh, 0.49, backend=b).quadratic_forms(loads) for b in ("pardiso", "superlu")]
    assert forms[0] == pytest.approx(forms[1], rel=1e-9, abs=1e-9)
    # a place that is solved alone has the bits that it has among others
    alone = Solver(mesh, 0.49, backend="pardiso")
    for k in range(4):
        assert np.array_equal(alone.quadratic_forms(loads[:, k : k + 1])[0], forms[0][k])


@pytest.fixture(scope="module")
def tables(box):
    mesh = box((5, 5, 3), (0.05, 0.05, 0.03))
    return mesh, surface_compliance(mesh, 0.45)


def test_own_table_is_what_a_site_sees(tables):
    mesh, surface = tables
    pick = np.flatnonzero(surface.own_normals[:, 2] > 0.99)[::5]
    sites = touch_sites(mesh, surface.own_points[pick], surface.own_normals[pick], 0.45, curvature=0.0)
    there = surface.far_at(surface.own_points[pick], surface.own_normals[pick])
    assert np.abs(there - sites.far).max() < 1e-6 * np.abs(surface.own).max()


def test_own_table_between_corners_is_near_the_truth(tables):
    mesh, surface = tables
    points = np.array([[0.003, 0.004, 0.03], [-0.007, 0.002, 0.03], [0.025, 0.003, 0.016]])
    normals = np.array([[0, 0, 1.0], [0, 0, 1.0], [1.0, 0, 0]])
    sites = touch_sites(mesh, points, normals, 0.45, curvature=0.0)
    error = np.abs(surface.far_at(points, normals) - sites.far).max()
    assert error < 0.03 * np.abs(surface.own).max()


def test_blocks_are_symmetric_positive_and_continuous(tables):
    _, surface = tables
    t = len(surface.nodes)
    dense = surface.blocks.transpose(0, 2, 1, 3).reshape(3 * t, 3 * t).astype(float)
    assert np.abs(dense - dense.T).max() < 1e-6 * np.abs(dense).max()
    assert np.linalg.eigvalsh(dense).min() > -1e-6 * np.abs(dense).max()
    one, other = surface.triangles[0], surface.triangles[7]
    w, v = np.array([0.2, 0.3, 0.5]), np.array([0.6, 0.4, 0.0])
    out = np.einsum("i,ijab,j->ab", w, surface.blocks[np.ix_(one, other)], v)
    moved = sum(v[c] * surface.displacement(other[c], np.array([0.0, 0.0, 1.0])) for c in range(3))
    assert w @ moved[one] == pytest.approx(out[:, 2], rel=1e-4)


def test_a_large_surface_is_compressed_by_itself(box, monkeypatch):
    mesh = box((4, 4, 2), (0.05, 0.05, 0.02))
    assert stored_compliance.low_rank_error(mesh) is None
    monkeypatch.setattr(stored_compliance, "LARGEST_DENSE_BYTES", 1e3)
    assert stored_compliance.low_rank_error(mesh) == stored_compliance.LOW_RANK_ERROR


def test_low_rank_tables_serve_the_same_compliance(box):
    """On elements of 4 mm: mutual compliance from a factor, own compliance as in the dense form."""
    mesh = box((8, 8, 5), (0.032, 0.032, 0.02))
    made = surface_compliance(mesh, 0.45, low_rank_error=0.01)
    assert made.blocks.size == 0
    assert made.factor.shape[:2] == (len(made.points), 3)
    rng = np.random.default_rng(0)
    faces = made.own_points[made.own_triangles[rng.integers(0, len(made.own_triangles), 12)]]
    points = np.einsum("c,kcx->kx", [0.3, 0.5, 0.2], faces)
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    solver = Solver(mesh.quadratic(), 0.45)
    width = float(made.own_width_m[0])
    sites = touch_sites(mesh, points, normals, 0.45, patch=LoadPatch(width), curvature=np.zeros(12))
    size = np.abs(made.own).max(axis=(0, 1, 2))
    assert np.abs(made.far_at(points, normals) - sites.far).max() < 0.04 * size
    dense = patch_blocks(solver, made.points[:40], float(made.patch_width_m[0]))
    for i, j in ((0, 0), (3, 30), (39, 11)):
        moved = [made.displacement(j, force)[i] for force in np.eye(3)]
        assert np.abs(np.transpose(moved) - dense[i, j]).max() < 0.012 * np.abs(dense).max()


def test_closest_point_on_triangles():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    triangles = np.array([[0, 1, 2], [1, 3, 2]])
    points = np.array([[0.2, 0.2, 0.5], [0.9, 0.8, -0.1], [2.0, 0.5, 0.0], [-1.0, -1.0, 0.0]])
    found, triangle, weights = closest(corners, triangles, points)
    nearest = np.einsum("kc,kcx->kx", weights, corners[triangles[triangle]])
    assert found == pytest.approx(nearest)
    assert nearest == pytest.approx(np.array([[0.2, 0.2, 0], [0.9, 0.8, 0], [1, 0.5, 0], [0, 0, 0]]))
    assert (weights >= 0).all()
    assert [len(part) for part in closest(corners, triangles, np.zeros((0, 3)))] == [0, 0, 0]
