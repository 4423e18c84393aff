"""Triangles that enclose no solid as they are: what their winding number calls inside, or a refusal."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from palpate.mechanics.errors import NotClosedError
from palpate.mechanics.shape.flat_foot import standing
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.reconstruction.geometry import filled
from palpate.reconstruction.geometry.filled import solid_of


@pytest.mark.slow
def test_a_soup_is_filled_and_stands():
    """Every triangle by itself, its corners off by more than rounding."""
    block = trimesh.creation.box(extents=(0.06, 0.05, 0.04))
    corners = np.array(block.triangles).reshape(-1, 3)
    corners += np.random.default_rng(2).normal(0, 2e-5, corners.shape)
    soup = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    found = solid_of(soup)
    solid = trimesh.Trimesh(found.vertices, found.triangles, process=False)
    assert solid.volume == pytest.approx(block.volume, rel=0.01)
    assert "filled" in found.notes[0]
    assert standing(found).support_point[2] == pytest.approx(-0.02, abs=2e-4)


def test_corners_apart_by_rounding_are_joined_without_the_mesher(monkeypatch):
    def never(*_, **__):
        raise AssertionError("the mesher was asked")

    monkeypatch.setattr(filled, "tetrahedralize", never)
    block = trimesh.creation.icosphere(subdivisions=3, radius=0.03)
    corners = np.array(block.triangles).reshape(-1, 3)
    corners += np.random.default_rng(2).normal(0, 2e-6, corners.shape)
    soup = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    found = solid_of(soup)
    assert len(found.triangles) == len(block.faces) and "joined" in found.notes[0]
    solid = trimesh.Trimesh(found.vertices, found.triangles, process=False)
    assert solid.volume == pytest.approx(block.volume, rel=1e-3)


def test_tetrahedra_that_meet_in_an_edge_alone_have_a_closed_boundary_each():
    left = box_mesh((2, 2, 2), (0.03, 0.03, 0.03))
    points = np.vstack([left.points, left.points + [0.03, 0.03, 0]])
    places, merged = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    cells = merged.ravel()[np.vstack([left.tetrahedra, left.tetrahedra + len(left.points)])]
    shell = trimesh.Trimesh(*filled._boundary(places, cells), process=False)
    assert shell.is_watertight and shell.is_winding_consistent
    assert shell.volume == pytest.approx(2 * 0.03**3)


@pytest.mark.slow
def test_a_wall_between_bodies_that_touch_is_no_reason_to_refuse():
    left, right = (trimesh.creation.box(extents=(0.03, 0.04, h)) for h in (0.03, 0.045))
    right.apply_translation([0.03, 0, 0.0075])
    both = trimesh.util.concatenate([left, right])
    both.merge_vertices()
    found = solid_of(both)
    solid = trimesh.Trimesh(found.vertices, found.triangles, process=False)
    assert solid.volume == pytest.approx(left.volume + right.volume, rel=0.01)


def test_a_sheet_stays_refused():
    sheet = trimesh.creation.icosphere(subdivisions=2, radius=0.03)
    sheet.update_faces((sheet.triangles_center[:, 2] > 0.02) | (np.arange(len(sheet.faces)) % 40 == 0))
    with pytest.raises(NotClosedError):
        solid_of(sheet)


def test_layers_whose_walls_are_cut_into_other_triangles_are_one_solid(monkeypatch):
    """Three layers of a cube, each a body of its own: the mesher lost one or another of them."""

    def never(*_, **__):
        raise AssertionError("the mesher was asked")

    monkeypatch.setattr(filled, "tetrahedralize", never)
    layers = [trimesh.creation.box(extents=(0.05, 0.05, 0.015)) for _ in range(3)]
    for k, layer in enumerate(layers):
        layer.apply_translation([0, 0, 0.015 * k])
    found = solid_of(trimesh.util.concatenate(layers))
    solid = trimesh.Trimesh(found.vertices, found.triangles, process=False)
    assert solid.is_watertight and solid.volume == pytest.approx(0.05 * 0.05 * 0.045)
    assert "joined" in found.notes[0]


def test_a_fill_of_another_volume_is_refused(monkeypatch):
    """A hollow block that the mesher gives as a full one: the cavity's triangles lie inside, as walls do."""
    block, hollow = (trimesh.creation.box(extents=(edge, edge, edge)) for edge in (0.06, 0.045))
    hollow.invert()
    a, b = block.vertices[block.edges[0]]
    fin = trimesh.Trimesh([a, b, (a + b) / 3], [[0, 1, 2]])  # an edge of three
    full = box_mesh((4, 4, 4), (0.06, 0.06, 0.06))
    points = full.points - full.points.min(axis=0) + block.bounds[0]
    monkeypatch.setattr(filled, "tetrahedralize", lambda *_, **__: (points, full.tetrahedra))
    with pytest.raises(NotClosedError):
        solid_of(trimesh.util.concatenate([block, hollow, fin]))
    assert "filled" in solid_of(trimesh.util.concatenate([block, fin])).notes[0]


def test_a_closed_surface_winds_once_around_what_is_inside():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.03)
    points = np.array([[0.0, 0, 0], [0.01, 0.02, 0], [0.04, 0, 0]])
    assert filled.winding(ball.vertices, ball.faces, points) == pytest.approx([1, 1, 0], abs=1e-9)


def test_a_fold_that_bounds_nothing_is_taken_off_and_crossing_bodies_are_let_be():
    """A tip would be felt on the sheet that a fold pushes out through the surface, a millimetre too early."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.03)
    whole = solid_of(ball)
    assert not whole.notes
    folded = ball.copy()
    near = np.linalg.norm(folded.vertices - [0.024, 0, 0.018], axis=1) < 0.008
    folded.vertices[near] += [0.006, 0, -0.014]
    found = solid_of(folded)
    assert "crosses itself" in found.notes[0] and "filled" in found.notes[0]
    assert filled._inside_out(found) == 0.0
    beside = ball.copy()
    beside.apply_translation([0.02, 0, 0])
    both = solid_of(trimesh.util.concatenate([ball, beside]))
    assert filled._inside_out(both) == 0.0 and not any("itself" in note for note in both.notes)
