"""Recognise what the files are, import and check them, and make a model or a material of them.

FILEs are a recording (NAME.csv and NAME.toml), a table or bag of a robot's log, a machine's curves, a surface
or mesh, or a MODEL. A recording becomes a model, curves become a material, a surface a MODEL; one page shows
the result. Where a meaning is unclear (unit, sign, tip radius, one clock or many) it asks one question on a
terminal; elsewhere it ends with one line that names the flag. SI units. Exit code 1 if the result does not
predict held-out data.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.mechanics.contact.tip import other_tip
from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import flag_of
from palpate.operations._call import Call
from palpate.operations._declare import Given, argument, operation, option
from palpate.operations._shared import (
    MODEL,
    ClockOfRows,
    Seed,
    TipAngle,
    TipForm,
    columns_option,
    moduli,
    modulus_option,
    named,
    offset_option,
    report_option,
    save_option,
    units_option,
)
from palpate.reconstruction.methods import ReconstructOptions

if TYPE_CHECKING:
    from palpate.importing.imported import Imported
    from palpate.importing.kinds import Opened
    from palpate.mechanics.progress import Progress
    from palpate.mechanics.recording.recording import Recording


@operation(common="shape slab_m half_space sink_m poisson_ratio")
def open(
    *files: Annotated[
        Any,
        argument(
            "file, or folder of a MODEL or ROS 2 bag; in Python also a recording",
            metavar="FILE",
            count="+",
            reads=True,
        ),
    ],
    save: Annotated[
        str | Path | None, save_option("folder of the model to write, where one comes of it", "MODEL", MODEL)
    ] = None,
    report: Annotated[
        str | None, report_option("the page; default: NAME-palpate.html here, 'none' for no page")
    ] = None,
    tip: TipForm = None,
    tip_radius_m: Annotated[float | None, option("radius of the tip, if no file gives it", unit="m")] = None,
    tip_angle_deg: TipAngle = None,
    columns: Annotated[
        Mapping[str, str] | None,
        columns_option("as of import; of curves t, depth (or height), load", advanced=True),
    ] = None,
    units: Annotated[Mapping[str, str] | None, units_option(advanced=True)] = None,
    force_on: Annotated[
        str | None, option("body on which the force acts", choices=("tool", "object"), advanced=True)
    ] = None,
    travel: Annotated[
        str | None, option("which way a machine's position counts", choices=("into", "out"), advanced=True)
    ] = None,
    compression: Annotated[
        str | None,
        option("sign of a machine's load as it presses", choices=("positive", "negative"), advanced=True),
    ] = None,
    clock: ClockOfRows = None,
    rate_hz: Annotated[
        float | None,
        option("rate to resample a log to, or rate of rows without a time", unit="Hz"),
    ] = None,
    offset_s: Annotated[float | str | None, offset_option()] = None,
    layer_m: Annotated[
        float | None, option("thickness of a machine's sample; None: a half-space", unit="m", advanced=True)
    ] = None,
    young_modulus_pa: Annotated[float | Mapping[str, float] | None, modulus_option()] = None,
    fast: Annotated[bool, option("try fewer effects", advanced=True)] = False,
    seed: Seed = 0,
    how: Given[ReconstructOptions],
    call: Call,
) -> Opened:
    """Whatever it is: what it was taken for, brought in, checked, and the one sensible thing done.

    `result` is a Reconstruction, Material, Model, or the Checkup of a recording with something grave; lengths
    m, forces N, moduli Pa. Raises RecordingError where nothing can be understood, and what `reconstruct`,
    `material` and `model_of` raise.
    """
    from palpate.importing.kinds import kind_of_file
    from palpate.mechanics.recording.recording import Recording as Plain
    from palpate.operations.read_recording import read_recording
    from palpate.scenes.embedded import embedded_names, embedded_recording

    if not files:
        raise OptionError("pp.open needs a file: name at least one")
    if files[0] in embedded_names():
        files = (embedded_recording(files[0]), *files[1:])
    columns, units = named(columns, "columns"), named(units, "units")
    kind = "recording"
    if not isinstance(files[0], Plain):
        kind = kind_of_file(Path(files[0]), columns, units)
    of_file = {"tip_radius_m": tip_radius_m, "columns": columns, "units": units, "clock": clock}
    of_log = {**of_file, "force_on": force_on, "rate_hz": rate_hz, "offset_s": offset_s}
    if kind == "recording" and not isinstance(files[0], Plain) and any(of_log.values()):
        # said anew how its rows are meant: they are read as any other table
        files, stated = _as_table(_only(files))
        kind, of_log = "table", of_log | {name: of_log[name] or value for name, value in stated.items()}
    _refuse_idle(kind, files[0], how)
    of_tip = {"tip": tip, "tip_angle_deg": tip_angle_deg}
    if kind != "curves":
        _sphere_alone(tip, tip_angle_deg, files[0], tip_radius_m, own=kind == "recording")
    opened = {"files": files, "save": save, **of_log, **how}
    made = partial(_reconstructed, files, opened, how, save=save, tip=tip, seed=seed, progress=call.wanted)
    match kind:
        case "model":
            result = _model(files)
        case "mesh":
            result = _mesh(files, save, tip_radius_m, moduli(young_modulus_pa), how, call.wanted)
        case "curves":
            of_machine = {"travel": travel, "compression": compression, "layer_m": layer_m, "fast": fast}
            result = _curves(files, seed=seed, progress=call.wanted, **of_file, **of_machine, **of_tip, **how)
        case "table":
            result = _table(files, made, opened, thing=_known(how), **of_log)
        case _:
            result = made(read_recording(_only(files)), {"took it for": "a recording"})
    page = f"{Path(files[0]).name.split('.')[0] or 'opened'}-palpate.html" if report is None else report
    if page != "none":
        call.then(lambda: [f"report: {result.report(page)}"])
    call.exit_code = 0 if result.good else 1
    return result


def _model(files: tuple[Any, ...]) -> Opened:
    from palpate.importing.kinds import Opened
    from palpate.operations.load import load

    return Opened("model", _names(files), {"took it for": "a MODEL"}, result=load(_only(files)))


def _mesh(
    files: tuple[Any, ...],
    save: str | Path | None,
    tip_radius_m: float | None,
    modulus_pa: Any,
    how: Mapping[str, Any],
    progress: bool | Progress,
) -> Opened:
    from palpate.importing.kinds import Opened
    from palpate.operations.model import model_of

    made = model_of(_only(files), modulus_pa, save=save, tip_radius_m=tip_radius_m, progress=progress, **how)
    notes = () if modulus_pa else ("no modulus was given: 20000 Pa is taken; --modulus PA sets another",)
    understood = {"took it for": f"the surface of an object, lengths in {how.get('unit', 'm')}"}
    said = {"files": files, "tip_radius_m": tip_radius_m, "young_modulus_pa": modulus_pa, **how}
    return Opened("mesh", _names(files), understood, result=made, notes=notes, said=said)


def _curves(files: tuple[Any, ...], **said: Any) -> Opened:
    from palpate.importing.kinds import Opened
    from palpate.operations.material import material

    made = material(*files, **said)
    understood = {"took it for": f"a machine's curves ({made.kind})", "curves": str(made.curves)}
    return Opened("curves", _names(files), understood, result=made, odds=made.odds)


_IDLE = {"mesh": "unit up sink_m poisson_ratio mesh_size_m", "curves": "poisson_ratio", "model": ""}
"""What holds for a kind of file, of what is said of a reconstruction."""


def _refuse_idle(kind: str, file: Any, how: Mapping[str, Any]) -> None:
    """Raises OptionError for what says nothing of such a file."""
    for name in how:
        if kind in _IDLE and name not in _IDLE[kind].split():
            flag = flag_of(open.operation.fields[name])  # type: ignore[attr-defined]
            took = {"mesh": "a surface", "curves": "a machine's curves", "model": "a MODEL"}[kind]
            raise OptionError(f"{flag} is about a recording, and '{file}' is {took}: leave it out")


def _known(how: Mapping[str, Any]) -> dict[str, Any]:
    """What [object] of a recording says of a flat one."""
    return {name: how[name] for name in ("slab_m", "half_space") if how.get(name)}


def _as_table(file: Any) -> tuple[tuple[Path], dict[str, Any]]:
    """A recording's samples, and what its description states of their force."""
    from palpate.mechanics.disk.reading import read_toml
    from palpate.mechanics.errors import RecordingError
    from palpate.mechanics.recording.files import recording_files

    samples, description = recording_files(file)
    held = read_toml(description, RecordingError)
    return (samples,), {"force_on": held.get("recording", {}).get("force_on")}


