"""The window before there is anything to touch."""

from __future__ import annotations

import threading
import time

import pytest

from mechanics.errors import SceneError
from palpate.window.waiting import ClosedError, WaitingWindow


@pytest.fixture
def waiting():
    window = WaitingWindow("Palpate: a block", (320, 200), off_screen=True)
    yield window
    window.close()


def test_it_draws_how_far_a_job_has_come_and_returns_what_it_made(waiting: WaitingWindow) -> None:
    seen, go_on = threading.Event(), threading.Event()
    update = waiting.plotter.update

    def drawn() -> None:
        update()
        if "mesh   50 %" in waiting._stage.input:
            seen.set()

    waiting.plotter.update = drawn

    def job(tell) -> str:
        tell("mesh", 0.5)
        assert seen.wait(10.0)
        go_on.set()
        return "model"

    assert waiting.run(job) == "model"
    assert go_on.is_set()


def test_a_job_that_fails_fails_where_it_was_asked_for(waiting: WaitingWindow) -> None:
    def job(tell) -> None:
        raise SceneError("no such thing")

    with pytest.raises(SceneError, match="no such thing"):
        waiting.run(job)


def test_closing_it_ends_the_wait(waiting: WaitingWindow) -> None:
    ended = threading.Event()
    threading.Timer(0.1, waiting._gone).start()
    began = time.monotonic()
    with pytest.raises(ClosedError):
        waiting.run(lambda tell: ended.wait(5.0))
    assert time.monotonic() - began < 4.0
    ended.set()
