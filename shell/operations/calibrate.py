"""Calibrate the instrument by presses on a known object: tip, tool stiffness, sensor, bias, delay, play.

REC holds presses on a rigid plate (--rigid) or on an object of known Young's modulus (--modulus), whose
geometry is traced, or given by --slab, --half-space or --shape. TOOL.toml is what recordings may name
([tool] calibration = "TOOL.toml", in the same folder): every command then corrects them for the instrument.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from palpate.mechanics.errors import OptionError
from palpate.operations._call import Call
from palpate.operations._declare import Given, operation, option
from palpate.operations._shared import RecordingArgument, Seed, save_option
from palpate.operations.read_recording import read_recording
from palpate.operations.reconstruct import reconstruct
from palpate.reconstruction.geometry.stated import GeometryOptions

if TYPE_CHECKING:
    from palpate.mechanics.recording.calibration import Calibration


@operation(common="shape slab_m unit")
def calibrate(
    recording: RecordingArgument,
    *,
    save: Annotated[
        str | Path | None,
        save_option(
            "calibration to write, which recordings may name",
            "TOOL.toml",
            "palpate.mechanics.recording.calibration:TOOL",
        ),
    ] = None,
    rigid: Annotated[bool, option("the presses are on a rigid plate")] = False,
    modulus_pa: Annotated[
        float | None,
        option(
            "the presses are on an object of this Young's modulus, traced or of a given geometry", unit="Pa"
        ),
    ] = None,
    poisson_ratio: Annotated[float | None, option("Poisson's ratio of the object; None: 0.49")] = None,
    trust: Annotated[
        str,
        option(
            "which is taken as right where a common factor stays open: the tip's radius or the sensor's gain",
            choices=("tip", "gain"),
        ),
    ] = "tip",
    seed: Seed = 0,
    geometry: Given[GeometryOptions],
    call: Call,
) -> Calibration:
    """The instrument, from presses on something known: tool's stiffness, sensor, bias, delay, play.

    Lengths m, moduli Pa. Raises OptionError unless one of rigid and modulus_pa is given, ContactError or
    DiagnosisError where presses are too few.
    """
    from palpate.diagnosis.calibrate.on_object import calibrate_on_object
    from palpate.diagnosis.calibrate.on_plate import calibrate_on_plate
    from palpate.reconstruction.geometry.stated import nowhere
    from palpate.reconstruction.steps.s3_contacts.contacts import explore

    if rigid == (modulus_pa is not None):
        raise OptionError("give what was pressed: either rigid (--rigid) or modulus_pa (--modulus PA)")
    if modulus_pa is not None and not modulus_pa > 0:
        raise OptionError(f"modulus_pa is {modulus_pa}; it must be greater than 0 Pa")
    measured = read_recording(recording)
    with call.progress("calibrate") as show_progress:
        if modulus_pa is None:
            found = explore(measured, boundary=nowhere(measured), unbroken=True)
            result = calibrate_on_plate(found)
        else:
            made = reconstruct(
                measured,
                poisson_ratio=poisson_ratio,
                seed=seed,
                progress=lambda s, x: show_progress(s, 0.3 * x),
                **geometry,
            )
            result = calibrate_on_object(
                measured, made.model, modulus_pa, trust=trust, seed=seed,
                progress=lambda s, x: show_progress(s, 0.3 + 0.7 * x),
            )  # fmt: skip
    if save is None:
        call.then("next: keep it for recordings: --save TOOL.toml")
    else:
        result.save(save)
        key = f'under [tool] in a recording\'s .toml: calibration = "{save}"'
        call.then(f"written: {save}", f"next: let recordings be read by it, {key}")
    return result
