"""Both engines on real machinery: a Dask scheduler and workers as processes over TCP, one of which is killed,
the scheduler restarted; and the same bits from the MODEL on, whoever does the work."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from distributed import Client

import palpate as pp
from palpate.mechanics.recording.files import recording_files
from palpate.mechanics.recording.recording import read_recording, write_recording
from palpate.parallel.engines import DaskEngine, LocalEngine
from palpate.parallel.run import run
from palpate.parallel.tasks import Task
from palpate.scenes.embedded import embedded_recording

from ...support.waiting import PATIENCE_S, eventually
from .test_batch_local import alive

DOZEN_S = 45.7
"""Until here the recording holds its tracing and twelve presses."""


class Cluster:
    """A scheduler and workers of one thread, started as on a cluster: `dask scheduler`, `dask worker`."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.log = (folder / "dask.log").open("a")
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []

    def _start(self, *words: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *words, "--no-dashboard"]
        return subprocess.Popen(command, stdout=self.log, stderr=self.log, start_new_session=True)

    def start_scheduler(self) -> None:
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", str(self.port))

    def start_worker(self) -> None:
        self.workers.append(self._start("worker", self.address, "--nthreads", "1", "--no-nanny"))

    def kill(self, process: subprocess.Popen[bytes] | None) -> None:
        assert process is not None
        process.send_signal(signal.SIGKILL)
        process.wait()

    def close(self) -> None:
        for process in (self.scheduler, *self.workers):
            if process is not None:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        self.log.close()


@pytest.fixture
def cluster(tmp_path, monkeypatch) -> Iterator[Cluster]:
    folder, old = str(Path(__file__).parent), os.environ.get("PYTHONPATH")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([folder, *([old] if old else [])]))
    made = Cluster(tmp_path)
    made.start_scheduler()
    for _ in range(2):
        made.start_worker()
    try:
        with Client(made.address, timeout=PATIENCE_S, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=PATIENCE_S)
        yield made
    finally:
        made.close()


@pytest.mark.slow
def test_a_killed_worker_and_a_restarted_scheduler_lose_nothing_and_double_nothing(tmp_path, cluster):
    """40 chains of two tasks. What was finished before stays as it was; every result is there once."""
    root, log = tmp_path / "out", tmp_path / "done.log"
    root.mkdir()
    tasks = []
    for k in range(40):
        product = root / f"{k}.txt"
        places = {"path": str(product), "log": str(log)}
        first = Task("errands:write", {"value": k, "seconds": 0.3}, root / f"{k}.first", places, (product,))
        second = Task("errands:double", {}, root / f"{k}.second", {"path": str(product)}, (), (first.name,))
        tasks += [first, second]
    finished_before: dict[Path, float] = {}
    harm_done = []

    def harm() -> None:
        def wait_until(count: int) -> None:
            assert eventually(lambda: len(list(root.glob("*.second"))) >= count), "the batch stands still"

        wait_until(8)
        cluster.kill(cluster.workers[0])  # in the middle of a task: it always has one
        harm_done.append("worker")
        wait_until(16)
        cluster.kill(cluster.scheduler)
        finished_before.update({path: path.stat().st_mtime for path in root.glob("*.second")})
        harm_done.append("scheduler")
        cluster.start_scheduler()
        for _ in range(2):  # as a cluster's supervisor does: workers end with their scheduler
            cluster.start_worker()

    trouble = threading.Thread(target=harm, daemon=True)
    with DaskEngine(cluster.address) as engine:
        trouble.start()
        outcomes = run(tasks, engine, root)
    trouble.join(PATIENCE_S)
    assert harm_done == ["worker", "scheduler"]
    assert len(outcomes) == 80 and all(o.state == "done" for o in outcomes.values())
    values = sorted(o.record.value for o in outcomes.values() if o.task.record.suffix == ".second")
    assert values == [2.0 * k for k in range(40)]
    assert len(finished_before) >= 16
    assert all(path.stat().st_mtime == was for path, was in finished_before.items())
    done = log.read_text().splitlines()
    assert set(done) == {f"{k}.txt" for k in range(40)}
    assert len(done) <= 40 + 3  # what was under way with the two that died, at most, was done again
    again = run(tasks, NoEngine(), root)
    assert all(o.reused for o in again.values())


class NoEngine:
    """Nothing is left to be done."""

    memory_bytes = None

    def slots(self) -> int:
        return 1

    def submit(self, job, order):
        raise AssertionError(f"{job} would be done again")


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_told_in_a_line(monkeypatch):
    monkeypatch.setattr("palpate.parallel.engines._CONNECT_S", 1.0)
    with pytest.raises(pp.OptionError, match="no Dask scheduler answers at 'tcp://127.0.0.1:9'"):
        DaskEngine("tcp://127.0.0.1:9")


