"""Measured figures, and the file that keeps them: `docs/evidence/NAME.json` (INTERFACE: "Evidence").

A benchmark's `run` returns a dict; what it wants to be kept stands there under "figures", a list of `Figure`.
`palpate bench NAME --evidence` writes them with the command, commit, date and processor.
"""

from __future__ import annotations

import datetime
import json
import math
import os
import platform
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from scipy.stats import binomtest

from palpate.mechanics.disk.reading import read_text
from palpate.mechanics.disk.writing import JSON, atomic_file
from palpate.mechanics.errors import FileError
from palpate.parallel.tasks import high_water_bytes


@dataclass(frozen=True)
class Figure:
    """A measured number. spread: least and greatest of repeats, or an interval; the value twice where it was
    measured once. unit: "1" for a ratio. target: in words, "" for none; met: None where there is no target.
    Raises ValueError for numbers that are not finite."""

    what: str
    value: float
    spread: tuple[float, float] | None = None
    unit: str = "1"
    target: str = ""
    met: bool | None = None

    def __post_init__(self) -> None:
        low, high = self.spread or (self.value, self.value)
        object.__setattr__(self, "value", float(self.value))
        object.__setattr__(self, "spread", (float(low), float(high)))
        if not all(map(math.isfinite, (self.value, low, high))):
            raise ValueError(f"'{self.what}' is {self.value} ({low} to {high}): only finite numbers are kept")
        if (self.met is None) != (not self.target):
            raise ValueError(
                f"'{self.what}' has target '{self.target}' and met {self.met}: give both or none"
            )

    def at_most(self, limit: float, whose: str = "") -> Figure:
        """The figure with a limit that its value must not exceed; whose: "the paper's", if that is so."""
        return self._with(f"at most {limit:g} {self.unit}", whose, bool(self.value <= limit))

    def at_least(self, limit: float, whose: str = "") -> Figure:
        """The figure with a limit that its value must reach."""
        return self._with(f"at least {limit:g} {self.unit}", whose, bool(self.value >= limit))

    def _with(self, target: str, whose: str, met: bool) -> Figure:
        words = target.removesuffix(" 1") + (f" ({whose})" if whose else "")
        return Figure(self.what, self.value, self.spread, self.unit, words, met)


def wilson(hits: int, of: int) -> tuple[float, float, float]:
    """(rate, low, high): Wilson's 95 % interval; all nan for none."""
    if of == 0:
        return (float("nan"),) * 3
    interval = binomtest(hits, of).proportion_ci(0.95, "wilson")
    return hits / of, float(interval.low), float(interval.high)


def rates(counted: Mapping[str, tuple[int, int]]) -> list[Figure]:
    """A figure in % for each (hits, of), with Wilson's 95 % interval; none where nothing was counted."""
    found = []
    for what, (hits, of) in counted.items():
        if of:
            rate, low, high = (100 * x for x in wilson(hits, of))
            found.append(Figure(f"{what}, {hits} of {of} (95 % interval)", rate, (low, high), "%"))
    return found


@dataclass(frozen=True)
class Evidence:
    """What a file holds. command: that measured it; commit: short hash, "-dirty" where the working tree had
    changes; date: YYYY-MM-DD; processor: its name, cores and the machine's load, never the host's name."""

    command: str
    commit: str
    date: str
    processor: str
    figures: tuple[Figure, ...]


def measured(command: str, figures: Sequence[Figure], clone: Path) -> Evidence:
    """Evidence of here and now. clone: the project's folder. Raises ValueError for no figures."""
    if not figures:
        raise ValueError(f"'{command}' gave no figures to keep")
    today = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d")
    return Evidence(command, commit_of(clone), today, processor(), tuple(figures))


def spent() -> tuple[Figure, ...]:
    """Processor time and greatest memory of the command so far, without processes that it started."""
    return (
        Figure("the command itself, processor time", time.process_time(), unit="s"),
        Figure("the command itself, greatest memory", high_water_bytes() / 1e6, unit="MB"),
    )


def commit_of(clone: Path) -> str:
    """Short hash of the clone's commit; "-dirty" where anything but evidence was changed since, "unknown"
    without git."""

    def git(*words: str) -> str:
        command = ["git", "-C", str(clone), *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    try:
        dirty = git("status", "--porcelain", "--", ".", ":(exclude)docs/evidence")
        return git("rev-parse", "--short=7", "HEAD") + ("-dirty" if dirty else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def processor() -> str:
    """Name of the processor, the cores that this process may use, and the load: others may share them."""
    name = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")  # where Linux alone names the model
    if cpuinfo.is_file():
        lines = cpuinfo.read_text(errors="replace").splitlines()
        name = next((x.split(":", 1)[1].strip() for x in lines if x.startswith("model name")), name)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{name}, {cores} {'core' if cores == 1 else 'cores'}{load}"


def write(path: Path | str, evidence: Evidence) -> Path:
    """Write the file whole or not at all; its folder is made."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path, JSON) as temporary:
        temporary.write_text(json.dumps(_rounded(asdict(evidence)), indent=1) + "\n", encoding="utf-8")
    return path


def _rounded(value: Any) -> Any:
    """Numbers to six significant digits."""
    if isinstance(value, dict):
        return {key: _rounded(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(each) for each in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def read(path: Path | str) -> Evidence:
    """Read a file; raises FileError in one line for missing or further keys, wrong types, numbers that are
    not finite, a date or a spread that is none, a target without `met`."""
    try:
        held = json.loads(read_text(path))
        _check(held, Evidence, {"figures": list})
        datetime.date.fromisoformat(held["date"])
        figures = []
        for each in held["figures"]:
            numbers = {"value": (int, float), "spread": list, "met": (bool, type(None))}
            _check(each, Figure, numbers)
            low, high = each["spread"]
            if not low <= each["value"] <= high:
                raise ValueError(f"'{each['what']}' lies outside of its spread")
            figures.append(Figure(**{**each, "spread": (low, high)}))
        return Evidence(**{**held, "figures": tuple(figures)})
    except (ValueError, TypeError) as error:
        raise FileError(f"'{path}' is no evidence file: {error}") from error


def _check(held: Any, kind: type, types: dict[str, Any]) -> None:
    """Raise ValueError unless `held` has the keys of `kind`, each a string or of what `types` says."""
    wanted = [field.name for field in fields(kind)]
    if not isinstance(held, dict) or sorted(held) != sorted(wanted):
        raise ValueError(f"it must hold {', '.join(wanted)}, not {', '.join(map(str, held))}")
    for name in wanted:
        allowed = types.get(name, str)
        if not isinstance(held[name], allowed) or (name == "value" and isinstance(held[name], bool)):
            raise ValueError(f"'{name}' is {held[name]!r}")
