"""Touch sites: Hertz on a large block whatever the mesh, refinement near the surface, curvature."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import (
    LoadPatch,
    contact_curvature,
    factorised_once,
    patch_width,
    touch_sites,
    touch_solver,
)
from palpate.mechanics.compliance.surface_compliance import surface_compliance
from palpate.mechanics.contact.touch import touch_force
from palpate.mechanics.elastic.pardiso import available
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import MeshError
from palpate.mechanics.shape.refine import (
    MOST_TETRAHEDRA,
    refined_around,
    refined_near_surface,
    typical_edge,
)

from .closed_forms import hertz_force

UP = np.array([0.0, 0.0, 1.0])


def test_one_factorisation_serves_who_asks_an_object_again(box):
    def stiffness(solver):
        return solver.matrix.data

    made = partial(touch_solver, surface_edge_m=0.02)
    mesh = box((3, 3, 2), (0.03, 0.03, 0.02))
    ones = np.ones(len(mesh.tetrahedra))
    alone = made(mesh, 0.45)
    with factorised_once():
        first = made(mesh, 0.45)
        assert made(mesh.quadratic(), 0.45, ones) is first
        with ThreadPoolExecutor(1) as other:  # no factor is used by two threads at once
            assert other.submit(made, mesh, 0.45).result() is not first
        # all that the numbers depend on makes it another one
        moved = replace(mesh, points=1.01 * mesh.points)
        free = replace(mesh, fixed=mesh.fixed & (mesh.points[:, 0] > 0))
        for changed in ((moved, 0.45), (free, 0.45), (mesh, 0.4), (mesh, 0.45, 1 + ones)):
            assert not np.array_equal(stiffness(made(*changed)), stiffness(first))
        again = made(mesh, 0.45)
        assert again is not first  # the last one alone is held
    assert made(mesh, 0.45) is not again
    assert all(np.array_equal(stiffness(alone), stiffness(each)) for each in (first, again))


def test_a_small_object_gives_way_as_a_large_one_of_its_form(box):
    """All lengths a tenth: the same but for the unit of length, as its elements are halved alike."""
    far = []
    for size in (0.05, 0.005):
        mesh = box((5, 5, 5), (size, size, size))
        places = size * np.array([[0.5, 0.0, 0.2], [0.2, 0.1, 1.0]])
        facing = np.array([[1.0, 0.0, 0.0], UP])
        far.append(
            size
            * touch_sites(
                mesh, places, facing, 0.45, curvature=0.0, patch=LoadPatch(tip_radius_m=size / 10)
            ).far
        )
    np.testing.assert_allclose(far[1], far[0], atol=0.01 * np.abs(far[0]).max())


def test_a_place_beside_a_rim_or_above_the_base_gives_way_alike_on_a_finer_mesh(box):
    """The patch went with the elements: 1 mm from this block's rim they changed the force by 6 %, near its
    base by 2 %."""
    size, tip, depth = (0.07, 0.06, 0.04), 5e-3, 1.9e-3
    places = np.array([[0.034, 0.001, 0.04], [0.035, 0.001, 0.006]])
    facing = np.array([UP, [1.0, 0.0, 0.0]])
    forces = []
    for cells in ((14, 12, 8), (20, 17, 12)):  # edges of 5 and 3.5 mm
        sites = touch_sites(box(cells, size), places, facing, 0.49, curvature=0.0)
        forces.append(
            [
                touch_force(
                    -depth * n[None], n, far, young_modulus_pa=20e3, poisson_ratio=0.49, tip_radius_m=tip
                )[-1]
                @ n
                for n, far in zip(facing, sites.far, strict=True)
            ]
        )
    assert forces[0] == pytest.approx(forces[1], rel=0.015)


@pytest.mark.slow
def test_an_object_on_a_narrow_foot_turns_about_it_as_on_a_foot_of_fine_elements(box):
    """A ball on a foot a third as wide gave way 8 % too little, on two meshes 7 % apart."""
    whole = box((6, 6, 6), (0.06, 0.06, 0.06))
    foot = whole.fixed & (np.abs(whole.points[:, :2]) < 0.0101).all(axis=1)
    mesh = replace(whole, fixed=foot, touchable=whole.touchable | (whole.fixed & ~foot))
    fine = mesh
    for edge_m in (4e-3, 2e-3):  # to 2.5 mm
        fine, _ = refined_around(fine, np.zeros(3), 0.015, edge_m)
    side, facing = np.array([[0.03, 0.001, 0.05]]), np.array([[1.0, 0.0, 0.0]])
    give, known = (touch_sites(each, side, facing, 0.49, curvature=0.0).far[0, 0, 0] for each in (mesh, fine))
    assert give == pytest.approx(known, rel=0.03)
    assert len(refined_near_surface(whole, 1.0)[0].points) == len(whole.points)  # as wide as the object


@pytest.mark.skipif(not available(), reason="large systems, slow without MKL")
def test_hertz_on_a_large_block_whatever_the_mesh(box):
    """A sphere of 10 mm pressed 1 mm into a block of 400 mm on elements of 130, 80, 50 mm.

    Within 3 % of Hertz (the block is finite: 1.4 % of it is real), and nearer and nearer to a finer mesh.
    """
    nu, modulus, depth, radius = 0.49, 20e3, 1e-3, 10e-3
    known = hertz_force(depth, radius, modulus, nu)
    point = np.array([[0.013, -0.008, 0.2]])
    forces = []
    for cells in (3, 5, 8, 10):
        mesh = box((cells, cells, cells // 2 + 1), (0.4, 0.4, 0.2)).quadratic()
        sites = touch_sites(mesh, point, UP[None], nu, solver=Solver(mesh, nu), curvature=0.0)
        known_touch = {"young_modulus_pa": modulus, "poisson_ratio": nu, "tip_radius_m": radius}
        path = np.array([[0, 0, -depth]])
        forces.append(touch_force(path, UP, sites.far[0], law="hertz", **known_touch)[0, 2])
    *coarse, reference = np.array(forces) / known
    assert np.abs(np.array(forces) / known - 1).max() < 0.03
    errors = np.abs(np.array(coarse) - reference)
    assert errors[0] > errors[1] > errors[2], forces


def test_sites_near_the_base_give_less(box):
    mesh = box((6, 6, 4), (0.1, 0.1, 0.06))
    points = np.array([[0.05, 0.0, z] for z in (0.01, 0.03, 0.05)])
    normals = np.tile([1.0, 0, 0], (3, 1))
    sites = touch_sites(mesh, points, normals, 0.49, solver=Solver(mesh.quadratic(), 0.49))
    compliance = sites.far[:, 0, 0]
    assert compliance[0] < compliance[1] < compliance[2]
    assert np.array_equal(sites.far, sites.far.transpose(0, 2, 1))
    assert np.abs(sites.curvature).max() < 1e-6


def test_sites_leave_the_callers_arrays_writable(box):
    mesh = box((4, 4, 2), (0.1, 0.1, 0.05))
    points, normals = np.array([[0.0, 0, 0.05]]), np.array([[0.0, 0, 2.0]])
    sites = touch_sites(mesh, points, normals, 0.3, solver=Solver(mesh.quadratic(), 0.3))
    points[0, 0] = 1.0
    assert sites.points[0, 0] == 0.0
    assert sites.normals[0, 2] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        sites.far[0] = 0
    with pytest.raises(MeshError, match="normals not 0"):
        touch_sites(mesh, points, normals * 0, 0.3)


@pytest.mark.slow
@pytest.mark.skipif(not available(), reason="large systems, slow without MKL")
def test_what_a_stiff_layer_adds_does_not_hang_on_the_patch_that_the_shape_is_felt_under(box):
    """The renderer's tables and a site agree, and both give the layer what a load as narrow as elements bear
    tells of it."""
    nu, point = 0.49, np.array([[0.0, 0.0, 0.04]])
    mesh = box((6, 6, 3), (0.08, 0.08, 0.04))
    # what is held around the place has no tables to make, which are all that takes long here
    held = mesh.fixed | (np.abs(mesh.points[:, :2]).max(axis=1) > 0.026)
    mesh = replace(mesh, fixed=held, touchable=mesh.touchable & ~held).quadratic()
    layer = np.where(mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)[:, 2] > 0.0267, 3.0, 1.0)
    solvers = [touch_solver(mesh, nu, ratio) for ratio in (None, layer)]
    edge = 0.8 * typical_edge(solvers[0].mesh)
    assert edge < 0.8 * patch_width(solvers[0].mesh)

    def added(patch: LoadPatch) -> float:
        bare, stiff = (
            touch_sites(mesh, point, UP[None], nu, solver=s, curvature=0.0, patch=patch).far[0, 2, 2]
            for s in solvers
        )
        return stiff - bare

    assert added(LoadPatch()) == pytest.approx(added(LoadPatch(width_m=edge)), rel=1e-6)
    tables = [surface_compliance(mesh, nu, ratio).far_at(point, UP[None])[0, 2, 2] for ratio in (None, layer)]
    # a table has no sharper load than its elements bear
    assert tables[1] - tables[0] == pytest.approx(added(LoadPatch(width_m=edge)), rel=0.15)


def test_a_spot_of_tiny_elements_makes_no_place_softer(box):
    """The mesher leaves one now and then: by number they were most of the edges, the patch became a point and
    a modulus came out at a quarter."""
    mesh = box((6, 6, 3), (0.1, 0.1, 0.05))
    spotted, corner = mesh, np.array([0.05, 0.05, 0.05])
    for _ in range(5):
        spotted, _ = refined_around(spotted, corner, 0.006, 0.001)
    edges = spotted.points[spotted.touchable_surface[:, :3]]
    assert np.median(np.linalg.norm(edges - np.roll(edges, 1, axis=1), axis=2)) < 0.5 * typical_edge(mesh)
    assert typical_edge(spotted) == pytest.approx(typical_edge(mesh), rel=0.05)
    place = np.array([[0.0, 0, 0.05]]), np.array([[0.0, 0, 1.0]])
    far = [
        touch_sites(m, *place, 0.49, solver=Solver(m.quadratic(), 0.49)).far[0, 0, 0] for m in (mesh, spotted)
    ]
    assert far[1] == pytest.approx(far[0], rel=0.03)


def test_refinement_keeps_shape_base_and_conformity(box):
    mesh = box((5, 5, 4), (0.1, 0.1, 0.08))
    fine, parent = refined_near_surface(mesh, 0.012)
    assert typical_edge(fine) <= 0.012 < typical_edge(mesh)
    assert fine.volumes.sum() == pytest.approx(mesh.volumes.sum(), rel=1e-12)
    shares = np.bincount(parent, weights=fine.volumes, minlength=len(mesh.tetrahedra))
    assert shares == pytest.approx(mesh.volumes, rel=1e-9)
    edges = np.sort(fine.surface[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # closed: no hanging node
    assert np.array_equal(np.flatnonzero(fine.fixed), np.flatnonzero(fine.points[:, 2] == 0))
    on = np.zeros(len(fine.points), dtype=bool)
    on[np.unique(fine.surface)] = True
    assert np.array_equal(fine.touchable, on & ~fine.fixed)


def test_a_mesh_that_is_fine_enough_is_left_alone(box):
    mesh = box((4, 4, 2), (0.1, 0.1, 0.05))
    same, parent = refined_near_surface(mesh, 1.0)
    assert same is mesh
    assert np.array_equal(parent, np.arange(len(mesh.tetrahedra)))


def test_refined_elements_inherit_their_modulus(box):
    mesh = box((3, 3, 2), (0.06, 0.06, 0.04))
    ratio = np.random.default_rng(0).uniform(1, 5, len(mesh.tetrahedra))
    point, normal = np.array([[0.0, 0.0, 0.04]]), UP[None]
    plain = touch_sites(mesh, point, normal, 0.4).far[0, 2, 2]
    stiff = touch_sites(mesh, point, normal, 0.4, solver=touch_solver(mesh, 0.4, ratio)).far[0, 2, 2]
    double = touch_sites(mesh, point, normal, 0.4, solver=touch_solver(mesh, 0.4, 2 * np.ones_like(ratio)))
    solver = touch_solver(mesh, 0.4)
    known = plain + (1 - 0.4**2) / (2 * np.sqrt(np.pi) * patch_width(solver.mesh))
    assert stiff < plain
    assert double.far[0, 2, 2] == pytest.approx(plain - known / 2, rel=1e-9)


def test_curvature_of_a_bent_surface(box):
    mesh = box((12, 12, 3), (0.1, 0.1, 0.03))
    points = mesh.points.copy()
    points[:, 2] *= 1 - (points[:, 0] ** 2 / 0.1 + points[:, 1] ** 2 / 0.3) / (2 * 0.03)
    bent = type(mesh)(points, mesh.tetrahedra, mesh.fixed, mesh.touchable)
    found = contact_curvature(bent, np.array([[0.0, 0.0, 0.03]]), UP[None])[0]
    assert found == pytest.approx(0.5 * (1 / 0.1 + 1 / 0.3), rel=0.05)


def test_a_large_object_is_refined_as_far_as_memory_allows(box):
    """A block of 250 mm: a round more would make 165,000 tetrahedra, four times what 2 GB hold."""
    mesh = box((14, 14, 14), (0.25, 0.25, 0.25))
    fine, parent = refined_near_surface(mesh, 0.006)
    assert len(mesh.tetrahedra) < len(fine.tetrahedra) <= MOST_TETRAHEDRA
    assert typical_edge(fine) == pytest.approx(0.5 * typical_edge(mesh), rel=0.01)
    shares = np.bincount(parent, weights=fine.volumes, minlength=len(mesh.tetrahedra))
    assert shares == pytest.approx(mesh.volumes, rel=1e-9)