@pytest.mark.slow
def test_an_error_and_a_crash_on_a_dask_worker_cost_their_task_alone(tmp_path, cluster):
    tasks = [
        Task("errands:fail", {"words": "no presses"}, tmp_path / "fail"),
        Task("errands:die", {"times": 2}, tmp_path / "die", {"path": str(tmp_path / "die.txt")}),
        Task("errands:threads", {}, tmp_path / "threads"),
    ]
    with DaskEngine(cluster.address) as engine:
        found = {Path(n).name: o for n, o in run(tasks, engine, tmp_path).items()}
    assert found["fail"].reason == "no presses"
    assert found["die"].reason.startswith("its process was ended by SIGKILL")
    value = found["threads"].record.value
    assert (value["omp"], value["numba"]) == ("1", 1)
    assert value["process"] not in [worker.pid for worker in cluster.workers]


@pytest.mark.slow
def test_an_interruption_ends_what_the_cluster_does_for_this_run_and_for_no_other(tmp_path, cluster):
    said = [tmp_path / "ours.txt", tmp_path / "theirs.txt"]
    runs = [[Task("errands:linger", {}, path.with_suffix(""), {"path": str(path)})] for path in said]

    def processes(path: Path) -> list[int]:
        return list(map(int, path.read_text().split())) if path.exists() else []

    def stop_when_both_work(status) -> None:
        if all(len(processes(path)) == 2 for path in said):
            raise KeyboardInterrupt

    def theirs() -> None:
        with suppress(KeyboardInterrupt), DaskEngine(cluster.address) as other:
            run(runs[1], other, tmp_path, tell=stop_when_ours_ended)

    def stop_when_ours_ended(status) -> None:
        if ended.is_set():
            raise KeyboardInterrupt

    ended = threading.Event()
    neighbour = threading.Thread(target=theirs)
    neighbour.start()
    with pytest.raises(KeyboardInterrupt), DaskEngine(cluster.address) as engine:
        run(runs[0], engine, tmp_path, tell=stop_when_both_work)
    assert eventually(lambda: not any(map(alive, processes(said[0]))))
    assert all(map(alive, processes(said[1])))
    ended.set()
    neighbour.join(PATIENCE_S)
    assert eventually(lambda: not any(map(alive, processes(said[1]))))


@pytest.mark.release
def test_both_engines_and_any_number_of_workers_give_the_same_bits_from_the_model_on(tmp_path, cluster):
    """Of replay, compare and diagnose; beside a recording that is broken."""
    _, description = recording_files(embedded_recording("silicone-1-cylinder"))
    (tmp_path / "in").mkdir()
    whole = read_recording(description)
    rows = whole.t < DOZEN_S
    turned = None if whole.quaternion is None else whole.quaternion[rows]
    dozen = dataclasses.replace(
        whole, t=whole.t[rows], position=whole.position[rows], force_on_tool=whole.force_on_tool[rows],
        quaternion=turned, sha256="",
    )  # fmt: skip
    source = write_recording(tmp_path / "in" / "cylinder.csv.gz", dozen)
    (tmp_path / "in" / "broken.csv").write_text("t,x\n0,1\n")
    shutil.copy(description, tmp_path / "in" / "broken.toml")
    options = {
        "reconstruct": {"mesh_size_m": 0.02, "bootstraps": 50},
        "compare": {"folds": 2},
        "diagnose": {"fast": True, "bootstrap": 50},
    }
    given = {"options": options, "reports": False, "progress": False}
    made = pp.batch(tmp_path / "in", tmp_path / "one", do="reconstruct", workers=2, **given)
    assert [row.status for row in made] == ["failed", "done"]
    answers = {}
    for name, engine in {
        "one": {"workers": 1},
        "two": {"workers": 2},
        "dask": {"scheduler": cluster.address},
    }.items():
        out = tmp_path / name
        if name != "one":
            shutil.copytree(tmp_path / "one", out, ignore=shutil.ignore_patterns("compare*", "diagnose*"))
        result = pp.batch(tmp_path / "in", out, **given, **engine)
        assert [row.status for row in result] == ["failed", "done"]
        assert result.reused >= 1  # the model is that of the first
        answers[name] = _answers(out / "cylinder", _engine(engine), source)
    assert answers["one"] == answers["two"] == answers["dask"]
    result.show(screenshot=tmp_path / "objects.png")
    assert "cylinder/thumbnail.png" in (tmp_path / "dask" / "index.html").read_text()


def _engine(engine):
    if "scheduler" in engine:
        return lambda: DaskEngine(engine["scheduler"])
    return lambda: LocalEngine(engine["workers"])


def _answers(folder: Path, engine, recording: Path) -> dict:
    """What does not depend on the clock: the JSON of the steps, and the hash of a replay's forces."""
    replay = Task(
        "errands:replayed",
        {},
        folder / "replay",
        {"model": str(folder / "model"), "recording": str(recording)},
    )
    with engine() as chosen:
        (outcome,) = run([replay], chosen, folder).values()
    found = {step: json.loads((folder / f"{step}.json").read_text()) for step in ("compare", "diagnose")}
    assert found["diagnose"].pop("seconds")
    return {**found, "replay": outcome.record.value}
