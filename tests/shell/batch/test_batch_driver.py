"""Which task next: needs, what is finished, what failed, memory. Jobs are done in this process."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import CancelledError, Future
from pathlib import Path
from typing import Any

import pytest

from palpate.parallel.run import _Run, run
from palpate.parallel.tasks import Task, done

GB = 10**9


class Here:
    """Does jobs at once, or answers what a test wants; notes which."""

    def __init__(self, slots: int = 1, memory_bytes: int | None = None) -> None:
        self.count, self.memory_bytes = slots, memory_bytes
        self.did: list[str] = []
        self.answers: dict[str, list[dict[str, Any] | Exception]] = {}

    def slots(self) -> int:
        return self.count

    def submit(self, job, order):
        name = Path(job["record"]).name
        self.did.append(name)
        planned, future = self.answers.get(name), Future()
        answer = planned.pop(0) if planned else done(job)
        if isinstance(answer, Exception):
            future.set_exception(answer)
        else:
            future.set_result(answer)
        return future


class Held(Here):
    """Holds jobs until a test answers them."""

    def submit(self, job, order):
        self.held = {**getattr(self, "held", {}), Path(job["record"]).name: Future()}
        return self.held[Path(job["record"]).name]


@pytest.fixture(autouse=True)
def errands_are_found(monkeypatch) -> Iterator[None]:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    yield


def writing(root: Path, name: str, value: float = 1.0, **more: Any) -> Task:
    """A task NAME that writes a value to NAME.txt."""
    product = root / f"{name}.txt"
    return Task(
        "errands:write", {"value": value}, root / name, {"path": str(product)}, (product,), label=name, **more
    )


def doubling(root: Path, name: str, of: Task) -> Task:
    return Task("errands:double", {}, root / name, {"path": str(of.products[0])}, (), (of.name,), label=name)


def states(outcomes) -> dict[str, tuple[str, bool]]:
    return {Path(name).name: (o.state, o.reused) for name, o in outcomes.items()}


def test_needs_come_first_and_what_depends_on_a_failure_is_skipped_while_the_rest_goes_on(tmp_path):
    good = writing(tmp_path, "good", 3.0)
    bad = Task("errands:fail", {"words": "no\nmodulus"}, tmp_path / "bad", stage="reconstruct", label="bean")
    tasks = [
        Task("errands:double", {}, tmp_path / "b2", {"path": "x"}, (), (bad.name,)),
        Task("errands:double", {}, tmp_path / "b3", {"path": "x"}, (), (str(tmp_path / "b2"),)),
        doubling(tmp_path, "good2", good),
        bad,
        Task("errands:blunder", {}, tmp_path / "blunder"),
        good,
    ]
    outcomes = run(tasks, Here(2), tmp_path)
    found = {Path(name).name: o for name, o in outcomes.items()}
    assert found["good2"].record.value == 6.0
    assert (found["bad"].state, found["bad"].reason) == ("failed", "no modulus")
    assert {found[name].reason for name in ("b2", "b3")} == {"reconstruct bean: no modulus"}
    assert found["blunder"].reason == "ZeroDivisionError: nobody foresaw this"
    assert "errands.py" in found["blunder"].trace and not found["bad"].trace
    assert not (tmp_path / "bad").exists()


def test_what_is_finished_is_recognised_and_only_what_changed_is_done_again(tmp_path):
    def both(value):
        first = writing(tmp_path, "first", value)
        return [first, doubling(tmp_path, "second", first), writing(tmp_path, "other")]

    run(both(1.0), Here(), tmp_path)
    assert set(states(run(both(1.0), Here(), tmp_path)).values()) == {("done", True)}
    again = states(run(both(5.0), Here(), tmp_path))
    assert again == {"first": ("done", False), "second": ("done", False), "other": ("done", True)}
    here = Here()
    run(both(5.0), here, tmp_path, force=True)
    assert sorted(here.did) == ["first", "other", "second"]


def test_a_need_that_was_done_again_with_another_result_is_noticed_after_an_interruption(tmp_path):
    first = writing(tmp_path, "first", 1.0)
    second = doubling(tmp_path, "second", first)
    run([first, second], Here(), tmp_path)
    first.products[0].unlink()  # it must be made again: its value is the same, and so is what follows
    assert states(run([first, second], Here(), tmp_path)) == {
        "first": ("done", False),
        "second": ("done", True),
    }
    stored = json.loads(first.record.read_text())
    first.record.write_text(json.dumps({**stored, "digest": "of another mesh"}))
    assert states(run([first, second], Here(), tmp_path))["second"] == ("done", False)


@pytest.mark.parametrize("harm", ["torn", "gone", "other version"])
def test_a_record_that_is_not_whole_or_not_of_this_version_does_not_count(tmp_path, harm, monkeypatch):
    task = writing(tmp_path, "task")
    run([task], Here(), tmp_path)
    if harm == "torn":
        task.record.write_text(task.record.read_text()[:40])
    elif harm == "gone":
        task.products[0].unlink()
    else:
        monkeypatch.setattr("palpate.parallel.tasks.__version__", "9.9")
        task = writing(tmp_path, "task")
    assert states(run([task], Here(), tmp_path)) == {"task": ("done", False)}


def test_while_a_task_is_done_again_its_old_record_is_gone(tmp_path):
    task = writing(tmp_path, "task")
    run([task], Here(), tmp_path)
    broken = Task("errands:blunder", {}, task.record, products=task.products)
    run([broken], Here(), tmp_path)
    assert not task.record.exists()


def test_a_crash_is_tried_once_more_and_a_lost_task_as_often_as_it_is_lost(tmp_path):
    tasks = [writing(tmp_path, name) for name in ("once", "twice", "lost")]
    here = Here(3)
    crash = {"state": "crashed", "reason": "ended by SIGKILL"}
    here.answers = {"once": [crash], "twice": [crash, crash], "lost": 4 * [CancelledError()]}
    found = run(tasks, here, tmp_path)
    assert states(found) == {
        "once": ("done", False),
        "twice": ("failed", False),
        "lost": ("done", False),
    }
    assert found[tasks[1].name].reason == "ended by SIGKILL"
    assert here.did.count("lost") == 5


def test_as_many_at_once_as_fit_and_what_fits_nowhere_is_done_alone(tmp_path):
    def tasks(memory, count=4):
        return [writing(tmp_path, f"{memory}-{k}", memory_bytes=memory * GB) for k in range(count)]

    for memory, most in ((100, 4), (300, 3), (600, 1), (5000, 1)):
        here, held = Here(4, memory_bytes=1000 * GB), []
        run(tasks(memory), here, tmp_path, tell=lambda status, held=held: held.append(len(status.running)))
        assert max(held) == most
        assert len(here.did) == 4


def test_a_measured_peak_corrects_the_estimate_and_a_crash_doubles_it(tmp_path):
    tasks = [writing(tmp_path, str(k), memory_bytes=1) for k in range(5)]
    here = Held(2, memory_bytes=150 * GB)
    peak = {"key": "", "needs": {}, "digest": "", "value": 0, "seconds": 1, "cpu_s": 1, "host": "here"}
    state = _Run(tasks, here, tmp_path, False, {})
    running = state.status.running
    state.begin()
    assert len(running) == 2  # nothing is known yet
    here.held["1"].set_result({"state": "done", "record": {**peak, "peak_bytes": 100 * GB}})
    state.collect()
    state.begin()
    assert len(running) == 1  # 110 of the one that runs, now that it is known
    here.held["0"].set_result({"state": "crashed", "reason": ""})
    state.collect()
    assert state.memory_bytes(tasks[0]) == 220 * GB


def test_workers_of_another_version_or_without_the_folder_say_so(tmp_path):
    task = writing(tmp_path, "task")
    job = task.job({}, tmp_path)
    assert "install the same on all" in done({**job, "version": "0.0.7"})["reason"]
    assert "choose a folder that all workers share" in done({**job, "root": str(tmp_path / "away")})["reason"]


def test_a_run_refuses_unknown_needs_circles_and_two_of_one_name(tmp_path):
    a = Task("m:f", {}, tmp_path / "a", needs=(str(tmp_path / "b"),))
    b = Task("m:f", {}, tmp_path / "b", needs=(str(tmp_path / "a"),))
    for tasks, words in (([a], "no task"), ([a, b], "cycle")):
        with pytest.raises(ValueError, match=words):
            run(tasks, Here(), tmp_path)
    with pytest.raises(ValueError, match="two different tasks"):
        run([Task("m:f", {}, tmp_path / "c"), Task("m:g", {}, tmp_path / "c")], Here(), tmp_path)


def test_words_and_share_of_a_run(tmp_path):
    first, second = (
        writing(tmp_path, "bean", stage="reconstruct"),
        writing(tmp_path, "bowl", stage="diagnose"),
    )
    told = []
    run([first, second], Here(2), tmp_path, tell=lambda s: told.append((s.words(), s.fraction)))
    assert told[0] == ("0 of 2: reconstruct bean, diagnose bowl", 0.0)
    assert told[-1] == ("2 of 2", 1.0)
    assert [share for _, share in told] == sorted(share for _, share in told)
