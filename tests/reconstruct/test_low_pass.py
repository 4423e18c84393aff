"""The low-pass has no phase and a known gain; the noise is found under the presses."""

import numpy as np
import pytest

from palpate.mechanics.errors import OptionError
from palpate.reconstruction.steps.s1_filter.noise import low_pass, noise_gain, white_noise_std


def test_a_symmetric_pulse_stays_symmetric_and_in_place():
    t = np.linspace(-1, 1, 2001)
    pulse = np.exp(-((t / 0.03) ** 2))
    filtered = low_pass(pulse, 1000.0, 25.0)
    assert np.argmax(filtered) == np.argmax(pulse)
    assert np.allclose(filtered, filtered[::-1], atol=1e-9)


def test_the_gain_is_one_half_at_the_cut_off_and_one_below():
    t = np.arange(0, 4, 1e-3)
    for frequency, gain in ((25.0, 0.5), (2.5, 1.0)):
        filtered = low_pass(np.sin(2 * np.pi * frequency * t), 1000.0, 25.0)
        assert np.abs(filtered[1000:3000]).max() == pytest.approx(gain, rel=0.01)


def test_the_noise_gain_is_that_of_white_noise():
    noise = np.random.default_rng(1).standard_normal((40000, 3))
    assert low_pass(noise, 1000.0, 25.0).std() == pytest.approx(noise_gain(1000.0, 25.0), rel=0.05)


def test_presses_do_not_count_as_noise(cylinder):
    recording, _ = cylinder
    assert white_noise_std(recording.force_on_tool) == pytest.approx(0.012, rel=0.03)


def test_a_cut_off_of_zero_is_refused():
    with pytest.raises(OptionError, match="greater than 0"):
        low_pass(np.zeros(100), 1000.0, 0.0)
