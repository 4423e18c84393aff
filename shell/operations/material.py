"""Fit a material to the curves of a testing machine: indentation, compression, tension, relaxation.

FILEs are exports of bench instruments, a curve each (approach, perhaps a hold, retract): indentations by a
sphere, flat punch, cone or pyramid (Chiaro's text, or any table with travel and load), cylinders between
platens, pulls to failure, relaxation curves. Columns and units are recognised by their names, or given by
--column and --units as in `palpate import`. The result is a modulus, and the law or effects that predict
held-out curves best, compared with 1D models and with a regression without mechanics; and what such a test
cannot determine. SI units.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

from palpate.importing.machine_tests import KINDS
from palpate.operations._call import Call
from palpate.operations._declare import argument, operation, option
from palpate.operations._shared import Seed, TipAngle, TipForm, Units, columns_option, named, report_option

if TYPE_CHECKING:
    from pathlib import Path

    from palpate.diagnosis.specimen.result import Material


@operation()
def material(
    *files: Annotated[str | Path, argument("files of one curve each", metavar="FILE", count="+", reads=True)],
    kind: Annotated[str, option("kind of test; auto reads the headers", choices=("auto", *KINDS))] = "auto",
    tip: TipForm = None,
    tip_radius_m: Annotated[
        float | None, option("radius of the sphere or flat punch, if the files do not give it", unit="m")
    ] = None,
    tip_angle_deg: TipAngle = None,
    layer_m: Annotated[float | None, option("thickness of the sample; None: a half-space", unit="m")] = None,
    poisson_ratio: Annotated[
        float | None, option("of the material; None: as the file says, else 0.49")
    ] = None,
    specimens: Annotated[
        bool, option("each indentation is of another piece; default: one piece", advanced=True)
    ] = False,
    columns: Annotated[Mapping[str, str] | None, columns_option("t, depth (or height), load")] = None,
    units: Units = None,
    travel: Annotated[
        str | None,
        option(
            "which way the position counts; None: by the sign that a solid gives", choices=("into", "out")
        ),
    ] = None,
    compression: Annotated[
        str | None,
        option(
            "the load's sign as it presses; None: by the sign that a solid gives",
            choices=("positive", "negative"),
            advanced=True,
        ),
    ] = None,
    clock: Annotated[
        str | None,
        option("if time goes back: one clock, or blocks with a clock each", choices=("one", "blocks")),
    ] = None,
    fast: Annotated[bool, option("try fewer effects", advanced=True)] = False,
    report: Annotated[str | None, report_option("write the answer with its curves as a page")] = None,
    seed: Seed = 0,
    call: Call,
) -> Material:
    """The material of a specimen from a machine's curves: indentation, compression, tension or relaxation.

    From 6 indentations on, effects are searched for as `diagnose` does, each curve held out.
    Lengths m, moduli Pa, angles degrees. Raises RecordingError where a file cannot be read, ContactError
    where nothing is touched.
    """
    from palpate.diagnosis.specimen.material import material_of
    from palpate.importing.curve_meaning import SaidOfCurves
    from palpate.importing.machine_tests import SaidOfTip, read_tests

    said = SaidOfCurves(named(columns, "columns"), named(units, "units"), travel, compression, clock)
    tests = read_tests(files, kind=kind, tip=SaidOfTip(tip, tip_radius_m, tip_angle_deg), said=said)
    with call.progress("material") as show_progress:
        result = material_of(
            tests,
            files,
            layer_m=layer_m,
            poisson_ratio=poisson_ratio,
            specimens=specimens,
            fast=fast,
            seed=seed,
            progress=show_progress,
        )
    call.then_report(result, report)
    call.exit_code = 0 if result.predicts else 1
    return result
