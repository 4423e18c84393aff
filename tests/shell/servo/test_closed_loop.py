"""Hand, device and loop as one system: what stays passive, and what that costs."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from benchmarks._closed_loop import SUBSTEPS, Loop, Timing, closed_loop
from benchmarks._elastic_plane import ElasticPlane
from benchmarks._stability_objects import dome
from benchmarks._stability_objects import one as one_on_dome
from benchmarks.stability import IMPEDANCES, one, plane_stiffness_n_per_m, press_hold_release
from palpate.devices.impedance import HandImpedance
from palpate.devices.safety import CLOCK, JUMP, OVER_SPEED, WORDS
from palpate.devices.virtual_hand import SPEC
from palpate.render.coupling import series_compliance_m_per_n, stable_stiffness_n_per_m, stiffest_n_per_m
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.render.passivity import PassivityOptions

GRASP = (12.0, 600.0)


def test_without_guard_a_delayed_stiff_plane_feeds_a_light_hand_and_with_it_it_does_not():
    loop = Loop(delay_s=0.004)
    off = one(1e6, 0.05, (2.0, 200.0), loop, active=False)
    on = one(1e6, 0.05, (2.0, 200.0), loop, active=True)
    assert off.given_back_j > 5e-3
    assert on.given_back_j < 1e-3


def test_a_thrown_mass_comes_back_no_faster():
    result = one(100e3, 0.2, (0.0, 0.0), Loop(), active=True)
    speed = np.diff(result.position[:, 2]) * 1000.0
    energy = 0.5 * 0.2 * speed**2
    assert energy[-1] - energy[0] < 1e-3
    assert speed[-1] > 0.02, "it does bounce: an elastic plane gives back what it took"


def test_the_work_is_the_change_of_a_free_masss_energy():
    result = one(100e3, 0.2, (0.0, 0.0), Loop(delay_s=0.002), active=False)
    speed = np.diff(result.position[:, 2]) * 1000.0
    gained = 0.5 * 0.2 * (speed[-1] ** 2 - speed[0] ** 2)
    np.testing.assert_allclose(result.work_j[-1], gained, rtol=1e-4, atol=1e-9)


def test_a_soft_object_in_a_firm_hand_is_hardly_changed():
    result = one(20e3, 0.2, GRASP, Loop(quantisation_m=1e-5), active=True)
    assert result.compliance_m_per_n == 0.0
    assert result.given_back_j < 1e-4
    assert result.force_distortion < 0.1


def test_energy_owed_is_half_a_tick_of_stiffness_without_a_controller():
    """What a held force gives beyond the model's is K v^2 T / 2 a second, on the way in and out."""
    k, rate = 500.0, 1000.0
    hand = HandImpedance(0.2, 2000.0, 1e6)
    path = press_hold_release(rate, times=1)
    result = closed_loop(
        ElasticPlane(k), SPEC, hand, path, loop=Loop(rate, passivity=PassivityOptions(passivity=False))
    )
    depth = np.maximum(0.005 - result.position[:, 2], 0.0)
    expected = 0.5 * k * (np.diff(depth) ** 2).sum()
    np.testing.assert_allclose(result.work_j[-1], expected, rtol=0.05)


def late(periods: int, random: np.random.Generator, share: float, usual_ms: float) -> Timing:
    """Ticks that jitter by a fifth of a period, a share of them late by up to 200 ms, whenever they please.

    The late ones' poses are of any time since the tick before, and what they answer comes late as well.
    """
    is_late = random.random(2 * periods) < share
    stall = np.minimum(random.exponential(usual_ms, 2 * periods), 200.0) * SUBSTEPS
    jitter = SUBSTEPS + random.integers(-4, 5, 2 * periods)
    gaps = np.maximum(np.where(is_late, stall, jitter), 4).astype(np.int64)
    read = np.concatenate([[0], gaps.cumsum()])
    number = int(np.searchsorted(read, periods * SUBSTEPS))
    gaps = gaps[:number]
    lag = np.where(is_late[:number], random.random(number) * gaps, np.minimum(8, gaps - 1))
    return Timing(read[: number + 1], lag.astype(np.int64))


