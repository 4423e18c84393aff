"""Benchmarks: medians, spreads, and ratios against a peer or limit in the same run.

They lie in the folder `benchmarks` of a clone of the project and are found from inside of that clone.
"""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import sys
from pathlib import Path
from typing import Any

from mechanics.errors import OptionError
from palpate.arguments import OneLineParser, add_json, emit_json

SUMMARY = "benchmarks: medians, spreads and ratios"
_HELPERS = ("evidence", "timing")


def clone() -> Path:
    """The clone of the project that the working folder lies in. Raises OptionError outside of one."""
    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / "benchmarks" / "__init__.py").is_file() and (folder / "palpate" / "cli.py").is_file():
            return folder
    raise OptionError(
        f"benchmarks come with a clone of the project, not with what is installed: '{here}' lies in none; "
        "change into the clone and run it there"
    )


def names() -> list[str]:
    """The benchmarks of the clone that one stands in, as the command line spells them."""
    found = (m.name for m in pkgutil.iter_modules([str(clone() / "benchmarks")]))
    return sorted(n.replace("_", "-") for n in found if n not in _HELPERS and not n.startswith("_"))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """`NAME` and what that benchmark takes."""
    parser.add_argument("name", help="which; without a known name the error lists them")
    add_json(parser)
    parser.add_argument("rest", nargs=argparse.REMAINDER, help="the benchmark's own options (NAME --help)")


def run(arguments: argparse.Namespace) -> int:
    """Run one benchmark."""
    if arguments.name not in names():
        raise OptionError(f"'{arguments.name}' is no benchmark; allowed are {', '.join(names())}")
    sys.path.insert(0, str(clone()))
    module = importlib.import_module(f"benchmarks.{arguments.name.replace('-', '_')}")
    parser = OneLineParser(prog=f"palpate bench {arguments.name}", description=module.__doc__)
    module.add_arguments(parser)
    parser.add_argument("--json", metavar="PATH", default=arguments.json, help="write the figures as JSON")
    parser.add_argument(
        "--evidence",
        metavar="PATH",
        nargs="?",
        const=str(clone() / "docs" / "evidence" / f"{arguments.name}.json"),
        help="keep the figures with command, commit, date and processor (default: docs/evidence/NAME.json)",
    )
    own = parser.parse_args(arguments.rest)
    result = module.run(own)
    emit_json(result, own.json)
    if own.evidence:
        _keep(own.evidence, arguments, result.get("figures", ()))
    return 0


def _keep(path: str, arguments: argparse.Namespace, figures: Any) -> None:
    evidence = importlib.import_module("benchmarks.evidence")  # it lies in the clone, not in the product
    if not figures:
        raise OptionError(f"--evidence: 'palpate bench {arguments.name}' gives no figures to keep")
    words = ["palpate", "bench", arguments.name, *_without_evidence(arguments.rest)]
    print(
        f"kept: {evidence.write(path, evidence.measured(' '.join(words), figures, clone()))}", file=sys.stderr
    )


def _without_evidence(words: list[str]) -> list[str]:
    """The options that decide what was measured."""
    kept = [word for word in words if not word.startswith("--evidence=")]
    if "--evidence" in kept:
        at = kept.index("--evidence")
        value = at + 1 < len(kept) and not kept[at + 1].startswith("-")
        del kept[at : at + 1 + value]
    return kept
