"""How a surface is lit: smooth where the object is, sharp where it has an edge, whatever triangles it is cut
into."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.render.surface.contact_surface import contact_surface
from palpate.show.light import lit

RADIUS = 0.03


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip(np.einsum("nx,nx->n", a, b), -1.0, 1.0)))


def faceted_wall() -> trimesh.Trimesh:
    """A cylinder on z = 0 of facets of 8 mm, cut to 2 mm, the corners between which lie up to 40 um off."""
    wall = trimesh.creation.cylinder(RADIUS, 0.04, sections=24).subdivide().subdivide()
    wall.apply_translation([0, 0, 0.02])
    side = (wall.vertices[:, 2] > 1e-3) & (wall.vertices[:, 2] < 0.039)
    off = np.random.default_rng(0).uniform(-4e-5, 4e-5, side.sum())
    out = wall.vertices[side] * [1.0, 1.0, 0.0]
    wall.vertices[side] += off[:, None] * out / np.linalg.norm(out, axis=1, keepdims=True)
    return wall


def test_a_wall_of_facets_is_lit_as_the_round_one_that_it_stands_for():
    wall = faceted_wall()
    points, triangles = np.asarray(wall.vertices), np.asarray(wall.faces)
    seen = lit(points, triangles)
    at = points[seen.at]
    middle = (at[:, 2] > 0.01) & (at[:, 2] < 0.03) & (np.hypot(at[:, 0], at[:, 1]) > 0.025)
    out = at[middle] * [1.0, 1.0, 0.0]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    facets, light = angle(seen.facets[middle], out), angle(seen.normals[middle], out)
    assert facets.max() > 4.0, "what would be seen as patches"
    assert light.max() < 0.65 * facets.max() and light.mean() < 0.5 * facets.mean()


def test_an_edge_is_sharp():
    """It was a pale band of a triangle's width: both sides had the mean of their normals there."""
    box = trimesh.creation.box((0.06, 0.06, 0.03)).subdivide().subdivide()
    points, triangles = np.asarray(box.vertices), np.asarray(box.faces)
    seen = lit(points, triangles)
    assert len(seen.at) > len(points) and np.array_equal(seen.at[seen.triangles], triangles)
    assert np.abs(seen.normals).max(axis=1) == pytest.approx(1.0)


def test_a_foot_does_not_darken_the_wall_above_it():
    bowl = trimesh.creation.cylinder(RADIUS, 0.02, sections=64).subdivide().subdivide()
    points, triangles = np.array(bowl.vertices) + [0, 0, 0.01], np.asarray(bowl.faces)
    points[:, :2] *= 1.0 + points[:, 2:] / RADIUS  # walls that rise outward at 45 degrees
    foot = (points[triangles][:, :, 2] < 1e-9).all(axis=1)
    seen = lit(points, triangles, ~foot)
    rim = np.unique(seen.triangles[~foot])
    rim = rim[points[seen.at[rim], 2] < 1e-9]
    assert len(rim) > 60 and seen.normals[rim, 2] == pytest.approx(-np.sqrt(0.5), abs=0.01)
    joined = lit(points, triangles)
    assert joined.normals[joined.triangles[~foot], 2].min() < -0.75


def test_light_is_even_along_a_rim_that_is_rounded():
    """Normals that a tip feels fold beneath such a rim, and showed teeth there."""
    arrays = contact_surface(box_mesh((6, 6, 3), (0.06, 0.06, 0.03)).quadratic()).arrays
    seen = lit(arrays.vertices, arrays.triangles, arrays.free > 0)
    at = arrays.vertices[seen.at]
    along = (np.abs(at[:, 1]) < 0.02) & (at[:, 0] > 0.024)  # the rim at x = 30 mm, and the wall beneath it
    for low, high in ((0.02, 0.024), (0.024, 0.027), (0.027, 0.03)):
        band = along & (at[:, 2] > low) & (at[:, 2] <= high) & (seen.normals[:, 0] > 0.1)
        assert band.sum() > 10 and np.abs(seen.normals[band, 1]).max() < np.sin(np.radians(3.0))


def test_light_turns_with_what_moves():
    box = trimesh.creation.box((0.06, 0.06, 0.03)).subdivide()
    points, triangles = np.asarray(box.vertices), np.asarray(box.faces)
    seen = lit(points, triangles)
    assert seen.turned(points) == pytest.approx(seen.normals)
    turn = trimesh.transformations.rotation_matrix(0.5, [0, 0, 1])[:3, :3]
    assert seen.turned(points @ turn.T) == pytest.approx(seen.normals @ turn.T)
