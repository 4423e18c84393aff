"""Repeated timings: median and spread, wall and CPU."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Timing:
    """Seconds over the repeats; spread is (max - min) / median, cpu_spread_s the least and the most."""

    median_s: float
    least_s: float
    most_s: float
    cpu_median_s: float
    cpu_spread_s: tuple[float, float]
    repeats: int

    @property
    def spread(self) -> float:
        """(max - min) / median of the wall time."""
        return (self.most_s - self.least_s) / self.median_s if self.median_s > 0 else 0.0


def measure(work: Callable[[], Any], *, repeats: int = 5, warm_up: int = 1) -> Timing:
    """Time `work()` after `warm_up` calls that do not count."""
    for _ in range(warm_up):
        work()
    wall, cpu = [], []
    for _ in range(repeats):
        c, w = time.process_time(), time.perf_counter()
        work()
        wall.append(time.perf_counter() - w)
        cpu.append(time.process_time() - c)
    limits = (min(cpu), max(cpu))
    return Timing(float(np.median(wall)), min(wall), max(wall), float(np.median(cpu)), limits, repeats)


def table(header: list[str], rows: list[list[Any]]) -> str:
    """A Markdown table, numbers to three significant digits."""

    def cell(value: Any) -> str:
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    lines += ["| " + " | ".join(map(cell, row)) + " |" for row in rows]
    return "\n".join(lines)
