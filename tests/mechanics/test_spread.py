"""Values at some corners of a surface, spread to all."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from mechanics.refine import refined_near_surface
from mechanics.spread import spaced_corners, spread
from mechanics.tetmesh import vertex_normals


@pytest.fixture(scope="module")
def surface(box):
    mesh, _ = refined_near_surface(box((5, 5, 3), (0.05, 0.05, 0.03)), 0.004)
    nodes = np.unique(mesh.touchable_surface[:, :3])
    return mesh.points[nodes], vertex_normals(mesh.points, mesh.touchable_surface)[nodes]


def test_corners_are_apart_and_leave_no_hole(surface):
    points, normals = surface
    chosen = spaced_corners(points, normals, 0.008)
    tree = cKDTree(points[chosen])
    assert tree.query(points[chosen], k=2)[0][:, 1].min() > 0.008
    assert tree.query(points)[0].max() <= 0.008
    assert len(chosen) < 0.3 * len(points)


def test_planes_are_met_and_the_other_side_of_an_edge_is_not_asked(surface):
    points, normals = surface
    chosen = spaced_corners(points, normals, 0.008)
    top = normals[:, 2] > 0.99
    value = np.where(top, 3 + 40 * points[:, 0] - 25 * points[:, 1], -100.0)
    found = spread(points, normals, chosen, value[chosen, None])[:, 0]
    inner = top & (np.abs(points[:, :2]).max(axis=1) < 0.012)
    assert found[inner] == pytest.approx(value[inner], rel=1e-3)
    assert found[chosen] == pytest.approx(value[chosen])
