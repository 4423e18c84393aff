"""Whatever it is: says what it took the files for, brings them in, checks them, does the one sensible thing.

FILEs are a recording (NAME.csv and NAME.toml), a table or bag of a robot's log, a machine's curves, a surface
or mesh, or a MODEL. A recording becomes a model, curves become a material, a surface a MODEL; one page tells
it. Where meaning is open (unit, sign, tip radius, one clock or many) it asks in one question on a terminal;
elsewhere it ends in one line that names the flag. SI units. Exit code 1 where the answer does not predict.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.mechanics.errors import OptionError
from palpate.operations._declare import Call, operand, operation
from palpate.operations._run import say_next
from palpate.operations._shared import (
    MODEL,
    columns_operand,
    named,
    report_operand,
    save_operand,
    seed_operand,
    tip_radius_operand,
    units_operand,
)
from palpate.output import Output

if TYPE_CHECKING:
    from palpate.importing.kinds import Opened
    from palpate.mechanics.recording.recording import Recording


@dataclass(frozen=True)
class OpenOperands:
    """The files, and what is said of them; all of it is optional where the files tell it."""

    files: tuple[Any, ...] = operand(
        (), "file, or folder of a MODEL or ROS 2 bag; in Python also a recording", metavar="FILE",
        positional=True, count="+", reads=True,
    )  # fmt: skip
    _: KW_ONLY
    save: str | Path | None = save_operand(
        "folder of the model to write, where one comes of it", "MODEL", MODEL
    )
    report: str | None = report_operand("the page; default: NAME-palpate.html here, 'none' for no page")
    tip_radius_m: float | None = tip_radius_operand("of the tool or indenter, where no file says it")
    columns: Mapping[str, str] | None = columns_operand(
        "as of import; of curves t, depth (or height), load", rare=True
    )
    units: Mapping[str, str] | None = units_operand()
    force_on: str | None = operand(None, "whose force it is", choices=("tool", "object"))
    travel: str | None = operand(
        None, "which way a machine's position counts", choices=("into", "out"), rare=True
    )
    compression: str | None = operand(
        None, "a machine's load as it presses", choices=("positive", "negative"), rare=True
    )
    clock: str | None = operand(None, "where time goes back", choices=("one", "blocks"), rare=True)
    slab_m: float | None = operand(None, "the object is a slab so thick", unit="m", flag="--slab")
    half_space: bool = operand(False, "the object is deep and wide")
    layer_m: float | None = operand(None, "thickness of a machine's sample; None: a half-space", unit="m")
    young_modulus_pa: float | None = operand(None, "of a surface's file", unit="Pa", flag="--modulus")
    unit: str = operand("m", "of a surface's file: m, cm, mm, um, in")
    fast: bool = operand(False, "fewer effects are tried", rare=True)
    seed: int = seed_operand()


def _answer(result: Opened, asked: OpenOperands, out: Output) -> int:
    out.say(*result.lines())
    page = asked.report
    if page is None:
        first = Path(asked.files[0])
        page = f"{first.name.split('.')[0] or 'opened'}-palpate.html"
    if page != "none":
        out.say(f"report: {result.report(page)}")
    say_next(result, out)
    out.json(result.as_json())
    return 0 if result.good else 1


@operation(OpenOperands, answer=_answer)
def open(asked: OpenOperands, call: Call) -> Opened:
    """Whatever it is: what it was taken for, brought in, checked, and the one sensible thing done.

    `result` is a Reconstruction, Material, Model, or the Checkup of a recording with something grave; lengths
    m, forces N, moduli Pa. Raises RecordingError where nothing can be understood, and what `reconstruct`,
    `material` and `model_of` raise.
    """
    from palpate.importing.kinds import with_answers

    if not asked.files:
        raise OptionError("pp.open needs a file: name at least one")
    return with_answers(_opened, asked, call)


def _opened(asked: OpenOperands, call: Call) -> Opened:
    from palpate.importing.kinds import kind_of_file
    from palpate.mechanics.recording.recording import Recording as Plain

    kind = "recording" if isinstance(asked.files[0], Plain) else kind_of_file(
        Path(asked.files[0]), named(asked.columns, "columns"), named(asked.units, "units")
    )  # fmt: skip
    return _DO[kind](asked, call)


def _model(asked: OpenOperands, call: Call) -> Opened:
    from palpate.importing.kinds import Opened
    from palpate.operations.load import load

    return Opened("model", _names(asked), {"took it for": "a MODEL"}, result=load(_only(asked)))


def _mesh(asked: OpenOperands, call: Call) -> Opened:
    from palpate.importing.kinds import Opened
    from palpate.operations.model import model_of

    given = {"tip_radius_m": asked.tip_radius_m, "young_modulus_pa": asked.young_modulus_pa}
    made = model_of(
        _only(asked),
        save=asked.save,
        unit=asked.unit,
        progress=call.wanted,
        **{key: value for key, value in given.items() if value is not None},
    )
    modulus = asked.young_modulus_pa
    notes = () if modulus else ("nobody said a modulus: 20000 Pa; --modulus PA states another",)
    understood = {"took it for": f"the surface of an object, lengths in {asked.unit}"}
    return Opened("mesh", _names(asked), understood, result=made, notes=notes)


def _curves(asked: OpenOperands, call: Call) -> Opened:
    from palpate.importing.kinds import Opened
    from palpate.operations.material import material

    names = (
        "tip_radius_m", "columns", "units", "travel", "compression", "clock", "layer_m", "fast", "seed"
    )  # fmt: skip
    made = material(*asked.files, progress=call.wanted, **{name: getattr(asked, name) for name in names})
    understood = {"took it for": f"a machine's curves ({made.kind})", "curves": str(made.curves)}
    return Opened("curves", _names(asked), understood, result=made, odds=made.odds)


def _table(asked: OpenOperands, call: Call) -> Opened:
    from palpate.operations.import_ import import_table

    thing = {"slab_m": asked.slab_m} if asked.slab_m else {"half_space": True} if asked.half_space else {}
    names = ("tip_radius_m", "columns", "units", "force_on", "clock")
    brought = import_table(*asked.files, thing=thing, **{name: getattr(asked, name) for name in names})
    understood = {
        "took it for": "a recording in another program's table",
        **{role: str(c).partition(" = ")[2] for role, c in brought.understood.columns.items()},
    }
    return _reconstructed(
        asked, call, brought.recording, understood, brought.understood.notes, brought.understood.odds
    )


def _recording(asked: OpenOperands, call: Call) -> Opened:
    from palpate.operations.read_recording import read_recording

    understood = {"took it for": "a recording"}
    return _reconstructed(asked, call, read_recording(_only(asked)), understood, (), None)


def _reconstructed(
    asked: OpenOperands, call: Call, recording: Recording, understood: dict[str, str],
    notes: tuple[str, ...], odds: float | None,
) -> Opened:  # fmt: skip
    """Checked; reconstructed unless something is grave."""
    from palpate.importing.kinds import Opened
    from palpate.operations.check import check
    from palpate.operations.reconstruct import reconstruct

    checked = check(recording, progress=call.wanted)
    result: Any = checked
    if not checked.grave:
        given: dict[str, Any] = {"field": "where-beaten"}
        if asked.slab_m:
            given["slab_m"] = asked.slab_m
        if asked.half_space:
            given["half_space"] = True
        result = reconstruct(recording, save=asked.save, seed=asked.seed, progress=call.wanted, **given)
    return Opened("recording", _names(asked), understood, result=result, notes=notes, odds=odds or 1e6)


def _only(asked: OpenOperands) -> Any:
    if len(asked.files) > 1:
        raise OptionError(
            f"{len(asked.files)} files were given, and '{asked.files[0]}' stands alone: name one"
        )
    return asked.files[0]


def _names(asked: OpenOperands) -> tuple[str, ...]:
    return tuple(getattr(file, "object_name", None) or Path(file).name for file in asked.files)


_DO = {"model": _model, "mesh": _mesh, "curves": _curves, "table": _table, "recording": _recording}
