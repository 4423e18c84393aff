"""Processes on this machine: one thread each, a crash costs one task, nothing is left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from palpate.parallel.engines import LocalEngine
from palpate.parallel.run import run
from palpate.parallel.tasks import Task

from ...support.waiting import PATIENCE_S, eventually

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")


@pytest.fixture(autouse=True)
def errands_are_found(monkeypatch) -> Iterator[None]:
    folder, old = str(Path(__file__).parent), os.environ.get("PYTHONPATH")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([folder, *([old] if old else [])]))
    yield


def alive(process: int) -> bool:
    try:
        return psutil.Process(process).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@linux
def test_each_process_has_one_thread_and_prints_disturb_nobody(tmp_path):
    tasks = [Task("errands:threads", {}, tmp_path / str(k)) for k in range(4)]
    with LocalEngine(2) as engine:
        values = [o.record.value for o in run(tasks, engine, tmp_path).values()]
    assert {(v["omp"], v["numba"]) for v in values} == {("1", 1)}
    assert all(v["running"] <= 3 for v in values)  # the work, who listens, who watches the memory
    assert 1 <= len({v["process"] for v in values} - {os.getpid()}) <= 2


def test_a_killed_process_costs_its_task_one_retry_and_nobody_else_anything(tmp_path):
    tasks = [
        Task("errands:die", {"times": times}, tmp_path / f"{times}", {"path": str(tmp_path / f"{times}.txt")})
        for times in (0, 1, 2)
    ]
    with LocalEngine(2) as engine:
        found = [(o.state, o.reason) for o in run(tasks, engine, tmp_path).values()]
    killed = "its process was ended by SIGKILL (out of memory?)"
    assert sorted(found) == [("done", ""), ("done", ""), ("failed", killed)]


@linux
def test_memory_of_a_task_is_measured_by_itself(tmp_path):
    tasks = [Task("errands:fill", {"megabytes": m}, tmp_path / str(m)) for m in (150, 1)]
    with LocalEngine(1) as engine:
        found = [o.record.peak_bytes / 1e6 for o in run(tasks, engine, tmp_path).values()]
    assert 150 < found[0] < 300
    assert found[1] < found[0] - 120  # the same process, after a larger task


@linux
@pytest.mark.parametrize("end", ["left", "killed", "interrupted"])
def test_nothing_is_left_running(tmp_path, end):
    """Ctrl-C, the end of the block, and the sudden death of the parent end workers and what these started."""
    said, seen = tmp_path / "processes.txt", tmp_path / "seen.txt"
    script = f"""
import signal
from pathlib import Path
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
from palpate.parallel.engines import LocalEngine
from palpate.parallel.run import run
from palpate.parallel.tasks import Task
root = Path({str(tmp_path)!r})
quick = Task("errands:write", {{"value": 1}}, root / "quick", {{"path": str(root / "quick.txt")}})
slow = Task("errands:linger", {{}}, root / "slow", {{"path": {str(said)!r}}})
class Left(Exception): ...
def tell(status):
    if {end == "left"} and Path({str(seen)!r}).exists(): raise Left
with LocalEngine(2) as engine:
    run([quick, slow], engine, root, tell=tell)
"""
    parent = subprocess.Popen([sys.executable, "-P", "-c", script], stderr=subprocess.PIPE)
    assert eventually(
        lambda: said.exists() and len(said.read_text().split()) == 2 and (tmp_path / "quick").exists()
    )
    processes = list(map(int, said.read_text().split()))
    assert all(map(alive, processes))
    seen.write_text("all of them run\n")
    if end != "left":
        parent.send_signal(signal.SIGKILL if end == "killed" else signal.SIGINT)
    parent.communicate(timeout=PATIENCE_S)
    assert eventually(lambda: not any(map(alive, processes)))
    # what was begun would have taken a minute and then been kept
    assert not (tmp_path / "slow").exists() and (tmp_path / "quick").exists()
