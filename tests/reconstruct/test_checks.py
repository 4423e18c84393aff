"""The check-up: each fault is found under its name in a sound exploration, which itself gives no finding."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.errors import PalpateError, RecordingError
from palpate.reconstruction.checks.finding import Finding, ReconstructionOutcome, decades_of_tail, outcome
from palpate.reconstruction.checks.registry import check, checked_samples, refuse_grave, widened
from palpate.reconstruction.checks.samples import Samples
from palpate.reconstruction.checks.units import measured

from ..support.faults import FAULTS
from .exploration_of_cylinder import explore_cylinder

NEED_PRESSES = ("base half the size", "base double the size", "support 2 cm too high")
ALIKE = (
    "force in grams", "position x 10", "position / 1000", "encoder stuck 5 s", "saturated at half",
    "gap of a year", "rate said 10 times", "50 Hz", "force 120 ms late",
)  # fmt: skip
"""Other sizes of faults that are tried everyday."""


@pytest.mark.parametrize("seed", [0, 1])
def test_a_sound_exploration_gives_no_finding(seed):
    recording, _ = explore_cylinder(seed=seed, noise=0.006 * (seed + 1), unlike_speeds=bool(seed))
    assert check(recording) == ()


def test_a_heavy_tool_and_a_bias_are_no_faults():
    recording, _ = explore_cylinder(tool_mass_kg=0.06, bias=(0.3, -0.2, 0.5), drift_n_per_s=0.002)
    assert checked_samples(recording).found == ()


@pytest.mark.parametrize(
    "fault",
    [pytest.param(f, marks=[pytest.mark.release] * (f in ALIKE)) for f in FAULTS if f not in NEED_PRESSES],
)
def test_a_fault_is_found_under_its_name(cylinder, fault):
    it = FAULTS[fault]
    try:
        found = checked_samples(it.change(cylinder[0], np.random.default_rng(0))).found
    except PalpateError:  # refused where it is read
        return
    assert found and found[0].name in it.names, [f.line() for f in found]


@pytest.mark.parametrize(
    "fault", [pytest.param(NEED_PRESSES[0], marks=pytest.mark.release), *NEED_PRESSES[1:]]
)
def test_a_base_that_does_not_fit_the_presses_is_found(cylinder, fault):
    it = FAULTS[fault]
    found = check(it.change(cylinder[0], np.random.default_rng(0)))
    assert found and found[0].name in it.names and found[0].grave


@pytest.mark.parametrize("scale", [0.0, 1e-300])
def test_a_recording_of_nothing_is_found_without_a_warning_of_numpy(cylinder, scale):
    recording = dataclasses.replace(cylinder[0], force_on_tool=scale * cylinder[0].force_on_tool)
    still = dataclasses.replace(recording, position=np.zeros_like(recording.position))
    with np.errstate(all="raise", under="ignore"):
        assert any(f.grave for f in check(recording))
        assert any(f.grave for f in check(still))


def test_what_is_found_says_where_and_how_sure(cylinder):
    recording = cylinder[0]
    position = np.array(recording.position)
    rows = (recording.t > 20.0) & (recording.t < 28.0)
    position[rows] = position[np.argmax(rows)]
    found = checked_samples(dataclasses.replace(recording, position=position)).found[0]
    assert found.name == "stuck channel" and found.channels == ("x", "y", "z")
    assert found.stretch == pytest.approx((20.0, 28.0), abs=0.5)
    assert "p = 1e-" in found.sure and found.decades > 6


def test_what_is_less_than_a_step_off_a_straight_line_is_no_spike_and_more_is(cylinder):
    """A robot's commanded way has no noise: off its lines any micrometre is millions of deviations."""
    recording = cylinder[0]
    knots = recording.t[::500]
    lines = np.column_stack([np.interp(recording.t, knots, x[::500]) for x in recording.position.T])
    kinks = np.arange(1250, len(lines) - 600, 700)
    step = np.median(np.abs(np.diff(lines[:, 2])))
    for size, spikes in ((0.3 * step, False), (30 * step, True)):
        position = np.array(lines)
        position[kinks, 2] += size
        found = checked_samples(dataclasses.replace(recording, position=position)).found
        assert any(f.name == "spikes" for f in found) is spikes


def test_a_press_made_twice_by_a_hand_without_noise_is_no_limit_of_the_sensor():
    """A mouse that comes back to a place presses there to the same micronewton, and holds it still."""
    recording, _ = explore_cylinder(noise=0.0)
    force, spans = np.round(recording.force_on_tool, 6), Samples(recording).spans
    first, last = max(spans, key=lambda span: np.linalg.norm(force[slice(*span)], axis=1).max())
    again = np.r_[np.arange(len(force)), np.arange(first - 100, last + 100)]
    twice = dataclasses.replace(
        recording,
        t=np.arange(len(again)) / recording.sample_rate_hz,
        position=recording.position[again],
        force_on_tool=force[again],
    )
    assert "clipped" not in {finding.name for finding in check(twice)}
    assert "clipped" in {finding.name for finding in check(FAULTS["saturated at 0.3 N"].change(twice, None))}


def test_a_hand_that_held_still_along_one_axis_is_no_stuck_channel(cylinder):
    recording = cylinder[0]
    position = np.array(recording.position)
    held = np.interp(recording.t, [19.5, 20.0, 26.0, 26.5], [0.0, 1.0, 1.0, 0.0])
    held = held**2 * (3 - 2 * held)
    position[:, 1] += held * (position[np.searchsorted(recording.t, 20.0), 1] - position[:, 1])
    assert not any(
        f.name == "stuck channel" for f in check(dataclasses.replace(recording, position=position))
    )


