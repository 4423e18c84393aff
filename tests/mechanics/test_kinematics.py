"""Acceleration of sampled paths against those of known movements."""

import numpy as np
import pytest

from palpate.mechanics.recording.kinematics import acceleration

EVEN = np.arange(0, 1.0, 1e-3)


def jittered(seed: int = 0, share: float = 0.3) -> np.ndarray:
    """A clock of 1 kHz that comes up to `share` of a step early or late."""
    return EVEN + 1e-3 * np.random.default_rng(seed).uniform(-share, share, len(EVEN))


def test_a_parabola_has_its_own_acceleration_to_its_ends() -> None:
    path = np.column_stack([0.3 * EVEN**2 - EVEN, 2 - EVEN, 0 * EVEN])
    assert acceleration(EVEN, path) == pytest.approx(np.tile([0.6, 0.0, 0.0], (len(EVEN), 1)), abs=1e-6)


@pytest.mark.parametrize("t", [EVEN, jittered(), np.round(EVEN * 0.9973, 4)])
def test_a_swing_through_an_encoder_and_an_uneven_clock(t: np.ndarray) -> None:
    swing = 2 * np.pi * 2.0
    read = np.round(0.02 * np.sin(swing * t) / 3e-5) * 3e-5
    hand = acceleration(t, read)
    inner = slice(30, -30)
    true = -0.02 * swing**2 * np.sin(swing * t)
    assert np.sqrt(np.mean((hand - true)[inner] ** 2)) < 0.03 * 0.02 * swing**2
    plain = np.gradient(np.gradient(read, t), t)
    assert np.sqrt(np.mean((plain - true)[inner] ** 2)) > 0.02 * swing**2


def test_short_paths_give_what_they_can() -> None:
    assert acceleration(np.array([0.0]), np.zeros((1, 3))).tolist() == [[0, 0, 0]]
    assert acceleration(np.array([0.0, 0.5]), np.array([1.0, 2.0])).tolist() == [0, 0]
    t = np.array([0.0, 0.1, 0.2, 0.3])
    assert acceleration(t, t**2) == pytest.approx(2.0)
