"""Values between the corners of a surface."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.compliance.fine_corners import EdgeMiddles
from palpate.mechanics.compliance.patch import triangle_shapes
from palpate.mechanics.shape.nearest import closest


def surface(box):
    mesh = box((6, 6, 4), (0.06, 0.06, 0.03))
    nodes, local = np.unique(mesh.touchable_surface, return_inverse=True)
    return mesh.points[nodes], local.reshape(-1, 3)


def middle_points(points, triangles):
    corners = points[triangles]
    return 0.5 * (corners + np.roll(corners, -1, axis=1))


def test_a_quadratic_field_on_each_face_is_recovered_exactly(box):
    points, triangles = surface(box)

    def field(p):
        x, y, z = np.moveaxis(p, -1, 0)
        return np.stack([x * x + 3 * x * y + z * y, 2 - y * y + z * z], axis=-1)

    middles = EdgeMiddles(points, triangles)(field(points))
    assert middles.shape == (len(triangles), 3, 2)
    assert np.allclose(middles, field(middle_points(points, triangles)), atol=1e-9)


def test_a_bend_at_an_edge_is_no_curvature(box):
    points, triangles = surface(box)
    values = np.abs(points[:, 2] - 0.03) + 0.1 * points[:, 0]  # linear on every face
    middles = EdgeMiddles(points, triangles)(values)
    ends = values[triangles]
    on_top = (points[triangles][:, :, 2] == 0.03).all(axis=1)
    assert on_top.sum() > 8
    assert np.allclose(middles[on_top], 0.5 * (ends + np.roll(ends, -1, axis=1))[on_top])


def test_it_is_nearer_to_a_field_that_falls_off_beside_an_edge(box):
    points, triangles = surface(box)

    def field(p):
        return 1 / (0.012 + np.minimum(0.03 - np.abs(p[:, 0]), 0.03 - np.abs(p[:, 1])))

    rng = np.random.default_rng(0)
    across, along = rng.uniform(0.02, 0.028, 60), rng.uniform(-0.015, 0.015, 60)
    somewhere = np.column_stack([across, along, np.full(60, 0.03)])
    _, triangle, weights = closest(points, triangles, somewhere)
    middles = EdgeMiddles(points, triangles)(field(points))[triangle]
    six = np.concatenate([field(points)[triangles[triangle]], middles], axis=1)
    linear = (weights * six[:, :3]).sum(axis=1)
    better = (triangle_shapes(2, weights) * six).sum(axis=1)
    wrong, left = (np.abs(found / field(somewhere) - 1).max() for found in (linear, better))
    assert left < 0.6 * wrong
