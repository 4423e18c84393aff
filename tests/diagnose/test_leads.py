"""The side of a play that a tip is on is read off the motion of a reading that follows it."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.recording.side_of_play import leads, play, sides

WIDTH = 0.25e-3


def _followed(x: np.ndarray, step: float = 3e-5, jitter: float = 0.0) -> np.ndarray:
    """What a reading shows that is dragged once the tip is half the play ahead, with noise, in steps."""
    out = np.empty_like(x)
    play(np.array([0, len(x)]), x, np.zeros((1, 3)), WIDTH, out)
    out += jitter * np.random.default_rng(1).normal(size=x.shape)
    return np.round(out / step) * step


def _hand(t: np.ndarray) -> np.ndarray:
    """(n, 3) m: reaches of 5 mm and rests of half a second by turns, with tremor."""
    share = np.clip((t / 0.8) % 2 - 0.4, 0, 1) * (1 - np.clip((t / 0.8) % 2 - 1.4, 0, 1) / 0.6)
    reach = 5e-3 * share**3 * (10 - 15 * share + 6 * share**2)
    tremor = [25e-6 * np.sqrt(2) * np.sin(2 * np.pi * 9 * t + k) for k in range(3)]
    return np.column_stack([reach + tremor[0], -reach + tremor[1], 0.5 * reach + tremor[2]])


def test_a_moving_tip_is_half_the_play_ahead_of_its_reading():
    t = np.arange(0, 4, 1e-3)
    tip = np.column_stack([5e-3 * np.sin(2 * np.pi * 0.7 * t + k) for k in range(3)])
    reading = _followed(tip)
    lead = leads(t, reading)
    error = tip - reading - 0.5 * WIDTH * lead
    assert np.abs(lead).max() <= 1
    assert np.sqrt((error[200:] ** 2).mean()) < 0.3 * np.sqrt(((tip - reading)[200:] ** 2).mean())


@pytest.mark.parametrize("every", [1, 2, 10])
@pytest.mark.parametrize("step_m", [5e-6, 30e-6, 60e-6])
@pytest.mark.parametrize("jitter_m", [0.0, 3e-6, 8e-6])
def test_an_encoder_that_flickers_between_two_steps_is_no_motion(every, step_m, jitter_m):
    t = np.arange(0, 12, 1e-3)
    tip = _hand(t)
    true = 2 / WIDTH * (tip - _followed(tip, step=1e-12))
    lead, unsure = sides(t[::every], _followed(tip, step_m, jitter_m)[::every])
    true, later = true[::every], t[::every] > 0.5
    for axis in range(3):
        assert np.corrcoef(lead[later, axis], true[later, axis])[0, 1] > 0.7
    sure = (unsure < 0.2) & later[:, None]
    assert sure.mean() > 0.2
    assert (np.sign(lead[sure]) != np.sign(true[sure])).mean() < 0.05


def test_a_reading_that_stands_still_tells_nothing():
    t = np.arange(0, 2, 1e-3)
    position = np.zeros((len(t), 3))
    position[:500, 0] = -1e-2 * (0.5 - t[:500])
    position[1500:, 0] = 1e-2 * (t[1500:] - 1.5)
    lead = leads(t, position)
    assert (np.abs(lead[900:1100]) < 0.01).all()
    assert lead[495, 0] > 0.9 and lead[1560, 0] > 0.9
