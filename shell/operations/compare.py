"""Which model predicts a touch that it has not seen: finite elements (FEM), or springs and dampers that are
interpolated between presses (1D). Or, with REC2, two recordings of one object (before and after, two tools):
their moduli, the difference, what explains it.

Single places are left out of the fits, then whole regions. Of --model only the geometry is used; all else is
fitted anew each time. Errors are root mean squares of the force vector in contact, N; bias is the share by
which the predicted force is too large.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Any

from palpate.diagnosis.compare.comparison import CompareOptions
from palpate.mechanics.errors import OptionError
from palpate.mechanics.progress import part
from palpate.operations._declare import REQUIRED, Call, operand, operation
from palpate.operations._shared import (
    MeshFileOptions,
    given_model,
    model_flag,
    recording_operand,
    report_operand,
    seed_operand,
)
from palpate.operations._simulators import (
    numbers_operand,
    run_along,
    settings_operand,
    simulator,
    simulator_operand,
)
from palpate.operations.diagnose import diagnose
from palpate.operations.load import load
from palpate.operations.read_recording import read_recording
from palpate.operations.reconstruct import reconstruct
from palpate.reconstruction.geometry.stated import GeometryOptions

if TYPE_CHECKING:
    from palpate.diagnosis.compare.before_after import Changes
    from palpate.diagnosis.compare.comparison import Comparison
    from palpate.operations._shared import ModelLike, RecordingLike


@dataclass(frozen=True)
class CompareOperands:
    """What is compared."""

    recording: RecordingLike = recording_operand()
    model: ModelLike | None = model_flag("take the geometry from it; default: reconstruct")
    _: KW_ONLY
    renderer: str | None = simulator_operand("another simulator beside them, run along the path")
    simulator_settings: str = settings_operand()
    simulator_set: str = numbers_operand()
    other: str | None = operand(
        None,
        "a second recording of the object: say what differs instead (--no-diagnosis: moduli alone)",
        metavar="REC2",
        positional=True,
        count="?",
        reads=True,
        only="command",
    )
    diagnosed: bool = operand(
        True, "of two recordings: diagnose each; else moduli alone", flag="--diagnosis", only="command"
    )
    report: str | None = report_operand("write tables and pictures as a page", short="-o")
    seed: int = seed_operand()


@operation(CompareOperands, MeshFileOptions, CompareOptions, often="folds field")
def compare(asked: CompareOperands, call: Call) -> Comparison:
    """FEM against the interpolated 1D models, on presses and regions that no fit has seen; errors N rms.

    model: only its geometry is used, every parameter is refitted in each fold; without one the recording is
    reconstructed. Raises ContactError for fewer sites than two.
    """
    from palpate.diagnosis.compare.comparison import Along
    from palpate.diagnosis.compare.comparison import compare as compared

    if asked.other is not None:
        if asked.renderer is not None:
            raise OptionError("--renderer goes with one recording: it is set beside the models of it")
        if asked.model:
            raise OptionError("--model goes with one recording: two are reconstructed each by itself")
        two: Any = changes(
            asked.recording, asked.other, diagnosed=asked.diagnosed, seed=asked.seed, progress=call.wanted
        )
        return two
    source = given_model(asked.model, call)
    chosen, measured = call.of(CompareOptions), read_recording(asked.recording)
    with call.progress("compare") as tell:
        plain = None if source is None else load(source, progress=tell)
        if asked.renderer is None:
            return compared(measured, plain, chosen, seed=asked.seed, progress=tell)
        if plain is None:
            plain = reconstruct(measured, seed=asked.seed, progress=part(tell, 0.0, 0.3)).model
        settings, numbers = asked.simulator_settings, asked.simulator_set
        made = simulator(asked.renderer, settings, numbers, plain)
        ran = run_along(made, measured, part(tell, 0.3, 0.7))
        simulated = {asked.renderer: Along(measured.t, ran.force)}
        return compared(
            measured, plain, chosen, simulated=simulated, seed=asked.seed, progress=part(tell, 0.7, 1.0)
        )


@dataclass(frozen=True)
class ChangesOperands:
    """The two recordings."""

    before: RecordingLike = operand(REQUIRED, "a recording of the object")
    after: RecordingLike = operand(REQUIRED, "another of the same object")
    _: KW_ONLY
    diagnosed: bool = operand(True, "diagnose each too")
    fast: bool = operand(True, "by fewer effects")
    seed: int = seed_operand()


@operation(ChangesOperands, GeometryOptions)
def changes(asked: ChangesOperands, call: Call) -> Changes:
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
    both = read_recording(asked.before), read_recording(asked.after)  # a wrong name is refused at once
    with call.progress("changes") as tell:
        for k, measured in enumerate(both):

            def step(words: str, share: float, k: int = k) -> None:
                tell(words, 0.5 * k + 0.5 * share)

            made = reconstruct(
                measured,
                seed=asked.seed,
                progress=lambda s, x: step(s, 0.4 * x),
                **call.values(GeometryOptions),
            )
            found = None
            if asked.diagnosed:
                found = diagnose(
                    measured,
                    made,
                    fast=asked.fast,
                    seed=asked.seed,
                    progress=lambda s, x: step(s, 0.4 + 0.6 * x),
                )
            own = found if isinstance(found, Diagnosis) else None  # no simulator was named
            sides.append(Side(measured, made.model, own))
    return weighed(*sides)
