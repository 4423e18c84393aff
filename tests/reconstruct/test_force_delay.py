"""A force that reads late: found, corrected, and never seen where the force is on time."""

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.steps.s3_contacts import contacts
from palpate.reconstruction.steps.s3_contacts.contacts import ContactOptions, explore, read_earlier
from palpate.reconstruction.steps.s3_contacts.force_delay import Delay

from .exploration_of_cylinder import HEIGHT, RADIUS, TILTED, TIP, explore_cylinder


@pytest.fixture(scope="module")
def on_time():
    return explore_cylinder(unlike_speeds=True)[0]


def shift_of_first_touch(exploration) -> float:
    """Median distance (m) by which the tip's centres lie nearer than its radius: first touch found late."""
    q = TILTED.object(exploration.presses.centre)
    q = np.column_stack([np.hypot(q[:, 0], q[:, 1]) - RADIUS, q[:, 2] - HEIGHT])
    return float(np.median(TIP - q.max(axis=1)))


@pytest.mark.parametrize("delay", [0.02, -0.01])
def test_a_delay_is_found_and_first_touch_comes_out_right(on_time, delay):
    late = read_earlier(on_time, -delay)
    exploration = explore(late)
    assert exploration.delay_s == pytest.approx(delay, abs=max(4 * exploration.delay_error_s, 0.001))
    assert exploration.delay_error_s < 0.002
    assert abs(shift_of_first_touch(exploration)) < 1e-4
    left = explore(late, contact_options=ContactOptions(correct_delay=False))
    assert left.delay_s == 0 and abs(shift_of_first_touch(left)) > 2 * abs(shift_of_first_touch(exploration))
    assert exploration.recording is late


@pytest.mark.parametrize("delay", [0.2])
def test_a_force_of_another_clock_is_found_before_touches_are_looked_for(on_time, delay):
    """They are nowhere in it: first and last touch alone find none."""
    exploration = explore(read_earlier(on_time, -delay))
    assert exploration.delay_s == pytest.approx(delay, abs=0.002)
    assert len(exploration.presses.onset_s) == len(explore(on_time).presses.onset_s)
    assert abs(shift_of_first_touch(exploration)) < 1e-4


def test_a_force_on_time_is_left_alone(on_time):
    exploration = explore(on_time)
    assert exploration.delay_s == 0 and exploration.delay_error_s == 0


def test_adhesion_which_delays_the_loss_of_touch_at_any_speed_is_no_delay():
    exploration = explore(explore_cylinder(unlike_speeds=True, adhesion_n=0.1)[0])
    assert exploration.delay_s == 0


def test_the_papers_mode_takes_the_force_as_it_is(on_time):
    options = ContactOptions(contact_threshold_n=0.3)
    late = read_earlier(on_time, -0.02)
    assert explore(late, method="paper", contact_options=options).delay_s == 0


def test_a_delay_smaller_than_twice_its_error_is_not_corrected_and_said(on_time, monkeypatch):
    """It seemed sure at first, and is not once the force is shifted by it."""
    plain = explore(on_time, contact_options=ContactOptions(correct_delay=False))
    told = [Delay(-0.045, 0.005, 9), Delay(0.0, 0.239, 9)]
    monkeypatch.setattr(contacts, "force_delay", lambda *_: told.pop(0))
    exploration = explore(on_time)
    assert exploration.delay_s == exploration.delay_error_s == 0.0
    assert np.array_equal(exploration.presses.onset_s, plain.presses.onset_s)
    (words,) = exploration.dropped
    assert "-45 +- 239 ms late" in words and "not corrected" in words


def with_gaps(recording: Recording) -> Recording:
    """As a busy program writes it: a third of the samples missing, 15 ms at a time."""
    rng = np.random.default_rng(3)
    kept = np.ones(len(recording.t), dtype=bool)
    lost = round(0.015 * recording.sample_rate_hz)
    for first in rng.choice(len(kept) - lost - 1, len(kept) // (3 * lost), replace=False) + 1:
        kept[first : first + lost] = False
    return dataclasses.replace(
        recording, t=recording.t[kept], position=recording.position[kept],
        force_on_tool=recording.force_on_tool[kept],
    )  # fmt: skip


def test_missing_samples_move_no_force_in_time(on_time):
    gappy = with_gaps(on_time)
    earlier = read_earlier(gappy, 0.05)
    held = np.isin(np.round(gappy.t + 0.05, 6), np.round(gappy.t, 6))
    at = np.searchsorted(on_time.t, gappy.t[held] + 0.05 - 1e-6)
    np.testing.assert_array_equal(earlier.force_on_tool[held], on_time.force_on_tool[at])
    between = np.interp(gappy.t + 0.05, gappy.t, gappy.force_on_tool[:, 2])
    np.testing.assert_allclose(earlier.force_on_tool[~held, 2], between[~held], atol=1e-9)


@pytest.mark.slow
def test_a_delay_is_found_where_samples_are_missing(on_time):
    gappy = with_gaps(read_earlier(on_time, -0.02))
    exploration = explore(gappy)
    assert exploration.delay_s == pytest.approx(0.02, abs=max(4 * exploration.delay_error_s, 0.001))
    assert abs(shift_of_first_touch(exploration)) < 1.5e-4
    assert explore(with_gaps(on_time)).delay_s == 0
