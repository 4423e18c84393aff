"""FEM against the interpolated 1D models on held-out palpations and held-out regions of one recording; or,
with REC2, two recordings of one object (before and after, two tools): their moduli, the difference, what
explains it.

Of --model only the geometry is used; every parameter is refitted in each fold. Errors are rms force vectors
over contact samples that the fit has not seen, N; bias is the share by which the predicted force is too
large.
"""

from __future__ import annotations

import argparse

from mechanics.errors import OptionError
from palpate import api
from palpate.arguments import (
    add_input,
    add_json,
    add_options_of,
    add_output,
    add_seed,
    emit_json,
    given_for,
    say,
)
from palpate.show.page import PAGE
from palpate.sources import add_mesh_arguments, given_model

SUMMARY = "FEM against interpolated 1D models on held-out palpations"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, --model, --report, folds, --json, --seed."""
    add_input(parser, "recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    add_input(
        parser, "other", metavar="REC2", nargs="?",
        help="a second recording of the object: say what differs instead (--no-diagnosis: moduli alone)",
    )  # fmt: skip
    parser.add_argument("--no-diagnosis", action="store_true", help="of two recordings: moduli alone")
    add_input(parser, "--model", metavar="MODEL", help="take the geometry from it (default: reconstruct)")
    add_output(
        parser,
        "-o",
        "--report",
        kind=PAGE,
        metavar="REPORT.html",
        help="write tables and pictures as a page",
    )
    add_mesh_arguments(parser)
    add_options_of(parser, "compare")
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Compare, print, report."""
    if arguments.other is not None:
        return _two(arguments)
    options = given_for(arguments, "compare")
    result = api.compare(
        arguments.recording, given_model(arguments, arguments.model), seed=arguments.seed, **options
    )
    say(arguments, *result.lines())
    if arguments.report:
        say(arguments, f"report: {result.report(arguments.report)}")
    emit_json(result.as_json(), arguments.json)
    return 0


def _two(arguments: argparse.Namespace) -> int:
    """What differs between two recordings."""
    if arguments.model:
        raise OptionError("--model goes with one recording: two are reconstructed each by itself")
    result = api.changes(
        arguments.recording, arguments.other, diagnosed=not arguments.no_diagnosis, seed=arguments.seed
    )
    say(arguments, *result.lines())
    if arguments.report:
        say(arguments, f"report: {result.report(arguments.report)}")
    emit_json(result.as_json(), arguments.json)
    return 0
