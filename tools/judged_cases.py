"""What the tools that fit to judged cases share: which cases, and the file that the program reads."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from benchmarks._diagnosis_blind import opened_case, verdict_path
from benchmarks._diagnosis_cases import Case, cases
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.errors import OptionError


def add_opened_arguments(parser: argparse.ArgumentParser, file: Path) -> None:
    """Where the judged cases are, and whether to write. file: what the program reads."""
    parser.add_argument(
        "--work", nargs="+", required=True, metavar="FOLDER:SEED",
        help="work folders of `palpate bench diagnose` and the first seed of each",
    )  # fmt: skip
    parser.add_argument("--size", choices=("quick", "medium", "full"), default="medium", help="of its cases")
    parser.add_argument("--write", metavar="TOML", help=f"write them there (the program reads {file.name})")


def opened_cases(given: Sequence[str], size: str) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Every judged case of work folders, each with its first seed: FOLDER:SEED. Raises OptionError."""
    for one in given:
        folder, _, seed = one.rpartition(":")
        if not folder or not seed.isdigit():
            raise OptionError(f"--work {one}: FOLDER:SEED, such as work/calibration:60000")
        for case in cases(size, None, int(seed)):
            if verdict_path(case, Path(folder)).exists():
                yield case, opened_case(case, Path(folder))


def write_fitted(tool: str, arguments: argparse.Namespace, body: str) -> None:
    """The file with the command and the seeds that it comes from above it, where it is asked for."""
    if not arguments.write:
        return
    seeds = ", ".join(given.rpartition(":")[2] for given in arguments.work)
    whence = f"# python -m tools.{tool} --size {arguments.size}, seeds {seeds}"
    with atomic_file(Path(arguments.write)) as temporary:
        temporary.write_text(f"{whence}\n{body}\n", encoding="utf-8")
