"""How far simulation and measurement are apart, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mechanics.progress import Progress
from palpate.api.models import load, reconstruct
from palpate.api.reading import read_recording
from palpate.api.telling import told
from palpate.keywords import taken

if TYPE_CHECKING:
    from diagnose.compare.before_after import Changes
    from diagnose.compare.comparison import Comparison
    from diagnose.verdict.result import Diagnosis
    from palpate.api.telling import ModelLike, RecordingLike


def compare(
    recording: RecordingLike,
    model: ModelLike | None = None,
    *,
    seed: int = 0,
    progress: bool | Progress = True,
    **options: Any,
) -> Comparison:
    """FEM against the interpolated 1D models, on presses and regions that no fit has seen; errors N rms.

    model: only its geometry is used, every parameter is refitted in each fold; without one the recording is
    reconstructed. options: see `pp.options("compare")`. Raises ContactError for fewer sites than two.
    """
    from diagnose.compare.comparison import CompareOptions
    from diagnose.compare.comparison import compare as compared

    chosen = CompareOptions(**taken("compare", options)[CompareOptions])
    measured = read_recording(recording)
    with told("compare", progress) as tell:
        plain = None if model is None else load(model, progress=tell)
        return compared(measured, plain, chosen, seed=seed, progress=tell)


def changes(
    before: RecordingLike,
    after: RecordingLike,
    *,
    diagnosed: bool = True,
    fast: bool = True,
    seed: int = 0,
    progress: bool | Progress = True,
    **options: Any,
) -> Changes:
    """Two recordings of one object, before and after or with two tools: moduli, their difference, what
    explains it.

    Each is reconstructed and, where diagnosed, diagnosed (fast: fewer effects); the moduli, Pa, are compared
    with their intervals, and place by place where the two share a frame. options: of both reconstructions,
    see `pp.options("changes")`, m. Raises what `reconstruct` and `diagnose` raise.
    """
    from diagnose.compare.before_after import Side
    from diagnose.compare.before_after import changes as weighed

    taken("changes", options)
    sides = []
    both = read_recording(before), read_recording(after)  # a name that is wrong is told at once
    with told("changes", progress) as tell:
        for k, measured in enumerate(both):

            def step(words: str, share: float, k: int = k) -> None:
                tell(words, 0.5 * k + 0.5 * share)

            made = reconstruct(measured, seed=seed, progress=lambda s, x: step(s, 0.4 * x), **options)
            found = None
            if diagnosed:
                found = diagnose(
                    measured, made, fast=fast, seed=seed, progress=lambda s, x: step(s, 0.4 + 0.6 * x)
                )
            sides.append(Side(measured, made.model, found))
    return weighed(*sides)


def diagnose(
    recording: RecordingLike,
    model: ModelLike | None = None,
    *,
    fast: bool = False,
    seed: int = 0,
    progress: bool | Progress = True,
    **options: Any,
) -> Diagnosis:
    """The sim-to-real gap: where simulated and measured force differ, which effect was left out, how far the
    gap shrinks with it on places that were not fitted; N rms.

    model: of this recording or of another of the same object; without one the recording is reconstructed.
    fast: fewer effects, one in an answer. options: see `pp.options("diagnose")`. Raises DiagnosisError where
    the data cannot carry it.
    """
    from diagnose.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
    from diagnose.pipeline import diagnose as diagnosed
    from reconstruct.placing import presses_on

    given = taken("diagnose", {"fast": fast, "seed": seed, **({"most": 1} if fast else {}), **options})
    measured = read_recording(recording)
    with told("diagnose", progress) as tell:
        if model is None:
            made = reconstruct(measured, progress=lambda s, x: tell(f"model: {s}", 0.3 * x)).model
            begun = 0.3
        else:
            plain = load(model, progress=tell)
            made, begun = plain.replaced(presses=presses_on(measured, plain)), 0.0
        return diagnosed(
            measured,
            made,
            DiagnoseOptions(**given[DiagnoseOptions]),
            lambda s, x: tell(s, begun + (1 - begun) * x),
            nuisance=NuisanceOptions(**given[NuisanceOptions]),
            attribution=AttributionOptions(**given[AttributionOptions]),
        )
