"""What may be wrong with a recording, before it is believed: units, axes, channels, clock, base, presses.

REC is a recording's .csv, .csv.gz or .toml. A grave finding makes its modulus worthless, and `palpate
reconstruct` refuses it without --force; others widen the modulus's interval. Exit code 1 where one is grave.
"""

from __future__ import annotations

import argparse

from palpate import api
from palpate.arguments import add_input, add_json, add_output, emit_json, say
from palpate.show.page import PAGE

SUMMARY = "what may be wrong with a recording, before it is believed"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, --full, --report, --json."""
    add_input(parser, "recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    parser.add_argument("--full", action="store_true", help="reconstruct too, and check the modulus")
    add_output(
        parser,
        "--report",
        kind=PAGE,
        metavar="HTML",
        help="write the findings with pictures as one HTML page",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check, say it, report; 1 where something is grave."""
    result = api.check(arguments.recording, full=arguments.full)
    say(arguments, *result.lines())
    if arguments.report:
        say(arguments, f"report: {result.report(arguments.report)}")
    emit_json(result.as_json(), arguments.json)
    return 1 if result.grave else 0
