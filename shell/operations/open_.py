"""Recognise what the files are, import and check them, and make a model or a material of them.

FILEs are a recording (NAME.csv and NAME.toml), a table or bag of a robot's log, a machine's curves, a surface
or mesh, or a MODEL. A recording becomes a model, curves become a material, a surface a MODEL; one page shows
the result. Where a meaning is unclear (unit, sign, tip radius, one clock or many) it asks one question on a
terminal; elsewhere it ends with one line that names the flag. SI units. Exit code 1 if the result does not
predict held-out data.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.mechanics.errors import OptionError
from palpate.operations._call import Call
from palpate.operations._declare import argument, operation, option
from palpate.operations._shared import (
    MODEL,
    ClockOfRows,
    Seed,
    TipAngle,
    TipForm,
    Units,
    columns_option,
    named,
    report_option,
    save_option,
)

if TYPE_CHECKING:
    from palpate.importing.kinds import Opened
    from palpate.mechanics.progress import Progress
    from palpate.mechanics.recording.recording import Recording


@operation()
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
    poisson_ratio: Annotated[
        float | None, option("of the material; None: as the file says, else 0.49")
    ] = None,
    columns: Annotated[
        Mapping[str, str] | None,
        columns_option("as of import; of curves t, depth (or height), load", advanced=True),
    ] = None,
    units: Units = None,
    force_on: Annotated[
        str | None, option("body on which the force acts", choices=("tool", "object"))
    ] = None,
    travel: Annotated[
        str | None, option("which way a machine's position counts", choices=("into", "out"), advanced=True)
    ] = None,
    compression: Annotated[
        str | None,
        option("sign of a machine's load as it presses", choices=("positive", "negative"), advanced=True),
    ] = None,
    clock: ClockOfRows = None,
    slab_m: Annotated[
        float | None, option("thickness, if the object is a slab", unit="m", flag="--slab")
    ] = None,
    half_space: Annotated[bool, option("the object is deep and wide compared with the contacts")] = False,
    layer_m: Annotated[
        float | None, option("thickness of a machine's sample; None: a half-space", unit="m")
    ] = None,
    young_modulus_pa: Annotated[
        float | None, option("Young's modulus, for a surface file", unit="Pa", flag="--modulus")
    ] = None,
    unit: Annotated[str, option("unit of a surface file: m, cm, mm, um, in")] = "m",
    fast: Annotated[bool, option("try fewer effects", advanced=True)] = False,
    seed: Seed = 0,
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

    if not files:
        raise OptionError("pp.open needs a file: name at least one")
    kind = "recording" if isinstance(files[0], Plain) else kind_of_file(
        Path(files[0]), named(columns, "columns"), named(units, "units")
    )  # fmt: skip
    of_file = {"tip_radius_m": tip_radius_m, "columns": columns, "units": units, "clock": clock}
    thing = {"slab_m": slab_m} if slab_m else {"half_space": True} if half_space else {}
    of_material = {} if poisson_ratio is None else {"poisson_ratio": poisson_ratio}
    made = partial(
        _reconstructed, files, {**thing, **of_material}, save=save, seed=seed, progress=call.wanted
    )
    of_tip = {"tip": tip, "tip_angle_deg": tip_angle_deg}
    if kind != "curves":
        _sphere_alone(of_tip)
    match kind:
        case "model":
            result = _model(files)
        case "mesh":
            result = _mesh(files, save, unit, tip_radius_m, young_modulus_pa, of_material, call.wanted)
        case "curves":
            of_machine = {
                "travel": travel, "compression": compression, "layer_m": layer_m, "fast": fast,
                **of_material, **of_tip,
            }  # fmt: skip
            result = _curves(files, seed=seed, progress=call.wanted, **of_file, **of_machine)
        case "table":
            result = _table(files, made, thing=thing, force_on=force_on, **of_file)
        case _:
            result = made(read_recording(_only(files)), {"took it for": "a recording"})
    page = f"{Path(files[0]).name.split('.')[0] or 'opened'}-palpate.html" if report is None else report
    if page != "none":
        call.then(lambda: [f"report: {result.report(page)}"])
    call.exit_code = 0 if result.good else 1
    return result


def _sphere_alone(of_tip: Mapping[str, Any]) -> None:
    """Raise OptionError for a tip that recordings, surfaces and models know nothing of."""
    for name, value in of_tip.items():
        if value not in (None, "sphere"):
            flag = "--" + name.removesuffix("_deg").replace("_", "-")
            raise OptionError(
                f"{flag} is {value}, and an object is pressed by a sphere alone: leave {flag} out (a "
                "machine's curves take other tips)"
            )


def _model(files: tuple[Any, ...]) -> Opened:
    from palpate.importing.kinds import Opened
    from palpate.operations.load import load

    return Opened("model", _names(files), {"took it for": "a MODEL"}, result=load(_only(files)))


def _mesh(
    files: tuple[Any, ...],
    save: str | Path | None,
    unit: str,
    tip_radius_m: float | None,
    modulus_pa: float | None,
    of_material: Mapping[str, Any],
    progress: bool | Progress,
) -> Opened:
    from palpate.importing.kinds import Opened
    from palpate.operations.model import model_of

    made = model_of(
        _only(files),
        modulus_pa,
        save=save,
        unit=unit,
        tip_radius_m=tip_radius_m,
        progress=progress,
        **of_material,
    )
    notes = () if modulus_pa else ("no modulus was given: 20000 Pa is taken; --modulus PA sets another",)
    understood = {"took it for": f"the surface of an object, lengths in {unit}"}
    return Opened("mesh", _names(files), understood, result=made, notes=notes)


def _curves(files: tuple[Any, ...], **said: Any) -> Opened:
    from palpate.importing.kinds import Opened
    from palpate.operations.material import material

    made = material(*files, **said)
    understood = {"took it for": f"a machine's curves ({made.kind})", "curves": str(made.curves)}
    return Opened("curves", _names(files), understood, result=made, odds=made.odds)


def _table(files: tuple[Any, ...], made: Callable[..., Opened], **said: Any) -> Opened:
    from palpate.operations.import_ import import_table

    brought = import_table(*files, **said)
    understood = {
        "took it for": "a recording in another program's table",
        **{role: str(c).partition(" = ")[2] for role, c in brought.understood.columns.items()},
    }
    return made(brought.recording, understood, brought.understood.notes, brought.understood.odds)


def _reconstructed(
    files: tuple[Any, ...],
    geometry: Mapping[str, Any],
    recording: Recording,
    understood: dict[str, str],
    notes: tuple[str, ...] = (),
    odds: float | None = None,
    *,
    save: str | Path | None,
    seed: int,
    progress: bool | Progress,
) -> Opened:
    """Checked; reconstructed unless something is grave."""
    from palpate.importing.kinds import Opened
    from palpate.operations.check import check
    from palpate.operations.reconstruct import reconstruct

    checked = check(recording, progress=progress)
    result: Any = checked
    if not checked.grave:
        result = reconstruct(
            recording, save=save, seed=seed, progress=progress, field="where-beaten", **geometry
        )
    return Opened("recording", _names(files), understood, result=result, notes=notes, odds=odds or 1e6)


def _only(files: tuple[Any, ...]) -> Any:
    if len(files) > 1:
        raise OptionError(f"{len(files)} files were given, and '{files[0]}' is opened by itself: name one")
    return files[0]


def _names(files: tuple[Any, ...]) -> tuple[str, ...]:
    return tuple(getattr(file, "object_name", None) or Path(file).name for file in files)
