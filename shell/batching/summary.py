"""What came out of many recordings: a row each, and how far the explorations of one object agree."""

from __future__ import annotations

import csv
import importlib.util
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.disk.writing import Kind, atomic_file
from palpate.mechanics.result import Result
from palpate.parallel.run import Outcome

_Z95 = 1.959964


@dataclass(frozen=True)
class Row:
    """A recording in summary.csv. status: done, failed or waiting; reason: in a line, why it failed or is not
    to be believed. verdict: the diagnosis' kind; effects: those asserted, ';' between. Moduli Pa, gaps N rms;
    seconds: of all steps, whenever they were done."""

    recording: str
    status: str
    reason: str = ""
    young_modulus_pa: float | None = None
    young_modulus_lo_pa: float | None = None
    young_modulus_hi_pa: float | None = None
    verdict: str | None = None
    effects: str | None = None
    gap_before_n: float | None = None
    gap_after_n: float | None = None
    seconds: float = 0.0


COLUMNS = tuple(field.name for field in fields(Row))
SUMMARY = Kind("a batch's summary", (",".join(COLUMNS[:3]).encode(),))


@dataclass(frozen=True)
class BatchEntry:
    """A recording's row, and what the page shows beside it. values: step -> what its function returned;
    cost: step -> (CPU s, peak bytes); trace: of an error that nobody foresaw; object: as the recording calls
    it, None where it does not."""

    row: Row
    values: Mapping[str, Mapping[str, Any]]
    cost: Mapping[str, tuple[float, int]]
    trace: str = ""

    @property
    def object(self) -> str | None:
        name = self.values.get("reconstruct", {}).get("object")
        return None if name is None else str(name)

    @property
    def doubt(self) -> str:
        """Why its model is not reliable; '' where nothing speaks against it."""
        return str(self.values.get("reconstruct", {}).get("doubt", ""))


@dataclass(frozen=True)
class Agreement:
    """Explorations of one object: how far apart their moduli are, and how far their own intervals say.

    count: of recordings; young_modulus_pa: geometric mean; spread: standard deviation of ln E between
    explorations, about the relative one, with its 95 % interval (chi-squared); expected: what the recordings'
    own intervals would give, rms; both as shares.
    """

    object: str
    count: int
    young_modulus_pa: float
    spread: float
    spread_ci95: tuple[float, float]
    expected: float


@dataclass(frozen=True, eq=False, repr=False)
class Batch(Result):
    """A row a recording, and how far explorations of one object agree. Moduli Pa, gaps N rms, lengths m.

    Iterate over its rows, or take `table`, name -> column, which `pandas.DataFrame` reads. entries: one a
    recording with what every step returned, in the order of their paths; agreements: objects explored more
    than once; folder: has a folder a recording, summary.csv and index.html; reused: tasks that were finished
    before; undescribed: tables in the folders that are no recordings, as no .toml lies beside them; steps:
    what was done. `plot`: moduli over the mean of their object, or over the recordings. `show`: the first
    objects side by side.
    """

    folder: Path
    entries: tuple[BatchEntry, ...]
    agreements: tuple[Agreement, ...]
    tasks: int
    reused: int
    undescribed: tuple[Path, ...] = ()
    steps: tuple[str, ...] = ()

    @property
    def rows(self) -> list[Row]:
        """As in summary.csv, in the order of the recordings' paths."""
        return [entry.row for entry in self.entries]

    @property
    def failed(self) -> list[Row]:
        """Those that failed; `reason` says why."""
        return [row for row in self.rows if row.status == "failed"]

    @property
    def doubtful(self) -> list[Row]:
        """Those whose model is not reliable; `reason` says why."""
        return [entry.row for entry in self.entries if entry.doubt]

    @property
    def table(self) -> dict[str, list[Any]]:
        """The columns of summary.csv by name; None where nothing is known."""
        return {name: [getattr(row, name) for row in self.rows] for name in COLUMNS}

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.entries)


