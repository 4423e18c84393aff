"""A recording becomes a model: contacts, base, surface, tetrahedra, modulus, 1D models of every press.

REC is a recording's .csv, .csv.gz or .toml. MODEL is a folder: model.toml, mesh.vtu (ParaView opens it),
palpations.csv. Lengths in m, forces in N, moduli in Pa. Exit code 1, with everything written, where the
answer is not to be believed: a known shape that the first touches do not lie on, or places that were held
out and are predicted worse than by a constant push.
"""

from __future__ import annotations

import dataclasses
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.operations._declare import Call, operand, operation
from palpate.operations._run import report_words, say_next
from palpate.operations._shared import MODEL, recording_operand, report_operand, save_operand, seed_operand
from palpate.operations.read_recording import read_recording
from palpate.output import Output, progress_bar
from palpate.reconstruction.geometry.stated import GeometryOptions
from palpate.reconstruction.pipeline import ReconstructOptions
from palpate.reconstruction.steps.s1_filter.noise import FilterOptions
from palpate.reconstruction.steps.s2_base import BoundaryOptions
from palpate.reconstruction.steps.s3_contacts.contacts import ContactOptions
from palpate.reconstruction.steps.s4_surface import SurfaceOptions
from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusOptions
from palpate.reconstruction.steps.s7_modulus.modulus_field import FieldOptions
from palpate.reconstruction.steps.s7_modulus.modulus_paper import PaperOptions

if TYPE_CHECKING:
    from palpate.operations._shared import RecordingLike
    from palpate.reconstruction.pipeline import Reconstruction

_STEPS: tuple[type, ...] = (
    GeometryOptions,
    FilterOptions,
    BoundaryOptions,
    ContactOptions,
    SurfaceOptions,
    MeshingOptions,
    ModulusOptions,
    FieldOptions,
    PaperOptions,
)


@dataclass(frozen=True)
class ReconstructOperands:
    """What is reconstructed, and where the model goes."""

    recording: RecordingLike = recording_operand()
    _: KW_ONLY
    save: str | Path | None = save_operand("folder of the model to write", "MODEL", MODEL, needed=True)
    seed: int = seed_operand()
    report: str | None = report_operand(
        "write the paper's figures and table, remade; PNGs into HTML's folder"
    )
    beside: list[str] = operand(
        (),
        "with --report: another model to draw beside (repeatable)",
        metavar="MODEL",
        reads=True,
        count="repeat",
        only="command",
        rare=True,
    )


def _answer(result: Reconstruction, asked: ReconstructOperands, out: Output) -> int:
    from palpate.mechanics.compliance.stored_compliance import load_or_condense
    from palpate.mechanics.model.files import read_model

    out.say(*result.lines(), f"written to {asked.save}")
    if asked.report:
        beside = {Path(name).name: read_model(name) for name in asked.beside}
        with progress_bar("report") as tell:
            load_or_condense(result.model, tell)  # the report's object can be pressed
        out.say(report_words(result.report(asked.report, beside)))
    say_next(result, out)
    out.json({"model": asked.save, **result.as_json()})
    return 1 if result.doubt else 0


@operation(
    ReconstructOperands,
    ReconstructOptions,
    *_STEPS,
    often="method poisson_ratio mesh_size_m surface contact_threshold_n indentation_m shape slab_m",
    answer=_answer,
)
def reconstruct(asked: ReconstructOperands, call: Call) -> Reconstruction:
    """A recording becomes a model: contacts, base, surface, tetrahedra, Young's modulus, 1D models.

    What is computed for the model later is kept in the folder `save` too. The result goes wherever a model
    goes; its `doubt` says why it is not to be believed, '' where nothing speaks against it. Lengths m, forces
    N. Raises OptionError, ContactError, SurfaceError or MeshError.
    """
    from palpate.mechanics.model.files import read_model
    from palpate.reconstruction.pipeline import reconstruct_fully
    from palpate.render.surface.felt_surface import felt_surface

    for name in asked.beside:
        read_model(name)  # before the work
    steps: dict[str, Any] = {
        field.name: call.of(kind)
        for field in dataclasses.fields(ReconstructOptions)
        for kind in _STEPS
        if field.default_factory is kind and call.values(kind)
    }
    chosen = call.of(ReconstructOptions, **steps, seed=asked.seed)
    with call.progress("reconstruct") as tell:
        made = reconstruct_fully(read_recording(asked.recording), chosen, tell, call.out.say)
    if asked.save is not None:
        made = dataclasses.replace(made, model=made.model.save(asked.save))
        felt_surface(made.model, made.sites)
    return made
