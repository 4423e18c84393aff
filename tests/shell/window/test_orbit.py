"""The eye on its turntable: it keeps up, finds back, and never sinks under the floor."""

from __future__ import annotations

import numpy as np
import pytest
import vtk

from palpate.window.keys import FARTHEST, NEAREST, Orbit

MIDDLE = np.array([0.01, -0.02, 0.03])
UP = np.array([0.0, 0.6, 0.8])
EYE = MIDDLE + 0.3 * np.array([0.8, 0.36, 0.48])


@pytest.fixture
def camera() -> vtk.vtkCamera:
    return vtk.vtkCamera()


@pytest.fixture
def orbit(camera: vtk.vtkCamera) -> Orbit:
    return Orbit(camera, MIDDLE, UP, EYE)


def test_begins_where_it_was_put(camera: vtk.vtkCamera, orbit: Orbit) -> None:
    np.testing.assert_allclose(camera.GetPosition(), EYE)
    np.testing.assert_allclose(camera.GetFocalPoint(), MIDDLE)


def test_a_drag_there_and_back_is_no_drag(camera: vtk.vtkCamera, orbit: Orbit) -> None:
    for across, upwards in ((0.3, 0.0), (-0.1, 0.05), (0.7, -0.02), (-0.9, -0.03)):
        orbit.turn(across, upwards)
    np.testing.assert_allclose(camera.GetPosition(), EYE, atol=1e-12)


def test_turning_is_even_all_the_way_round(camera: vtk.vtkCamera, orbit: Orbit) -> None:
    """Every pixel of a drag turns by as much, about the support's normal."""
    eyes = []
    for _ in range(200):
        orbit.turn(0.01, 0.0)
        eyes.append(np.array(camera.GetPosition()) - MIDDLE)
    heights = np.array(eyes) @ UP
    np.testing.assert_allclose(heights, heights[0])
    steps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-9)
    np.testing.assert_allclose(eyes[-1], EYE - MIDDLE, atol=1e-12)


def test_whatever_is_done_the_eye_stays_over_the_floor_and_comes_home(
    camera: vtk.vtkCamera, orbit: Orbit
) -> None:
    random = np.random.default_rng(4)
    for _ in range(500):
        move = (orbit.turn, orbit.pan)[random.integers(2)]
        move(*random.normal(size=2))
        orbit.zoom(random.normal() * 3.0)
        eye, seen = np.array(camera.GetPosition()), np.array(camera.GetFocalPoint())
        away = float(np.linalg.norm(eye - seen))
        assert (eye - MIDDLE) @ UP > 0.0 and (seen - MIDDLE) @ UP >= -1e-12
        assert NEAREST * 0.3 - 1e-9 <= away <= FARTHEST * 0.3 + 1e-9
        assert camera.GetDirectionOfProjection() @ UP < 0.0
        near, far = camera.GetClippingRange()
        assert near < away < far
    orbit.reset()
    np.testing.assert_allclose(camera.GetPosition(), EYE)


def test_what_is_looked_at_moves_with_the_mouse(camera: vtk.vtkCamera, orbit: Orbit) -> None:
    right = np.cross(np.array(camera.GetDirectionOfProjection()), UP)
    orbit.pan(0.1, 0.0)
    moved = np.array(camera.GetFocalPoint()) - MIDDLE
    assert moved @ right < 0.0, "the eye goes left where the picture goes right"
    shown = 2.0 * 0.3 * np.tan(np.radians(camera.GetViewAngle()) / 2.0)
    assert np.linalg.norm(moved) == pytest.approx(0.1 * shown)
