"""What is to be done, the records by which a finished task is recognised, and how one is done."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import json
import os
import socket
import threading
import time
import traceback
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import psutil

from palpate.mechanics.disk.reading import sha256_of_file
from palpate.mechanics.disk.store import content_key
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.result import plain
from palpate.version import __version__

Answer = dict[str, Any]
"""Of a job: state "done" with the record; "failed" with a reason, and the trace of what nobody foresaw; or
"crashed" with a reason, where its process ended."""


@dataclass(frozen=True)
class Task:
    """One call of a function, whose result is kept in files.

    function: "package.module:name"; it is called with the keywords `content` and `places`, in any process,
    and returns what JSON can hold. content: what the result depends on (numbers, words, lists, tables; of a
    file its hash), which with the keys of the needs and the version makes the key. places: where things lie;
    they do not count. record: the file that is written last, whole, when the task is finished. products: what
    the function must have written; without them the task is not finished. needs: names of tasks that come
    first. stage: the kind of work, in a word; label: whose. memory_bytes: what one such task takes at most,
    as far as known; measured peaks of the stage correct it.
    """

    function: str
    content: Mapping[str, Any]
    record: Path
    places: Mapping[str, str] = field(default_factory=dict)
    products: tuple[Path, ...] = ()
    needs: tuple[str, ...] = ()
    stage: str = "task"
    label: str = ""
    memory_bytes: int = 0

    @property
    def name(self) -> str:
        """What other tasks call it."""
        return str(self.record)

    @cached_property
    def key(self) -> str:
        """Of all that decides the result, but for what the needs gave: hexadecimal SHA-256."""
        return content_key(self.function, json.dumps(self.content, sort_keys=True), __version__)

    def job(self, needs: Mapping[str, str], root: Path) -> dict[str, Any]:
        """What `done` must know, in JSON. needs: name -> digest; root: the folder of all records."""
        return {
            "function": self.function,
            "keywords": {**self.content, **self.places},
            "key": self.key,
            "needs": dict(needs),
            "record": str(self.record),
            "products": list(map(str, self.products)),
            "root": str(root),
            "version": __version__,
        }


@dataclass(frozen=True)
class Record:
    """A finished task. value: what its function returned; digest: SHA-256 of that and of the products;
    seconds, cpu_s: of the call; peak_bytes: of the process during it, with its children."""

    key: str
    needs: Mapping[str, str]
    digest: str
    value: Any
    seconds: float
    cpu_s: float
    peak_bytes: int
    host: str


def finished(task: Task, needs: Mapping[str, str]) -> Record | None:
    """The task's record, where it is of this content, made from these needs (name -> digest), and whole."""
    try:
        record = Record(**json.loads(task.record.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    same = record.key == task.key and record.needs == dict(needs)
    return record if same and all(path.exists() for path in task.products) else None


def done(job: Mapping[str, Any]) -> Answer:
    """Do a job (`Task.job`) in this process, and write its record."""
    host = socket.gethostname()
    if job["version"] != __version__:
        return _failed(f"{host} has palpate {__version__}, not {job['version']}: install the same on all")
    path = Path(job["record"])
    try:
        if not Path(job["root"]).is_dir():
            raise PalpateError(f"{host} does not see '{job['root']}': choose a folder that all workers share")
        path.unlink(missing_ok=True)  # from here on the products may be others than the record says
        module, name = job["function"].split(":")
        began, cpu = time.perf_counter(), _cpu_s()
        with Peak() as peak:
            value = plain(getattr(importlib.import_module(module), name)(**job["keywords"]))
        record = {
            "key": job["key"],
            "needs": job["needs"],
            "digest": _digest(value, map(Path, job["products"])),
            "value": value,
            "seconds": time.perf_counter() - began,
            "cpu_s": _cpu_s() - cpu,
            "peak_bytes": peak.bytes,
            "host": host,
        }
        with atomic_file(path) as temporary:
            temporary.write_text(json.dumps(record) + "\n", encoding="utf-8")
    except PalpateError as error:
        return _failed(str(error))
    except Exception as error:
        return _failed(f"{type(error).__name__}: {error}", traceback.format_exc())
    return {"state": "done", "record": record}


def _failed(reason: str, trace: str = "") -> Answer:
    return {"state": "failed", "reason": " ".join(reason.split()), "trace": trace}


def _digest(value: Any, products: Iterable[Path]) -> str:
    """SHA-256 of a value and of the bytes of files, and of folders' files."""
    digest = hashlib.sha256(json.dumps(value, sort_keys=True).encode())
    for product in products:
        files = sorted(p for p in product.rglob("*") if p.is_file()) if product.is_dir() else [product]
        for path in files:
            digest.update(f"|{path.relative_to(product)}|{sha256_of_file(path)}".encode())
    return digest.hexdigest()


def _cpu_s() -> float:
    """CPU seconds of this process and of its children that ended."""
    return sum(os.times()[:4])


_SAMPLE_S = 0.2


class Peak:
    """Greatest memory of this process and its children while the block runs: `with Peak() as peak`."""

    bytes: int = 0

    def __enter__(self) -> Self:
        with contextlib.suppress(OSError):  # Linux: the kernel's own high-water mark begins anew
            Path("/proc/self/clear_refs").write_text("5")
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        return self

    def _watch(self) -> None:
        own = psutil.Process()
        while not self._ended.wait(_SAMPLE_S):
            self.bytes = max(self.bytes, sum(map(_resident_bytes, (own, *own.children()))))

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self.bytes = max(self.bytes, high_water_bytes())


def _resident_bytes(process: psutil.Process) -> int:
    try:
        return int(process.memory_info().rss)
    except psutil.Error:  # it ended meanwhile
        return 0


def high_water_bytes() -> int:
    """The greatest resident memory of this process, since `Peak` began where the system counts anew (Linux;
    psutil does not read this mark, and getrusage's carries over a parent's); else what is resident now."""
    with contextlib.suppress(OSError, StopIteration, ValueError):
        status = Path("/proc/self/status").read_text().splitlines()
        return 1024 * next(int(line.split()[1]) for line in status if line.startswith("VmHWM:"))
    return _resident_bytes(psutil.Process())
