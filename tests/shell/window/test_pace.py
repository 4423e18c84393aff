"""What a slow machine leaves out of a picture: never what is felt, the rest by turns."""

from __future__ import annotations

import pytest

from palpate.window.worker import Pace


def drawn(pace: Pace, step_s: float, pictures: int, begin_s: float = 0.0) -> tuple[float, float]:
    """Shares of the pictures, after a second of them, in which the second picture and the words are drawn."""
    told = [pace.next(begin_s + k * step_s) for k in range(pictures)]
    settled = told[int(1.0 / step_s) :]
    return tuple(sum(part) / len(settled) for part in zip(*settled, strict=True))


def test_a_quick_machine_draws_everything_at_every_picture():
    assert drawn(Pace(), 0.016, 200) == (1.0, 1.0)


def test_a_slow_machine_draws_the_second_picture_at_every_other_one_and_words_ten_times_a_second():
    beside, words = drawn(Pace(), 0.04, 200)
    assert beside == pytest.approx(0.5, abs=0.01) and words == pytest.approx(1 / 3, abs=0.01)


def test_what_was_left_out_does_not_come_back_until_there_is_time_for_it():
    pace = Pace()
    drawn(pace, 0.05, 100)
    assert drawn(pace, 0.025, 200, begin_s=5.0)[0] == pytest.approx(0.5, abs=0.01), "else it would flicker"
    assert drawn(pace, 0.016, 200, begin_s=10.0) == (1.0, 1.0)


def test_words_come_at_once_where_the_window_has_changed():
    pace = Pace()
    drawn(pace, 0.05, 100)
    assert [pace.next(5.2 + 0.03 * k)[1] for k in range(2)] == [True, False]
    pace.forget()
    assert pace.next(5.26)[1]
