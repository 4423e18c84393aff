"""Instruments, machines' curves, the virtual laboratory, and many recordings at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanics.errors import OptionError
from mechanics.progress import Progress
from palpate.api.models import reconstruct
from palpate.api.reading import read_recording
from palpate.api.telling import told
from palpate.keywords import taken

if TYPE_CHECKING:
    from diagnose.specimen.result import Material
    from mechanics.calibration import Calibration
    from palpate.api.telling import RecordingLike
    from palpate.batching.run import Batch
    from scenes.laboratory.simulate import Simulation
    from scenes.phantoms import Phantom


def calibrate(
    recording: RecordingLike,
    *,
    rigid: bool = False,
    modulus_pa: float | None = None,
    poisson_ratio: float | None = None,
    trust: str = "tip",
    save: str | Path | None = None,
    seed: int = 0,
    progress: bool | Progress = True,
    **options: Any,
) -> Calibration:
    """The instrument, from presses on something known: tool's stiffness, sensor, bias, delay, play.

    rigid: on a rigid plate; or modulus_pa and poisson_ratio of an object that the recording traces, or whose
    geometry options give, see `pp.options("calibrate")`, m. trust: where a common factor is left, "tip"
    gives it to the sensor, "gain" to the tip's radius. save: TOOL.toml to write, which recordings may name.
    Raises OptionError unless one of rigid and modulus_pa is given, ContactError or DiagnosisError where
    presses are too few.
    """
    from diagnose.calibrate.on_object import calibrate_on_object
    from diagnose.calibrate.on_plate import calibrate_on_plate
    from reconstruct.geometry.placed import nowhere
    from reconstruct.steps.s3_contacts.contacts import explore

    taken("calibrate", options)
    if rigid == (modulus_pa is not None):
        raise OptionError(
            "say on what it was pressed: rigid (--rigid), or modulus_pa (--modulus PA), one of them"
        )
    if modulus_pa is not None and not modulus_pa > 0:
        raise OptionError(f"modulus_pa is {modulus_pa}; it must be greater than 0 Pa")
    measured = read_recording(recording)
    with told("calibrate", progress) as tell:
        if modulus_pa is None:
            found = explore(measured, boundary=nowhere(measured), unbroken=True)
            result = calibrate_on_plate(measured, found)
        else:
            made = reconstruct(
                measured,
                poisson_ratio=poisson_ratio,
                seed=seed,
                progress=lambda s, x: tell(s, 0.3 * x),
                **options,
            )
            result = calibrate_on_object(
                measured, made.model, modulus_pa, trust=trust, seed=seed,
                progress=lambda s, x: tell(s, 0.3 + 0.7 * x),
            )  # fmt: skip
    if save is not None:
        result.save(save)
    return result


def material(
    *files: str | Path,
    kind: str = "auto",
    tip_radius_m: float | None = None,
    layer_m: float | None = None,
    poisson_ratio: float = 0.49,
    specimens: bool = False,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    fast: bool = False,
    seed: int = 0,
    progress: bool | Progress = True,
) -> Material:
    """The material of a specimen from a machine's curves: indentation, compression, tension or relaxation.

    files: a curve each. kind: "auto" goes by their headers. tip_radius_m: of an indenter's sphere, where the
    files do not say; layer_m: thickness of the sample, None is a half-space; specimens: each indentation is
    of another piece. columns {"t", "z", "fz": name}, units {kind: unit}: where names do not tell.
    poisson_ratio: of the sample; fast: fewer effects are tried. From 6
    indentations on, effects are searched for as `diagnose` does, each curve held out (docs/real-data.md).
    Raises RecordingError where a file cannot be read, ContactError where nothing is touched.
    """
    from diagnose.specimen.material import material_of
    from palpate.importing.specimens import read_tests

    tests = read_tests(
        files, kind=kind, tip_radius_m=tip_radius_m, columns=dict(columns or {}), units=dict(units or {})
    )
    with told("material", progress) as tell:
        return material_of(
            tests,
            files,
            layer_m=layer_m,
            poisson_ratio=poisson_ratio,
            specimens=specimens,
            fast=fast,
            seed=seed,
            progress=tell,
        )


def simulate(
    phantom: str | Path | Phantom,
    effects: Mapping[str, float] | None = None,
    *,
    seed: int = 0,
    save: str | Path | None = None,
    person: int = 0,
    sizes: bool = True,
    ideal: bool = False,
    workers: int | None = None,
    progress: bool | Progress = True,
    **options: Any,
) -> Simulation:
    """The virtual laboratory: a person explores a phantom, and what a device would have read is written down.

    phantom: a name ("cylinder", "block", "half-sphere", "bean", "dome", "wedge", "bowl") or a closed STL, PLY
    or VTU surface, m. effects: name to strength, 1 is the table's in docs/laboratory.md; none is the ideal
    model. save: NAME.csv.gz to write, with the truth in NAME.toml. person: whose hand, 0 the average. sizes:
    state each effect's size in N, which solves without it too; ideal: also what the ideal object would
    answer. workers: processes, one a core by default. options: see `pp.options("simulate")`. Solved touches
    are kept in the user's cache. Raises OptionError or SceneError.
    """
    from mechanics.files import check_target
    from mechanics.recording import SAMPLES
    from scenes.laboratory.hand import HandOptions, cohort_hand
    from scenes.laboratory.simulate import SimulateOptions
    from scenes.laboratory.simulate import simulate as simulated
    from scenes.phantoms import Phantom
    from scenes.phantoms import phantom as named

    given = taken("simulate", options)
    for name, value, least in (("seed", seed, 0), ("person", person, 0), ("workers", workers, 1)):
        if value is not None and not least <= value < 1 << 63:
            raise OptionError(f"{name} is {value}; it must be a whole number, {least} or greater")
    if save is not None:
        check_target(save, SAMPLES)
    thing = phantom if isinstance(phantom, Phantom) else named(phantom)
    with told("simulate", progress) as tell:
        result = simulated(
            thing,
            effects,
            SimulateOptions(**given[SimulateOptions]),
            hand=dataclasses.replace(cohort_hand(person), **given[HandOptions]),
            seed=seed,
            sizes=sizes,
            ideal=ideal,
            workers=workers,
            progress=tell,
        )
    return result if save is None else result.save(save)


def batch(
    recordings: str | Path | Iterable[str | Path],
    out: str | Path,
    *,
    do: str | Sequence[str] = ("reconstruct", "compare", "diagnose"),
    options: Mapping[str, Mapping[str, Any]] | None = None,
    reports: bool = True,
    workers: int | None = None,
    memory_gb: float | None = None,
    scheduler: str | None = None,
    force: bool = False,
    seed: int = 0,
    progress: bool | Progress = True,
) -> Batch:
    """Many recordings at once, in processes of one thread each or by a Dask cluster: a folder each in `out`.

    recordings: folders (and all below), patterns, files. do: steps; the others need "reconstruct". options:
    step -> keywords of its function, {"diagnose": {"fast": True}}; lengths m, forces N. reports: HTML pages
    of every step. workers: processes, one a core by default; memory_gb: that they may take together, 90 % of
    what is free by default; scheduler: "tcp://HOST:8786" of a cluster, in their place. What is finished is
    recognised by the recording's bytes, options and version, unless force. One bad recording stops no other:
    its row has the reason. Raises OptionError.
    """
    from palpate.batching.plan import Choice
    from palpate.batching.run import batch as run

    steps = tuple(do.split(",")) if isinstance(do, str) else tuple(do)
    return run(
        [recordings] if isinstance(recordings, str | Path) else recordings,
        out,
        Choice(steps, options, seed, reports),
        workers=workers,
        memory_bytes=None if memory_gb is None else int(1e9 * memory_gb),
        scheduler=scheduler,
        force=force,
        progress=progress,
    )
