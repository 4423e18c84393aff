"""Find the nodule: nearer and sooner scores more, and renderers are told apart."""

from __future__ import annotations

import re

import numpy as np
import pytest

from palpate.mechanics.model.material import Ball
from palpate.window.game import HALF_TIME_S, Game

NODULE = Ball((0.014, 0.012, 0.030), 0.009, 8.0)
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def game() -> Game:
    return Game([NODULE], UP)


def test_a_round(game: Game) -> None:
    assert game.answer(np.zeros(3), 1.0, "fem") is None, "nothing was touched yet"
    game.follow(True, 10.0)
    game.follow(True, 12.0)
    assert game.seconds(15.0) == 5.0 and not game.answered
    answer = game.answer(np.array([0.014, 0.012 + 0.009, 0.05]), 10.0 + HALF_TIME_S, "fem")
    assert answer.off_m == pytest.approx(0.009), "how deep it lies is not asked for"
    assert answer.score == pytest.approx(25.0)
    game.follow(True, 75.0)
    assert game.answered and "25 points" in game.lines(80.0)[0], "a press that goes on is no new touch"
    game.follow(False, 85.0)
    assert game.answered
    game.follow(True, 90.0)
    assert not game.answered and game.seconds(91.0) == 1.0


def test_the_nearest_of_several_counts() -> None:
    other = Ball((-0.02, 0.0, 0.02), 0.005, 8.0)
    game = Game([NODULE, other], UP)
    game.follow(True, 0.0)
    assert game.answer(np.array([-0.02, 0.0, 0.06]), 0.0, "fem").score == pytest.approx(100.0)


def test_renderers_are_compared(game: Game) -> None:
    for renderer, off in (("fem", 0.0), ("hunt-crossley", 0.018), ("fem", 0.009)):
        game.follow(True, 0.0)
        game.follow(False, 0.0)
        game.answer(np.array([0.014 + off, 0.012, 0.0]), 0.0, renderer)
    assert re.findall(r"(fem|hunt-crossley) (\d+) \w+ in (\d+)", game.lines(0.0)[1]) == [
        ("fem", "75", "2"), ("hunt-crossley", "25", "1"),
    ]  # fmt: skip
