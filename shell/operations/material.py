"""The material of a specimen from a machine's curves: indentation, compression, tension, relaxation.

FILEs are exports of bench instruments, a curve each (approach, perhaps a hold, retract): a sphere's
indentations (Chiaro's text, or any table with time, travel and load), cylinders between platens, pulls to
failure, relaxation curves. Columns and units are told by their names, or by --column and --units as in
`palpate import`. The answer is a modulus, the law or effects that predict curves which were held out, beside
1D models as floor and a regression without mechanics as ceiling, and what such a test cannot tell. SI units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING

from palpate.importing.machine_tests import KINDS
from palpate.operations._declare import Call, operand, operation
from palpate.operations._run import answer
from palpate.operations._shared import (
    columns_operand,
    named,
    poisson_operand,
    report_operand,
    seed_operand,
    tip_radius_operand,
    units_operand,
)
from palpate.output import Output

if TYPE_CHECKING:
    from pathlib import Path

    from palpate.diagnosis.specimen.result import Material


@dataclass(frozen=True)
class MaterialOperands:
    """The curves, and what they are of."""

    files: tuple[str | Path, ...] = operand(
        (), "a curve each", metavar="FILE", positional=True, count="+", reads=True
    )
    _: KW_ONLY
    kind: str = operand("auto", "of test; auto goes by the headers", choices=("auto", *KINDS))
    tip_radius_m: float | None = tip_radius_operand("of an indenter's sphere, where the files do not say")
    layer_m: float | None = operand(None, "thickness of the sample; None: a half-space", unit="m")
    poisson_ratio: float = poisson_operand("of the material", 0.49)
    specimens: bool = operand(False, "each indentation is of another piece; default: one piece", rare=True)
    columns: Mapping[str, str] | None = columns_operand("t, depth (or height), load")
    units: Mapping[str, str] | None = units_operand()
    travel: str | None = operand(
        None, "which way the position counts; None: by what a solid does", choices=("into", "out")
    )
    compression: str | None = operand(
        None,
        "the load's sign as it presses; None: by what a solid does",
        choices=("positive", "negative"),
        rare=True,
    )
    clock: str | None = operand(
        None, "where time goes back: one clock, or blocks with their own", choices=("one", "blocks")
    )
    fast: bool = operand(False, "fewer effects are tried", rare=True)
    report: str | None = report_operand("write the answer with its curves as a page")
    seed: int = seed_operand()


def _answer(result: Material, asked: MaterialOperands, out: Output) -> int:
    answer(result, asked, out)
    return 0 if result.predicts else 1


@operation(MaterialOperands, answer=_answer)
def material(asked: MaterialOperands, call: Call) -> Material:
    """The material of a specimen from a machine's curves: indentation, compression, tension or relaxation.

    From 6 indentations on, effects are searched for as `diagnose` does, each curve held out.
    Lengths m, moduli Pa. Raises RecordingError where a file cannot be read, ContactError
    where nothing is touched.
    """
    from palpate.importing.kinds import with_answers

    return with_answers(_made, asked, call)


def _made(asked: MaterialOperands, call: Call) -> Material:
    from palpate.diagnosis.specimen.material import material_of
    from palpate.importing.curve_meaning import SaidOfCurves
    from palpate.importing.machine_tests import read_tests

    tests = read_tests(
        asked.files,
        kind=asked.kind,
        tip_radius_m=asked.tip_radius_m,
        said=SaidOfCurves(
            named(asked.columns, "columns"),
            named(asked.units, "units"),
            asked.travel,
            asked.compression,
            asked.clock,
        ),
    )
    with call.progress("material") as tell:
        return material_of(
            tests,
            asked.files,
            layer_m=asked.layer_m,
            poisson_ratio=asked.poisson_ratio,
            specimens=asked.specimens,
            fast=asked.fast,
            seed=asked.seed,
            progress=tell,
        )
