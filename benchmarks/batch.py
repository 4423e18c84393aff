"""A batch: CPU seconds and memory of every step, measured by the batch itself, with reports and without; what
10,000 recordings need is computed from that.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.batching.plan import STEPS, Batch, BatchChoice, batch
from palpate.mechanics.errors import OptionError
from palpate.mechanics.recording.files import recording_files

_MANY = 10_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which recordings."""
    parser.add_argument(
        "--recordings", nargs="+", metavar="SOURCE", help="default: copies of the embedded one"
    )
    parser.add_argument("--copies", type=int, default=4, help="of the embedded recording (default: 4)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print the table; return the costs and the figures."""
    with tempfile.TemporaryDirectory(prefix="palpate-bench-") as folder:
        place = Path(folder)
        made = cost(arguments.recordings or copies(place / "recordings", arguments.copies), place)
    figures = []
    for words in ("with reports", "without"):
        for step in STEPS:
            if (key := f"{step}, {words}") in made:
                cpu = made[key]["cpu_s"]
                spread = (min(cpu), max(cpu))
                figures.append(Figure(f"{step}, {words}, CPU, median", float(np.median(cpu)), spread, "s"))
    return {"cost": made, "figures": figures}


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
        result = batch(sources, place / f"cost-{reports}", BatchChoice(reports=reports))
        _all_done(result)
        total = 0.0
        words = "with reports" if reports else "without"
        for step in STEPS:
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


def _all_done(result: Batch) -> None:
    for row in (entry.row for entry in result.entries):
        if row.status != "done":
            raise OptionError(f"{row.recording} did not come through: {row.reason}")
