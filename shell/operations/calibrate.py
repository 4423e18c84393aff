"""The instrument told from presses on something known: tip, tool's stiffness, sensor, bias, delay, play.

REC holds presses on a rigid plate (--rigid) or on an object of known Young's modulus (--modulus), whose
geometry is traced, or given by --slab, --half-space or --shape. TOOL.toml is what recordings may name
([tool] calibration = "TOOL.toml", beside them): every command then reads them as an ideal instrument had.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.mechanics.errors import OptionError
from palpate.operations._declare import Call, operand, operation
from palpate.operations._run import answer
from palpate.operations._shared import poisson_operand, recording_operand, save_operand, seed_operand
from palpate.operations.read_recording import read_recording
from palpate.operations.reconstruct import reconstruct
from palpate.output import Output
from palpate.reconstruction.geometry.stated import GeometryOptions

if TYPE_CHECKING:
    from palpate.mechanics.recording.calibration import Calibration
    from palpate.operations._shared import RecordingLike


@dataclass(frozen=True)
class CalibrateOperands:
    """What was pressed, and what is to be trusted."""

    recording: RecordingLike = recording_operand()
    _: KW_ONLY
    save: str | Path | None = save_operand(
        "calibration to write, which recordings may name",
        "TOOL.toml",
        "palpate.mechanics.recording.calibration:TOOL",
    )
    rigid: bool = operand(False, "the presses are on a rigid plate")
    modulus_pa: float | None = operand(
        None,
        "they are on an object of this Young's modulus, traced, or of a geometry that is given",
        unit="Pa",
    )
    poisson_ratio: float | None = poisson_operand("of the object; None: 0.49")
    trust: str = operand(
        "tip",
        "right where a common factor is left: the tip's radius or the sensor's gain",
        choices=("tip", "gain"),
    )
    seed: int = seed_operand()


def _answer(result: Calibration, asked: CalibrateOperands, out: Output) -> int:
    lines = ["next: keep it for recordings: --save TOOL.toml"]
    if asked.save is not None:
        key = f'under [tool] in a recording\'s .toml: calibration = "{asked.save}"'
        lines = [f"written: {asked.save}", f"next: let recordings be read by it, {key}"]
    return answer(result, asked, out, lines=lines)


@operation(CalibrateOperands, GeometryOptions, often="shape slab_m unit", answer=_answer)
def calibrate(asked: CalibrateOperands, call: Call) -> Calibration:
    """The instrument, from presses on something known: tool's stiffness, sensor, bias, delay, play.

    Lengths m, moduli Pa. Raises OptionError unless one of rigid and modulus_pa is given, ContactError or
    DiagnosisError where presses are too few.
    """
    from palpate.diagnosis.calibrate.on_object import calibrate_on_object
    from palpate.diagnosis.calibrate.on_plate import calibrate_on_plate
    from palpate.reconstruction.geometry.stated import nowhere
    from palpate.reconstruction.steps.s3_contacts.contacts import explore

    if asked.rigid == (asked.modulus_pa is not None):
        raise OptionError(
            "say on what it was pressed: rigid (--rigid), or modulus_pa (--modulus PA), one of them"
        )
    if asked.modulus_pa is not None and not asked.modulus_pa > 0:
        raise OptionError(f"modulus_pa is {asked.modulus_pa}; it must be greater than 0 Pa")
    measured = read_recording(asked.recording)
    with call.progress("calibrate") as tell:
        if asked.modulus_pa is None:
            found = explore(measured, boundary=nowhere(measured), unbroken=True)
            result = calibrate_on_plate(found)
        else:
            made = reconstruct(
                measured,
                poisson_ratio=asked.poisson_ratio,
                seed=asked.seed,
                progress=lambda s, x: tell(s, 0.3 * x),
                **call.values(GeometryOptions),
            )
            result = calibrate_on_object(
                measured, made.model, asked.modulus_pa, trust=asked.trust, seed=asked.seed,
                progress=lambda s, x: tell(s, 0.3 + 0.7 * x),
            )  # fmt: skip
    if asked.save is not None:
        result.save(asked.save)
    return result