def _table(
    files: tuple[Any, ...], made: Callable[..., Opened], opened: dict[str, Any], **said: Any
) -> Opened:
    from palpate.operations.import_ import import_table

    brought = import_table(*files, **said)
    _ask_of_force(brought)
    opened["names"] = {role: column.name for role, column in brought.understood.columns.items()}
    understood = {
        "took it for": "a recording in another program's table",
        **{role: str(c).partition(" = ")[2] for role, c in brought.understood.columns.items()},
    }
    return made(brought.recording, understood, brought.understood.notes, brought.understood.odds)


def _ask_of_force(brought: Imported) -> None:
    """Raise Unclear where nobody said the force's unit, and it looks like another than the one assumed."""
    from palpate.importing.meaning import Unclear
    from palpate.reconstruction.checks.registry import force_unit_doubt

    columns = brought.understood.columns
    if not any(columns[role].assumed for role in ("fx", "fy", "fz") if role in columns):
        return
    if (doubt := force_unit_doubt(brought.recording)) is None:
        return
    likely = [way.options["units"]["force"] for way in doubt.ways if "units" in way.options]
    question = f"the force's unit is not given: {doubt.saw} ({doubt.sure})"
    raise Unclear(question, "units", [f"force={unit}" for unit in dict.fromkeys((*likely, "mN", "N"))])


