"""Tetrahedra of a shape with thin walls: as small as the wall asks for, so that finer ones press alike."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import palpate as pp
from palpate.mechanics.compliance.sites import SURFACE_EDGE_M
from palpate.mechanics.shape import refine
from palpate.mechanics.shape.refine import typical_wall
from palpate.scenes.build import CoarserMesh


def _tube(wall_m: float) -> trimesh.Trimesh:
    """Outer radius 20 mm, 40 mm high, standing."""
    made = trimesh.creation.annulus(r_min=0.02 - wall_m, r_max=0.02, height=0.04, sections=48)
    made.apply_translation([0, 0, 0.02])
    return made


@pytest.mark.parametrize("wall_m", [0.003, 0.008])
def test_the_wall_of_a_tube(wall_m):
    tube = _tube(wall_m)
    assert typical_wall(tube.vertices, tube.faces) == pytest.approx(wall_m, rel=0.02)


def test_a_thin_wall_is_meshed_by_two_tetrahedra():
    plate = trimesh.creation.box(extents=(0.05, 0.05, 0.006))
    plate.apply_translation([0, 0, 0.003])
    model = pp.model_of(plate)
    assert model.mesh_size_m == pytest.approx(0.003)
    assert pp.model_of(plate, mesh_size_m=0.005).mesh_size_m == 0.005


def test_a_block_is_meshed_as_its_length_says():
    block = trimesh.creation.box(extents=(0.06, 0.05, 0.04))
    block.apply_translation([0, 0, 0.02])
    assert pp.model_of(block).mesh_size_m == pytest.approx(0.06 / 8)


def test_a_surface_that_is_not_halved_is_said(monkeypatch):
    """The limit of the work left out a round of halving without a word."""
    block = trimesh.creation.box(extents=(0.1, 0.1, 0.05))
    block.apply_translation([0, 0, 0.025])
    monkeypatch.setattr("palpate.mechanics.shape.refine.MOST_TETRAHEDRA", 100)
    with pytest.warns(CoarserMesh, match="near a rim or the base"):
        pp.model_of(block)


def test_the_surface_of_a_model_is_halved_once(monkeypatch):
    block = trimesh.creation.box(extents=(0.06, 0.05, 0.04))
    block.apply_translation([0, 0, 0.02])
    halved, rounds = refine._halved, []
    monkeypatch.setattr(refine, "_halved", lambda *given: rounds.append(given) or halved(*given))
    model = pp.model_of(block)
    made = len(rounds)
    refine.refined_near_surface(model.mesh, SURFACE_EDGE_M)
    assert made == len(rounds) - made > 0


@pytest.mark.slow
def test_a_tube_presses_as_with_finer_tetrahedra():
    """One tetrahedron across its wall of 5 mm was 3 to 8 % too stiff."""
    tube = _tube(0.005)
    forces = []
    for size in (None, 0.0018):
        curve = pp.press(
            pp.model_of(tube, mesh_size_m=size), at=(0.02, 0.0, 0.025), direction=(-1.0, 0.0, 0.0),
            depth_m=6e-4,
        )  # fmt: skip
        forces.append(float(np.linalg.norm(curve.force[curve.deepest])))
    assert forces[0] == pytest.approx(forces[1], rel=0.02)
