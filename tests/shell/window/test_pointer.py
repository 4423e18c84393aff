"""A mouse becomes a tip: it hovers, presses along the normal, and slides around the foot on the support."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.model.model import Model
from palpate.window.pointer import BEAR_DOWN_M, HOVER_M, LEAN_M, MOST_PRESS_M, MOST_SPEED_M_PER_S, Pointer

R = 0.005
FRAME_S = 1 / 60


@pytest.fixture
def pointer(block: Model) -> Pointer:
    surface = block.mesh.touchable_surface[:, :3]
    return Pointer(block.mesh.points, surface, R, block.support.point, block.support.normal)


def down_at(pointer: Pointer, x: float, y: float) -> None:
    pointer.point_along(np.array([x, y, 0.3]), np.array([x, y, -0.3]))


def settle(pointer: Pointer, frames: int = 120) -> np.ndarray:
    places = [pointer.place(FRAME_S).copy() for _ in range(frames)]
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert steps.max() <= MOST_SPEED_M_PER_S * FRAME_S + 1e-12, "the tip leaps"
    return places[-1]


def test_hovers_over_what_it_points_at(pointer: Pointer) -> None:
    down_at(pointer, 0.01, -0.01)
    assert not pointer.target.on_support
    assert settle(pointer) == pytest.approx([0.01, -0.01, 0.04 + R + HOVER_M], abs=1e-9)


def test_presses_to_its_depth_and_comes_back(pointer: Pointer) -> None:
    down_at(pointer, 0.0, 0.0)
    settle(pointer)
    pointer.pressing = True
    heights = [pointer.place(FRAME_S)[2] for _ in range(90)]
    assert heights[-1] == pytest.approx(0.04 + R - pointer.press_depth_m)
    assert (np.diff(heights) <= 1e-12).all(), "a press goes in steadily"
    pointer.pressing = False
    assert settle(pointer)[2] == pytest.approx(0.04 + R + HOVER_M)


def test_presses_a_wall_along_its_normal(pointer: Pointer) -> None:
    pointer.point_along(np.array([0.3, 0.0, 0.02]), np.array([-0.3, 0.0, 0.02]))
    settle(pointer)
    pointer.pressing = True
    assert settle(pointer) == pytest.approx([0.04 + R - pointer.press_depth_m, 0.0, 0.02], abs=1e-6)


def test_wheel_sets_the_depth_within_bounds(pointer: Pointer) -> None:
    before = pointer.press_depth_m
    pointer.deeper(2)
    assert pointer.press_depth_m == pytest.approx(before + 0.001)
    pointer.deeper(100)
    assert pointer.press_depth_m == MOST_PRESS_M


def test_comes_down_onto_the_support(pointer: Pointer) -> None:
    down_at(pointer, 0.07, 0.0)
    assert pointer.target.on_support
    pointer.pressing = True
    assert settle(pointer, 240) == pytest.approx([0.07, 0.0, R - BEAR_DOWN_M], abs=1e-9)


@pytest.mark.parametrize("beside_m", [0.001, 0.0065])
def test_slides_around_the_foot(pointer: Pointer, beside_m: float) -> None:
    """Pointing at the very edge of the foot, or at what counts as traced, the tip leans on it by a little and
    no more: a tip that slid 2 mm beside it drew a base 2 mm too wide."""
    pointer.pressing = True
    for angle in np.linspace(0, 2 * np.pi, 9)[:-1]:
        away = np.array([np.cos(angle), np.sin(angle)])
        edge = away * (0.04 / np.abs(away).max() + beside_m)
        down_at(pointer, *edge)
        assert pointer.target.on_support
        tip = settle(pointer, 300)
        outside = np.maximum(np.abs(tip[:2]) - 0.04, 0.0)
        assert np.linalg.norm(outside) == pytest.approx(R - LEAN_M, abs=1e-4)
        assert tip[2] == pytest.approx(R - BEAR_DOWN_M, abs=1e-4)


def test_a_ray_into_the_sky_changes_nothing(pointer: Pointer) -> None:
    down_at(pointer, 0.0, 0.0)
    kept = pointer.target
    assert pointer.point_along(np.array([0, 0, 0.3]), np.array([0, 0, 0.9])) is None
    assert pointer.target is kept


def test_travels_around_the_object_and_not_through_it(pointer: Pointer) -> None:
    """From the foot on one side to the foot on the other, the button held or not."""
    for pressing in (False, True):
        pointer.pressing = False
        down_at(pointer, -0.07, 0.005)
        settle(pointer)
        pointer.pressing = pressing
        down_at(pointer, 0.07, 0.0)
        for _ in range(240):
            x, y, z = pointer.place(FRAME_S)
            outside = np.maximum(np.abs([x, y]) - 0.04, 0.0)
            assert np.hypot(np.linalg.norm(outside), max(z - 0.04, 0.0)) >= R - LEAN_M - 1e-6, (
                "through the object"
            )
            assert z >= R - BEAR_DOWN_M - 1e-9, "through the support"
        assert pointer.tip_m[0] == pytest.approx(0.07, abs=1e-6)


def test_a_tip_that_stays_behind_is_waited_for_and_cuts_no_corner(pointer: Pointer) -> None:
    """Frames take a tenth of a second, and the tip follows late, straight to where it was last told to be."""
    down_at(pointer, -0.07, 0.005)
    settle(pointer)
    down_at(pointer, 0.07, 0.0)
    felt = pointer.tip_m.copy()
    for _ in range(200):
        felt = felt + 0.2 * (pointer.place(0.1, felt) - felt)
        outside = np.maximum(np.abs(felt[:2]) - 0.04, 0.0)
        assert np.hypot(np.linalg.norm(outside), max(felt[2] - 0.04, 0.0)) >= R, "through the object"
    assert felt[0] == pytest.approx(0.07, abs=1e-4)
