"""The instrument told from presses on something known: tip, tool's stiffness, sensor, bias, delay, play.

REC holds presses on a rigid plate (--rigid) or on an object of known Young's modulus (--modulus), whose
geometry is traced, or given by --slab, --half-space or --shape. TOOL.toml is what recordings may name
([tool] calibration = "TOOL.toml", beside them): every command then reads them as an ideal instrument had.
"""

from __future__ import annotations

import argparse

from mechanics.calibration import TOOL
from palpate import api
from palpate.arguments import (
    add_input,
    add_json,
    add_options_of,
    add_output,
    add_seed,
    emit_json,
    finite,
    given_for,
    say,
)

SUMMARY = "the instrument told from presses on something known"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, -o, on what, --json, --seed."""
    add_input(parser, "recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    add_output(parser, "-o", "--output", kind=TOOL, metavar="TOOL.toml", help="calibration to write")
    parser.add_argument("--rigid", action="store_true", help="the presses are on a rigid plate")
    parser.add_argument("--modulus", type=finite, metavar="PA", help="they are on an object so stiff [Pa]")
    parser.add_argument("--poisson-ratio", type=finite, metavar="NU", help="of the object (default: 0.49)")
    parser.add_argument(
        "--trust", choices=("tip", "gain"), default="tip",
        help="right where a common factor is left: the tip's radius or the sensor's gain (default: tip)",
    )  # fmt: skip
    add_options_of(parser, "calibrate")
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Calibrate, say it, write it."""
    result = api.calibrate(
        arguments.recording,
        rigid=arguments.rigid,
        modulus_pa=arguments.modulus,
        poisson_ratio=arguments.poisson_ratio,
        trust=arguments.trust,
        seed=arguments.seed,
        **given_for(arguments, "calibrate"),
    )
    say(arguments, *result.lines())
    if arguments.output:
        say(arguments, f"written: {result.save(arguments.output)}")
    emit_json(result.as_json(), arguments.json)
    return 0
