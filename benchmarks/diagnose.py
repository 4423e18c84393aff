"""The blind benchmark: sealed recordings of the virtual laboratory, verdicts first, truths opened after.

Sizes: quick (for CI), protocol (what presses alone hide, explored in two ways), medium, full. Everything that
is no question is drawn by each case's seed (benchmarks.varied). Tasks, done by processes here or
by a Dask cluster: touches are solved once an object, every case is simulated with its truth sealed and
reconstructed, then diagnosed, and its verdict written to the work folder, before the truth is opened; a run
that was interrupted goes on where it stopped. Rates carry Wilson's 95 % intervals. Baselines on the same
recordings: the best in-sample fit by BIC, and for the gap a regression of the residual on place, depth, rate
and history.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._diagnosis_blind import opened_case, tasks_of, unfinished, verdict_path
from benchmarks._diagnosis_cases import POOLS, SEEDS, Case, cases
from benchmarks._diagnosis_scores import summarise
from benchmarks._diagnosis_tables import TARGETS, show
from benchmarks.evidence import Figure, rates
from benchmarks.timing import table
from palpate.mechanics.errors import OptionError
from palpate.operations._to_argparse import finite
from palpate.parallel.run import Outcome, run_with_bar
from palpate.parallel.tasks import Task


def _add_engine(parser: argparse.ArgumentParser) -> None:
    """--workers, --memory, --scheduler, --force."""
    group = parser.add_argument_group("who does it")
    group.add_argument(
        "--workers",
        type=int,
        metavar="INTEGER",
        help="processes of one thread each on this machine (default: one a core)",
    )
    group.add_argument(
        "--memory",
        type=finite,
        metavar="NUMBER",
        help="memory of all processes together [GB] (default: 90 %% of what is free)",
    )
    group.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="address of a Dask cluster to use instead, such as tcp://HOST:8786",
    )
    group.add_argument("--force", action="store_true", help="repeat what is finished")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Size, work folder, seed."""
    parser.add_argument("--size", choices=tuple(POOLS), default="quick", help="how many cases")
    parser.add_argument(
        "--work", default="bench-diagnose", help="folder of recordings, models and verdicts (resumed)"
    )
    parser.add_argument(
        "--phantom", action="append", metavar="FAMILY", help="only objects of this family (repeatable)"
    )
    parser.add_argument(
        "--fast", action=argparse.BooleanOptionalAction, default=None, help="diagnose with --fast"
    )
    parser.add_argument(
        "--stage",
        choices=("all", "prepare", "judge", "table"),
        default="all",
        help="only simulate and reconstruct, only diagnose what is prepared, or only open and count",
    )
    parser.add_argument(
        "--solve",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="let the laboratory solve touches that the work folder does not hold (default: yes)",
    )
    parser.add_argument(
        "--limit", type=int, help="at most this many new cases (the table shows what is there)"
    )
    parser.add_argument(
        "--minutes", type=float, help="stop after so many minutes (what was begun is done again next time)"
    )
    parser.add_argument(
        "--part",
        default="1/1",
        metavar="K/N",
        help="only every N-th case, from the K-th (runs beside others)",
    )
    parser.add_argument(
        "--seen",
        metavar="FOLDER",
        help="leave cases with a verdict in this folder out of the table: rules were chosen after those",
    )
    parser.add_argument(
        "--cases",
        choices=tuple(SEEDS),
        default="development",
        help="whose seeds: to look at, to calibrate on unseen, or to be opened once a release",
    )
    parser.add_argument("--seed", type=int, help="first seed, instead of that of --cases")
    _add_engine(parser)


