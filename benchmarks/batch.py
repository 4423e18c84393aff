"""A batch: what a recording costs, what more workers bring, how many tasks a second the engines hand on.

cost: CPU seconds and memory of every step, measured by the batch itself, and what 10,000 recordings need,
computed from that. workers: the same recordings with 1 and with 2 processes of one thread (the limit is 2),
in turns, on this machine and as Dask workers; before each pair the load that others make is told. tasks:
the same needs between tasks that do nothing, 10^4 and 10^5 of them, on two workers: the engines' own limit.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.batching.plan import Batch, Choice, batch
from palpate.mechanics.errors import OptionError
from palpate.mechanics.progress import Progress
from palpate.mechanics.recording.files import recording_files
from palpate.output import progress_bar
from palpate.parallel.engines import engine as chosen_engine
from palpate.parallel.run import Status
from palpate.parallel.run import run as run_tasks
from palpate.parallel.tasks import Task

_MANY = 10_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Parts, recordings, repeats, tasks, engines."""
    parser.add_argument(
        "parts", nargs="*", help="of cost, workers, tasks (default: all)", metavar="PART", default=[]
    )
    parser.add_argument(
        "--recordings", nargs="+", metavar="SOURCE", help="default: copies of the embedded one"
    )
    parser.add_argument("--copies", type=int, default=4, help="of the embedded recording (default: 4)")
    parser.add_argument("--repeats", type=int, default=2, help="pairs of 1 and 2 workers (default: 2)")
    parser.add_argument("--tasks", type=int, nargs="+", default=[10_000, 100_000], help="that do nothing")
    parser.add_argument(
        "--engines", nargs="+", choices=("local", "dask"), default=["local", "dask"], help="(default: both)"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print the tables of the parts asked for."""
    parts = arguments.parts or ["cost", "workers", "tasks"]
    made: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="palpate-bench-") as folder:
        place = Path(folder)
        sources = arguments.recordings or copies(place / "recordings", arguments.copies)
        if "cost" in parts:
            made["cost"] = cost(sources, place)
        if "workers" in parts:
            made["workers"] = workers(sources, place, arguments.repeats, arguments.engines)
        if "tasks" in parts:
            made["tasks"] = tasks(arguments.tasks, place, arguments.engines)
    return {**made, "figures": _kept(made)}


def _kept(made: dict[str, Any]) -> list[Figure]:
    found = []
    for words in ("with reports", "without"):
        for step in ("reconstruct", "compare", "diagnose"):
            if (key := f"{step}, {words}") in made.get("cost", {}):
                cpu = made["cost"][key]["cpu_s"]
                spread = (min(cpu), max(cpu))
                found.append(Figure(f"{step}, {words}, CPU, median", float(np.median(cpu)), spread, "s"))
    for engine, of in made.get("workers", {}).items():
        ratio = of["ratio"]
        spread = (min(ratio), max(ratio))
        found.append(Figure(f"2 workers over 1, {engine}", float(np.median(ratio)), spread).at_least(1.8))
    for name, of in made.get("tasks", {}).items():
        count = int(name.split()[1])
        found.append(Figure(f"tasks that do nothing, {name}", count / of["seconds"], unit="tasks/s"))
        found.append(Figure(f"driver's CPU a task, {name}", 1e3 * of["driver_cpu_s"] / count, unit="ms"))
    return found


def copies(folder: Path, count: int) -> list[Path]:
    """The embedded recording so many times, each of other bytes."""
    from palpate.scenes.embedded import embedded_recording

    samples, description = recording_files(embedded_recording())
    words = description.read_text(encoding="utf-8")
    folder.mkdir()
    for k in range(count):
        shutil.copy(samples, folder / f"{k}.csv.gz")
        (folder / f"{k}.toml").write_text(f"# copy {k}\n{words}", encoding="utf-8")
    return sorted(folder.glob("*.toml"))


def cost(sources: Sequence[str | Path], place: Path) -> dict[str, Any]:
    """CPU seconds and memory of every step, with reports and without; what 10,000 recordings need."""
    made: dict[str, Any] = {}
    rows: list[list[Any]] = []
    for reports in (True, False):
        result = batch(sources, place / f"cost-{reports}", Choice(reports=reports))
        _all_done(result)
        total = 0.0
        words = "with reports" if reports else "without"
        for step in ("reconstruct", "compare", "diagnose"):
            known = [e.cost[step] for e in result.entries if step in e.cost]
            cpu, peak = np.array(known, dtype=float).T
            rows.append(
                [words, step, len(cpu), float(np.median(cpu)), float(cpu.max()), float(peak.max() / 1e9)]
            )
            total += float(np.median(cpu))
            made[f"{step}, {words}"] = {"cpu_s": cpu.tolist(), "peak_bytes": peak.tolist()}
        size = sum(p.stat().st_size for p in result.folder.rglob("*") if p.is_file()) / len(result.entries)
        rows.append([words, f"{_MANY:,} recordings: CPU hours", "", total * _MANY / 3600, "", ""])
        rows.append([words, f"{_MANY:,} recordings: disk, GB", "", size * _MANY / 1e9, "", ""])
        made[words] = {"cpu_s": total, "disk_bytes": size}
    print(table(["", "step", "recordings", "CPU s, median", "most", "memory, most [GB]"], rows))
    return made


def workers(
    sources: Sequence[str | Path], place: Path, repeats: int, engines: Sequence[str]
) -> dict[str, Any]:
    """Wall seconds with 1 and with 2 workers, in turns; their ratio, median and spread."""
    made: dict[str, Any] = {}
    rows: list[list[Any]] = []
    _batch_seconds(sources[:1], place / "first", "local", 1)  # compiles kernels, and does not count
    for engine in engines:
        seconds: dict[int, list[float]] = {1: [], 2: []}
        loads = []
        for turn in range(repeats):
            loads.append(os.getloadavg()[0])
            for count in (1, 2) if turn % 2 else (2, 1):
                out = place / "throughput"
                shutil.rmtree(out, ignore_errors=True)
                seconds[count].append(_batch_seconds(sources, out, engine, count))
        ratio = np.array(seconds[1]) / np.array(seconds[2])
        one, two, usual = (float(np.median(v)) for v in (seconds[1], seconds[2], ratio))
        rows.append([engine, repeats, one, two, usual, float(ratio.min()), float(ratio.max()), max(loads)])
        made[engine] = {"one_s": seconds[1], "two_s": seconds[2], "ratio": ratio.tolist(), "load": loads}
    heads = ["engine", "pairs", "1 worker [s]", "2 workers [s]", "ratio, median (limit 2)", "least", "most"]
    print(table([*heads, "greatest load before a pair"], rows))
    return made


def _batch_seconds(sources: Sequence[str | Path], out: Path, engine: str, count: int) -> float:
    choice = Choice(reports=False)
    with dask_workers(count) if engine == "dask" else contextlib.nullcontext() as address:
        began = time.perf_counter()
        chosen: dict[str, Any] = {"scheduler": address} if address else {"workers": count}
        result: Batch = batch(sources, out, choice, **chosen)
        spent = time.perf_counter() - began
    _all_done(result)
    return spent


def _all_done(result: Batch) -> None:
    for row in (entry.row for entry in result.entries):
        if row.status != "done":
            raise OptionError(f"{row.recording} did not come through: {row.reason}")


def nothing(number: int) -> int:
    """What a task of the third part does."""
    return number


def empty_tasks(count: int, root: Path) -> list[Task]:
    """Tasks that do nothing, in the shape of a batch: two that need one, for every recording."""
    made: list[Task] = []
    for k in range(count):
        first = k % 3 == 0
        made.append(
            Task(
                "benchmarks.batch:nothing",
                {"number": k},
                root / f"{k // 300}" / f"{k}.json",
                needs=() if first else (made[k - k % 3].name,),
                stage=("reconstruct", "compare", "diagnose")[k % 3],
            )
        )
    return made


def _told(bar: Progress, status: Status) -> None:
    bar("tasks", status.fraction)


def tasks(counts: Sequence[int], place: Path, engines: Sequence[str]) -> dict[str, Any]:
    """Tasks a second of both engines with two workers; and of a run that finds all of them finished."""
    made: dict[str, Any] = {}
    rows: list[list[Any]] = []
    for engine in engines:
        for count in counts:
            root = place / f"tasks-{engine}-{count}"
            root.mkdir()
            began = time.perf_counter()
            todo = empty_tasks(count, root)
            planned = time.perf_counter() - began
            with (
                dask_workers(2) if engine == "dask" else contextlib.nullcontext() as address,
                chosen_engine(None if address else 2, address) as chosen,
                progress_bar(f"{engine}, {count} tasks") as bar,
            ):
                began, cpu = time.perf_counter(), time.process_time()
                outcomes = run_tasks(todo, chosen, root, tell=partial(_told, bar))
                spent, own = time.perf_counter() - began, time.process_time() - cpu
                began = time.perf_counter()
                again = run_tasks(todo, chosen, root)
                found = time.perf_counter() - began
            assert len(outcomes) == count and all(o.state == "done" for o in outcomes.values())
            assert all(o.reused for o in again.values())
            rows.append([engine, count, planned, spent, count / spent, 1e3 * own / count, found])
            made[f"{engine} {count}"] = {"seconds": spent, "driver_cpu_s": own, "resume_s": found}
            shutil.rmtree(root)
    print(table(["engine", "tasks", "plan [s]", "run [s]", "tasks a second", "driver's CPU a task [ms]",
                 "find all finished [s]"], rows))  # fmt: skip
    return made


@contextlib.contextmanager
def dask_workers(count: int) -> Iterator[str]:
    """The address of a Dask scheduler with so many workers of one thread, processes of this machine."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    commands = [["scheduler", "--host", "127.0.0.1", "--port", str(port)]]
    commands += [["worker", address, "--nthreads", "1"]] * count
    processes = [
        subprocess.Popen(
            [sys.executable, "-m", "dask", *words, "--no-dashboard"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for words in commands
    ]
    try:
        from distributed import Client

        with Client(address, timeout=30, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=60)
        yield address
    finally:
        for process in reversed(processes):
            process.terminate()
        for process in processes:
            process.wait()
