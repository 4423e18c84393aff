"""Other programs' files become a recording: text, spreadsheets, NumPy, MATLAB, HDF5, Parquet, ROS, MCAP.

Columns are guessed from their names, and said by --column ROLE=NAME where that fails (roles: t, x, y, z,
fx, fy, fz, qw, qx, qy, qz; '#3' is the third column, '-NAME' its negative, '=0' a constant in SI,
'TOPIC:NAME' one of several tables), or by a --mapping file. Units come from the names ('Load (uN)', 'x_mm')
or --units position=mm,force=N,time=ms. A picture of what was understood is drawn before anything is
written. Several FILEs have clocks of their own, which are joined. Rows without a time are quasi-static
points. Libraries beyond the program's own: palpate[import].
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.mechanics.errors import OptionError
from palpate.operations._declare import Call, operand, operation
from palpate.operations._shared import (
    SAMPLES,
    columns_operand,
    named,
    output_operand,
    tip_radius_operand,
    units_operand,
)
from palpate.operations._to_argparse import finite, vector
from palpate.output import Output

if TYPE_CHECKING:
    from palpate.importing.imported import Imported
    from palpate.mechanics.recording.recording import Recording


def _list(text: str) -> list[float]:
    return vector(text).tolist()


def _seconds(text: str, flag: str) -> float:
    try:
        return finite(text)
    except (ValueError, argparse.ArgumentTypeError) as error:
        raise OptionError(f"{flag}: '{text}' is no finite number of seconds") from error


def _tare(text: str) -> tuple[float, ...]:
    parts = text.split(",")
    if len(parts) != 2:
        raise OptionError(f"--tare is '{text}'; it must be two times START,END in s")
    return tuple(_seconds(part, "--tare") for part in parts)


def _offset(text: str) -> float | str:
    return text if text == "auto" else _seconds(text, "--offset")


@dataclass(frozen=True)
class ImportOperands:
    """The files, and what their columns are; what is said here counts before what a mapping file says."""

    files: tuple[str | Path, ...] = operand(
        (), "file, or folder of a ROS 2 bag", metavar="FILE", positional=True, count="+", reads=True
    )
    _: KW_ONLY
    output: str | None = output_operand("recording to write: .csv.gz or .csv", "REC", SAMPLES)
    mapping: str | Path | None = operand(
        None, "all of this as a file (docs/howto/own-data.md)", metavar="TOML", reads=True
    )
    columns: Mapping[str, str] | None = columns_operand("t, x, y, z, fx, fy, fz, qw, qx, qy, qz")
    units: Mapping[str, str] | None = units_operand()
    tip_radius_m: float | None = tip_radius_operand("of the tool's spherical tip")
    force_on: str | None = operand(
        None, "whose force it is; None: by what a solid does", choices=("tool", "object")
    )
    frame: str | None = operand(None, "of the force; None: device", choices=("device", "tool"))
    rotation: Any = operand(None, "(3, 3) from the file's axes to the device frame", only="python")
    flange_to_tip_m: Sequence[float] | None = operand(
        None, "in the tool's frame, (3,)", unit="m", metavar="X,Y,Z", parse=_list, rare=True
    )
    mass_kg: float | None = operand(
        None, "beyond the sensor; its weight is taken off", unit="kg", flag="--tool-mass", rare=True
    )
    tare_s: Sequence[float] | None = operand(
        None, "take off the mean force of this time", unit="s", metavar="START,END", parse=_tare
    )
    offset_s: float | str | None = operand(
        None,
        "of the force's clock, or auto (cross-correlation)",
        unit="s",
        metavar="NUMBER",
        parse=_offset,
        rare=True,
    )
    clock: str | None = operand(
        None,
        "where time goes back: one clock, or blocks with their own",
        choices=("one", "blocks"),
        rare=True,
    )
    rate_hz: float | None = operand(None, "to resample to, or of rows without a time", unit="Hz", rare=True)
    thing: Mapping[str, Any] | None = operand(None, "what [object] of the recording is to say", only="python")
    name: str | None = operand(None, "of the object", only="command", rare=True)
    slab: float | None = operand(None, "the object is a slab so thick", unit="m", only="command", rare=True)
    half_space: bool = operand(False, "the object is deep and wide", only="command", rare=True)
    picture: str | None = operand(
        None,
        "what was understood; default: beside REC, 'none' for no picture",
        metavar="PNG",
        writes="palpate.importing.imported:PICTURE",
        only="command",
        rare=True,
    )
    dry_run: bool = operand(False, "picture and summary only: write no recording", only="command")


_SAID = (
    "columns", "units", "tip_radius_m", "force_on", "frame", "rotation", "flange_to_tip_m", "mass_kg",
    "tare_s", "offset_s", "clock", "rate_hz", "thing",
)  # fmt: skip


def _answer(result: Imported, asked: ImportOperands, out: Output) -> int:
    where = asked.picture or _beside(asked.output)
    if where != "none":
        out.say(f"picture: {result.draw(where)}")
    out.say(*result.lines())
    if not asked.dry_run:
        out.say(f"written: {result.save(str(asked.output))}")
        look = "" if where == "none" else f"look at {where}, then "
        out.say(f"next: {look}check it: palpate check {asked.output}")
    out.json({"recording": asked.output, **result.as_json()})
    return 0


def _beside(output: str | None) -> str:
    if output is None:
        return "none"
    path = Path(output)
    return str(path.with_name(path.name.removesuffix(".gz").rsplit(".", 1)[0] + ".png"))


def _on_command_line(asked: ImportOperands) -> None:
    if asked.output is None and not asked.dry_run:
        raise OptionError("-o REC is missing: name the recording to write, or give --dry-run")


@operation(ImportOperands, answer=_answer, before=_on_command_line, progress=False)
def import_table(asked: ImportOperands, call: Call) -> Imported:
    """What other programs' files hold, as a recording: CSV, TSV, text, spreadsheets, NumPy, MATLAB, HDF5,
    Parquet, ROS bag, MCAP.

    The recording is in m, s and N, forces on the tool. Raises RecordingError where something needed is
    missing.
    """
    from palpate.importing.kinds import with_answers

    return with_answers(_understood, asked, call)


def _understood(asked: ImportOperands, call: Call) -> Imported:
    from palpate.importing.convert import understand
    from palpate.importing.imported import Imported
    from palpate.importing.mapping import Said, read_mapping
    from palpate.importing.tables import read_tables

    held = {} if asked.mapping is None else read_mapping(asked.mapping)
    for key, value in _said(call).items():
        merged = isinstance(value, Mapping) and isinstance(held.get(key), Mapping)
        held[key] = {**held[key], **value} if merged else value
    if not asked.files:
        raise OptionError("pp.import_table needs a file")
    chosen = Said(**held)
    tables = [table for file in asked.files for table in read_tables(file)]
    understood = understand(tables, chosen, Path(asked.files[0]).name.split(".")[0])
    return Imported(understood, chosen.thing, tuple(Path(file).name for file in asked.files))


def _said(call: Call) -> dict[str, Any]:
    """What was said of the files, by the fields of a mapping."""
    given = dict(call.given)
    thing = dict(given.get("thing") or {})
    for flag, key in (("name", "name"), ("slab", "slab_m"), ("half_space", "half_space")):
        if given.get(flag):
            thing[key] = given[flag]
    for key in ("columns", "units"):
        given[key] = named(given.get(key), key)
    given["thing"] = thing
    return {key: given[key] for key in _SAID if key in given and not _says_nothing(given[key])}


def _says_nothing(value: Any) -> bool:
    return value is None or (isinstance(value, Mapping) and not value)


@operation(ImportOperands, progress=False)
def read_table(asked: ImportOperands, call: Call) -> Recording:
    """The recording in other programs' files, in m, s and N, as `import_table` reads it, which also tells and
    draws what it understood. Raises RecordingError."""
    given = dict(call.given)
    return import_table(*given.pop("files", ()), **given).recording
