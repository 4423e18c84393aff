"""What may be wrong with a recording, before it is believed: units, axes, channels, clock, base, presses.

REC is a recording's .csv, .csv.gz or .toml. A grave finding makes its modulus worthless, and `palpate
reconstruct` refuses it without --force; others widen the modulus's interval. Exit code 1 where one is grave.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING

from palpate.operations._declare import Call, operand, operation
from palpate.operations._run import answer
from palpate.operations._shared import recording_operand, report_operand
from palpate.operations.read_recording import read_recording
from palpate.output import Output

if TYPE_CHECKING:
    from palpate.operations._shared import RecordingLike
    from palpate.reconstruction.checks.finding import Checkup


@dataclass(frozen=True)
class CheckOperands:
    """What is looked at, and how far."""

    recording: RecordingLike = recording_operand()
    _: KW_ONLY
    full: bool = operand(False, "reconstruct too, some 20 s, and check the modulus")
    report: str | None = report_operand("write the findings with pictures as one HTML page")


def _answer(result: Checkup, asked: CheckOperands, out: Output) -> int:
    answer(result, asked, out)
    return 1 if result.grave else 0


@operation(CheckOperands, answer=_answer)
def check(asked: CheckOperands, call: Call) -> Checkup:
    """What may be wrong with a recording: units, axes, channels, clock, traced base, presses.

    The result has findings, the gravest first, each with a stretch in s; `reconstruct` refuses what is grave.
    Raises RecordingError for what is no recording, and what `reconstruct` raises with `full`.
    """
    from palpate.reconstruction.checks.finding import Checkup
    from palpate.reconstruction.checks.registry import looked_at
    from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct_fully

    measured = read_recording(asked.recording)
    with call.progress("check") as tell:
        findings, seen = looked_at(measured)
        if asked.full and not any(f.grave for f in findings):
            findings = reconstruct_fully(measured, ReconstructOptions(force=True), tell).findings
    return Checkup(measured, findings, seen, asked.full)
