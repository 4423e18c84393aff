"""What is asked for while the worker is busy waits its turn; what is offered each frame does not pile up."""

from __future__ import annotations

import threading

from palpate.mechanics.errors import PalpateError
from palpate.window.worker import Worker

from ...support.waiting import PATIENCE_S


def test_requests_wait_their_turn() -> None:
    worker, gate, done = Worker(), threading.Event(), []
    worker.run("waiting", lambda: done.append(gate.wait(PATIENCE_S)))
    for k in range(5):
        worker.run(f"{k}", lambda k=k: done.append(k))
    assert not worker.offer("offered", lambda: done.append("offered"))
    gate.set()
    worker.wait()
    assert done == [True, 0, 1, 2, 3, 4] and worker.busy == ""
    assert worker.offer("offered", lambda: done.append("offered"))
    worker.wait()
    assert done[-1] == "offered"


def test_a_job_that_fails_says_why_and_the_next_one_runs() -> None:
    worker, done = Worker(), []

    def fails() -> None:
        raise PalpateError("no such model: name another")

    worker.run("failing", fails)
    worker.wait()
    assert worker.failure == "no such model: name another"
    worker.run("failing", lambda: 1 / 0)
    worker.wait()
    assert "ZeroDivisionError" in worker.failure
    worker.run("going on", lambda: done.append(1))
    worker.wait()
    assert done == [1] and worker.failure == ""
