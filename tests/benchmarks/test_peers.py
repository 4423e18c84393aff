"""The peers of `palpate bench peers`: each answers a press as its theory says, on a small block."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks._peers import PEERS, ByHand, PointLoad, lines_of
from palpate.mechanics.shape.tetmesh import box_mesh

E, NU, RADIUS = 30e3, 0.45, 0.005
DEPTHS = np.array([0.0005, 0.001, 0.002])


@pytest.fixture(scope="module")
def block():
    return box_mesh((6, 6, 3), (0.042, 0.042, 0.021))


def press(kind, mesh, young_pa=E):
    top = np.array([0.0, 0.0, mesh.points[:, 2].max()])
    top[:2] = 0.5 * (mesh.points.max(axis=0) + mesh.points.min(axis=0))[:2]
    return kind(mesh, young_pa, NU, RADIUS).force(top, np.array([0.0, 0.0, 1.0]), DEPTHS)


def test_a_point_load_is_linear_in_depth_and_modulus(block):
    force = press(PointLoad, block)
    assert force[2] == pytest.approx(4 * force[0]) and force[0] > 0
    assert press(PointLoad, block, 2 * E) == pytest.approx(2 * force)


def test_the_hand_written_script_meets_hertz_where_its_mesh_can_tell(block):
    pytest.importorskip("skfem")
    force = press(ByHand, block)
    hertz = 4 / 3 * E / (1 - NU**2) * np.sqrt(RADIUS) * DEPTHS**1.5
    assert (np.diff(force) > 0).all()
    assert force[2] / hertz[2] == pytest.approx(1.0, abs=0.4)


def test_lines_are_counted_without_words():
    counts = {peer.name: lines_of(peer) for peer in PEERS}
    assert counts["the paper's method"] < counts["scikit-fem by hand"] < 60
