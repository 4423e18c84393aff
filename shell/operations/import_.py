"""Convert other programs' files to a recording: text, spreadsheets, NumPy, MATLAB, HDF5, Parquet, ROS, MCAP.

Columns are guessed from their names, or given by --column ROLE=NAME where that fails (roles: t, x, y, z,
fx, fy, fz, qw, qx, qy, qz; '#3' is the third column, '-NAME' its negative, '=0' a constant in SI,
'TOPIC:NAME' one of several tables), or by a --mapping file. Units come from the names ('Load (uN)', 'x_mm')
or --units position=mm,force=N,time=ms. A picture of what was understood is drawn before anything is
written. Several FILEs have clocks of their own, which are joined. Rows without a time are quasi-static
points. Libraries beyond the program's own: extra 'import'.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.mechanics.contact.tip import other_tip
from palpate.mechanics.errors import OptionError, RecordingError
from palpate.operations._call import Call
from palpate.operations._declare import Given, argument, operation, option
from palpate.operations._shared import (
    SAMPLES,
    ClockOfRows,
    TipForm,
    Units,
    columns_option,
    named,
    offset_option,
    output_option,
    seconds,
)
from palpate.operations._to_argparse import vector
from palpate.reconstruction.geometry.stated import GeometryOptions, as_stated
from palpate.words import typed_word

if TYPE_CHECKING:
    from palpate.importing.imported import Imported
    from palpate.mechanics.recording.recording import Recording


def _list(text: str) -> list[float]:
    return vector(text).tolist()


def _tare(text: str) -> tuple[float, ...]:
    parts = text.split(",")
    if len(parts) != 2:
        raise OptionError(f"--tare is '{text}'; it must be two times START,END in s")
    return tuple(seconds(part, "--tare") for part in parts)


@operation(common="shape unit slab_m", progress=False)
def import_table(
    *files: Annotated[
        str | Path, argument("file, or folder of a ROS 2 bag", metavar="FILE", count="+", reads=True)
    ],
    output: Annotated[
        str | None, output_option("recording to write: .csv.gz or .csv", "REC", SAMPLES)
    ] = None,
    mapping: Annotated[
        str | Path | None,
        option("file that gives all of this (docs/howto/own-data.md)", metavar="TOML", reads=True),
    ] = None,
    columns: Annotated[
        Mapping[str, str] | None, columns_option("t, x, y, z, fx, fy, fz, qw, qx, qy, qz")
    ] = None,
    units: Units = None,
    tip_radius_m: Annotated[float | None, option("radius of the tool's spherical tip", unit="m")] = None,
    tip: TipForm = None,
    force_on: Annotated[
        str | None,
        option(
            "body on which the force acts; None: by the sign that a solid gives", choices=("tool", "object")
        ),
    ] = None,
    frame: Annotated[
        str | None, option("frame of the force; None: device", choices=("device", "tool"))
    ] = None,
    rotation: Annotated[Any, option("(3, 3) from the file's axes to the device frame", only="python")] = None,
    flange_to_tip_m: Annotated[
        Sequence[float] | None,
        option(
            "from flange to tip, in the tool's frame, (3,)",
            unit="m",
            metavar="X,Y,Z",
            parse=_list,
            advanced=True,
        ),
    ] = None,
    mass_kg: Annotated[
        float | None,
        option(
            "mass beyond the sensor; its weight is subtracted", unit="kg", flag="--tool-mass", advanced=True
        ),
    ] = None,
    tare_s: Annotated[
        Sequence[float] | None,
        option("subtract the mean force of this time span", unit="s", metavar="START,END", parse=_tare),
    ] = None,
    offset_s: Annotated[float | str | None, offset_option()] = None,
    clock: ClockOfRows = None,
    rate_hz: Annotated[
        float | None, option("rate to resample to, or rate of rows without a time", unit="Hz", advanced=True)
    ] = None,
    thing: Annotated[
        Mapping[str, Any] | None, option("what [object] of the recording is to say", only="python")
    ] = None,
    name: Annotated[str | None, option("name of the object", only="command", advanced=True)] = None,
    picture: Annotated[
        str | None,
        option(
            "what was understood; default: next to REC, 'none' for no picture",
            metavar="PNG",
            writes="palpate.importing.imported:PICTURE",
            only="command",
            advanced=True,
        ),
    ] = None,
    dry_run: Annotated[bool, option("picture and summary only: write no recording", only="command")] = False,
    geometry: Given[GeometryOptions],
    call: Call,
) -> Imported:
    """What other programs' files hold, as a recording: CSV, TSV, text, spreadsheets, NumPy, MATLAB, HDF5,
    Parquet, ROS bag, MCAP.

    The recording is in m, s and N, forces on the tool. Raises RecordingError where something needed is
    missing.
    """
    from palpate.importing.convert import understand
    from palpate.importing.headers import of_tables
    from palpate.importing.imported import Imported
    from palpate.importing.mapping import Said, read_mapping
    from palpate.importing.tables import read_tables

    if call.command and output is None and not dry_run:
        raise OptionError("-o REC is missing: name the recording to write, or give --dry-run")
    said: dict[str, Any] = {
        "columns": named(columns, "columns"),
        "units": named(units, "units"),
        "tip_radius_m": tip_radius_m,
        "tip": tip,
        "force_on": force_on,
        "frame": frame,
        "rotation": rotation,
        "flange_to_tip_m": flange_to_tip_m,
        "mass_kg": mass_kg,
        "tare_s": tare_s,
        "offset_s": offset_s,
        "clock": clock,
        "rate_hz": rate_hz,
        "thing": {
            **(thing or {}),
            **({"name": name} if name else {}),
            **as_stated(GeometryOptions(**geometry)),
        },
    }
    held = {} if mapping is None else read_mapping(mapping)
    for key, value in said.items():  # counts before what a mapping file says
        if value is None or (isinstance(value, Mapping) and not value):
            continue
        merged = isinstance(value, Mapping) and isinstance(held.get(key), Mapping)
        held[key] = {**held[key], **value} if merged else value
    if not files:
        raise OptionError("pp.import_table needs a file")
    chosen = Said(**of_tables([Path(file) for file in files], held))
    if chosen.tip not in (None, "sphere"):
        raise RecordingError(other_tip(str(chosen.tip), "the tip", str(files[0]), chosen.tip_radius_m))
    tables = [table for file in files for table in read_tables(file)]
    understood = understand(tables, chosen, Path(files[0]).name.split(".")[0])
    result = Imported(understood, chosen.thing, tuple(Path(file).name for file in files))
    if call.command:
        drawn = picture or _beside(output)
        if drawn != "none":
            call.out.say(f"picture: {result.draw(drawn)}")
        call.figures = {"recording": output}
        if not dry_run:
            call.then(lambda: [f"written: {result.save(str(output))}"])
            look = "" if drawn == "none" else f"look at {drawn}, then "
            call.following = _next_steps(result.recording, str(output), look)
    return result


def _next_steps(recording: Recording, output: str, look: str) -> list[str]:
    """What goes on with it: its check-up, or the geometry that no tracing tells."""
    from palpate.operations._written import open_words
    from palpate.reconstruction.checks.finding import OF_A_KNOWN_OBJECT
    from palpate.reconstruction.checks.registry import force_unit_doubt, no_base

    if not no_base(recording):
        return [f"next: {look}check it: palpate check {typed_word(output)}"]
    doubt = force_unit_doubt(recording)
    ways = [f"{way.says}: {open_words({'files': (output,)}, way.options)}" for way in OF_A_KNOWN_OBJECT]
    return [
        *([f"is the {doubt.name} right? {doubt.saw} ({doubt.sure})"] if doubt else []),
        f"next: {look}say what the object is, as no foot was traced:",
        *(f"      {way}" for way in ways),
    ]


def _beside(output: str | None) -> str:
    if output is None:
        return "none"
    path = Path(output)
    return str(path.with_name(path.name.removesuffix(".gz").rsplit(".", 1)[0] + ".png"))


@operation(like=import_table, progress=False)
def read_table(*files: Any, geometry: Mapping[str, Any], **said: Any) -> Recording:
    """The recording in other programs' files, in m, s and N, as `import_table` reads it, which also tells and
    draws what it understood. Raises RecordingError."""
    return import_table(*files, **said, **geometry).recording