class _Late(Exception):
    """The time is up."""


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Do what is missing, open the truths, print the table."""
    work = Path(arguments.work)
    fast = arguments.size == "quick" if arguments.fast is None else arguments.fast
    first = SEEDS[arguments.cases] if arguments.seed is None else arguments.seed
    todo = cases(arguments.size, arguments.phantom, first)
    outcomes: dict[str, Outcome] = {}
    if arguments.stage != "table":
        chosen = _chosen(part_of(todo, arguments.part), work, arguments, fast)
        work.mkdir(parents=True, exist_ok=True)
        _work_through(chosen, work, arguments, outcomes)
        _tell(outcomes)
    counted = [c for c in todo if not (arguments.seen and (Path(arguments.seen) / f"{c.key}.json").exists())]
    done = [opened_case(c, work) for c in counted if verdict_path(c, work).exists()]
    summary = summarise(done)
    summary["size"] = {"asked": len(counted), "done": len(done), "fast": fast}
    summary["failed_tasks"] = {o.task.label: o.reason for o in outcomes.values() if o.state == "failed"}
    summary["figures"] = [
        _against(figure, TARGETS.get(name, ""))
        for name, rate in summary["rates"].items()
        for figure in rates({name: (rate["hits"], rate["of"])})
    ]
    show(summary)
    return summary


def _against(figure: Figure, target: str) -> Figure:
    """The figure, in %, with a target such as "at most 2 %" or "at least 5 of 6"."""
    if not target:
        return figure
    first, *of = (float(word) for word in target.split() if word.isdigit())
    limit = 100 * first / of[0] if of else first
    return figure.at_most(limit) if target.startswith("at most") else figure.at_least(limit)


def _chosen(own: list[Case], work: Path, arguments: argparse.Namespace, fast: bool) -> list[Task]:
    """Tasks of the cases that are to be done, in the order of the cases: a run that stops has verdicts."""
    found: dict[str, Task] = {}
    fresh = 0
    for case in own:
        mine = tasks_of(case, work, solve=arguments.solve, fast=fast)
        if arguments.stage == "prepare":
            mine = mine[:-1]
        if arguments.stage == "judge" and any(map(unfinished, mine[:-1])):
            continue
        fresh += unfinished(mine[-1])
        if arguments.limit is not None and fresh > arguments.limit:
            break
        found.update({task.name: task for task in mine})
    return list(found.values())


def _work_through(
    tasks: Sequence[Task], work: Path, arguments: argparse.Namespace, outcomes: dict[str, Outcome]
) -> None:
    until = np.inf if arguments.minutes is None else time.monotonic() + 60 * arguments.minutes

    def look(words: str, share: float) -> None:
        if time.monotonic() > until:
            raise _Late

    memory = None if arguments.memory is None else int(1e9 * arguments.memory)
    try:
        run_with_bar(
            tasks, work.resolve(), workers=arguments.workers, scheduler=arguments.scheduler,
            memory_bytes=memory, force=arguments.force, progress=look, outcomes=outcomes,
        )  # fmt: skip
    except _Late:
        print(f"stopped after {arguments.minutes:g} minutes")
    except KeyboardInterrupt:
        print("stopped")


def _tell(outcomes: dict[str, Outcome]) -> None:
    """What the tasks of this run cost, and those that failed."""
    rows: list[list[Any]] = []
    for stage in ("solve", "prepare", "judge"):
        ended = [o for o in outcomes.values() if o.task.stage == stage]
        new = [o.record for o in ended if o.record is not None and not o.reused]
        cpu, peak = [r.cpu_s for r in new], [r.peak_bytes for r in new]
        rows.append([stage, len(ended), len(new), sum(o.state == "failed" for o in ended),
                     float(np.median(cpu)) if cpu else "", float(np.sum(cpu)),
                     max(peak) / 1e9 if peak else ""])  # fmt: skip
    print(table(["stage", "ended", "now", "failed", "median CPU [s]", "CPU [s]", "most memory [GB]"], rows))
    for outcome in outcomes.values():
        if outcome.state == "failed":
            print(f"failed: {outcome.task.stage} {outcome.task.label}: {outcome.reason}")
    print()


def part_of(todo: list[Case], part: str) -> list[Case]:
    """Every N-th case from the K-th; raises OptionError for anything but K/N with 1 <= K <= N."""
    first, _, of = part.partition("/")
    if not (first.isdigit() and of.isdigit() and 1 <= int(first) <= int(of)):
        raise OptionError(f"--part '{part}' must be K/N with 1 <= K <= N, such as 1/2")
    return todo[int(first) - 1 :: int(of)]
