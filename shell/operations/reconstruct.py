"""Make a model from a recording: contacts, base, surface, tetrahedra, modulus, 1D models of every press.

REC is a recording's .csv, .csv.gz or .toml. MODEL is a folder: model.toml, mesh.vtu (ParaView opens it),
palpations.csv. Lengths in m, forces in N, moduli in Pa. Exit code 1, with all files written, if the
model is not reliable: the first touches do not lie on the known shape, or the model predicts held-out places
worse than a constant force does.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from palpate.operations._call import Call, report_words
from palpate.operations._declare import operation, option
from palpate.operations._shared import MODEL, RecordingArgument, Seed, TipForm, report_option, save_option
from palpate.operations.read_recording import read_recording
from palpate.output import progress_bar
from palpate.reconstruction.pipeline import ReconstructOptions

if TYPE_CHECKING:
    from palpate.reconstruction.pipeline import Reconstruction


@operation(common="method poisson_ratio mesh_size_m surface contact_threshold_n indentation_m shape slab_m")
def reconstruct(
    recording: RecordingArgument,
    *,
    save: Annotated[
        str | Path | None, save_option("folder of the model to write", "MODEL", MODEL, needed=True)
    ] = None,
    tip: TipForm = None,
    seed: Seed = 0,
    report: Annotated[
        str | None, report_option("write the paper's figures and table, remade; PNGs into HTML's folder")
    ] = None,
    beside: Annotated[
        Sequence[str],
        option(
            "with --report: another model to draw next to this one (repeatable)",
            metavar="MODEL",
            reads=True,
            count="repeat",
            only="command",
            advanced=True,
        ),
    ] = (),
    options: ReconstructOptions,
    call: Call,
) -> Reconstruction:
    """A recording becomes a model: contacts, base, surface, tetrahedra, Young's modulus, 1D models.

    What is computed for the model later is kept in the folder `save` too. The result goes wherever a model
    goes; its `doubt` says why it is not reliable, '' where nothing speaks against it. Lengths m, forces
    N. Raises OptionError, ContactError, SurfaceError or MeshError.
    """
    from palpate.importing.tip_form import ask_of_presses, with_tip
    from palpate.mechanics.model.files import read_model
    from palpate.reconstruction.pipeline import reconstruct_fully
    from palpate.render.surface.felt_surface import felt_surface

    for name in beside:
        read_model(name)  # before the work
    read = read_recording(recording)
    if tip is not None:
        read = with_tip(read, tip)
    with call.progress("reconstruct") as show_progress:
        ask_of_presses(read, options.geometry)
        made = reconstruct_fully(read, options, show_progress, call.out.say)
    if save is not None:
        made = dataclasses.replace(made, model=made.model.save(save))
        felt_surface(made.model, made.sites)
    call.then(f"written to {save}")
    if report:
        call.then(partial(_reported, made, report, beside))
    call.figures = {"model": save}
    call.exit_code = 1 if made.doubt else 0
    return made


def _reported(made: Reconstruction, page: str, beside: Sequence[str]) -> list[str]:
    """Where the page is that was written, with models beside."""
    from palpate.mechanics.compliance.stored_compliance import load_or_condense
    from palpate.mechanics.model.files import read_model

    models = {Path(name).name: read_model(name) for name in beside}
    with progress_bar("report") as show_progress:
        load_or_condense(made.model, show_progress)  # the report's object can be pressed
    return [report_words(made.report(page, models))]
