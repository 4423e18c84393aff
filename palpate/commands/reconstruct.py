"""A recording becomes a model: contacts, base, surface, tetrahedra, modulus, 1D models of every press.

REC is a recording's .csv, .csv.gz or .toml. MODEL is a folder: model.toml, mesh.vtu (ParaView opens it),
palpations.csv. Lengths in m, forces in N, moduli in Pa.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mechanics.model_files import read_model
from palpate import api
from palpate.arguments import (
    add_input,
    add_json,
    add_model_output,
    add_options_of,
    add_output,
    add_seed,
    emit_json,
    given_for,
    say,
)
from palpate.show.page import PAGE

SUMMARY = "a recording becomes a model"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, -o MODEL, the options of every step, --json, --seed."""
    add_input(parser, "recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    add_model_output(parser)
    add_output(
        parser,
        "--report",
        kind=PAGE,
        metavar="HTML",
        help="write the paper's figures and table, remade; PNGs into HTML's folder",
    )
    add_input(
        parser,
        "--beside",
        metavar="MODEL",
        action="append",
        default=[],
        help="with --report: another model to draw beside (repeatable)",
    )
    add_options_of(parser, "reconstruct")
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Reconstruct and write the model."""
    output = Path(arguments.output)
    beside = {Path(name).name: read_model(name) for name in arguments.beside}
    options = given_for(arguments, "reconstruct")
    result = api.reconstruct(arguments.recording, save=output, seed=arguments.seed, **options)
    if arguments.report:
        say(arguments, f"report: {result.report(arguments.report, beside)}")
    say(arguments, *result.lines(), f"written to {output}")
    emit_json({"model": output, **result.as_json()}, arguments.json)
    return 0
