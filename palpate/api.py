"""The functions behind `import palpate as pp`, which the commands call too: one way to do a thing.

A recording may be given as what `read_recording` returned, a simulation, a file or an embedded name; a model
as what `load` or `reconstruct` returned, a MODEL folder or a scene. SI units; device frame; forces on the
tool. What a room needs is imported when its function is called.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanics.errors import OptionError
from mechanics.progress import Progress, silent
from palpate.keywords import taken

if TYPE_CHECKING:
    import mechanics.model
    import mechanics.recording
    from mechanics.presses import Presses
    from palpate.results.batch import Batch
    from palpate.results.calibration import Calibration
    from palpate.results.changes import Changes
    from palpate.results.check import Checkup
    from palpate.results.comparison import Comparison
    from palpate.results.curve import Curve
    from palpate.results.diagnosis import Diagnosis
    from palpate.results.imported import Imported
    from palpate.results.material import Material
    from palpate.results.model import Model
    from palpate.results.reconstruction import Reconstruction
    from palpate.results.recording import Recording
    from palpate.results.replay import ReplayResult
    from palpate.results.simulation import Simulation
    from render.base import Renderer
    from render.options import RenderOptions
    from render.scene import TouchScene
    from scenes.phantoms import Phantom
    from scenes.scene import Scene

    RecordingLike = str | Path | mechanics.recording.Recording | Simulation
    ModelLike = str | Path | mechanics.model.Model | Reconstruction | Scene


def read_recording(source: RecordingLike) -> Recording:
    """Read a recording: NAME.csv, NAME.csv.gz or NAME.toml, or an embedded one by its name.

    source: the file, or "silicone-1-cylinder". Times s, positions of the tip's centre m, forces on the tool
    N, device frame (docs/recording-format.md). Raises RecordingError for what is missing or impossible.
    """
    from mechanics.errors import RecordingError
    from mechanics.recording import Recording as Plain
    from mechanics.recording import read_recording as read
    from palpate.results.recording import recording_of
    from scenes.embedded import embedded_names, embedded_recording

    if isinstance(source, Plain):
        return recording_of(source)
    held = getattr(source, "recording", None)
    if isinstance(held, Plain):
        return recording_of(held)
    if str(source) in embedded_names():
        return recording_of(read(embedded_recording(str(source))))
    if not isinstance(source, str | Path):
        raise OptionError(f"a {type(source).__name__} is no recording: give one, or the path of its file")
    try:
        return recording_of(read(source))
    except RecordingError as error:
        if Path(source).exists() or "." in Path(source).name:
            raise
        raise RecordingError(f"{error}; embedded are {', '.join(embedded_names())}") from error


def check(recording: RecordingLike, *, full: bool = False, progress: bool | Progress = True) -> Checkup:
    """What may be wrong with a recording: units, axes, channels, clock, traced base, presses (docs/check.md).

    full: reconstruct it too, some 20 s, and check its modulus. The result has findings, the gravest first,
    each with a stretch in s; `reconstruct` refuses what is grave. Raises RecordingError for what is no
    recording, and what `reconstruct` raises with `full`.
    """
    from palpate.results.check import Checkup
    from reconstruct.checks.registry import looked_at
    from reconstruct.pipeline import ReconstructOptions, reconstruct_fully

    measured = read_recording(recording)
    with _told("check", progress) as tell:
        findings, seen = looked_at(measured)
        if full and not any(f.grave for f in findings):
            findings = reconstruct_fully(measured, ReconstructOptions(force=True), tell).findings
    return Checkup(measured, findings, seen, full)


def import_table(*files: str | Path, mapping: str | Path | None = None, **said: Any) -> Imported:
    """What other programs' files hold, as a recording: CSV, TSV, text, NumPy, MATLAB, HDF5, Parquet, ROS
    bag, MCAP.

    mapping: a TOML file that says what the columns are (docs/import-export.md); said: the same by keyword,
    which count before it: columns {role: name}, units {kind: unit}, tip_radius_m, force_on ("tool",
    "object"), frame ("device", "tool"), rotation (3, 3), flange_to_tip_m (3,), mass_kg, tare_s (start,
    end), offset_s, rate_hz, thing (what [object] of the recording is to say). The recording is in m, s and N,
    forces on the tool. Raises RecordingError where something needed is missing.
    """
    import dataclasses as classes

    from palpate.importing.convert import understand
    from palpate.importing.mapping import Said, read_mapping
    from palpate.importing.tables import read_tables
    from palpate.results.imported import Imported

    held = {} if mapping is None else read_mapping(mapping)
    for key, value in said.items():
        merged = isinstance(value, Mapping) and isinstance(held.get(key), Mapping)
        held[key] = {**held[key], **value} if merged else value
    allowed = [field.name for field in classes.fields(Said)]
    strange = sorted(set(held) - set(allowed))
    if strange:
        raise OptionError(f"pp.import_table has no option '{strange[0]}': allowed are {', '.join(allowed)}")
    if not files:
        raise OptionError("pp.import_table needs a file")
    chosen = Said(**held)
    tables = [table for file in files for table in read_tables(file)]
    understood = understand(tables, chosen, Path(files[0]).name.split(".")[0])
    return Imported(understood, chosen.thing, tuple(Path(file).name for file in files))


def read_table(*files: str | Path, mapping: str | Path | None = None, **said: Any) -> Recording:
    """The recording in other programs' files, in m, s and N; files, mapping and said are as for
    `import_table`, which also tells and draws what it understood. Raises RecordingError."""
    return import_table(*files, mapping=mapping, **said).recording


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
    from palpate.materials import material_of
    from palpate.specimens import read_tests

    tests = read_tests(
        files, kind=kind, tip_radius_m=tip_radius_m, columns=dict(columns or {}), units=dict(units or {})
    )
    with _told("material", progress) as tell:
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


def load(source: ModelLike, *, progress: bool | Progress = True) -> Model:
    """The model of a MODEL folder; or of a scene, which is built the first time and then kept.

    source: a folder that `reconstruct` wrote; the name of a scene ("demo", "nodule", "bean", ...), a scene's
    .toml, a phantom ("cylinder", ..., or a closed surface as STL, PLY or VTU in m), or a recording, which is
    then reconstructed. progress: True draws a bar where stderr is a terminal. Raises ModelError or SceneError
    where there is none.
    """
    from mechanics.model import Model as Plain
    from mechanics.model import read_model
    from palpate.results.model import model_of
    from scenes.build import model_of as scene_model
    from scenes.scene import Scene, load_scene

    if isinstance(source, Plain):
        return model_of(source)
    held = getattr(source, "model", None)
    if isinstance(held, Plain):
        return model_of(held)
    if isinstance(source, str | Path):
        if Path(source).is_dir():
            return model_of(read_model(source))
        source = load_scene(source)
    if not isinstance(source, Scene):
        raise OptionError(f"a {type(source).__name__} is no model: give one, a MODEL folder or a scene")
    with _told("load", progress) as tell:
        return model_of(scene_model(source, tell))


def model_of(
    shape: Any,
    young_modulus_pa: float | None = None,
    *,
    unit: str = "m",
    up: str = "+z",
    sink_m: float = 0.0,
    poisson_ratio: float | None = None,
    tip_radius_m: float | None = None,
    mesh_size_m: float | None = None,
    save: str | Path | None = None,
    progress: bool | Progress = True,
) -> Model:
    """The model of an object whose shape is known, in the frame of its file.

    shape: an STL, OBJ, PLY, glTF, VTP, VTU, MSH or INP file with lengths in `unit` ("m", "cm", "mm", "um",
    "in"), or a triangle mesh with `vertices` and `faces` (trimesh's). young_modulus_pa: None takes 20 kPa.
    up: out of the support, "+z", "-x", ... or "X,Y,Z" in the file's frame; sink_m: cut off flat at the
    bottom. poisson_ratio: None takes 0.49; tip_radius_m: 5 mm; mesh_size_m: 10 mm, or an eighth of the
    object. save: MODEL folder to write. Raises SurfaceError where the surface is open or has no flat foot.
    """
    from dataclasses import replace as changed

    from mechanics.files import check_target
    from mechanics.model import MODEL
    from palpate.results.model import model_of as dressed_model
    from scenes.build import model_of_mesh
    from scenes.scene import Scene

    if save is not None:
        check_target(save, MODEL)
    scene = Scene("mesh", "mesh", "", unit=unit, up=up, sink_m=sink_m, mesh_size_m=mesh_size_m)
    scene = changed(
        scene, young_modulus_pa=young_modulus_pa, poisson_ratio=poisson_ratio, tip_radius_m=tip_radius_m
    )
    for name in ("young_modulus_pa", "tip_radius_m", "mesh_size_m"):
        value = getattr(scene, name)
        if value is not None and not value > 0:
            raise OptionError(f"{name} is {value}; it must be greater than 0")
    with _told("model", progress) as tell:
        made = dressed_model(model_of_mesh(shape, scene, tell))
    return made if save is None else made.save(save)


def reconstruct(
    recording: RecordingLike,
    *,
    method: str = "finite-tip",
    save: str | Path | None = None,
    seed: int = 0,
    progress: bool | Progress = True,
    **options: Any,
) -> Reconstruction:
    """A recording becomes a model: contacts, base, surface, tetrahedra, Young's modulus, 1D models.

    method: "finite-tip", or "paper" for Goksel et al.'s own. save: MODEL folder to write, where what is
    computed for the model later is kept too. options: see `pp.options("reconstruct")`; lengths m, forces N.
    The result goes wherever a model goes. Raises OptionError, ContactError, SurfaceError or MeshError.
    """
    from mechanics.files import check_target
    from mechanics.model import MODEL, write_model
    from palpate.results.reconstruction import reconstruction_of
    from reconstruct.pipeline import ReconstructOptions, reconstruct_fully
    from render.felt import felt_surface

    given = taken("reconstruct", {"method": method, **options})
    if save is not None:
        check_target(save, MODEL)
    steps: dict[str, Any] = {
        field.name: kind(**values)
        for field in dataclasses.fields(ReconstructOptions)
        for kind, values in given.items()
        if field.default_factory is kind
    }
    chosen = ReconstructOptions(**given[ReconstructOptions], **steps, seed=seed)
    with _told("reconstruct", progress) as tell:
        result = reconstruct_fully(read_recording(recording), chosen, tell)
    made = reconstruction_of(result, None if save is None else write_model(save, result.model))
    if save is not None:
        felt_surface(made.model, made.sites)
    return made


def renderer(
    model: ModelLike | Renderer, name: str = "fem", *, progress: bool | Progress = True, **options: Any
) -> Renderer:
    """The renderer of a model: `state = r.start()`, then `state, forces = r.step(state, tips)` at 1 kHz.

    tips (m, 3) m are the tips' centres, forces (m, 3) N act on the tool; device frame. name: "fem",
    "kelvin-voigt", "hunt-crossley", "hunt-crossley-undamped" or "hunt-crossley-kh". The model's compliance is
    computed, some seconds, or read from its folder. options: see `pp.options("renderer")`. Raises
    OptionError.
    """
    make = _renderer("renderer", model, name, options)
    with _told("renderer", progress) as tell:
        return make(tell).renderer


def replay(
    model: ModelLike | Renderer,
    recording: RecordingLike,
    renderer: str = "fem",
    *,
    progress: bool | Progress = True,
    **options: Any,
) -> ReplayResult:
    """Feed a recorded tip path to a renderer and compare its force with the measured one.

    model: or a renderer that is there already. The result has t (n,) s, force_n (n, 3) N on the tool, the
    mask `contact`, and the error rmse_n, N, over it. The same input gives the same bits. options: see
    `pp.options("replay")`. Raises OptionError.
    """
    from palpate.results.model import model_of
    from palpate.results.replay import ReplayResult
    from reconstruct.points import is_points
    from render.replay import replay_error, replay_recording

    make = _renderer("replay", model, renderer, options)
    measured = read_recording(recording)
    if is_points(measured):
        raise OptionError(
            f"'{measured.name}' holds points without a time, and a replay needs a path: reconstruct, compare "
            "and diagnose read points"
        )
    with _told("replay", progress) as tell:
        scene = make(tell)
        forces = replay_recording(scene, measured, tell)
    error = replay_error(measured, _touched(measured, scene.model), forces)
    return ReplayResult(
        recording=measured,
        model=model_of(scene.model),
        renderer=scene.renderer.name,
        t=measured.t,
        force_n=forces,
        contact=error.contact,
        rmse_n=error.rmse_n,
        force_rms_n=error.force_rms_n,
        relative=error.relative,
    )


def press(
    model: ModelLike | Renderer,
    at: Sequence[float],
    direction: Sequence[float] | None = None,
    depth_m: float = 0.004,
    speed_m_per_s: float = 0.01,
    *,
    hold_s: float = 0.0,
    approach_m: float = 2e-3,
    rate_hz: float = 1000.0,
    tip_radius_m: float | None = None,
    renderer: str = "fem",
    progress: bool | Progress = True,
    **options: Any,
) -> Curve:
    """One scripted press: the force response of a model at one place.

    model: or a renderer that is there already, which saves seconds where many presses follow. at: (3,) m, the
    point that the tip's centre is aimed at; direction: (3,) of the motion, any length, None is straight onto
    the support; device frame. depth_m: along the surface's normal after first touch; speed_m_per_s, hold_s:
    of the motion and at depth; approach_m: of free air before; rate_hz: of the samples; tip_radius_m: None
    takes the model's. options: see `pp.options("press")`. Raises OptionError where the line misses object
    and support, or grazes them.
    """
    import numpy as np

    from palpate.results.base import dressed
    from palpate.results.curve import Curve
    from render.press import press as pressed

    make = _renderer("press", model, renderer, options)
    with _told("press", progress) as tell:
        scene = make(tell)
    along = -scene.model.support.normal if direction is None else np.asarray(direction, dtype=float)
    radius = scene.model.tool.tip_radius_m if tip_radius_m is None else float(tip_radius_m)
    curve = pressed(
        scene,
        np.asarray(at, dtype=float),
        along,
        depth_m,
        speed_m_per_s,
        hold_s=hold_s,
        approach_m=approach_m,
        rate_hz=rate_hz,
        tip_radius_m=radius,
    )
    return dressed(Curve, curve, renderer=scene.renderer, tip_radius_m=radius)


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
    from palpate.comparison import CompareOptions
    from palpate.comparison import compare as compared
    from palpate.results.base import dressed
    from palpate.results.comparison import Comparison
    from palpate.results.model import model_of

    chosen = CompareOptions(**taken("compare", options)[CompareOptions])
    measured = read_recording(recording)
    with _told("compare", progress) as tell:
        plain = None if model is None else load(model, progress=tell)
        result = compared(measured, plain, chosen, seed=seed, progress=tell)
    return dressed(Comparison, result, recording=measured, model=model_of(result.model))


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
    from palpate.before_after import Side
    from palpate.before_after import changes as weighed
    from palpate.results.base import dressed
    from palpate.results.changes import Changes

    taken("changes", options)
    sides = []
    both = read_recording(before), read_recording(after)  # a name that is wrong is told at once
    with _told("changes", progress) as tell:
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
    return dressed(Changes, weighed(*sides))


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
    from diagnose.judging import AttributionOptions
    from diagnose.pipeline import DiagnoseOptions
    from diagnose.pipeline import diagnose as diagnosed
    from diagnose.whiten import NuisanceOptions
    from palpate.results.base import dressed
    from palpate.results.diagnosis import Diagnosis
    from palpate.results.model import model_of
    from reconstruct.placing import presses_on

    given = taken("diagnose", {"fast": fast, "seed": seed, **({"most": 1} if fast else {}), **options})
    measured = read_recording(recording)
    with _told("diagnose", progress) as tell:
        if model is None:
            made = reconstruct(measured, progress=lambda s, x: tell(f"model: {s}", 0.3 * x)).model
            begun = 0.3
        else:
            plain = load(model, progress=tell)
            made, begun = model_of(plain.replaced(presses=presses_on(measured, plain))), 0.0
        result = diagnosed(
            measured,
            made,
            DiagnoseOptions(**given[DiagnoseOptions]),
            lambda s, x: tell(s, begun + (1 - begun) * x),
            nuisance=NuisanceOptions(**given[NuisanceOptions]),
            attribution=AttributionOptions(**given[AttributionOptions]),
        )
    return dressed(Diagnosis, result, recording=measured, model=made)


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
    from diagnose.calibrate import calibrate_on_object, calibrate_on_plate
    from palpate.results.base import dressed
    from palpate.results.calibration import Calibration
    from reconstruct.contacts import explore
    from reconstruct.known_shape import nowhere

    taken("calibrate", options)
    if rigid == (modulus_pa is not None):
        raise OptionError(
            "say on what it was pressed: rigid (--rigid), or modulus_pa (--modulus PA), one of them"
        )
    if modulus_pa is not None and not modulus_pa > 0:
        raise OptionError(f"modulus_pa is {modulus_pa}; it must be greater than 0 Pa")
    measured = read_recording(recording)
    with _told("calibrate", progress) as tell:
        if modulus_pa is None:
            found = explore(measured, boundary=nowhere(measured), unbroken=True)
            plain = calibrate_on_plate(measured, found)
        else:
            made = reconstruct(
                measured,
                poisson_ratio=poisson_ratio,
                seed=seed,
                progress=lambda s, x: tell(s, 0.3 * x),
                **options,
            )
            plain = calibrate_on_object(
                measured, made.model, modulus_pa, trust=trust, seed=seed,
                progress=lambda s, x: tell(s, 0.3 + 0.7 * x),
            )  # fmt: skip
    result = dressed(Calibration, plain)
    if save is not None:
        result.save(save)
    return result


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
    from palpate.results.simulation import simulation_of
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
    with _told("simulate", progress) as tell:
        plain = simulated(
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
    result = simulation_of(plain, Path(thing.name).name, thing)
    return result if save is None else result.save(save)


def export(
    model: ModelLike,
    to: str,
    path: str | Path,
    *,
    at: Sequence[float] | None = None,
    depth_m: float | None = None,
    unit: str = "m",
    progress: bool | Progress = True,
) -> tuple[str, ...]:
    """Write a model for another program: a minimal scene that runs there, or its mesh.

    to: "mujoco" (.xml), "sofa" (.scn), "abaqus" (.inp), "gmsh" (.msh) or "stl"; path: the file to write.
    at: (3,) m, where the scene's tip presses, None is the middle of the top; depth_m: how deep, None is half
    the tip's radius.
    unit: of an STL's lengths; all else is in SI units and the model's frame. Returns what the format cannot
    say, one line each. progress: a bar while a scene is built. Raises OptionError for an unknown format or a
    place that misses the object, FileError where the file cannot be written.
    """
    import numpy as np

    from palpate.exporting.registry import write

    plain = load(model, progress=progress)
    return write(plain, to, path, at=None if at is None else np.asarray(at), depth_m=depth_m, unit=unit)


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
    from palpate.results.base import dressed
    from palpate.results.batch import Batch

    steps = tuple(do.split(",")) if isinstance(do, str) else tuple(do)
    plain = run(
        [recordings] if isinstance(recordings, str | Path) else recordings,
        out,
        Choice(steps, options, seed, reports),
        workers=workers,
        memory_bytes=None if memory_gb is None else int(1e9 * memory_gb),
        scheduler=scheduler,
        force=force,
        progress=progress,
    )
    return dressed(Batch, plain)


def _renderer(
    function: str, model: ModelLike | Renderer, name: str, options: Mapping[str, Any]
) -> Callable[[Progress], TouchScene]:
    """What will make the renderer, on its model's support; options are checked at once."""
    from render.base import Renderer
    from render.felt import with_own_stiffness
    from render.options import RenderOptions
    from render.registry import create, names
    from render.scene import scene_of
    from render.support import SupportOptions

    given = taken(function, options)
    support = SupportOptions(**given.get(SupportOptions, {}))
    if isinstance(model, Renderer):
        if given[RenderOptions]:
            words = "a renderer that is there keeps its options; give them to pp.renderer"
            raise OptionError(f"{', '.join(given[RenderOptions])}: {words}")
        return lambda tell: scene_of(model, support)
    if name not in names():
        raise OptionError(f"'{name}' is no renderer; allowed are {', '.join(names())}")
    chosen = _with_scene(model, RenderOptions(**given[RenderOptions]))

    def make(tell: Progress) -> TouchScene:
        made = create(name, load(model, progress=tell), chosen, tell)
        if made.model.path is not None:
            with_own_stiffness(made)
        return scene_of(made, support)

    return make


def _with_scene(model: ModelLike, options: RenderOptions) -> RenderOptions:
    """The options with what the scene's file says, where a scene was given."""
    from palpate.sources import with_friction
    from scenes.scene import Scene, load_scene

    scene = load_scene(model) if isinstance(model, str | Path) else model
    return with_friction(options, scene) if isinstance(scene, Scene) else options


def _touched(recording: mechanics.recording.Recording, model: mechanics.model.Model) -> Presses:
    """The recording's presses on the model; none where it holds none."""
    from mechanics.errors import ContactError
    from mechanics.press_making import no_presses
    from reconstruct.placing import presses_on

    try:
        return presses_on(recording, model)
    except ContactError:
        return no_presses(recording.tip_radius_m)


@contextmanager
def _told(label: str, progress: bool | Progress) -> Iterator[Progress]:
    """Where progress goes: to a callable, to a bar on a terminal, or nowhere."""
    if callable(progress):
        yield progress
    elif progress:
        from palpate.arguments import progress_bar

        with progress_bar(label) as bar:
            yield bar
    else:
        yield silent
