"""The window before there is anything to touch."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest
import pyvista

from palpate.mechanics.errors import SceneError
from palpate.operations.touch import DEFAULT
from palpate.scenes.scene import load_scene
from palpate.show.colours import HINT, PAPER
from palpate.window.waiting import ClosedError, WaitingWindow, _draw

from ...support.waiting import PATIENCE_S


@pytest.fixture
def waiting():
    window = WaitingWindow(size=(320, 200), off_screen=True)
    yield window
    window.close()


def test_it_draws_how_far_a_job_has_come_and_returns_what_it_made(waiting: WaitingWindow) -> None:
    seen, go_on = threading.Event(), threading.Event()
    draw = waiting.plotter.render

    def drawn() -> None:
        draw()
        if "mesh   50 %" in waiting.head.text:
            seen.set()

    waiting.plotter.render = drawn

    def job(tell) -> str:
        tell("mesh", 0.5)
        assert seen.wait(PATIENCE_S)
        go_on.set()
        return "model"

    assert waiting.run("a block", job) == "model"
    assert go_on.is_set()


def test_a_job_that_fails_fails_where_it_was_asked_for(waiting: WaitingWindow) -> None:
    def job(tell) -> None:
        raise SceneError("no such thing")

    with pytest.raises(SceneError, match="no such thing"):
        waiting.run("a block", job)


def test_closing_it_ends_the_wait(waiting: WaitingWindow) -> None:
    begun, go_on, ended = threading.Event(), threading.Event(), threading.Event()

    def job(tell) -> None:
        begun.set()
        go_on.wait(PATIENCE_S)
        ended.set()

    def close() -> None:
        begun.wait(PATIENCE_S)
        waiting._gone()

    threading.Thread(target=close).start()
    with pytest.raises(ClosedError):
        waiting.run("a block", job)
    assert not ended.is_set(), "the job was not waited for"
    go_on.set()


def test_a_scene_is_chosen_by_a_click_on_its_card() -> None:
    window = WaitingWindow(
        [load_scene(name) for name in ("bean", "nodule")], size=(480, 300), off_screen=True
    )
    board = window.cards[1]
    assert "Find the nodule" in board.text and "resists more" in board.text
    x, y = board.find("Find the nodule")
    window.interactor.SetEventPosition(round(x), round(y))
    window.interactor.InvokeEvent("MouseMoveEvent")
    assert [card.fill for card in window.cards] == [PAPER, HINT], "the card under the mouse lights up"
    window.interactor.InvokeEvent("LeftButtonPressEvent")
    assert window.choose().name == "nodule"
    assert window.run("Find the nodule", lambda tell: 3) == 3, "the same window then waits"
    window.close()


def test_a_closed_gallery_chooses_nothing() -> None:
    window = WaitingWindow([load_scene("bean")], size=(320, 200), off_screen=True)
    window.interactor.SetKeySym("q")
    window.interactor.InvokeEvent("KeyPressEvent")
    with pytest.raises(ClosedError, match="before a scene was chosen"):
        window.choose()
    window.close()


def test_the_first_card_is_a_picture_of_what_one_will_touch(own_cache: Path) -> None:
    """It was a cloud of where the tip went."""
    plotter = pyvista.Plotter(off_screen=True)
    _draw(plotter, load_scene(DEFAULT))
    shade, drawn = (actor.mapper.dataset for actor in plotter.actors.values())
    size = np.ptp(drawn.points, axis=0)
    assert drawn.n_cells > 100 and size == pytest.approx([0.08, 0.08, 0.08], rel=0.1)
    assert shade.points[:, 2] == pytest.approx(drawn.points[:, 2].min()), "it stands on its shadow"
    plotter.close()


def test_a_round_wall_is_lit_without_a_band() -> None:
    """Each of two lights ended somewhere on it, and the eye saw a stripe there; the top was as dim."""
    plotter = pyvista.Plotter(off_screen=True, window_size=[300, 300], lighting="none")
    _draw(plotter, load_scene("silicone-1"))
    plotter.camera.zoom(1.3)
    light = np.asarray(plotter.screenshot(return_img=True)).sum(axis=2, dtype=float)
    plotter.close()
    wall = light[150][light[150] < light[0, 0]][5:-5]
    fall = np.diff(np.convolve(wall, np.ones(9) / 9, "valid"))
    assert len(wall) > 150 and fall.max() < 0.0, "darker from left to right, all the way"
    assert fall.min() > 2.0 * fall.mean(), "evenly"
    assert light[75, 150] > wall.max() + 30, "light comes from above"
