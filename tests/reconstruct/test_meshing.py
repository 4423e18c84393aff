"""Tetrahedra: base planar and fixed, volume kept, quality reported."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import Delaunay

import palpate.reconstruction.steps.s5_mesh.meshing as meshing_module
from benchmarks._surface_truth import phantom_truth, touch
from palpate.mechanics.errors import MeshError, SurfaceError
from palpate.reconstruction.shapes.drawing import balanced
from palpate.reconstruction.steps.s4_surface import Surface, SurfaceOptions, reconstruct_surface
from palpate.reconstruction.steps.s5_mesh import tetwild
from palpate.reconstruction.steps.s5_mesh.meshing import (
    MeshingOptions,
    _held,
    mesh_surface,
    radius_edge_ratio,
    relaxed,
)
from palpate.reconstruction.steps.s5_mesh.tetwild import tetrahedralize
from palpate.reconstruction.steps.s5_mesh.voxel_mesher import labels, voxel_surface


@pytest.fixture(scope="module")
def surface():
    return reconstruct_surface(touch(phantom_truth("half-sphere"), 0)[0], SurfaceOptions(surface="sphere"))


@pytest.fixture(scope="module")
def meshing(surface):
    return mesh_surface(surface, MeshingOptions(mesh_size_m=0.012))


def test_fixed_nodes_are_the_base(surface, meshing):
    mesh = meshing.mesh
    height = (mesh.points - surface.support_point) @ surface.support_normal
    assert np.abs(height[mesh.fixed]).max() < 1e-9
    assert height[mesh.touchable].min() > 0
    assert mesh.fixed.sum() > 40
    assert not (mesh.fixed & mesh.touchable).any()
    on_surface = np.zeros(len(mesh.points), dtype=bool)
    on_surface[np.unique(mesh.surface)] = True
    assert np.array_equal(on_surface, mesh.fixed | mesh.touchable)


def test_the_mesh_fills_the_surface(surface, meshing):
    report = meshing.report
    assert report.volume_m3 == pytest.approx(surface.volume_m3, rel=0.005)
    assert np.percentile(report.surface_distance_m, 95) < 0.0005
    assert report.edge_m.mean() == pytest.approx(0.012, rel=0.25)
    assert np.mean(report.radius_edge_ratio > 2) < 0.01


def test_radius_edge_ratio_of_regular_tetrahedra():
    from palpate.mechanics.shape.tetmesh import TetMesh
    from palpate.reconstruction.steps.s5_mesh.meshing import quality

    corner = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    cell = np.array([[0, 1, 3, 2]])
    volume = np.linalg.det(corner[cell[0, 1:]] - corner[cell[0, 0]])
    cell = cell if volume > 0 else cell[:, [0, 2, 1, 3]]
    yes = np.array([True, True, True, False])
    mesh = TetMesh(corner, cell, yes, ~yes)
    shell = Surface(
        corner, mesh.surface, np.zeros(4), np.zeros(3), np.array([0, 0, 1.0]), method="known", reason=""
    )
    report = quality(mesh, shell)
    assert report.radius_edge_ratio == pytest.approx(np.sqrt(6) / 4)
    assert report.surface_distance_m.max() < 1e-9


def test_uncertainty_reaches_the_nodes(surface, meshing):
    found = meshing.shape_uncertainty_m
    assert found.shape == (len(meshing.mesh.points),)
    assert (found[meshing.mesh.touchable] > 0).all()
    assert found.max() <= surface.uncertainty_m.max() + 1e-12


def test_a_coarse_drawing_keeps_the_volume():
    from palpate.reconstruction.shapes.cap import Cap

    ball = Cap.sphere(np.array([0.0, 0, 0.01]), 0.05)
    fine, coarse = ball.mesh(0.002), ball.mesh(0.009)

    before = volume(*coarse) / volume(*fine) - 1
    after = volume(balanced(coarse, fine), coarse[1]) / volume(*fine) - 1
    assert before < -0.005
    assert abs(after) < 0.15 * abs(before)


def test_voxels_keep_the_base_and_the_volume():
    from palpate.reconstruction.shapes.cap import Cap

    given = Cap.sphere(np.array([0.0, 0, 0.01]), 0.03).mesh(0.006)
    found = voxel_surface(*given, 0.002)
    assert volume(*found) == pytest.approx(volume(*given), rel=0.03)
    assert found[0][:, 2].min() == 0.0
    assert (found[0][:, 2] == 0.0).sum() > 10


def volume(vertices, triangles):
    corner = vertices[triangles]
    return np.einsum("ij,ij->i", np.cross(corner[:, 0], corner[:, 1]), corner[:, 2]).sum() / 6


def test_a_surface_with_a_hole_is_refused(surface):
    with pytest.raises(SurfaceError, match="open"):
        Surface(
            surface.vertices,
            surface.triangles[1:],
            surface.uncertainty_m,
            surface.support_point,
            surface.support_normal,
            method="known",
            reason="",
        )


def test_a_mesh_size_of_nothing_is_refused(surface):
    with pytest.raises(MeshError, match="mesh-size"):
        mesh_surface(surface, MeshingOptions(mesh_size_m=0.0))


@pytest.mark.slow
def test_a_mesh_beyond_its_bound_is_made_anew_and_the_best_is_kept(surface, monkeypatch):
    made, standing = [], meshing_module._standing
    monkeypatch.setattr(meshing_module, "_standing", lambda *given: made.append(standing(*given)) or made[-1])

    def worst(mesh):
        return radius_edge_ratio(mesh.points[mesh.tetrahedra]).max()

    # no mesh is that regular: all tries are made, and relaxing them to the end would only take longer
    monkeypatch.setattr(meshing_module, "_SWEEPS", 2)
    found = meshing_module.fill(surface, MeshingOptions(mesh_size_m=0.015, radius_edge_ratio=0.9))
    assert len(made) == 3 and worst(found) == min(map(worst, made))
    made.clear()
    found = meshing_module.fill(surface, MeshingOptions(mesh_size_m=0.015, radius_edge_ratio=50.0))
    assert len(made) == 1 and found is made[0]


def test_a_surface_off_the_support_is_refused(surface):
    lifted = Surface(
        surface.vertices + 0.02 * surface.support_normal,
        surface.triangles,
        surface.uncertainty_m,
        surface.support_point,
        surface.support_normal,
        method="known",
        reason="",
    )
    with pytest.raises(MeshError, match="support"):
        mesh_surface(lifted, MeshingOptions(mesh_size_m=0.015))


@pytest.fixture(scope="module")
def paper_meshing():
    """The paper's way: hull, voxels, tetrahedra."""
    evidence = touch(phantom_truth("half-sphere"), 1)[0]
    surface = reconstruct_surface(evidence, SurfaceOptions(surface="hull"))
    return mesh_surface(surface, MeshingOptions(mesh_source="voxels"))


