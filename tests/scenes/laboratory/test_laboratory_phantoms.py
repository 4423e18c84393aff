"""Phantoms are closed, stand on their support, and can be touched."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from palpate.mechanics.errors import SceneError, SurfaceError
from palpate.mechanics.shape.flat_foot import direction
from palpate.scenes.laboratory.hand import HandOptions
from palpate.scenes.laboratory.mesh import graded_mesh
from palpate.scenes.laboratory.presses import FLOOR_MM, RIM_MM, press_set
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.laboratory.tracing import foot_path, trace
from palpate.scenes.phantoms import PHANTOMS, phantom

VOLUMES_CM3 = {
    "cylinder": np.pi * 4**2 * 8,
    "block": 10.5**2 * 4.7,
    "half-sphere": np.pi * 5.5**2 * (6 - 5.5 / 3),
}


@pytest.mark.parametrize("name", PHANTOMS)
def test_every_phantom_is_closed_outward_and_stands_on_its_support(name: str) -> None:
    thing = phantom(name)
    mesh = trimesh.Trimesh(thing.vertices, thing.faces, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume > 0
    assert thing.vertices[:, 2].min() == 0.0
    if name in VOLUMES_CM3:
        assert mesh.volume * 1e6 == pytest.approx(VOLUMES_CM3[name], rel=0.002)


def test_bean_and_bowl_are_not_convex() -> None:
    for name in ("bean", "bowl"):
        thing = phantom(name)
        mesh = trimesh.Trimesh(thing.vertices, thing.faces)
        assert mesh.volume < 0.985 * mesh.convex_hull.volume


def test_phantom_from_file(tmp_path) -> None:
    ball = trimesh.creation.box(extents=(0.06, 0.05, 0.04))
    ball.apply_translation([0.3, 0.2, 0.1])
    ball.export(tmp_path / "thing.stl")
    thing = phantom(tmp_path / "thing.stl")
    assert thing.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    assert np.abs(thing.vertices[:, :2].mean(axis=0)).max() < 1e-3
    assert thing.height_m == pytest.approx(0.04)


def test_phantom_errors_name_what_is_allowed(tmp_path) -> None:
    with pytest.raises(SceneError, match="cylinder"):
        phantom("teapot")
    open_ball = trimesh.creation.icosphere(radius=0.03)
    open_ball.update_faces((open_ball.triangles_center[:, :2] < 0.005).any(axis=1))
    open_ball.export(tmp_path / "open.stl")
    with pytest.raises(SurfaceError, match="is open: a hole"):
        phantom(tmp_path / "open.stl")


@pytest.mark.parametrize("name", ["cylinder", "bowl", "bean"])
def test_touches_lie_on_the_surface_away_from_rims_and_floor(name: str) -> None:
    thing = phantom(name)
    touches = press_set(thing, "ordinary", 0)
    points = np.array([t.point for t in touches])
    surface = TriangleSurface(thing.vertices * 1e3, thing.faces)
    assert surface.nearest(points)[1].max() < 0.01
    assert points[:, 2].min() > FLOOR_MM - 0.1
    again = press_set(thing, "ordinary", 0)
    assert all(
        np.array_equal(a.point, b.point) and a.depth == b.depth for a, b in zip(touches, again, strict=True)
    )
    if name == "cylinder":
        rim = np.minimum(np.abs(np.hypot(*points.T[:2]) - 40) + np.abs(points[:, 2] - 80), 99)
        assert rim.min() > 0.9 * RIM_MM


@pytest.mark.parametrize("name", ["cylinder", "block", "half-sphere"])
def test_deep_exploration_passes_ten_millimetres_at_every_place(name: str) -> None:
    touches = press_set(phantom(name), "deep", 0)
    deepest: dict[int, float] = {}
    for touch in touches:
        if touch.kind == "press":
            deepest[touch.site] = max(deepest.get(touch.site, 0.0), touch.depth)
    assert len(deepest) >= 10
    assert min(deepest.values()) > 10.0


@pytest.mark.parametrize("name", ["cylinder", "half-sphere", "bean"])
def test_traced_foot_keeps_the_tip_one_radius_from_the_wall(name: str) -> None:
    thing = phantom(name)
    surface = TriangleSurface(thing.vertices * 1e3, thing.faces)
    centres, _, _ = foot_path(surface, 5.0)
    near, distance, _ = surface.nearest(centres)
    wall = near[:, 2] > 0.01
    assert distance[wall] == pytest.approx(5.0, abs=0.05)
    assert np.all(centres[:, 2] == 5.0)


def test_tracing_starts_and_ends_in_the_air_and_leans_less_than_allowed() -> None:
    traced = trace(phantom("cylinder"), HandOptions(), 5.0, 29e3, np.random.default_rng(0))
    assert not traced.contact[0] and not traced.contact[-1]
    radius = np.hypot(traced.position[:, 0], traced.position[:, 1])[traced.contact]
    assert radius.min() > 45.0 - 0.66
    assert radius.max() < 45.5
    assert traced.force[traced.contact][:, 2].max() > 0.3


@pytest.mark.parametrize("name", PHANTOMS)
def test_the_whole_foot_of_a_phantom_is_held(name: str) -> None:
    thing = phantom(name)
    mesh = graded_mesh(thing, np.array([0.0, 0.0, 1e3 * thing.height_m]), finest=4.0)
    foot = _area(1e3 * thing.vertices, thing.faces[(thing.vertices[thing.faces, 2] < 1e-6).all(axis=1)])
    # the rim of the coarse mesh is a polygon
    assert _area(mesh.points, mesh.base[:, :3]) == pytest.approx(foot, rel=0.06)


def _area(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.mark.parametrize("up", ["-z", "+x", "0.2,0,1"])
def test_a_file_in_another_unit_and_turned_is_the_same_phantom(up, tmp_path):
    """Its refusal named a unit and a direction that no command about phantoms took."""
    cone = trimesh.creation.cone(0.03, 0.05, sections=40)
    cone.export(tmp_path / "upright.stl")
    cone.apply_transform(trimesh.geometry.align_vectors((0, 0, 1), direction(up)))
    cone.apply_scale(1e3).apply_translation((40, 70, -20)).export(tmp_path / "turned.stl")
    upright, turned = phantom(tmp_path / "upright.stl"), phantom(tmp_path / "turned.stl", unit="mm", up=up)
    for given in (upright, turned):
        assert np.ptp(given.vertices[:, 2]) == pytest.approx(0.05, rel=1e-4)
        assert np.hypot(*given.vertices[given.vertices[:, 2] < 1e-5].T[:2]).max() == pytest.approx(
            0.03, rel=0.01
        )
    assert turned.vertices[:, 2].min() == pytest.approx(upright.vertices[:, 2].min(), abs=1e-6)


def test_a_unit_is_refused_for_what_is_no_file():
    with pytest.raises(SceneError, match="surface's file"):
        phantom("dome", unit="mm")
