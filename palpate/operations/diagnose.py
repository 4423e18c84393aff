"""The sim-to-real gap: where the simulated force leaves the measured one, which effect was left out, how far
the gap shrinks.

REC is a recording's .csv, .csv.gz or .toml. Without --model the recording is reconstructed first. The answer
may be one effect, several, a set that the touches cannot tell apart, "none" (the gap is noise) or "unknown".
Forces in N (rms of the 3-vector over contact samples of held-out places), lengths in m, moduli in Pa.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING

from diagnose.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from mechanics.errors import OptionError
from palpate.operations._declare import Call, operand, operation
from palpate.operations._shared import (
    MODEL,
    SAMPLES,
    MeshFileOptions,
    given_model,
    model_flag,
    recording_operand,
    report_operand,
    seed_operand,
)
from palpate.operations.load import load
from palpate.operations.read_recording import read_recording
from palpate.operations.reconstruct import reconstruct
from palpate.output import Output

if TYPE_CHECKING:
    from diagnose.verdict.result import Diagnosis
    from palpate.operations._shared import ModelLike, RecordingLike


@dataclass(frozen=True)
class DiagnoseOperands:
    """What is diagnosed, and what is written."""

    recording: RecordingLike = recording_operand()
    model: ModelLike | None = model_flag(
        "of this recording or of another of the same object; without it the recording is reconstructed"
    )
    _: KW_ONLY
    apply: str | None = operand(
        None,
        "write the improved model (object, contact, boundary effects)",
        metavar="MODEL2",
        writes=MODEL,
        only="command",
    )
    corrected: str | None = operand(
        None,
        "write the recording with the instrument's effects taken off (.csv.gz, .csv)",
        metavar="REC2",
        writes=SAMPLES,
        only="command",
    )
    report: str | None = report_operand("write the three answers with pictures as one HTML page")
    seed: int = seed_operand()


def _answer(result: Diagnosis, asked: DiagnoseOperands, out: Output) -> int:
    out.say(*result.lines())
    if asked.apply:
        better = result.improved().save(asked.apply)
        kept = [name for name in result.effects if name in better.effects]
        out.say(f"improved model ({', '.join(kept) or 'modulus only'}): {asked.apply}")
    if asked.corrected:
        result.corrected().save(asked.corrected)
        out.say(f"corrected recording: {asked.corrected}")
    if asked.report:
        out.say(f"report: {result.report(asked.report)}")
    out.json(result.as_json())
    return 0


@operation(
    DiagnoseOperands,
    MeshFileOptions,
    DiagnoseOptions,
    AttributionOptions,
    NuisanceOptions,
    often="fast without",
    answer=_answer,
)
def diagnose(asked: DiagnoseOperands, call: Call) -> Diagnosis:
    """The sim-to-real gap: where simulated and measured force differ, which effect was left out, how far the
    gap shrinks with it on places that were not fitted; N rms.

    fast: fewer effects, one in an answer. Raises DiagnosisError where the data cannot carry it.
    """
    from diagnose.pipeline import diagnose as diagnosed
    from reconstruct.placing import presses_on

    if asked.corrected and not str(asked.corrected).endswith((".csv", ".csv.gz")):
        raise OptionError(f"--corrected '{asked.corrected}' must end in .csv or .csv.gz")
    options = call.of(DiagnoseOptions, seed=asked.seed)
    most = {"most": 1} if options.fast and "most" not in call.given else {}
    source, measured = given_model(asked.model, call), read_recording(asked.recording)
    with call.progress("diagnose") as tell:
        if source is None:
            made = reconstruct(measured, progress=lambda s, x: tell(f"model: {s}", 0.3 * x)).model
            begun = 0.3
        else:
            plain = load(source, progress=tell)
            made, begun = plain.replaced(presses=presses_on(measured, plain)), 0.0
        return diagnosed(
            measured,
            made,
            options,
            lambda s, x: tell(s, begun + (1 - begun) * x),
            nuisance=call.of(NuisanceOptions),
            attribution=call.of(AttributionOptions, **most),
        )
