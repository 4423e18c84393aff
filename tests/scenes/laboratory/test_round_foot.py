"""The laboratory holds the foot that a surface stands on, also where a round underside ends in it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from palpate.scenes.laboratory.mesh import graded_mesh, round_rim
from palpate.scenes.phantoms import PHANTOMS, phantom


def area(points: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = np.moveaxis(points[triangles[:, :3]], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.fixture(scope="module")
def organ(tmp_path_factory):
    """A box with round edges, 80 x 50 x 40 mm: it stands on the flattest part of its underside."""
    solid = trimesh.creation.icosphere(subdivisions=4)
    v = solid.vertices
    solid.vertices = v / ((np.abs(v) ** 4).sum(axis=1) ** 0.25)[:, None] * [40, 25, 20]
    path = tmp_path_factory.mktemp("organ") / "organ.stl"
    solid.export(path)
    return phantom(path, unit="mm")


def test_the_foot_of_a_round_underside_is_held_nearly_whole(organ, tmp_path):
    """Less than half of it was: 38 by 28 mm of 48 by 31."""
    foot = organ.faces[(organ.vertices[organ.faces][:, :, 2] < 1e-9).all(axis=1)]
    mesh = graded_mesh(organ, np.array([0.0, 0.0, 40.0]), cache=tmp_path)
    assert 0.8 < area(mesh.points, mesh.base) / area(1e3 * organ.vertices, foot) < 1.1


def test_a_foot_with_an_edge_needs_no_finer_mesh():
    assert all(len(round_rim(phantom(name))) == 0 for name in PHANTOMS)
