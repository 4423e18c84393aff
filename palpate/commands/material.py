"""The material of a specimen from a machine's curves: indentation, compression, tension, relaxation.

FILEs are exports of bench instruments, a curve each (approach, perhaps a hold, retract): a sphere's
indentations (Chiaro's text, or any table with time, travel and load), cylinders between platens, pulls to
failure, relaxation curves. Columns and units are told by their names, or by --column and --units as in
`palpate import`. The answer is a modulus, the law or effects that predict curves which were held out, beside
1D models as floor and a regression without mechanics as ceiling, and what such a test cannot tell. SI units.
"""

from __future__ import annotations

import argparse

from palpate import api
from palpate.arguments import add_input, add_json, add_seed, emit_json, finite, say
from palpate.commands.import_ import pairs
from palpate.importing.specimens import KINDS

SUMMARY = "the material of a specimen from a machine's curves"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """FILEs, what they are, --json, --seed."""
    add_input(parser, "files", metavar="FILE", nargs="+", help="a curve each")
    parser.add_argument("--kind", choices=("auto", *KINDS), default="auto", help="of test (default: auto)")
    parser.add_argument("--tip-radius", type=finite, metavar="M", help="of an indenter's sphere [m]")
    parser.add_argument("--layer", type=finite, metavar="M", help="thickness (default: a half-space) [m]")
    parser.add_argument("--poisson-ratio", type=finite, default=0.49, help="of the material (default: 0.49)")
    parser.add_argument(
        "--specimens", action="store_true", help="each indentation is of another piece (default: one piece)"
    )
    parser.add_argument(
        "--column", metavar="ROLE=NAME", action="append", default=[], help="repeatable: t, z, fz"
    )
    parser.add_argument("--units", metavar="KIND=UNIT,...", help="kinds: position, force, time")
    parser.add_argument("--fast", action="store_true", help="fewer effects are tried")
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Read, weigh, say."""
    result = api.material(
        *arguments.files,
        kind=arguments.kind,
        tip_radius_m=arguments.tip_radius,
        layer_m=arguments.layer,
        poisson_ratio=arguments.poisson_ratio,
        specimens=arguments.specimens,
        columns=pairs(arguments.column, "--column", "t=Time"),
        units=pairs(arguments.units.split(",") if arguments.units else [], "--units", "position=mm"),
        fast=arguments.fast,
        seed=arguments.seed,
    )
    say(arguments, *result.lines())
    emit_json(result.as_json(), arguments.json)
    return 0
