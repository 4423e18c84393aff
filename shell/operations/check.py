"""Check a recording before a model is made of it: units, axes, channels, clock, base, presses.

REC is a recording's .csv, .csv.gz or .toml. With a grave finding the modulus would be wrong:
`palpate reconstruct` refuses the recording without --force. Other findings widen the interval of the
modulus. Exit code 1 if a finding is grave.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from palpate.operations._call import Call
from palpate.operations._declare import operation, option
from palpate.operations._shared import RecordingArgument, report_option
from palpate.operations.read_recording import read_recording

if TYPE_CHECKING:
    from palpate.reconstruction.checks.finding import Checkup


@operation()
def check(
    recording: RecordingArgument,
    *,
    full: Annotated[bool, option("reconstruct too, some 20 s, and check the modulus")] = False,
    report: Annotated[str | None, report_option("write the findings with pictures as one HTML page")] = None,
    call: Call,
) -> Checkup:
    """What may be wrong with a recording: units, axes, channels, clock, traced base, presses.

    The result has findings, the gravest first, each with a stretch in s; `reconstruct` refuses what is grave.
    Raises RecordingError for what is no recording, and what `reconstruct` raises with `full`.
    """
    from palpate.reconstruction.checks.finding import Checkup
    from palpate.reconstruction.checks.registry import looked_at
    from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct_fully

    measured = read_recording(recording)
    with call.progress("check") as show_progress:
        findings, seen = looked_at(measured)
        if full and not any(f.grave for f in findings):
            findings = reconstruct_fully(measured, ReconstructOptions(force=True), show_progress).findings
    result = Checkup(measured, findings, seen, full)
    call.then_report(result, report)
    call.exit_code = int(bool(result.grave))
    return result
