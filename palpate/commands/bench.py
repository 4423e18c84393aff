"""Benchmarks: medians, spreads, and ratios against a peer or limit in the same run."""

from __future__ import annotations

import argparse
import importlib
import pkgutil

from mechanics.errors import OptionError
from palpate import benchmarks
from palpate.arguments import OneLineParser, add_json, emit_json

SUMMARY = "benchmarks: medians, spreads and ratios"
_HELPERS = ("timing",)


def names() -> list[str]:
    """The benchmarks that are there, as the command line spells them."""
    found = (m.name for m in pkgutil.iter_modules(benchmarks.__path__))
    return sorted(n.replace("_", "-") for n in found if n not in _HELPERS and not n.startswith("_"))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """`NAME` and what that benchmark takes."""
    parser.add_argument("name", help=f"which: {', '.join(names())}")
    add_json(parser)
    parser.add_argument("rest", nargs=argparse.REMAINDER, help="the benchmark's own options (NAME --help)")


def run(arguments: argparse.Namespace) -> int:
    """Run one benchmark."""
    if arguments.name not in names():
        raise OptionError(f"'{arguments.name}' is no benchmark; allowed are {', '.join(names())}")
    module = importlib.import_module(f"palpate.benchmarks.{arguments.name.replace('-', '_')}")
    parser = OneLineParser(prog=f"palpate bench {arguments.name}", description=module.__doc__)
    module.add_arguments(parser)
    parser.add_argument("--json", metavar="PATH", default=arguments.json, help="write the figures as JSON")
    own = parser.parse_args(arguments.rest)
    emit_json(module.run(own), own.json)
    return 0
