"""Which model predicts a held-out touch better: finite elements (FEM), or springs and dampers that are
interpolated between presses (1D). With REC2, compare two recordings of one object (before and after, two
tools): their moduli, the difference, what explains it.

Single places are left out of the fits, then whole regions. Of --model only the geometry is used; all else is
fitted anew each time. Errors are root mean squares of the force vector in contact, mN (in --json N); bias is
the share by which the predicted force is too large.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from palpate.diagnosis.compare.comparison import CompareOptions
from palpate.mechanics.errors import OptionError
from palpate.mechanics.progress import part
from palpate.operations._call import Call
from palpate.operations._declare import Given, argument, operation, option
from palpate.operations._shared import MeshFileOptions, RecordingArgument, Seed, given_model, report_option
from palpate.operations._simulators import (
    NumbersOfSimulator,
    SettingsOfSimulator,
    run_along,
    simulator,
    simulator_option,
)
from palpate.operations.diagnose import diagnose
from palpate.operations.load import load
from palpate.operations.read_recording import read_recording
from palpate.operations.reconstruct import reconstruct
from palpate.reconstruction.geometry.stated import GeometryOptions
from palpate.render.options import DOCUMENTED
from palpate.render.registry import check_settings

if TYPE_CHECKING:
    from palpate.diagnosis.compare.before_after import Changes
    from palpate.diagnosis.compare.comparison import Comparison
    from palpate.operations._shared import ModelLike, RecordingLike


@operation(common="folds field")
def compare(
    recording: RecordingArgument,
    model: Annotated[
        ModelLike | None,
        option("take the geometry from it; default: reconstruct", metavar="MODEL", reads=True),
    ] = None,
    *,
    renderer: Annotated[
        str | None, simulator_option("another simulator to compare with, run along the path")
    ] = None,
    simulator_settings: SettingsOfSimulator = DOCUMENTED,
    simulator_set: NumbersOfSimulator = "",
    other: Annotated[
        str | None,
        argument(
            "a second recording of the object: say what differs instead (--no-diagnosis: moduli alone)",
            metavar="REC2",
            count="?",
            reads=True,
            only="command",
        ),
    ] = None,
    diagnosed: Annotated[
        bool,
        option("of two recordings: diagnose each; else moduli alone", flag="--diagnosis", only="command"),
    ] = True,
    report: Annotated[str | None, report_option("write tables and pictures as a page", short="-o")] = None,
    seed: Seed = 0,
    file: Given[MeshFileOptions],
    options: CompareOptions,
    call: Call,
) -> Comparison:
    """FEM against the interpolated 1D models, on presses and regions that no fit has seen; errors N rms.

    model: only its geometry is used, every parameter is refitted in each fold; without one the recording is
    reconstructed. Raises ContactError for fewer sites than two.
    """
    from palpate.diagnosis.compare.comparison import Along
    from palpate.diagnosis.compare.comparison import compare as compared

    result: Any
    if other is not None:
        if renderer is not None:
            raise OptionError("--renderer needs one recording: it is compared with its models")
        if model:
            raise OptionError("--model needs one recording: with two, each is reconstructed by itself")
        result = changes(recording, other, diagnosed=diagnosed, seed=seed, progress=call.wanted)
        call.then_report(result, report)
        return result
    if renderer is not None:
        check_settings(renderer, simulator_settings, simulator_set)
    source, measured = given_model(model, file), read_recording(recording)
    with call.progress("compare") as show_progress:
        plain = None if source is None else load(source, progress=show_progress)
        simulated, rest = None, show_progress
        if renderer is not None:
            if plain is None:
                plain = reconstruct(measured, seed=seed, progress=part(show_progress, 0.0, 0.3)).model
            made = simulator(renderer, simulator_settings, simulator_set, plain)
            ran = run_along(made, measured, part(show_progress, 0.3, 0.7))
            simulated, rest = {renderer: Along(measured.t, ran.force)}, part(show_progress, 0.7, 1.0)
        result = compared(measured, plain, options, simulated=simulated, seed=seed, progress=rest)
    call.then_report(result, report)
    return result


@operation()
def changes(
    before: Annotated[RecordingLike, option("a recording of the object")],
    after: Annotated[RecordingLike, option("another of the same object")],
    *,
    diagnosed: Annotated[bool, option("diagnose each too")] = True,
    fast: Annotated[bool, option("try fewer effects")] = True,
    seed: Seed = 0,
    geometry: Given[GeometryOptions],
    call: Call,
) -> Changes:
    """Two recordings of one object, before and after or with two tools: moduli, their difference, what
    explains it.

    Each is reconstructed and, where diagnosed, diagnosed; the moduli, Pa, are compared with their intervals,
    and place by place where the two share a frame. The options, m, are of both reconstructions. Raises what
    `reconstruct` and `diagnose` raise.
    """
    from palpate.diagnosis.compare.before_after import Side
    from palpate.diagnosis.compare.before_after import changes as weighed
    from palpate.diagnosis.verdict.result import Diagnosis

    sides = []
    both = read_recording(before), read_recording(after)  # a wrong name is refused at once
    with call.progress("changes") as show_progress:
        for k, measured in enumerate(both):

            def step(words: str, share: float, k: int = k) -> None:
                show_progress(words, 0.5 * k + 0.5 * share)

            made = reconstruct(measured, seed=seed, progress=lambda s, x: step(s, 0.4 * x), **geometry)
            found = None
            if diagnosed:
                found = diagnose(
                    measured, made, fast=fast, seed=seed, progress=lambda s, x: step(s, 0.4 + 0.6 * x)
                )
            own = found if isinstance(found, Diagnosis) else None  # no simulator was named
            sides.append(Side(measured, made.model, own))
    return weighed(*sides)
