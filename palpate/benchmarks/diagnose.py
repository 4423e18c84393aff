"""The blind benchmark: sealed recordings of the virtual laboratory, verdicts first, truths opened after.

Sizes: quick (for CI), medium, full. Every case is simulated with its truth sealed, reconstructed, diagnosed,
and its verdict written to the work folder before the truth is opened; a run that was interrupted goes on
where it stopped. Cases whose touches the laboratory has not solved yet are left out unless --solve allows for
the hours. Rates carry Wilson's 95 % intervals. Baselines on the same recordings: the best in-sample fit by
BIC, and for the gap a regression of the residual on place, depth, rate and history.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from mechanics.errors import OptionError
from palpate.benchmarks._diagnosis_blind import NotSolved, judge, opened_case, prepare, prepared, verdict_path
from palpate.benchmarks._diagnosis_cases import Case, cases
from palpate.benchmarks._diagnosis_scores import summarise
from palpate.benchmarks._diagnosis_tables import pictures, show

SUMMARY = "blind diagnosis of sealed recordings: detection, names, false alarms, gap closed"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Size, work folder, seed."""
    parser.add_argument("--size", choices=("quick", "medium", "full"), default="quick", help="how many cases")
    parser.add_argument(
        "--work", default="bench-diagnose", help="folder of recordings, models and verdicts (resumed)"
    )
    parser.add_argument("--phantom", action="append", help="phantoms to use (repeatable; default: by size)")
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
        default=None,
        help="let the laboratory solve touches that it has not kept (default: in the quick size only)",
    )
    parser.add_argument(
        "--limit", type=int, help="stop after this many new cases (the table shows what is there)"
    )
    parser.add_argument("--minutes", type=float, help="begin no further case after so many minutes")
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
    parser.add_argument("--picture", metavar="PNG", help="write the pictures")
    parser.add_argument("--seed", type=int, default=0, help="first seed")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Run what is missing, open the truths, print the table."""
    work = Path(arguments.work)
    quick = arguments.size == "quick"
    fast = quick if arguments.fast is None else arguments.fast
    solve = quick if arguments.solve is None else arguments.solve
    todo = cases(arguments.size, arguments.phantom, arguments.seed)
    own = part_of(todo, arguments.part)
    fresh, unsolved = 0, 0
    begun = time.perf_counter()
    for number, case in enumerate(own if arguments.stage != "table" else []):
        late = arguments.minutes is not None and time.perf_counter() - begun > 60 * arguments.minutes
        if late or (arguments.limit is not None and fresh >= arguments.limit):
            break
        clock = time.process_time()
        said = "prepared"
        if not prepared(case, work):
            if arguments.stage == "judge":
                continue
            try:
                prepare(case, work, solve=solve)
            except NotSolved:
                unsolved += 1
                continue
        elif arguments.stage == "prepare":
            continue
        if arguments.stage != "prepare":
            if verdict_path(case, work).exists():
                continue
            answer = judge(case, work, fast=fast)
            said = f"{answer['kind']} {answer['effects']} {answer['candidates']}"
        fresh += 1
        print(f"{number + 1}/{len(own)} {case.key}: {said} ({time.process_time() - clock:.0f} CPU s)",
              flush=True)  # fmt: skip
    counted = [c for c in todo if not (arguments.seen and (Path(arguments.seen) / f"{c.key}.json").exists())]
    done = [opened_case(c, work) for c in counted if verdict_path(c, work).exists()]
    summary = summarise(done)
    summary["size"] = {"asked": len(counted), "done": len(done), "not_solved": unsolved, "fast": fast}
    show(summary)
    if arguments.picture and done:
        print(f"picture: {pictures(summary, arguments.picture)}")
    return summary


def part_of(todo: list[Case], part: str) -> list[Case]:
    """Every N-th case from the K-th; raises OptionError for anything but K/N with 1 <= K <= N."""
    first, _, of = part.partition("/")
    if not (first.isdigit() and of.isdigit() and 1 <= int(first) <= int(of)):
        raise OptionError(f"--part '{part}' must be K/N with 1 <= K <= N, such as 1/2")
    return todo[int(first) - 1 :: int(of)]
