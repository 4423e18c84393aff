"""The contact surface: round where the mesh is round, closed, drawn through the touches; the search is
exact."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from palpate.mechanics.presses.making import of_places
from palpate.render.options import RenderOptions
from palpate.render.surface.bvh import STACK, closest_triangle
from palpate.render.surface.contact_surface import contact_surface
from palpate.render.surface.snapping import touch_gaps, touched_surface
from palpate.render.surface.triangles import cut_beside

from . import shapes


def test_a_cylinder_of_coarse_facets_is_felt_round():
    mesh = shapes.cylinder(0.04, 0.08, (8, 8))
    arrays = contact_surface(mesh).arrays
    radius = np.linalg.norm(arrays.vertices[:, :2], axis=1)
    side = (np.abs(arrays.vertices[:, 2] - 0.04) < 0.03) & (radius > 0.035)
    assert np.abs(radius[side] - 0.04).max() < 6e-5  # the flat facets are 0.3 mm off
    outward = arrays.vertices[side, :2] / radius[side, None]
    assert (arrays.normals[side, :2] * outward).sum(axis=1).min() > 0.999


def test_the_rim_of_a_round_top_is_even_on_an_uneven_mesh():
    mesh = shapes.cylinder(0.04, 0.08, (7, 6))  # a square grid drawn out to a disc: long and short edges
    v = contact_surface(mesh).arrays.vertices
    around = ((np.arctan2(v[:, 1], v[:, 0]) + np.pi) / (2 * np.pi) * 28).astype(int) % 28
    outward = (np.linalg.norm(v[:, :2], axis=1) + v[:, 2]) / np.sqrt(2)  # the sharp rim lies at 84.85 mm
    rim = np.array([outward[around == sector].max() for sector in range(28)])
    assert np.ptp(rim) < 2.5e-4
    assert 0.083 < rim.mean() < 0.0845


def test_a_block_keeps_its_flat_faces_and_its_edges_are_eased():
    arrays = contact_surface(shapes.block((0.1, 0.1, 0.05), (5, 5, 3))).arrays
    face = arrays.vertices[np.abs(arrays.vertices[:, :2]).max(axis=1) < 0.04]
    assert face[:, 2].max() == pytest.approx(0.05, abs=1e-9)
    upper = arrays.vertices[np.abs(arrays.vertices[:, 0]) < 0.04]
    rim = (upper[:, 1] + upper[:, 2]).max()  # of a sharp edge 0.1 m
    assert 0.096 < rim < 0.099
    inner = (arrays.vertices[:, 2] > 0.0499) & (np.abs(arrays.vertices[:, :2]).max(axis=1) < 0.04)
    assert arrays.normals[inner] == pytest.approx(np.tile([0, 0, 1.0], (inner.sum(), 1)), abs=1e-2)


def test_the_search_finds_the_closest_triangle():
    arrays = contact_surface(
        shapes.block((0.1, 0.06, 0.05), (4, 3, 3)), edge_m=8e-3
    ).arrays  # too coarse to ease the edges
    weights, stack = np.zeros(3), np.zeros(STACK, dtype=np.int64)
    p = arrays.vertices[arrays.triangles]
    for tip in np.random.default_rng(0).uniform(-0.1, 0.1, (50, 3)):
        triangle, distance = closest_triangle(
            arrays.bvh, arrays.vertices, arrays.triangles, tip, np.inf, weights, stack
        )
        assert np.linalg.norm(weights @ p[triangle] - tip) == pytest.approx(distance)
        box = np.maximum(np.abs(tip - [0, 0, 0.025]) - [0.05, 0.03, 0.025], 0)
        inside = np.min(np.array([0.05, 0.03, 0.025]) - np.abs(tip - [0, 0, 0.025]))
        assert distance == pytest.approx(np.linalg.norm(box) if inside < 0 else inside, abs=1e-9)


def test_the_surface_is_drawn_to_the_touched_points():
    shift = 4e-4
    places = np.array([[x, y, 0.05 + shift] for x in (-0.02, 0.02) for y in (-0.02, 0.02)])
    rows = of_places(places, np.tile([0.0, 0.0, 1.0], (4, 1)), 0.005)
    made = shapes.model(shapes.block((0.1, 0.1, 0.05), (6, 6, 3)), presses=rows)
    before = touch_gaps(contact_surface(made.mesh).arrays, made)[2]
    surface = touched_surface(made, RenderOptions())
    after = touch_gaps(surface.arrays, made)[2]
    assert before == pytest.approx(np.full(4, shift), abs=1e-9)
    assert np.abs(after).max() < 5e-5
    far = surface.arrays.vertices[surface.arrays.vertices[:, 2] < 0.01]
    assert np.abs(far).max(axis=0)[0] == pytest.approx(0.05, abs=1e-4)
    kept = touched_surface(made, RenderOptions(snap_to_touches=False)).arrays.vertices
    assert kept[:, 2].max() == pytest.approx(0.05)


def test_a_turned_normal_ends_where_its_strip_ends():
    """A vertex 0.9 strips beside a rim carried its normal to the next one, 3 strips off: a wedge was 7 % too
    soft there."""
    x, y = np.meshgrid(np.arange(4.0), [0.0, 0.9, 3.0], indexing="ij")
    vertices = 1e-3 * np.column_stack([x.ravel(), y.ravel(), np.zeros(12)])
    low = (3 * np.arange(3)[:, None] + np.arange(2)).ravel()
    triangles = np.vstack(
        [np.column_stack([low, low + 3, low + 1]), np.column_stack([low + 1, low + 3, low + 4])]
    )
    line = cKDTree(np.column_stack([np.linspace(0, 3e-3, 301), np.zeros((301, 2))]))
    weights = np.tile(np.eye(3), (len(triangles), 1, 1))
    placed, triangles, *_ = cut_beside(
        vertices, triangles, np.ones(len(triangles)), weights, vertices[:, 1] == 0, line, 1e-3
    )
    away = placed[triangles, 1]
    assert not ((away.min(axis=1) < 0.95e-3) & (away.max(axis=1) > 1.2e-3)).any()