def _reconstructed(
    files: tuple[Any, ...],
    opened: Mapping[str, Any],
    how: Mapping[str, Any],
    recording: Recording,
    understood: dict[str, str],
    notes: tuple[str, ...] = (),
    odds: float | None = None,
    *,
    save: str | Path | None,
    tip: str | None,
    seed: int,
    progress: bool | Progress,
) -> Opened:
    """Checked; reconstructed unless something is grave. opened: what was given, by name."""
    from palpate.importing.kinds import Opened
    from palpate.operations.reconstruct import reconstruct
    from palpate.reconstruction.checks.finding import Checkup
    from palpate.reconstruction.checks.registry import looked_at
    from palpate.reconstruction.geometry.stated import GeometryOptions

    named = {field.name for field in dataclasses.fields(GeometryOptions)}
    geometry = GeometryOptions(**{name: value for name, value in how.items() if name in named})
    with Call(progress).progress("check"):
        findings, seen = looked_at(recording, geometry)
    result: Any = Checkup(recording, findings, seen, opened=opened)
    if how.get("force") or not result.grave:
        result = reconstruct(
            recording, save=save, tip=tip, seed=seed, progress=progress, **{"field": "where-beaten", **how}
        )
    return Opened(
        "recording", _names(files), understood, result=result, notes=notes, odds=odds or 1e6, said=opened
    )


def _sphere_alone(
    tip: str | None, angle_deg: float | None, file: Any, radius_m: float | None, *, own: bool
) -> None:
    """Raise OptionError for a tip that recordings, surfaces and models know nothing of."""
    form = tip or ("sphere" if angle_deg is None else "cone")
    if form != "sphere":
        raise OptionError(other_tip(form, "--tip", str(file), radius_m, angle_deg, own=own))


def _only(files: tuple[Any, ...]) -> Any:
    if len(files) > 1:
        raise OptionError(f"{len(files)} files were given, and '{files[0]}' is opened by itself: name one")
    return files[0]


def _names(files: tuple[Any, ...]) -> tuple[str, ...]:
    return tuple(getattr(file, "object_name", None) or Path(file).name for file in files)
