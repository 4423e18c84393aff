"""What is to be done: tasks, what they need, and the records by which a finished one is recognised."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any

from palpate.mechanics.disk.reading import sha256_of_file
from palpate.mechanics.disk.store import content_key
from palpate.mechanics.disk.writing import atomic_file
from palpate.version import __version__


@dataclass(frozen=True)
class Task:
    """One call of a function, whose result is kept in files.

    function: "package.module:name"; it is called with the keywords `content` and `places`, in any process,
    and returns what JSON can hold. content: what the result depends on (numbers, words, lists, tables; of a
    file its hash), which with the keys of the needs and the version makes the key. places: where things lie;
    they do not count. record: the file that is written last, whole, when the task is finished. products: what
    the function must have written; without them the task is not finished. needs: names of tasks that come
    first. stage: the kind of work, in a word; label: whose. memory_bytes: what one such task takes at most,
    as far as known; measured peaks of the stage correct it. name: what other tasks call it, by default its
    record.
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
    name: str = ""

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", str(self.record))

    @cached_property
    def key(self) -> str:
        """Of all that decides the result, but for what the needs gave: hexadecimal SHA-256."""
        return content_key(self.function, json.dumps(self.content, sort_keys=True), __version__)


class Graph:
    """Tasks in the order in which they are wanted; `needs` lead to tasks of the graph and in no circle."""

    def __init__(self, tasks: Iterable[Task]) -> None:
        self.tasks: dict[str, Task] = {}
        for task in tasks:
            if self.tasks.setdefault(task.name, task) != task:
                raise ValueError(f"two different tasks are named '{task.name}'")
        for name, task in self.tasks.items():
            for need in task.needs:
                if need not in self.tasks:
                    raise ValueError(f"task '{name}' needs '{need}', which is not in the graph")
        self.sorter()

    def __len__(self) -> int:
        return len(self.tasks)

    def sorter(self) -> TopologicalSorter[str]:
        """Prepared to give the names of tasks whose needs have ended. Raises ValueError for a circle."""
        sorter = TopologicalSorter({name: task.needs for name, task in self.tasks.items()})
        try:
            sorter.prepare()
        except CycleError as error:
            raise ValueError(f"tasks of the graph need each other in a circle: {error.args[1]}") from error
        return sorter


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


def write_record(path: Path, record: Record) -> None:
    """Write it whole; the products are there already."""
    with atomic_file(path) as temporary:
        temporary.write_text(json.dumps(vars(record)) + "\n", encoding="utf-8")


def digest_of(value: Any, products: tuple[Path, ...]) -> str:
    """SHA-256 of a value and of the bytes of files, and of folders' files."""
    digest = hashlib.sha256(json.dumps(value, sort_keys=True).encode())
    for product in products:
        files = sorted(p for p in product.rglob("*") if p.is_file()) if product.is_dir() else [product]
        for path in files:
            digest.update(f"|{path.relative_to(product)}|{sha256_of_file(path)}".encode())
    return digest.hexdigest()