def entry_of(name: str, outcomes: Mapping[str, Outcome], bad: str | None, steps: Sequence[str]) -> BatchEntry:
    """The entry of one recording. outcomes: step -> outcome, of those that ended; bad: why it could not even
    be planned."""
    if bad is not None:
        return BatchEntry(Row(name, "failed", bad), {}, {})
    records = {step: o.record for step, o in outcomes.items() if o.record is not None}
    values: dict[str, Mapping[str, Any]] = {step: record.value for step, record in records.items()}
    failed = [o for o in outcomes.values() if o.state == "failed"]
    status = "failed" if failed else ("done" if len(records) == len(steps) else "waiting")
    made = values.get("reconstruct", {})
    low, high = made.get("young_modulus_ci95_pa") or (None, None)
    reasons = [f"{o.task.stage}: {o.reason}" for o in failed]
    reasons += [f"not reliable: {made['doubt']}"] if made.get("doubt") else []
    verdict = values.get("diagnose", {})
    row = Row(
        recording=name,
        status=status,
        reason="; ".join(reasons),
        young_modulus_pa=made.get("young_modulus_pa"),
        young_modulus_lo_pa=low,
        young_modulus_hi_pa=high,
        verdict=verdict.get("kind"),
        effects=";".join(verdict["effects"]) if verdict else None,
        gap_before_n=verdict.get("gap_before_n"),
        gap_after_n=verdict.get("gap_after_n"),
        seconds=round(sum(record.seconds for record in records.values()), 3),
    )
    cost = {step: (record.cpu_s, record.peak_bytes) for step, record in records.items()}
    return BatchEntry(row, values, cost, "\n".join(o.trace for o in failed if o.trace))


def agreements(entries: Sequence[BatchEntry]) -> list[Agreement]:
    """Of every object with two explorations or more whose moduli are known, the most explored first."""
    by_object: dict[str, list[Row]] = {}
    for entry in entries:
        if entry.object is not None and entry.row.young_modulus_pa:
            by_object.setdefault(entry.object, []).append(entry.row)
    found = [agreement(name, rows) for name, rows in by_object.items() if len(rows) > 1]
    return sorted(found, key=lambda a: (-a.count, a.object))


def agreement(name: str, rows: Sequence[Row]) -> Agreement:
    """How far the moduli of rows, two or more, agree."""
    from scipy.stats import chi2

    moduli = np.log([row.young_modulus_pa or math.nan for row in rows])
    low = np.array([row.young_modulus_lo_pa or math.nan for row in rows])
    high = np.array([row.young_modulus_hi_pa or math.nan for row in rows])
    own = np.log(high / low) / (2 * _Z95)
    free = len(rows) - 1
    spread = float(moduli.std(ddof=1))
    limits = spread * np.sqrt(free / chi2.ppf([0.975, 0.025], free))
    return Agreement(
        object=name,
        count=len(rows),
        young_modulus_pa=float(np.exp(moduli.mean())),
        spread=spread,
        spread_ci95=(float(limits[0]), float(limits[1])),
        expected=float(np.sqrt(np.mean(own**2))),
    )


def write_csv(path: Path, rows: Sequence[Row]) -> None:
    """summary.csv: COLUMNS; empty where nothing is known."""
    with atomic_file(path, SUMMARY) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)


def write_parquet(path: Path, rows: Sequence[Row]) -> bool:
    """summary.parquet, the same columns; False, and no file, where pyarrow is not installed."""
    if importlib.util.find_spec("pyarrow") is None:
        path.unlink(missing_ok=True)
        return False
    import pyarrow
    from pyarrow import parquet

    words = {"recording", "status", "reason", "verdict", "effects"}
    schema = pyarrow.schema(
        [(name, pyarrow.string() if name in words else pyarrow.float64()) for name in COLUMNS]
    )
    table = pyarrow.Table.from_pylist([asdict(row) for row in rows], schema)
    with atomic_file(path, Kind("Parquet", (b"PAR1",))) as temporary:
        parquet.write_table(table, temporary)
    return True
