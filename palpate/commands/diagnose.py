"""The sim-to-real gap: where the simulated force leaves the measured one, which effect was left out, how far
the gap shrinks.

REC is a recording's .csv, .csv.gz or .toml. Without --model the recording is reconstructed first. The answer
may be one effect, several, a set that the touches cannot tell apart, "none" (the gap is noise) or "unknown".
Forces in N (rms of the 3-vector over contact samples of held-out places), lengths in m, moduli in Pa.
"""

from __future__ import annotations

import argparse

from mechanics.errors import OptionError
from mechanics.model_files import MODEL
from mechanics.recording import SAMPLES
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

SUMMARY = "the sim-to-real gap: where, which effect, how far it shrinks"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, --model, --apply, --corrected, --report, options, --json, --seed."""
    add_input(parser, "recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    add_input(parser, "--model", metavar="MODEL", help="its model; without it the recording is reconstructed")
    add_output(
        parser, "--apply", kind=MODEL, metavar="MODEL2",
        help="write the improved model (object, contact, boundary effects)",
    )  # fmt: skip
    add_output(
        parser, "--corrected", kind=SAMPLES, metavar="REC2",
        help="write the recording with the instrument's effects taken off (.csv.gz, .csv)",
    )  # fmt: skip
    add_output(
        parser, "--report", kind=PAGE, metavar="HTML",
        help="write the three answers with pictures as one HTML page",
    )  # fmt: skip
    add_mesh_arguments(parser)
    add_options_of(parser, "diagnose", skip=("seed",))
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, say it, and write what was asked for."""
    if arguments.corrected and not arguments.corrected.endswith((".csv", ".csv.gz")):
        raise OptionError(f"--corrected '{arguments.corrected}' must end in .csv or .csv.gz")
    result = api.diagnose(
        arguments.recording, given_model(arguments, arguments.model), **given_for(arguments, "diagnose")
    )
    say(arguments, *result.lines())
    if arguments.apply:
        better = result.improved().save(arguments.apply)
        kept = [name for name in result.effects if name in better.effects]
        say(arguments, f"improved model ({', '.join(kept) or 'modulus only'}): {arguments.apply}")
    if arguments.corrected:
        result.corrected().save(arguments.corrected)
        say(arguments, f"corrected recording: {arguments.corrected}")
    if arguments.report:
        say(arguments, f"report: {result.report(arguments.report)}")
    emit_json(result.as_json(), arguments.json)
    return 0