def worst_when_late(seeds, modulus: float) -> tuple[float, set[str]]:
    """J that light hands got at most, and what the safety filter said, over loops drawn at random."""
    given, said = 0.0, set()
    for seed in seeds:
        random = np.random.default_rng(seed)
        path = press_hold_release(1000.0, times=3)
        grasp = IMPEDANCES[1 + random.integers(3)]
        timing = late(len(path) - 1, random, random.uniform(0.0, 0.5), 10 ** random.uniform(0.0, 1.5))
        result = closed_loop(
            ElasticPlane(plane_stiffness_n_per_m(modulus)),
            SPEC,
            HandImpedance(random.choice([0.05, 0.1, 0.2]), *grasp),
            path,
            loop=Loop(quantisation_m=random.choice([0.0, 5e-5])),
            timing=timing,
        )
        given, said = max(given, result.given_back_j), said | set(result.reasons)
    return given, said


@pytest.mark.parametrize("modulus", [20e3, 1e6])
def test_whenever_ticks_come_no_hand_gets_a_millijoule_and_none_is_too_fast(modulus):
    given, said = worst_when_late(range(8), modulus)
    assert given < 1e-3
    assert "damped to stay passive" in said
    assert not said & {WORDS[bit] for bit in (OVER_SPEED, JUMP, CLOCK)}


@pytest.mark.parametrize("delay_ticks, expected", [(0.0, 3000.0), (0.5, 3000.0 / 4.0)])
def test_the_stable_stiffness_falls_with_delay(delay_ticks, expected):
    np.testing.assert_allclose(stable_stiffness_n_per_m(3000.0, 1000.0, delay_ticks), expected)
    assert stable_stiffness_n_per_m(3000.0, 500.0) < 3000.0


def test_the_coupling_brings_the_stiffest_place_to_the_limit_exactly():
    plane = ElasticPlane(10_000.0)
    assert stiffest_n_per_m(plane, 20.0) == 10_000.0
    coupled = plane.with_series_compliance(series_compliance_m_per_n(10_000.0, 3000.0))
    np.testing.assert_allclose(stiffest_n_per_m(coupled, 20.0), 3000.0)
    assert series_compliance_m_per_n(2000.0, 3000.0) == 0.0


def test_two_tips_share_the_stiffness_that_the_device_renders_stably():
    plane, offsets = ElasticPlane(10_000.0), np.array([[0.0, -0.006, 0.0], [0.0, 0.006, 0.0]])
    hand, path = HandImpedance(0.2, *GRASP), press_hold_release(1000.0, times=1)
    result = closed_loop(plane, SPEC, hand, path, tip_offsets_m=offsets)
    felt = 2.0 / (1.0 / 10_000.0 + result.compliance_m_per_n)
    np.testing.assert_allclose(felt, SPEC.max_stiffness_n_per_m)
    assert result.given_back_j < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("tips", [1, 2])
def test_no_hand_gets_more_than_a_millijoule_from_a_dome_dragged_over_with_friction(tips):
    renderer = FemRenderer(dome(), RenderOptions(friction=0.5))
    light = (0.05, 2.0, 200.0)
    for modulus, delay, bound in ((30e3, 0.0, 0.0), (300e3, 0.002, 1e-2)):
        stiff = renderer.with_modulus(modulus)
        off = one_on_dome(stiff, light, Loop(1000.0, 5e-5, delay), tips, active=False)
        on = one_on_dome(stiff, light, Loop(1000.0, 5e-5, delay), tips, active=True)
        assert off.given_back_j >= bound
        assert on.given_back_j < 1e-3 and on.contact_share > 0.2


@pytest.mark.slow
def test_no_hand_gets_more_than_a_millijoule_at_1_khz():
    grid = itertools.product(
        (20e3, 1e6), (0.05, 0.5), ((0.0, 0.0), (2.0, 200.0), GRASP, (5.0, 2000.0)), (0.0, 5e-5), (0.0, 0.002)
    )
    for modulus, mass, impedance, quantum, delay in grid:
        result = one(modulus, mass, impedance, Loop(1000.0, quantum, delay), active=True)
        assert result.given_back_j < 1e-3, (modulus, mass, impedance, quantum, delay)
    assert plane_stiffness_n_per_m(1e6) > SPEC.max_stiffness_n_per_m
