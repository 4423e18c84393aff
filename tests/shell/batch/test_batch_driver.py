"""Which task next: needs, what is finished, what failed, memory. Jobs are done in this process."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from palpate.parallel import driver
from palpate.parallel.driver import run
from palpate.parallel.graph import Graph, Task
from palpate.parallel.worker import done

GB = 10**9


class Here:
    """Does jobs at once, one by one, or answers what a test wants; notes which, and how many it held."""

    def __init__(self, slots: int = 1, memory_bytes: int | None = None) -> None:
        self.count, self.memory_bytes = slots, memory_bytes
        self.held: list[tuple[str, dict[str, Any]]] = []
        self.most, self.did = 0, []
        self.answers: dict[str, list[dict[str, Any]]] = {}

    def at_once(self) -> int:
        return self.count

    def slots(self) -> int:
        return self.count

    def submit(self, jobs):
        self.held += jobs
        self.most = max(self.most, len(self.held))

    def collect(self, timeout_s):
        name, job = self.held.pop()
        self.did.append(Path(name).name)
        planned = self.answers.get(Path(name).name)
        return [(name, planned.pop(0) if planned else done(job))]


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
    outcomes = run(Graph(tasks), Here(2), tmp_path)
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

    run(Graph(both(1.0)), Here(), tmp_path)
    assert set(states(run(Graph(both(1.0)), Here(), tmp_path)).values()) == {("done", True)}
    again = states(run(Graph(both(5.0)), Here(), tmp_path))
    assert again == {"first": ("done", False), "second": ("done", False), "other": ("done", True)}
    here = Here()
    run(Graph(both(5.0)), here, tmp_path, force=True)
    assert sorted(here.did) == ["first", "other", "second"]


def test_a_need_that_was_done_again_with_another_result_is_noticed_after_an_interruption(tmp_path):
    first = writing(tmp_path, "first", 1.0)
    second = doubling(tmp_path, "second", first)
    run(Graph([first, second]), Here(), tmp_path)
    first.products[0].unlink()  # it must be made again: its value is the same, and so is what follows
    assert states(run(Graph([first, second]), Here(), tmp_path)) == {
        "first": ("done", False),
        "second": ("done", True),
    }
    stored = json.loads(first.record.read_text())
    first.record.write_text(json.dumps({**stored, "digest": "of another mesh"}))
    assert states(run(Graph([first, second]), Here(), tmp_path))["second"] == ("done", False)


@pytest.mark.parametrize("harm", ["torn", "gone", "other version"])
def test_a_record_that_is_not_whole_or_not_of_this_version_does_not_count(tmp_path, harm, monkeypatch):
    task = writing(tmp_path, "task")
    run(Graph([task]), Here(), tmp_path)
    if harm == "torn":
        task.record.write_text(task.record.read_text()[:40])
    elif harm == "gone":
        task.products[0].unlink()
    else:
        monkeypatch.setattr("palpate.parallel.graph.__version__", "9.9")
        task = writing(tmp_path, "task")
    assert states(run(Graph([task]), Here(), tmp_path)) == {"task": ("done", False)}


def test_while_a_task_is_done_again_its_old_record_is_gone(tmp_path):
    task = writing(tmp_path, "task")
    run(Graph([task]), Here(), tmp_path)
    broken = Task("errands:blunder", {}, task.record, products=task.products, name=task.name)
    run(Graph([broken]), Here(), tmp_path)
    assert not task.record.exists()


def test_a_crash_is_tried_once_more_and_a_lost_task_as_often_as_it_is_lost(tmp_path):
    tasks = [writing(tmp_path, name) for name in ("once", "twice", "lost")]
    here = Here(3)
    crash = {"state": "crashed", "reason": "ended by SIGKILL"}
    here.answers = {"once": [crash], "twice": [crash, crash], "lost": 4 * [{"state": "lost"}]}
    found = run(Graph(tasks), here, tmp_path)
    assert states(found) == {
        "once": ("done", False),
        "twice": ("failed", False),
        "lost": ("done", False),
    }
    assert found[tasks[1].name].reason == "ended by SIGKILL"
    assert here.did.count("lost") == 5


def test_as_many_at_once_as_fit_and_what_fits_nowhere_is_done_alone(tmp_path):
    def tasks(memory, count=4):
        return Graph([writing(tmp_path, f"{memory}-{k}", memory_bytes=memory * GB) for k in range(count)])

    for memory, most in ((100, 4), (300, 3), (600, 1), (5000, 1)):
        here = Here(4, memory_bytes=1000 * GB)
        run(tasks(memory), here, tmp_path)
        assert here.most == most
        assert len(here.did) == 4


def test_a_measured_peak_corrects_the_estimate_and_a_crash_doubles_it(tmp_path):
    tasks = [writing(tmp_path, str(k), memory_bytes=1) for k in range(5)]
    here = Here(2, memory_bytes=150 * GB)
    peak = {"key": "", "needs": {}, "digest": "", "value": 0, "seconds": 1, "cpu_s": 1, "host": "here"}
    here.answers = {"1": [{"state": "done", "record": {**peak, "peak_bytes": 100 * GB}}]}
    state = driver._Run(Graph(tasks), here, tmp_path, False, {})
    state.begin()
    assert len(state.running) == 2  # nothing is known yet
    for name, answer in here.collect(0):
        state.take(name, answer)
    state.begin()
    assert len(state.running) == 1  # 110 of the one that runs, now that it is known
    state.take(*here.collect(0)[0])
    state.begin()
    name = next(iter(state.running))
    state.take(name, {"state": "crashed", "reason": ""})
    assert state.memory_bytes(name) == 220 * GB


def test_workers_of_another_version_or_without_the_folder_say_so(tmp_path):
    task = writing(tmp_path, "task")
    job = driver.job_of(task, {}, tmp_path)
    assert "install the same on all" in done({**job, "version": "0.0.7"})["reason"]
    assert "choose a folder that all workers share" in done({**job, "root": str(tmp_path / "away")})["reason"]


def test_a_graph_refuses_unknown_needs_circles_and_two_of_one_name(tmp_path):
    a = Task("m:f", {}, tmp_path / "a", needs=(str(tmp_path / "b"),))
    b = Task("m:f", {}, tmp_path / "b", needs=(str(tmp_path / "a"),))
    for tasks, words in (([a], "not in the graph"), ([a, b], "circle")):
        with pytest.raises(ValueError, match=words):
            Graph(tasks)
    with pytest.raises(ValueError, match="two different tasks"):
        Graph([Task("m:f", {}, tmp_path / "c"), Task("m:g", {}, tmp_path / "c")])


def test_words_and_share_of_a_run(tmp_path):
    first, second = (
        writing(tmp_path, "bean", stage="reconstruct"),
        writing(tmp_path, "bowl", stage="diagnose"),
    )
    told = []
    run(Graph([first, second]), Here(2), tmp_path, tell=lambda s: told.append((s.words(), s.fraction)))
    assert told[0] == ("0 of 2: reconstruct bean, diagnose bowl", 0.0)
    assert told[-1] == ("2 of 2", 1.0)
    assert [share for _, share in told] == sorted(share for _, share in told)
