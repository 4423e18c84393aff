"""Find the nodule: nearer and sooner scores more, and renderers are told apart."""

from __future__ import annotations

import re

import numpy as np
import pytest

import palpate as pp
from palpate.mechanics.model.material import Ball
from palpate.render.surface.felt_surface import local_stiffness
from palpate.scenes.scene import load_scene
from palpate.window.game import HALF_TIME_S, PRESS_M, Game
from palpate.window.stiffness import common_limits

NODULE = Ball((0.014, 0.012, 0.030), 0.009, 8.0)
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def game() -> Game:
    return Game([NODULE], UP)


def test_a_round(game: Game) -> None:
    assert game.answer(1.0, "fem") is None, "nothing was touched yet"
    beside = np.array([0.014, 0.012 + 2 * 0.009, 0.05])
    game.follow(0.004, beside, 10.0)
    game.follow(0.004, beside, 12.0)
    assert game.seconds(15.0) == 5.0 and not game.answered
    answer = game.answer(10.0 + HALF_TIME_S, "fem")
    assert answer.off_m == pytest.approx(2 * 0.009), "how deep it lies is not asked for"
    assert answer.score == pytest.approx(25.0)
    game.follow(0.004, beside, 75.0)
    assert game.answered and "25 of 100 points" in game.lines(80.0)[0], "a press that goes on is no new touch"
    game.follow(0.0, beside, 85.0)
    assert game.answered
    game.follow(0.004, beside, 90.0)
    assert not game.answered and game.seconds(91.0) == 1.0


def test_over_the_nodule_every_place_has_the_points(game: Game) -> None:
    """Over its true place 142 N/m, 6.4 mm beside 143 N/m: what the N/m cannot tell costs nothing."""
    for off_m in (0.0, 0.0064, 0.0089):
        game.follow(0.004, np.array([0.014 + off_m, 0.012, 0.05]), 0.0)
        game.follow(0.0, np.zeros(3), 0.0)
        assert game.answer(0.0, "fem").score == pytest.approx(100.0)
    assert "Over the nodule" in game.lines(0.0)[0] and "halved by" in game.lines(0.0)[0]


def test_the_answer_is_where_the_last_press_was_deep_and_not_where_the_tip_hovers(game: Game) -> None:
    over, hovering = np.array([0.014, 0.012, 0.05]), np.array([-0.09, 0.0, 0.02])
    for depth_m, tip_m in (
        (0.001, hovering),
        (0.004, over),
        (0.0039, over),
        (0.002, hovering),
        (0.0, hovering),
    ):
        game.follow(depth_m, tip_m, 0.0)
    assert game.answer(0.0, "fem").off_m == pytest.approx(0.0)
    game.follow(0.001, hovering, 1.0)
    game.follow(0.0, over, 1.0)
    assert game.answer(1.0, "fem").off_m == pytest.approx(np.hypot(0.104, 0.012)), (
        "the next is one of its own"
    )


def test_the_nearest_of_several_counts() -> None:
    other = Ball((-0.02, 0.0, 0.02), 0.005, 8.0)
    game = Game([NODULE, other], UP)
    game.follow(0.004, np.array([-0.02, 0.0, 0.06]), 0.0)
    assert game.answer(0.0, "fem").score == pytest.approx(100.0)


def test_the_nodule_shows_at_the_depth_that_the_words_name_and_not_under_springs() -> None:
    """Over the nodule, against as high and as far from the middle; on the map in shares of its colours."""
    scene = load_scene("nodule")
    shares = {}
    for name in ("fem", "hunt-crossley"):
        renderer = pp.renderer(scene, name, progress=False)
        stiffness = np.nan_to_num(local_stiffness(renderer, scene.tip_radius_m, PRESS_M))
        low, high = common_limits([stiffness])
        points = renderer.contact.arrays.vertices
        upper = points[:, 2] > 0.5 * points[:, 2].max()
        top, away = points[:, 2] > 0.03, np.hypot(*(points[:, :2] - NODULE.centre_m[:2]).T)
        over, else_ = (np.median(stiffness[top & where]) for where in (away < 0.004, away > 0.02))
        shares[name] = (over - else_) / (high - low)
        if name == "fem":
            assert over > 1.1 * else_
            best = points[np.argmax(np.where(upper, stiffness, 0.0))]
            assert np.hypot(*(best[:2] - NODULE.centre_m[:2])) < NODULE.radius_m, "of the upper half"
            # all that a hand cannot tell from the stiffest place has the points, but for the last tenth:
            # on a dome the stiffest places lie outward of the middle, where the normal points at it
            alike = points[upper & (stiffness > 0.99 * stiffness[upper].max())]
            for place in alike:
                game = Game([NODULE], UP)
                game.follow(0.004, place, 0.0)
                assert game.answer(0.0, "fem").score > 90.0
    assert shares["fem"] > 0.7 and shares["hunt-crossley"] < 0.45
    words = Game([NODULE], UP).lines(0.0)[0].replace("\u00a0", " ")
    assert f"{1e3 * PRESS_M:g} mm" in words and "of the upper half" in words, "the foot is stiffer still"


def test_renderers_are_compared(game: Game) -> None:
    for renderer, off in (("fem", 0.0), ("hunt-crossley", 0.027), ("fem", 0.018)):
        game.follow(0.004, np.array([0.014 + off, 0.012, 0.0]), 0.0)
        game.follow(0.0, np.zeros(3), 0.0)
        game.answer(0.0, renderer)
    named = r"(this model|Hunt–Crossley spring) (\d+) of 100 points in (\d+)"
    assert re.findall(named, game.lines(0.0)[1]) == [
        ("this model", "75", "2"), ("Hunt–Crossley spring", "25", "1"),
    ]  # fmt: skip
