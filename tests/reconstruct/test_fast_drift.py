"""Where the tip only passes it is in the air; what the force reads there is carried through the touches."""

import dataclasses

import numpy as np
import pytest

from palpate.reconstruction.steps.s1_filter.fast_drift import follow_free_air, interpolation_error, passing
from palpate.reconstruction.steps.s1_filter.signals import filtered_of

from .exploration_of_cylinder import explore_cylinder


def test_no_touch_is_taken_for_air_whatever_its_force_and_whether_or_not_the_tracing_is_stated():
    recording, _ = explore_cylinder(noise=0.0)
    force = recording.force_on_tool
    touching = np.linalg.norm(force, axis=1) > 0
    start, end = recording.boundary_phase
    for sliding in (np.zeros(len(force), dtype=bool), (recording.t >= start) & (recording.t <= end)):
        air, _ = passing(recording.t, recording.position, force, recording.tip_radius_m, sliding)
        assert not (air & touching).any()
        assert air.sum() > 0.3 * (~touching).sum()


def test_a_force_that_turns_unseen_is_followed_through_the_presses(cylinder):
    plain, onsets = cylinder
    t = plain.t
    # as loud as the presses, faster than a drift, slower than a press
    turned = 0.5 * np.column_stack([np.sin(0.8 * t), np.cos(0.5 * t), np.sin(0.6 * t + 1)])
    recording = dataclasses.replace(plain, force_on_tool=plain.force_on_tool + turned, quaternion=None)
    read, whole = filtered_of(recording, 25.0), filtered_of(plain, 25.0)
    pressing = (t > onsets[0] - 0.5) & (t < onsets[-1] + 0.5)
    off = (read.free_air - turned - whole.free_air)[pressing]
    assert np.sqrt(np.mean(off**2)) < 0.05
    assert (read.touching == whole.touching)[pressing].mean() > 0.95


def test_where_nothing_turns_the_walk_is_not_taken():
    recording, _ = explore_cylinder(bias=(0.05, -0.03, 0.04), drift_n_per_s=0.002)
    with_orientation = filtered_of(recording, 25.0)
    blind = filtered_of(dataclasses.replace(recording, quaternion=None), 25.0)
    late = recording.t > 7
    assert np.abs(np.diff(blind.free_air[late], axis=0)).max() < 1e-3  # no noise is followed
    assert np.abs(blind.free_air - with_orientation.free_air)[late].max() < 0.01


def test_a_line_across_quiet_air_misses_what_the_noise_of_three_samples_makes():
    t = np.arange(4000) / 1000
    force = 0.01 * np.random.default_rng(0).normal(size=(4000, 3))
    air = np.ones(4000, dtype=bool)
    assert 0.9 < interpolation_error(t, force, air) / (0.01 * np.sqrt(1.5)) < 1.1
    assert np.isinf(interpolation_error(t, force, ~air))


def test_how_far_the_air_may_have_gone_unseen_is_a_brownian_bridges():
    rng = np.random.default_rng(1)
    t, per_s = np.arange(0, 40, 0.002), 0.0005  # N^2/s an axis
    walk = np.cumsum(np.sqrt(0.002 * per_s) * rng.normal(size=(len(t), 3)), axis=0)
    raw = walk + 0.01 * rng.normal(size=walk.shape)
    unseen = (t % 4) > 2
    followed, loose = follow_free_air(t, raw, ~unseen, lambda *_: unseen)
    assert loose[~unseen].max() < 0.3 * loose.max()
    middle = np.abs(t % 4 - 3) < 0.1
    assert np.median(loose[middle]) == pytest.approx(np.sqrt(per_s * 2 / 4), rel=0.3)
    # and so far it is off
    off = np.sqrt(np.mean((followed - walk)[middle] ** 2))
    assert 0.5 < off / np.median(loose[middle]) < 1.6
