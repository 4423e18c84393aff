"""Other programs' files become a recording: CSV, TSV, text, NumPy, MATLAB, HDF5, Parquet, ROS bags, MCAP.

Columns are guessed from their names, and said by --column ROLE=NAME where that fails (roles: t, x, y, z,
fx, fy, fz, qw, qx, qy, qz; '#3' is the third column, '-NAME' its negative, '=0' a constant in SI,
'TOPIC:NAME' one of several tables), or by a --mapping file. Units come from the names ('Load (uN)', 'x_mm')
or --units position=mm,force=N,time=ms. A picture of what was understood is drawn before anything is
written. Several FILEs have clocks of their own, which are joined. Rows without a time are quasi-static
points. Libraries beyond the program's own: palpate[import].
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from mechanics.errors import OptionError
from mechanics.recording import SAMPLES
from palpate import api
from palpate.arguments import add_input, add_json, add_output, emit_json, finite, say, vector
from palpate.importing.written import PICTURE

SUMMARY = "other programs' files become a recording"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """FILEs, -o REC, what their columns are, --picture, --dry-run, --json."""
    add_input(parser, "files", metavar="FILE", nargs="+", help="file, or folder of a ROS 2 bag")
    add_output(
        parser, "-o", "--output", kind=SAMPLES, metavar="REC", help="recording to write: .csv.gz or .csv"
    )
    parser.add_argument("--column", metavar="ROLE=NAME", action="append", default=[], help="repeatable")
    add_input(parser, "--mapping", metavar="TOML", help="all of this as a file (docs/import-export.md)")
    parser.add_argument("--units", metavar="KIND=UNIT,...", help="kinds: position, force, time")
    parser.add_argument("--tip-radius", type=finite, metavar="NUMBER", help="of the tool's spherical tip [m]")
    parser.add_argument("--force-on", choices=("tool", "object"), help="whose force it is (default: tool)")
    parser.add_argument("--frame", choices=("device", "tool"), help="of the force (default: device)")
    parser.add_argument("--flange-to-tip", type=vector, metavar="X,Y,Z", help="in the tool's frame [m]")
    parser.add_argument(
        "--tool-mass", type=finite, metavar="NUMBER", help="beyond the sensor; its weight is taken off [kg]"
    )
    parser.add_argument("--tare", metavar="START,END", help="take off the mean force of this time [s]")
    parser.add_argument(
        "--offset", metavar="NUMBER", help="of the force's clock, or auto (cross-correlation) [s]"
    )
    parser.add_argument(
        "--rate", type=finite, metavar="NUMBER", help="to resample to, or of rows without a time [Hz]"
    )
    parser.add_argument("--name", help="of the object")
    parser.add_argument("--slab", type=finite, metavar="NUMBER", help="the object is a slab so thick [m]")
    parser.add_argument("--half-space", action="store_true", help="the object is deep and wide")
    add_output(
        parser, "--picture", kind=PICTURE, metavar="PNG",
        help="what was understood (default: beside REC; 'none')",
    )  # fmt: skip
    parser.add_argument("--dry-run", action="store_true", help="picture and summary only: write no recording")
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Read, draw, say, write."""
    if arguments.output is None and not arguments.dry_run:
        raise OptionError("-o REC is missing: name the recording to write, or give --dry-run")
    result = api.import_table(*arguments.files, **_said(arguments))
    where = arguments.picture or _beside(arguments.output)
    if where != "none":
        say(arguments, f"picture: {result.draw(where)}")
    say(arguments, *result.lines())
    if not arguments.dry_run:
        say(arguments, f"written: {result.save(arguments.output)}")
    emit_json({"recording": arguments.output, **result.as_json()}, arguments.json)
    return 0


def _beside(output: str | None) -> str:
    if output is None:
        return "none"
    path = Path(output)
    return str(path.with_name(path.name.removesuffix(".gz").rsplit(".", 1)[0] + ".png"))


def _said(arguments: argparse.Namespace) -> dict[str, Any]:
    """The keywords of `pp.import_table`."""
    tare = None
    if arguments.tare is not None:
        parts = arguments.tare.split(",")
        if len(parts) != 2:
            raise OptionError(f"--tare is '{arguments.tare}'; it must be two times START,END in s")
        tare = (_number(parts[0], "--tare"), _number(parts[1], "--tare"))
    offset = arguments.offset
    if offset not in (None, "auto"):
        offset = _number(offset, "--offset")
    thing: dict[str, Any] = {}
    if arguments.name:
        thing["name"] = arguments.name
    if arguments.slab is not None:
        thing["slab_m"] = arguments.slab
    if arguments.half_space:
        thing["half_space"] = True
    given = {
        "mapping": arguments.mapping,
        "columns": pairs(arguments.column, "--column", "t=Time"),
        "units": pairs(arguments.units.split(",") if arguments.units else [], "--units", "position=mm"),
        "tip_radius_m": arguments.tip_radius,
        "force_on": arguments.force_on,
        "frame": arguments.frame,
        "flange_to_tip_m": None if arguments.flange_to_tip is None else arguments.flange_to_tip.tolist(),
        "mass_kg": arguments.tool_mass,
        "tare_s": tare,
        "offset_s": offset,
        "rate_hz": arguments.rate,
        "thing": thing,
    }
    return {key: value for key, value in given.items() if value not in (None, {})}


def pairs(texts: list[str], flag: str, example: str) -> dict[str, str]:
    pairs = {}
    for text in texts:
        name, found, value = text.partition("=")
        if not found or not value:
            raise OptionError(f"{flag} '{text}' must be two words like {example}")
        if name.strip() in pairs:
            raise OptionError(f"{flag} says '{name.strip()}' twice: say it once")
        pairs[name.strip()] = value.strip()
    return pairs


def _number(text: str, flag: str) -> float:
    try:
        return finite(text)
    except (ValueError, argparse.ArgumentTypeError) as error:
        raise OptionError(f"{flag}: '{text}' is no finite number of seconds") from error
