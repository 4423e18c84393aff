"""The work of held forces, booked by the side that holds them: exact whenever readings come."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.devices.intention import FreeExploration
from palpate.devices.virtual_hand import SimulatedHand
from palpate.servo.device_thread import HeldForce

PUSH = np.array([0.0, 0.0, 2.0])


@pytest.mark.parametrize("delay_s", [0.0, 0.0007, 0.003])
def test_a_delayed_force_is_booked_when_it_acts(delay_s):
    """On even motion the work is the integral of the force that acts, wherever readings fall."""
    random, held = np.random.default_rng(2), HeldForce(delay_s)
    speed = np.array([0.1, -0.02, 0.05])
    sends = np.cumsum(random.uniform(2e-4, 2e-3, 200))
    forces = random.normal(size=(200, 3))
    reads = np.cumsum(random.uniform(2e-4, 2e-3, 200))
    held.move(0.0, np.zeros(3))
    for time_s, kind, k in sorted([(t, 1, k) for k, t in enumerate(sends)] + [(t, 0, 0) for t in reads]):
        if kind:
            held.take(forces[k], time_s, 1.0)
        else:
            held.move(time_s, speed * time_s)
    starts, end = sends + delay_s, max(reads[reads <= max(sends[-1], reads[-1])])
    lasts = np.clip(np.append(starts[1:], np.inf), None, end) - np.clip(starts, None, end)
    np.testing.assert_allclose(held.work_j, ((forces @ speed) * lasts).sum(), rtol=1e-9)


def test_a_force_that_expired_unseen_is_booked_as_the_most_it_can_have_given():
    for moved, most in ((0.002, 0.004), (-0.002, 0.0)):
        held = HeldForce()
        held.move(0.0, np.zeros(3))
        held.take(PUSH, 0.0, 0.005)
        held.move(0.1, np.array([0.0, 0.0, moved]))
        np.testing.assert_allclose(held.work_j, most, atol=abs(moved) * 0.11)
        assert held.work_j >= most - abs(moved) * 0.11


def test_a_garbled_place_is_no_work():
    held = HeldForce()
    held.move(0.0, np.zeros(3))
    held.take(PUSH, 0.0, 1.0)
    for bad in (np.nan, np.inf, 1e200):
        held.move(0.001, np.array([0.0, 0.0, bad]))
    held.move(0.002, np.array([0.0, 0.0, 0.001]))
    np.testing.assert_allclose(held.work_j, 0.002)


def test_the_books_are_those_of_the_hand_whenever_it_is_read_and_pushed():
    """A hand that goes on by itself: what it says it got is what its readings tell, however late they are."""
    now, random = [5.0], np.random.default_rng(7)
    hand = SimulatedHand(intention=FreeExploration(np.zeros(3), 0.05, seed=3), clock=lambda: now[0])
    held = HeldForce()
    with hand:
        hand.enable_force()
        for _ in range(4000):
            now[0] += random.choice([3e-4, 1e-3, 4e-3], p=[0.4, 0.5, 0.1])
            state = hand.read()
            held.move(state.time_s, state.position_m)
            if random.random() < 0.5:
                push = random.normal(size=3)
                held.take(push, state.time_s, 0.02)
                hand.send_force(push, 0.02)
    assert abs(hand.work_j) > 1e-3
    np.testing.assert_allclose(held.work_j, hand.work_j, rtol=1e-2, atol=1e-5)