def test_the_delay_of_the_force_is_read_off_places_passed_twice(cylinder):
    for late_s in (-0.04, 0.0, 0.15):
        force = np.roll(cylinder[0].force_on_tool, round(late_s * 1000), axis=0)
        seen = Samples(dataclasses.replace(cylinder[0], force_on_tool=force)).late
        assert seen.seconds == pytest.approx(late_s, abs=0.006) and seen.error_s < 0.003


def test_grave_findings_refuse_unless_forced(cylinder):
    flipped = dataclasses.replace(cylinder[0], force_on_tool=-cylinder[0].force_on_tool)
    with pytest.raises(RecordingError, match="force sign: .*force_on.*--force"):
        refuse_grave(checked_samples(flipped).found)
    (finding, *_) = found = checked_samples(flipped).found
    refuse_grave(found, force=True)
    assert finding.name == "force sign" and "--force-on object" in finding.todo
    stated = dataclasses.replace(flipped, description={"recording": {"force_on": "object"}})
    assert "--force-on tool" in checked_samples(stated).found[0].todo
    said = dataclasses.replace(flipped, description={"import": {"force_on": "object"}})
    assert "leave that out" in checked_samples(said).found[0].todo


def test_lesser_findings_widen_the_interval():
    note = Finding("coarse steps", "", "", "", error=0.1, decades=9.0)
    grave = dataclasses.replace(note, error=np.inf)
    assert grave.grave and not note.grave
    assert widened(30e3, (29e3, 31e3), []) == (29e3, 31e3)
    assert widened(30e3, (29e3, 31e3), [grave]) == (29e3, 31e3)
    low, high = widened(30e3, (29e3, 31e3), [note])
    assert np.log(high / 30e3) == pytest.approx(np.hypot(np.log(31 / 30), 0.196))
    assert np.log(30e3 / low) == pytest.approx(np.hypot(np.log(30 / 29), 0.196))


@pytest.mark.parametrize(
    ("modulus", "interval", "misfit", "name"),
    [
        (30e3, (np.nan, np.nan), 0.01, "no interval"),
        (29e6, (28e6, 30e6), 0.01, "modulus"),
        (100.0, (90.0, 110.0), 0.01, "modulus"),
        (30e3, (29e3, 31e3), 0.9, "misfit"),
    ],
)
def test_an_outcome_that_is_none_is_an_error(modulus, interval, misfit, name):
    ones = np.ones(5)
    found = list(outcome(ReconstructionOutcome(modulus, interval, misfit * ones, ones, ones)))
    assert [f.name for f in found] == [name] and found[0].grave
    assert not list(outcome(ReconstructionOutcome(30e3, (29e3, 31e3), 0.02 * ones, ones, ones)))


def test_a_misfit_of_a_given_shape_asks_which_way_is_up():
    """It sent to other findings, which there were not."""
    ones = np.ones(5)
    (found,) = outcome(ReconstructionOutcome(30e3, (29e3, 31e3), 0.9 * ones, ones, ones, "part.stl"))
    assert "'part.stl'" in found.todo and "--up" in found.todo and "findings" not in found.todo


def test_the_probability_of_a_tail_is_the_binomial_one():
    assert decades_of_tail(3, 3, 0.01) == pytest.approx(6.0)
    assert decades_of_tail(0, 10, 0.5) == 0.0


def test_a_hand_that_rests_most_of_the_time_moves_as_fast_as_it_moves(cylinder):
    """Twenty seconds of thought after every second: the speed in the air is that of the second."""
    recording, _ = cylinder
    rate = round(recording.sample_rate_hz)
    force = np.linalg.norm(recording.force_on_tool, axis=1)
    repeats = np.ones(len(recording.t), dtype=int)
    resting = [k for k in range(rate, len(force), rate) if force[k - 50 : k + 50].max() < 0.1]
    repeats[resting] = 20 * rate
    rows = np.repeat(np.arange(len(recording.t)), repeats)
    rested = dataclasses.replace(
        recording,
        t=np.arange(len(rows)) / rate,
        position=recording.position[rows],
        force_on_tool=recording.force_on_tool[rows],
        quaternion=None,
    )
    assert len(resting) > 3 and len(rows) > 5 * len(recording.t)
    found = measured(Samples(rested))["speed"]
    assert found == pytest.approx(measured(Samples(recording))["speed"], rel=0.5)


@pytest.mark.parametrize("factor", [101.97, 1 / 101.97, 1.0])
def test_a_force_in_another_unit_is_asked_about_where_the_geometry_is_stated(cylinder, factor):
    """A modulus 102 times off is still one that a soft object can have: nothing after it would tell."""
    alike = {"force_on_tool": factor * cylinder[0].force_on_tool, "force_noise_std_n": None}
    found = checked_samples(dataclasses.replace(cylinder[0], **alike), by_hand=False).found
    assert [f.name for f in found] == ["force unit"] * (factor != 1.0)
    assert not any(f.grave for f in found)


def test_presses_that_barely_leave_the_noise_say_nothing_of_a_depth(cylinder):
    """They are felt late and lost early: depths of a tenth of what was pressed, and no fault of a unit."""
    recording = cylinder[0]
    force = recording.force_on_tool
    size = np.linalg.norm(force, axis=1)
    loud = 0.22 * float(np.quantile(size[size > 0.1], 0.9))
    noisy = force + np.random.default_rng(6).normal(0.0, loud, force.shape)
    seen = measured(Samples(dataclasses.replace(recording, force_on_tool=noisy, force_noise_std_n=loud)))
    depth = measured(Samples(recording))["depth"]
    assert seen.get("depth", depth) == pytest.approx(depth, rel=0.5)
