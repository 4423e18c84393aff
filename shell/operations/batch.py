"""Many recordings at once: reconstruct, compare and diagnose each, on all cores or on a Dask cluster.

SOURCE is a folder (it and all below it are searched), a pattern, or a recording. OUT gets a folder a
recording with its MODEL, JSON and reports, summary.csv (moduli in Pa, gaps in N rms), summary.parquet where
pyarrow is installed, and index.html. What is finished is recognised by the recording's bytes, options and
version: run the same command again to go on, or after recordings were added or changed.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import pairs
from palpate.operations._call import Call
from palpate.operations._declare import argument, operation, option
from palpate.operations._shared import Seed

if TYPE_CHECKING:
    from palpate.batching.summary import Batch


@operation()
def batch(
    recordings: Annotated[
        str | Path | Iterable[str | Path],
        argument("folder, pattern or recording", metavar="SOURCE", count="+"),
    ],
    out: Annotated[str | Path, option("folder of all results", flag="--output", short="-o", metavar="OUT")],
    *,
    do: Annotated[
        str | Sequence[str], option("steps, with commas; the others need the first", metavar="STEPS")
    ] = "reconstruct,compare,diagnose",
    options: Annotated[
        Mapping[str, Mapping[str, Any]] | None,
        option(
            "an option of a step, such as diagnose.fast=true or reconstruct.mesh_size_m=0.008 (repeatable; "
            "print(pp.options(STEP)) lists them with units and defaults)",
            flag="--set",
            metavar="STEP.OPTION=VALUE",
            count="repeat",
        ),
    ] = None,
    reports: Annotated[bool, option("an HTML page of every step of every recording")] = True,
    workers: Annotated[
        int | None, option("processes of one thread each on this machine; None: one per core")
    ] = None,
    memory_gb: Annotated[
        float | None, option("memory of all processes together; None: 90 % of what is free", unit="GB")
    ] = None,
    scheduler: Annotated[
        str | None,
        option("address of a Dask cluster that is used instead, such as tcp://HOST:8786", metavar="ADDRESS"),
    ] = None,
    force: Annotated[bool, option("repeat what is finished")] = False,
    seed: Seed = 0,
    call: Call,
) -> Batch:
    """Many recordings at once, in processes of one thread each or by a Dask cluster: a folder each in `out`.

    recordings: folders (and all below), patterns, files. options: step -> keywords of its function,
    {"diagnose": {"fast": True}}; lengths m, forces N. What is finished is recognised by the recording's
    bytes, options and version, unless force. One bad recording stops no other: its row has the reason.
    Raises OptionError.
    """
    from palpate.batching.plan import BatchChoice
    from palpate.batching.plan import batch as run

    steps = tuple(do.split(",")) if isinstance(do, str) else tuple(do)
    result = run(
        [recordings] if isinstance(recordings, str | Path) else recordings,
        out,
        BatchChoice(steps, options_of(options), seed, reports),
        workers=workers,
        memory_bytes=None if memory_gb is None else int(1e9 * memory_gb),
        scheduler=scheduler,
        force=force,
        progress=call.wanted,
    )
    call.exit_code = lambda: _exit_code(result)
    return result


def _exit_code(result: Batch) -> int:
    """2 where not one recording came through, 1 where a model is not reliable."""
    if result.failed:
        words = (
            f"{len(result.failed)} of {len(result)} recordings failed: see {result.folder / 'summary.csv'}"
        )
        print(f"palpate batch: {words}", file=sys.stderr)
    if len(result.failed) == len(result):
        return 2
    return 1 if result.doubtful else 0


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
