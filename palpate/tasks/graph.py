"""What is to be done: tasks, what they need, and the key by which a result is recognised."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from mechanics.store import content_key
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
        self.users: dict[str, list[str]] = {name: [] for name in self.tasks}
        for name, task in self.tasks.items():
            for need in task.needs:
                if need not in self.tasks:
                    raise ValueError(f"task '{name}' needs '{need}', which is not in the graph")
                self.users[need].append(name)
        if sum(1 for _ in self.in_order()) < len(self.tasks):
            raise ValueError("tasks of the graph need each other in a circle")

    def __len__(self) -> int:
        return len(self.tasks)

    def in_order(self) -> Iterator[Task]:
        """Every task after those that it needs; tasks in a circle never come."""
        missing = {name: len(task.needs) for name, task in self.tasks.items()}
        ready = [name for name, count in missing.items() if not count]
        for name in ready:
            yield self.tasks[name]
            for user in self.users[name]:
                missing[user] -= 1
                if not missing[user]:
                    ready.append(user)
