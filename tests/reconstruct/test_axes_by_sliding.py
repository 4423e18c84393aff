"""Axes are called swapped by what presses and slides say together, never by slides alone."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.checks.handedness import slides_agree
from palpate.reconstruction.checks.registry import checked_samples
from palpate.reconstruction.checks.samples import Samples

from .flat_contact import pushed, recorded
from .flat_ground import NOISE_N, TIP_M, raster


def strokes(friction: float, *, count: int = 24, way_m: float = 0.010, seed: int = 0) -> Recording:
    """A log of palpation by sliding: each stroke comes down askew and goes on along x, or y, as it goes in;
    the surface wanders by some mm."""
    rng = np.random.default_rng(seed)
    s, path, top = np.linspace(0, 1, 240), [], []
    for k in range(count):
        place = np.array([0.012 * (k % 5), 0.008 * (k // 5), rng.uniform(-0.006, 0.006)])
        height = np.interp(s, [0, 0.1, 0.2, 0.9, 1], [0.012, 0.002, -0.0008, -0.0024, 0.012])
        along = np.interp(s, [0, 0.1, 0.95, 1], [0, 0, way_m, way_m])
        way = (along, 0 * along) if k % 4 else (0 * along, along)
        stroke = place + np.column_stack([*way, TIP_M + height])
        if path:
            share = np.linspace(0, 1, 120)[:, None]
            path.append(path[-1][-1] + share * (stroke[0] - path[-1][-1]))
            top.append(np.full(120, -1.0))
        path.append(stroke)
        top.append(np.full(len(s), place[2]))
    position, surface = np.concatenate(path), np.concatenate(top)
    push = pushed(TIP_M + surface - position[:, 2])
    made = recorded(position, push, 200.0, NOISE_N, seed)
    moved = np.gradient(position[:, :2], axis=0)
    force = made.force_on_tool.copy()
    force[:, :2] -= friction * push[:, None] * np.sign(moved) * (np.abs(moved) > 1e-6)
    return dataclasses.replace(made, force_on_tool=force)


def names(recording: Recording) -> set[str]:
    return {found.name for found in checked_samples(recording, by_hand=False).found}


@pytest.mark.parametrize("friction", [0.0, 0.1, 0.3])
def test_a_log_of_sliding_is_not_refused_for_its_axes(friction):
    assert names(strokes(friction)) == set()


@pytest.mark.parametrize("columns", [[0, 2, 1], [1, 2, 0]])
def test_presses_with_another_order_of_axes_are_still_found(columns):
    recording = raster((4, 4), tilt=False)
    assert names(recording) == set()
    wrong = dataclasses.replace(recording, force_on_tool=recording.force_on_tool[:, columns])
    assert names(wrong) and names(wrong) <= {"swapped axes", "turned axes"}


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_slides_speak_against_another_order_of_axes_and_for_the_right_one(friction):
    recording = strokes(friction)
    assert not slides_agree(Samples(recording), "z y x")
    swapped = dataclasses.replace(recording, force_on_tool=recording.force_on_tool[:, [2, 1, 0]])
    assert slides_agree(Samples(swapped), "z y x")