@pytest.mark.slow
def test_the_papers_mesh_keeps_both_of_its_bounds(paper_meshing):
    report = paper_meshing.report
    assert report.radius_edge_ratio.max() <= 2.0
    assert report.surface_distance_m.max() <= 0.002


def test_bad_tetrahedra_are_relaxed_and_nothing_else_moves():
    # a flat tetrahedron over an edge of a regular stack: only its own nodes may move
    grid = np.stack(np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = Delaunay(grid + 0.15 * np.random.default_rng(4).random(grid.shape)).simplices
    corner = grid[cells]
    volume = np.linalg.det(corner[:, 1:] - corner[:, :1])
    cells[volume < 0] = cells[volume < 0][:, [0, 2, 1, 3]]
    cells = cells[np.abs(volume) > 1e-6]
    inside = ((grid > 0) & (grid < 3)).all(axis=1)
    node = np.flatnonzero(inside)[0]
    bent = grid.copy()
    bent[node] += [0.0, 0.0, 0.93]
    star = cells[(cells == node).any(axis=1)]
    before = radius_edge_ratio(bent[star])
    after = relaxed(
        bent, cells, 2.0, on_surface=~inside, fixed=grid[:, 2] == 0, up=np.array([0, 0, 1.0]), limit_m=0.05
    )
    assert before.max() > 4
    assert radius_edge_ratio(after[cells]).max() <= 2
    assert np.abs(after - bent)[~inside].max() <= 0.05 + 1e-12
    assert (after[grid[:, 2] == 0, 2] == 0).all()


def test_no_label_is_lost_where_a_line_meets_an_edge():
    from palpate.reconstruction.shapes.cap import Cap

    inside, low = labels(*Cap.sphere(np.array([0.0, 0, 0.01]), 0.03).mesh(0.006), 0.002)
    layers, rows, columns = np.nonzero(inside)
    points = low + 0.002 * np.column_stack([columns, rows, layers])
    assert np.linalg.norm(points - [0, 0, 0.01], axis=1).max() < 0.0305
    assert points[:, 2].min() > 0
    assert inside.sum() * 0.002**3 == pytest.approx(
        volume(*Cap.sphere(np.array([0.0, 0, 0.01]), 0.03).mesh(0.006)), rel=0.02
    )


def test_a_drawing_is_meshed_alike_each_time_it_is_asked_for(monkeypatch, tmp_path):
    monkeypatch.setenv("PALPATE_CACHE", str(tmp_path))
    ball = trimesh.creation.icosphere(3, radius=0.03)
    given = {"edge_m": 0.01, "envelope_m": 0.0005, "simplify": False}
    points, cells = tetrahedralize(ball.vertices, ball.faces, **given)
    again, same = tetrahedralize(ball.vertices, ball.faces, **given, threads=1)
    np.testing.assert_array_equal(again, points)
    np.testing.assert_array_equal(same, cells)
    other, _ = tetrahedralize(ball.vertices, ball.faces, **given, take=1)
    assert other.shape != points.shape or not np.allclose(other, points)


def test_a_mesher_that_hangs_is_tried_again_with_one_thread_on_a_simplified_drawing(monkeypatch, tmp_path):
    monkeypatch.setenv("PALPATE_CACHE", str(tmp_path))
    ended, asked = tetwild._ended, []

    def stuck_at_first(folder, limit_s):
        with np.load(folder / "surface.npz") as given:
            asked.append((bool(given["simplify"]), int(given["num_threads"])))
        return None if len(asked) == 1 else ended(folder, limit_s)

    monkeypatch.setattr(tetwild, "_ended", stuck_at_first)
    box = trimesh.creation.box(extents=(0.06, 0.06, 0.03))
    points, cells = tetrahedralize(
        box.vertices, box.faces, edge_m=0.02, envelope_m=0.001, simplify=False, threads=2
    )
    corner = points[cells]
    volume = np.linalg.det(corner[:, 1:] - corner[:, :1]).sum() / 6
    assert asked == [(False, 2), (True, 1)]
    assert volume == pytest.approx(0.06 * 0.06 * 0.03, rel=0.01)


@pytest.mark.slow
def test_a_mesh_that_the_support_flattens_is_made_again(surface, monkeypatch):
    relax, made = meshing_module.relaxed, []

    def flattened_at_first(points, cells, *arguments, **options):
        made.append(len(cells))
        moved = relax(points, cells, *arguments, **options)
        if len(made) == 1:
            moved[cells[0, 1]] = moved[cells[0, 0]]
        return moved

    monkeypatch.setattr(meshing_module, "relaxed", flattened_at_first)
    # the mesher is never twice the same: no bound on its ratio, which may ask for a third
    options = MeshingOptions(mesh_size_m=0.015, radius_edge_ratio=100.0)
    assert (mesh_surface(surface, options).mesh.volumes > 0).all()
    assert len(made) == 2


def test_a_drop_beside_the_object_is_left_out_and_half_of_it_refused():
    """What nothing holds would leave the stiffness singular."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    fixed = np.array([True, True, True, False])
    cell = np.arange(4)

    def beside(size):
        drop = points * size + 3.0
        return _held(
            np.vstack([points, drop]), np.vstack([cell, cell + 4]), np.concatenate([fixed, np.zeros(4, bool)])
        )

    np.testing.assert_array_equal(beside(0.1), [cell])
    with pytest.raises(MeshError, match="in pieces: 50 %"):
        beside(1.0)
    both = _held(np.vstack([points, points + 3]), np.vstack([cell, cell + 4]), np.tile(fixed, 2))
    assert len(both) == 2
