"""Find the smallest change of another simulator's settings with which it meets the measured force.

REC is a recording, or the name of an embedded one; without --model it is reconstructed first. What the object
is (Young's modulus, Poisson's ratio, friction, the tip) is held; tuned are numbers of the simulator alone:
mesh under the tip, contact, step, solver. Half of the presses are tuned on, half are held out, and two shapes
that were not tuned on are pressed before and after. Forces in N (rms in contact), times of the processor.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from palpate.diagnosis.forward.touches import LEAST_PRESSES
from palpate.mechanics.errors import DiagnosisError, OptionError
from palpate.mechanics.progress import TimeIsUp, part, until
from palpate.operations._call import Call
from palpate.operations._declare import Given, operation, option
from palpate.operations._shared import MeshFileOptions, RecordingArgument, given_model, save_option
from palpate.operations._simulators import NumbersOfSimulator, SettingsOfSimulator, simulator_option
from palpate.operations.load import load
from palpate.operations.read_recording import read_recording
from palpate.operations.reconstruct import reconstruct
from palpate.render.options import DOCUMENTED
from palpate.render.registry import check_settings

if TYPE_CHECKING:
    import numpy as np

    from palpate.diagnosis.other_simulator.runs import Runs, TruePath
    from palpate.diagnosis.other_simulator.tuned import Tuned
    from palpate.mechanics.model.model import Model
    from palpate.mechanics.presses.table import Presses
    from palpate.mechanics.progress import Progress
    from palpate.mechanics.recording.recording import Recording
    from palpate.operations._shared import ModelLike
    from palpate.scenes.conformance.scaled import ScaledBody

SHAPES = ("kidney", "dome")
"""Bodies of the conformance kit that settings are judged on."""
DIAGNOSED, IDEAL = 0.4, 0.5
"""Shares of the time at which is given up what only helps: the diagnosis of the start, which says what to try
first, and our ideal simulation, which says how near to come."""
_TIME = re.compile(r"([0-9.]+)\s*(s|min|h)")
_COST = re.compile(r"([0-9.]+)\s*(ms/step|s/s)")


def _within(text: str) -> float:
    found = _TIME.fullmatch(text.strip())
    if found is None or not _number(found[1]) > 0:
        raise OptionError(f"--within is '{text}'; it must be a time as 20min, 90s or 2h")
    return _number(found[1]) * {"s": 1.0, "min": 60.0, "h": 3600.0}[found[2]]


def _at_most(text: str | None) -> tuple[float, float]:
    """(ms a step, s a simulated second)."""
    if text is None:
        return math.inf, math.inf
    found = _COST.fullmatch(text.strip())
    if found is None or not _number(found[1]) > 0:
        raise OptionError(
            f"--at-most is '{text}'; it must be a cost as 5ms/step, or 2s/s (a simulated second)"
        )
    value = _number(found[1])
    return (value, math.inf) if found[2] == "ms/step" else (math.inf, value)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


@operation()
def tune(
    recording: RecordingArgument,
    model: Annotated[
        ModelLike | None,
        option(
            "a model of this object; without it the recording is reconstructed", metavar="MODEL", reads=True
        ),
    ] = None,
    *,
    renderer: Annotated[str, simulator_option("the simulator that is tuned")],
    save: Annotated[
        str | Path | None,
        save_option(
            "the settings in that simulator's own file: .xml of MuJoCo, .py of the others",
            "SETTINGS",
            "palpate.exporting.settings:SETTINGS",
            needed=True,
        ),
    ] = None,
    within: Annotated[
        str, option("time for all of it, by the clock: 20min, 90s, 2h", metavar="TIME")
    ] = "20min",
    at_most: Annotated[
        str | None,
        option(
            "what a step may cost, of the processor: 5ms/step, or 2s/s (a simulated second)", metavar="COST"
        ),
    ] = None,
    simulator_settings: SettingsOfSimulator = DOCUMENTED,
    simulator_set: NumbersOfSimulator = "",
    presses: Annotated[
        int,
        option("presses that it is run over, spread over the places: half are held out", low=LEAST_PRESSES),
    ] = LEAST_PRESSES,
    diagnosed: Annotated[
        bool, option("diagnose the start first: what is named is tried first", flag="--diagnosis")
    ] = True,
    shapes: Annotated[bool, option("press the shapes that were not tuned on")] = True,
    file: Given[MeshFileOptions],
    call: Call,
) -> Tuned:
    """The smallest change of another simulator's settings that meets the measured force, its physics held; N.

    renderer: the simulator; save: writes the settings in its own file. Raises OptionError where it is not
    installed or a setting is not there, DiagnosisError for fewer presses than two.
    """
    from palpate.diagnosis.other_simulator.runs import Runs, path_of_press
    from palpate.diagnosis.other_simulator.tuned import Judged, off, start_of, tuned
    from palpate.exporting.settings import check_suffix
    from palpate.reconstruction.presses_on_model import presses_on
    from palpate.render.options import RenderOptions
    from palpate.render.registry import simulator_names
    from palpate.scenes.conformance.scaled import scaled_body

    if renderer not in simulator_names():
        raise OptionError(f"--renderer is {renderer!r}; allowed are {', '.join(simulator_names())}")
    within_s, cost = _within(within), _at_most(at_most)
    check_settings(renderer, simulator_settings, simulator_set)
    if save is not None:
        check_suffix(renderer, save)
    begun = time.monotonic()
    source, measured = given_model(model, file), read_recording(recording)
    with call.progress("tune") as show_progress, _in_time(within):
        by_clock = until(show_progress, begun, within_s)
        if source is None:
            made = reconstruct(measured, progress=by_clock).model
        else:
            made = load(source, progress=by_clock)
        table = presses_on(measured, made)
        runs = Runs(
            renderer, RenderOptions(simulator_settings=simulator_settings, simulator_set=simulator_set)
        )
        adapter = runs.renderer({}, made).adapter
        numbers = _chosen(table, presses)
        paths = {int(p): path_of_press(measured, made, table, int(p)) for p in numbers}
        fitted, held = ([paths[int(p)] for p in numbers[k::2]] for k in (0, 1))
        notes = [f"it cannot say: {words}" for words in adapter.cannot]
        nu = made.material.poisson_ratio
        if nu > adapter.poisson_limit:
            notes.insert(
                0,
                f"Poisson's ratio {nu:g} is not taken: {renderer} is given {adapter.poisson_limit:g}, the "
                "most that it takes, and what that changes no setting mends",
            )
        off(runs, start_of(adapter), fitted, by_clock)
        named: tuple[str, ...] = ()
        if diagnosed:
            progress = until(show_progress, begun, within_s, DIAGNOSED)
            try:
                named, told = _named(measured, made, table, runs, paths, progress)
            except TimeIsUp:
                told = [
                    f"the diagnosis of the start was given up after {100 * DIAGNOSED:.0f} % of the time: "
                    "settings were tried in their usual order"
                ]
            notes += told
        try:
            law_n = off(
                Runs("fem", RenderOptions()), {}, fitted, until(show_progress, begun, within_s, IDEAL)
            ).gap_n
        except TimeIsUp:
            law_n = math.nan
        tip_m, young_pa = made.tool.tip_radius_m, made.material.young_modulus_pa
        unseen = [path_of_body(scaled_body(name, young_pa, tip_m)) for name in SHAPES] if shapes else []
        result = tuned(
            runs, made, Judged(fitted, held, unseen), noise_n=table.vector_noise_n, law_n=law_n,
            within_s=within_s, at_most=cost, named=named, notes=notes, begun_s=begun,
            progress=show_progress,
        )  # fmt: skip
    if save is not None:
        call.then_save(result, save) if call.command else result.save(save)
    if result.interrupted is not None:
        call.exit_code = _raises(result.interrupted)  # once all that was found is said and written
        if not call.command:
            raise result.interrupted
    return result


@contextmanager
def _in_time(within: str) -> Iterator[None]:
    """Raises OptionError where the time is over before a setting was tried."""
    try:
        yield
    except TimeIsUp as over:
        raise OptionError(
            f"--within {within} was over before a setting was tried, and nothing was tuned: what comes first "
            "(reconstruction unless --model is given, the simulator as it is) takes longer"
        ) from over


def _raises(how: BaseException) -> Callable[[], int]:
    def end() -> int:
        raise how

    return end


def _chosen(presses: Presses, most: int) -> np.ndarray:
    """Numbers of presses, spread over the places, neighbours in time on either side."""
    import numpy as np

    from palpate.diagnosis.other_simulator.forces import spread_out

    if presses.quasi_static:
        raise DiagnosisError("points without a time are not a path that a simulator can follow")
    numbers = np.flatnonzero(spread_out(presses, most))
    if len(numbers) < 2:
        raise DiagnosisError(f"{len(numbers)} presses: one is tuned on and one held out; record two or more")
    return numbers


def _named(
    measured: Recording,
    made: Model,
    presses: Presses,
    runs: Runs,
    paths: dict[int, TruePath],
    progress: Progress,
) -> tuple[tuple[str, ...], list[str]]:
    """(numerical effects that the diagnosis of the start names, its candidates after them; notes)."""
    import numpy as np

    from palpate.diagnosis.options import DiagnoseOptions
    from palpate.diagnosis.other_simulator.declared_parameters import stated_of
    from palpate.diagnosis.other_simulator.forces import Forces, ForcesOptions
    from palpate.diagnosis.other_simulator.frame import AS_RECORDED
    from palpate.diagnosis.other_simulator.pipeline import Asked, diagnose_simulated
    from palpate.diagnosis.other_simulator.tuned import start_of
    from palpate.render.replay import rows_of_touch

    force, chosen = np.zeros_like(measured.position), np.zeros(len(presses), dtype=bool)
    adapter = runs.renderer({}, made).adapter
    start = start_of(adapter)
    for k, (number, path) in enumerate(paths.items()):
        progress(f"{runs.name} as it is, press {k + 1} of {len(paths)}", 0.5 * k / len(paths))
        found = runs.run(start, path, progress)
        if not found.sums.ended:
            force[rows_of_touch(measured.t, presses, number)] = found.force
            chosen[number] = True
    plain = ForcesOptions(clock_offset_s=0.0, simulated_axes=AS_RECORDED, simulated_unit="N")
    asked = Asked(
        Forces(measured.t, force, runs.name, (), chosen), stated_of(adapter.stated, made), plain,
        adapter.version, adapter.advice, "", adapter.poisson_limit,
    )  # fmt: skip
    try:
        found_gap = diagnose_simulated(
            measured,
            made.replaced(presses=presses),
            asked,
            DiagnoseOptions(fast=True),
            part(progress, 0.5, 1.0),
        )
    except DiagnosisError as error:
        return (), [f"settings were tried in their usual order, as the start gave no diagnosis: {error}"]
    numerics = found_gap.parts["numerics"].names
    mended = {name for tunable in adapter.tunables for name in tunable.mends}
    own = [name for name in (*numerics, *found_gap.candidates) if name in mended]
    said = ", ".join(name.replace("_", " ") for name in own) or "nothing that a setting mends"
    return tuple(own), [f"the diagnosis of the start names {said}: tried first"]


def path_of_body(body: ScaledBody, until_s: float = math.inf) -> TruePath:
    """The path over a body of the kit, up to a time of it, and its true force."""
    import numpy as np

    from palpate.diagnosis.other_simulator.runs import TruePath

    rows = slice(0, int(np.searchsorted(body.t, until_s)))
    t, bound_n = body.t[rows], float(np.sqrt((body.bound[rows] ** 2).mean()))
    return TruePath(body.name, body.model, t, body.centre[rows], t, body.force[rows], bound_n, body.friction)
