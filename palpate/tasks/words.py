"""How far a run is: what is being done, what is done, how long it may still take."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from palpate.tasks.graph import Graph, Task
from palpate.tasks.record import Record


@dataclass
class Status:
    """Counts by stage; names of running tasks in the order of their beginning; at_once: how many can run."""

    total: Counter[str]
    ended_of: Counter[str] = field(default_factory=Counter)
    running: dict[str, Task] = field(default_factory=dict)
    seconds: dict[str, list[float]] = field(default_factory=dict)
    at_once: int = 1

    @classmethod
    def of(cls, graph: Graph) -> Status:
        """Nothing done yet."""
        return cls(Counter(task.stage for task in graph.tasks.values()))

    def began(self, task: Task) -> None:
        """A task was handed on."""
        self.running[task.name] = task

    def gave_back(self, task: Task) -> None:
        """It will have to be done again."""
        self.running.pop(task.name, None)

    def ended(self, task: Task, record: Record | None, *, reused: bool) -> None:
        """It is done, failed or skipped."""
        self.running.pop(task.name, None)
        self.ended_of[task.stage] += 1
        if record is not None:
            self.seconds.setdefault(task.stage, []).append(record.seconds)

    @property
    def done(self) -> int:
        """Tasks that ended."""
        return self.ended_of.total()

    @property
    def whole(self) -> int:
        """All tasks."""
        return self.total.total()

    def _mean_s(self, stage: str) -> float | None:
        known = self.seconds.get(stage)
        return sum(known) / len(known) if known else None

    @property
    def fraction(self) -> float:
        """Share of the work that is done; a stage that nobody has timed counts as the mean of the others."""
        means = {stage: self._mean_s(stage) for stage in self.total}
        known = [mean for mean in means.values() if mean]
        usual = sum(known) / len(known) if known else 1.0
        weight = {stage: mean or usual for stage, mean in means.items()}
        whole = sum(weight[s] * n for s, n in self.total.items())
        return sum(weight[s] * n for s, n in self.ended_of.items()) / whole if whole else 1.0

    def left_s(self) -> float | None:
        """Seconds that the rest takes; None before every stage has been timed."""
        means = {stage: self._mean_s(stage) for stage in self.total}
        rest = {stage: self.total[stage] - self.ended_of[stage] for stage in self.total}
        if any(rest[stage] and means[stage] is None for stage in rest):
            return None
        return sum((means[stage] or 0.0) * rest[stage] for stage in rest) / max(1, self.at_once)

    def words(self, most: int = 3) -> str:
        """'7 of 12, about 3 min left: diagnose bean, reconstruct block' of what began first."""
        left = self.left_s()
        text = f"{self.done} of {self.whole}"
        if left is not None and self.done < self.whole:
            text += f", about {_duration(left)} left"
        names = [f"{task.stage} {task.label}".strip() for task in self.running.values()][: self.at_once]
        more = f" and {len(names) - most} more" if len(names) > most else ""
        return text + (f": {', '.join(names[:most])}{more}" if names else "")


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
