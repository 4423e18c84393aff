"""Many recordings at once: reconstruct, compare and diagnose each, on all cores or on a Dask cluster.

SOURCE is a folder (it and all below it are searched), a pattern, or a recording. OUT gets a folder a
recording with its MODEL, JSON and reports, summary.csv (moduli in Pa, gaps in N rms), summary.parquet where
pyarrow is installed, and index.html. What is finished is recognised by the recording's bytes, options and
version: run the same command again to go on, or after recordings joined or changed.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import pairs
from palpate.operations._declare import REQUIRED, Call, operand, operation
from palpate.operations._run import say_next
from palpate.operations._shared import seed_operand
from palpate.output import Output

if TYPE_CHECKING:
    from palpate.batching.summary import Batch


@dataclass(frozen=True)
class BatchOperands:
    """Which recordings, what is done with each, and who does it."""

    recordings: str | Path | Iterable[str | Path] = operand(
        REQUIRED, "folder, pattern or recording", metavar="SOURCE", positional=True, count="+"
    )
    out: str | Path = operand(REQUIRED, "folder of all results", flag="--output", short="-o", metavar="OUT")
    _: KW_ONLY
    do: str | Sequence[str] = operand(
        "reconstruct,compare,diagnose",
        "steps, with commas; the others need the first",
        metavar="STEPS",
    )
    options: Mapping[str, Mapping[str, Any]] | None = operand(
        None,
        "an option of a step, such as diagnose.fast=true or reconstruct.mesh_size_m=0.008 (repeatable; "
        "print(pp.options(STEP)) lists them with units and defaults)",
        flag="--set",
        metavar="STEP.OPTION=VALUE",
        count="repeat",
    )
    reports: bool = operand(True, "an HTML page of every step of every recording")
    workers: int | None = operand(None, "processes of one thread each on this machine; None: one a core")
    memory_gb: float | None = operand(
        None, "what they may take together; None: 90 % of what is free", unit="GB"
    )
    scheduler: str | None = operand(
        None, "of a Dask cluster, such as tcp://HOST:8786, in their place", metavar="ADDRESS"
    )
    force: bool = operand(False, "do what is finished again")
    seed: int = seed_operand()


def _answer(result: Batch, asked: BatchOperands, out: Output) -> int:
    """2 where not one recording came through, 1 where a model is not to be believed."""
    out.say(*result.lines())
    say_next(result, out)
    out.json(result.as_json())
    if result.failed:
        words = (
            f"{len(result.failed)} of {len(result)} recordings failed: see {result.folder / 'summary.csv'}"
        )
        print(f"palpate batch: {words}", file=sys.stderr)
    if len(result.failed) == len(result):
        return 2
    return 1 if result.doubtful else 0


@operation(BatchOperands, answer=_answer)
def batch(asked: BatchOperands, call: Call) -> Batch:
    """Many recordings at once, in processes of one thread each or by a Dask cluster: a folder each in `out`.

    recordings: folders (and all below), patterns, files. options: step -> keywords of its function,
    {"diagnose": {"fast": True}}; lengths m, forces N. What is finished is recognised by the recording's
    bytes, options and version, unless force. One bad recording stops no other: its row has the reason.
    Raises OptionError.
    """
    from palpate.batching.plan import Choice
    from palpate.batching.plan import batch as run

    steps = tuple(asked.do.split(",")) if isinstance(asked.do, str) else tuple(asked.do)
    return run(
        [asked.recordings] if isinstance(asked.recordings, str | Path) else asked.recordings,
        asked.out,
        Choice(steps, options_of(asked.options), asked.seed, asked.reports),
        workers=asked.workers,
        memory_bytes=None if asked.memory_gb is None else int(1e9 * asked.memory_gb),
        scheduler=asked.scheduler,
        force=asked.force,
        progress=call.wanted,
    )


def options_of(
    values: Mapping[str, Mapping[str, Any]] | Sequence[str] | None,
) -> Mapping[str, Mapping[str, Any]] | None:
    """'STEP.OPTION=VALUE' as step -> option -> value: numbers, true and false as in TOML, else a word."""
    if values is None or isinstance(values, Mapping):
        return values
    found: dict[str, dict[str, Any]] = {}
    example = "diagnose.fast=true"
    for name, value in pairs(values, "--set", example):
        step, dot, option = name.partition(".")
        if not (dot and step and option):
            raise OptionError(f"--set '{name}={value}' must be STEP.OPTION=VALUE, such as {example}")
        try:
            read: Any = tomllib.loads(f"x = {value}")["x"]
        except (tomllib.TOMLDecodeError, RecursionError):
            read = value
        found.setdefault(step, {})[option] = read
    return found
