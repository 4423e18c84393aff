"""The side of a play that a tip is on is read off the steps of a reading that follows it."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.recording.side_of_play import leads

WIDTH = 0.25e-3


def _followed(x: np.ndarray) -> np.ndarray:
    """What a reading shows that is dragged once the tip is half the play ahead, in steps of 30 um."""
    out = x.copy()
    for i in range(1, len(x)):
        out[i] = np.clip(out[i - 1], x[i] - WIDTH / 2, x[i] + WIDTH / 2)
    return np.round(out / 3e-5) * 3e-5


def test_a_moving_tip_is_half_the_play_ahead_of_its_reading():
    t = np.arange(0, 4, 1e-3)
    tip = np.column_stack([5e-3 * np.sin(2 * np.pi * 0.7 * t + k) for k in range(3)])
    reading = _followed(tip)
    lead = leads(t, reading)
    error = tip - reading - 0.5 * WIDTH * lead
    assert np.abs(lead).max() <= 1
    assert np.sqrt((error[200:] ** 2).mean()) < 0.3 * np.sqrt(((tip - reading)[200:] ** 2).mean())


def test_a_reading_that_stands_still_tells_nothing():
    t = np.arange(0, 2, 1e-3)
    position = np.zeros((len(t), 3))
    position[:500, 0] = -1e-2 * (0.5 - t[:500])
    position[1500:, 0] = 1e-2 * (t[1500:] - 1.5)
    lead = leads(t, position)
    assert (np.abs(lead[900:1100]) < 0.01).all()
    assert lead[495, 0] > 0.9 and lead[1560, 0] > 0.9
