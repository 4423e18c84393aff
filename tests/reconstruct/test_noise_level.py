"""Free motion: its loudness beside touches, and how seldom noise alone passes for one."""

import numpy as np
import pytest

from palpate.reconstruction.steps.s1_filter.noise import (
    crowd_scale,
    least_contrast,
    low_pass,
    low_pass_at,
    moving_spread,
)
from palpate.reconstruction.steps.s1_filter.signals import hysteresis

RATE, CUTOFF = 1000.0, 25.0


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_the_crowd_is_as_loud_as_free_motion_whatever_the_presses_do(share):
    random = np.random.default_rng(1)
    force = 0.01 * random.standard_normal((20000, 3))
    pressed = random.random(len(force)) < share
    force[pressed] += random.uniform(0, 1.0, (pressed.sum(), 1)) * [0.0, 0.6, 0.8]
    assert crowd_scale(np.linalg.norm(force, axis=1)) == pytest.approx(0.01, rel=0.06)


def test_noise_passes_for_a_touch_less_than_once_in_a_thousand_seconds():
    """Counted at a level that is passed often enough to be counted, and at the level itself."""
    random = np.random.default_rng(2)
    noise = low_pass(random.standard_normal((400_000, 3)), RATE, CUTOFF)
    size = np.linalg.norm(noise, axis=1) / noise.std()
    often = least_contrast(RATE, CUTOFF, false_per_s=0.5)
    crossings = int(((size[1:] > often) & (size[:-1] <= often)).sum())
    assert crossings / 400 == pytest.approx(0.5, rel=0.25)
    level = least_contrast(RATE, CUTOFF)
    assert 4.8 < level < 5.6
    assert int(((size[1:] > level) & (size[:-1] <= level)).sum()) <= 3


def test_what_is_left_of_a_brisk_tools_inertia_counts_as_noise_while_it_is_brisk():
    random = np.random.default_rng(3)
    t = np.arange(60_000) / RATE
    brisk = np.where((t % 4) > 3, np.sin(2 * np.pi * 3 * t), 0.0)
    inertia = brisk[:, None] * [1.0, 0.0, 0.0]
    left = np.linalg.norm(0.003 * random.standard_normal((len(t), 3)) + 0.05 * inertia, axis=1)
    spread = moving_spread(left, inertia, crowd_scale(left), 40)
    still = (t % 4) < 2.8
    assert np.median(spread[still]) == pytest.approx(0.003, rel=0.15)
    assert np.median(spread[(t % 4) > 3.1]) > 0.012


def test_an_inertia_and_its_acceleration_pass_the_same_filter_on_an_uneven_clock():
    """300 Hz with jitter and lost samples: what is left is a hundredth."""
    random = np.random.default_rng(4)
    t = np.arange(9000) / 300.0
    t = (t + random.normal(0, 0.1 / 300, len(t)))[random.random(len(t)) > 0.01]
    wave = 2 * np.pi * 3.0
    path = 0.01 * np.column_stack([np.sin(wave * t), np.cos(wave * t), 0 * t])
    force = -0.1 * -(wave**2) * path
    passed = low_pass_at(t, force, 300.0, CUTOFF)
    told = -0.1 * low_pass_at(t, path, 300.0, CUTOFF, derivative=2)
    inside = slice(100, -100)
    assert np.abs(passed - told)[inside].max() < 0.05 * np.abs(passed).max()


def test_a_touch_ends_where_its_force_turns_round():
    force = np.zeros((60, 3))
    force[10:30, 0], force[31:50, 0] = 1.0, -1.0
    size = np.linalg.norm(force, axis=1)
    assert np.flatnonzero(np.diff(hysteresis(size, 0.3, 0.6, force, 5).astype(int))).tolist() == [
        9, 29, 30, 49
    ]  # fmt: skip
    assert hysteresis(size, 0.3, 0.6, np.abs(force), 5)[10:50].all()
