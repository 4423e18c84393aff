"""Many recordings at once: reconstruct, compare and diagnose each, on all cores or on a Dask cluster.

SOURCE is a folder (it and all below it are searched), a pattern, or a recording. OUT gets a folder a
recording with its MODEL, JSON and reports, summary.csv (moduli in Pa, gaps in N rms), summary.parquet where
pyarrow is installed, and index.html. What is finished is recognised by the recording's bytes, options and
version: run the same command again to go on, or after recordings joined or changed.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from typing import Any

from mechanics.errors import OptionError
from palpate import api
from palpate.arguments import add_json, add_seed, emit_json, say
from palpate.tasks.engine import add_engine

SUMMARY = "many recordings at once"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """SOURCE..., -o OUT, --do, --set, who does it, --json, --seed."""
    parser.add_argument("sources", metavar="SOURCE", nargs="+", help="folder, pattern or recording")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="folder of all results")
    parser.add_argument(
        "--do",
        default="reconstruct,compare,diagnose",
        metavar="STEPS",
        help="of reconstruct, compare, diagnose, with commas; the others need the first (default: all)",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="STEP.OPTION=VALUE",
        dest="values",
        help="an option of a step, such as diagnose.fast=true or reconstruct.mesh_size_m=0.008 (repeatable; "
        "print(pp.options(STEP)) lists them with units and defaults)",
    )
    parser.add_argument(
        "--reports",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="an HTML page of every step of every recording (default: yes)",
    )
    add_engine(parser)
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Do it, print the summary; 2 where not one recording came through."""
    result = api.batch(
        arguments.sources,
        arguments.output,
        do=arguments.do,
        options=options_of(arguments.values),
        reports=arguments.reports,
        workers=arguments.workers,
        memory_gb=arguments.memory,
        scheduler=arguments.scheduler,
        force=arguments.force,
        seed=arguments.seed,
    )
    say(arguments, *result.lines())
    emit_json(result.as_json(), arguments.json)
    if result.failed:
        words = (
            f"{len(result.failed)} of {len(result)} recordings failed: see {result.folder / 'summary.csv'}"
        )
        print(f"palpate batch: {words}", file=sys.stderr)
    return 2 if len(result.failed) == len(result) else 0


def options_of(values: list[str]) -> dict[str, dict[str, Any]]:
    """'STEP.OPTION=VALUE' as step -> option -> value: numbers, true and false as in TOML, else a word."""
    found: dict[str, dict[str, Any]] = {}
    for text in values:
        name, equals, value = text.partition("=")
        step, dot, option = name.partition(".")
        if not (equals and dot and step and option):
            raise OptionError(f"--set '{text}' must be STEP.OPTION=VALUE, such as diagnose.fast=true")
        try:
            read: Any = tomllib.loads(f"x = {value}")["x"]
        except (tomllib.TOMLDecodeError, RecursionError):
            read = value
        found.setdefault(step, {})[option] = read
    return found
