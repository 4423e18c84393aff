"""What a worker does with one recording: the operations themselves, and files beside one another.

FOLDER/model is the MODEL, FOLDER/STEP.json what `--json` of the command gives, FOLDER/STEP.html its report,
FOLDER/thumbnail.png the object. Each returns what the summary needs.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.batching.plan import MODEL, STEPS, THUMBNAIL, content_of
from palpate.mechanics.disk.writing import PNG, atomic_file
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.recording.recording import Recording
from palpate.operations.read_recording import read_recording
from palpate.output import emit_json
from palpate.schemas import labelled


@dataclass(frozen=True)
class Planned:
    """What a step was planned with; sha256: of the recording's files then."""

    sha256: Mapping[str, str]
    options: Mapping[str, Any]
    seed: int
    reports: bool
    recording: str
    shape: str
    folder: str

    @property
    def place(self) -> Path:
        """Where this recording's results go."""
        return Path(self.folder)

    def read(self) -> Recording:
        """The recording, which must still be the one that was planned for."""
        if content_of(self.recording, self.shape) != dict(self.sha256):
            raise RecordingError(f"'{self.recording}' changed after the batch began: run it again")
        return read_recording(self.recording)


def reconstruct(**planned: Any) -> dict[str, Any]:
    """The model. What an older model gave is removed first."""
    from palpate.operations.reconstruct import reconstruct

    plan = Planned(**planned)
    place = plan.place
    for step in STEPS[1:]:
        for name in (f"{step}.json", f"{step}.html"):
            (place / name).unlink(missing_ok=True)
    measured = plan.read()
    given = {**plan.options, **({"shape": plan.shape} if plan.shape else {})}
    result = reconstruct(measured, save=place / MODEL, seed=plan.seed, progress=False, **given)
    figures = {"model": place / MODEL, **result.as_json()}
    emit_json(labelled("reconstruct", figures), str(place / "reconstruct.json"))
    with _closing_figures():
        _draw_thumbnail(result.model, place / THUMBNAIL)
        if plan.reports:
            result.report(place / "reconstruct.html")
    about = measured.description.get("object", {})
    return {
        "object": about.get("name"),
        "presses": len(result.model.presses),
        "young_modulus_pa": result.young_modulus_pa,
        "young_modulus_ci95_pa": result.young_modulus_ci95_pa,
        "doubt": result.doubt,
    }


def compare(**planned: Any) -> dict[str, Any]:
    """FEM against the 1D models, on the model's geometry."""
    from palpate.operations.compare import compare

    plan = Planned(**planned)
    result = compare(plan.read(), plan.place / MODEL, seed=plan.seed, progress=False, **plan.options)
    _written(plan, "compare", result, result.as_json())
    return {"rmse_n": result.rmse_n, "relative_rmse": result.relative_rmse}


def diagnose(**planned: Any) -> dict[str, Any]:
    """The gap, its cause, and how far it shrinks."""
    from palpate.operations.diagnose import diagnose

    plan = Planned(**planned)
    result = diagnose(plan.read(), plan.place / MODEL, seed=plan.seed, progress=False, **plan.options)
    found = result.as_json()
    _written(plan, "diagnose", result, found)
    keys = ("noise_n", "gap_before_n", "gap_after_n", "gap_closed")
    return {**found["verdict"], **{key: found[key] for key in keys}}


def _written(plan: Planned, step: str, result: Any, figures: Mapping[str, Any]) -> None:
    emit_json(labelled(step, dict(figures)), str(plan.place / f"{step}.json"))
    with _closing_figures():
        if plan.reports:
            result.report(plan.place / f"{step}.html")


def _draw_thumbnail(model: Any, path: Path) -> None:
    from matplotlib.figure import Figure

    from palpate.show.scenery import draw_object

    figure = Figure(figsize=(1.6, 1.2))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    draw_object(ax, model, touches=model.presses.point)
    ax.set_axis_off()
    with atomic_file(path, PNG) as temporary:
        figure.savefig(temporary, dpi=150, format="png", transparent=True)


@contextlib.contextmanager
def _closing_figures() -> Iterator[None]:
    """A worker lives long: pictures of one recording are not kept for the next."""
    from matplotlib import pyplot

    try:
        yield
    finally:
        pyplot.close("all")
