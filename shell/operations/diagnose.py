"""Find what is wrong with a simulation: where its force differs from the measured one, which effect was left
out, and how far the gap shrinks with that effect.

REC is a recording, or the name of an embedded one. Without --model it is reconstructed first. The answer
may be one effect, several, a set that the touches cannot separate, "none" (the gap is noise) or "unknown".
Forces in N (root mean square in contact, at held-out places), lengths in m, moduli in Pa.
With --simulated FORCES.csv (t,fx,fy,fz: s, and N on the tool, along the recorded path) it is the gap of that
simulator, in three parts: its numerics, the parameters that it was given, and what every ideal elastic
simulation lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.diagnosis.forward.touches import LEAST_PRESSES
from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from palpate.diagnosis.other_simulator.forces import ForcesOptions
from palpate.mechanics.errors import OptionError
from palpate.mechanics.progress import part
from palpate.operations._call import Call
from palpate.operations._declare import Given, operation, option
from palpate.operations._shared import (
    MODEL,
    SAMPLES,
    MeshFileOptions,
    RecordingArgument,
    Seed,
    given_model,
    report_option,
    warn_of_modulus,
)
from palpate.operations._simulators import (
    NumbersOfSimulator,
    SettingsOfSimulator,
    fewest,
    mended_by,
    run_along,
    simulator,
    simulator_option,
)
from palpate.operations.load import load
from palpate.operations.read_recording import read_recording
from palpate.operations.reconstruct import reconstruct
from palpate.render.options import DOCUMENTED
from palpate.render.registry import check_settings
from palpate.words import typed_word, unsettled_words

if TYPE_CHECKING:
    from palpate.diagnosis.other_simulator.pipeline import Asked
    from palpate.diagnosis.other_simulator.result import SimulatedGap
    from palpate.diagnosis.verdict.result import Diagnosis
    from palpate.mechanics.progress import Progress
    from palpate.mechanics.recording.recording import Recording
    from palpate.operations._shared import ModelLike
    from palpate.render.simulators.base import SimulatorRenderer


@operation(common="fast without")
def diagnose(
    recording: RecordingArgument,
    model: Annotated[
        ModelLike | None,
        option(
            "a model of this object, from this recording or another; without it the recording is "
            "reconstructed",
            metavar="MODEL",
            reads=True,
        ),
    ] = None,
    *,
    simulated: Annotated[
        Any,
        option(
            "forces of another simulator along the recorded path: t,fx,fy,fz (in Python also (t, force) "
            "arrays)",
            metavar="FORCES.csv",
            reads=True,
        ),
    ] = None,
    renderer: Annotated[
        str | None,
        simulator_option("a simulator that is run along the recorded path, instead of --simulated"),
    ] = None,
    simulator_settings: SettingsOfSimulator = DOCUMENTED,
    simulator_set: NumbersOfSimulator = "",
    mended: Annotated[
        str | None,
        option(
            "run --renderer once more as the advice says, and measure the remaining gap: best, or numbers "
            "of its settings (KEY=VALUE, comma separated)",
            metavar="SETTINGS",
        ),
    ] = None,
    baseline: Annotated[
        Any,
        option(
            "judge it against the same simulator at its best: of --simulated those forces, BASE.csv (given "
            "the same parameters); of --renderer its settings, as for --mended",
            metavar="BASE",
        ),
    ] = None,
    presses: Annotated[
        int | None,
        option(
            "run --renderer over this many of the recording's presses, spread over its places; default: 12 "
            "for a slow simulator, else all",
            low=LEAST_PRESSES,
        ),
    ] = None,
    stated: Annotated[
        Any,
        option(
            "what that simulator was given (repeatable): young_modulus_pa, poisson_ratio, friction, "
            "tip_radius_m; default: the model's",
            metavar="KEY=VALUE",
            count="repeat",
        ),
    ] = None,
    apply: Annotated[
        str | None,
        option(
            "write the improved model (object, contact, boundary effects)",
            metavar="MODEL2",
            writes=MODEL,
            only="command",
        ),
    ] = None,
    corrected: Annotated[
        str | None,
        option(
            "write the recording with the instrument's effects taken off (.csv.gz, .csv)",
            metavar="REC2",
            writes=SAMPLES,
            only="command",
        ),
    ] = None,
    truth: Annotated[
        str | None,
        option(
            "the sealed truth of `palpate simulate --seal --truth`: say whether the verdict is right",
            metavar="TRUTH.json",
            reads=True,
            only="command",
            advanced=True,
        ),
    ] = None,
    report: Annotated[
        str | None, report_option("write the three answers with pictures as one HTML page")
    ] = None,
    seed: Seed = 0,
    file: Given[MeshFileOptions],
    options: DiagnoseOptions,
    attribution: AttributionOptions,
    nuisance: NuisanceOptions,
    of_forces: ForcesOptions,
    call: Call,
) -> Diagnosis | SimulatedGap:
    """The sim-to-real gap: where simulated and measured force differ, which effect was left out, how far the
    gap shrinks with it on places that were not fitted; N rms.

    fast: fewer effects, one in an answer; of a simulator's numerics all the same. With simulated the answer
    is a SimulatedGap: that simulator's numerics, the parameters that it was given, and what every ideal
    simulation lacks. Raises DiagnosisError where the data cannot carry it.
    """
    from palpate.diagnosis.pipeline import diagnose as diagnosed
    from palpate.mechanics.press_solver.press import LAWS
    from palpate.mechanics.press_solver.solved_places import deepest_of_sites, said_beforehand
    from palpate.reconstruction.presses_on_model import presses_on
    from palpate.scenes.laboratory.sealing import opened, seal_of

    runs = [(simulator_settings, simulator_set)]
    if renderer is not None:
        runs += [mended_by(*runs[0], by) for by in (baseline, mended) if by is not None]
    _check(simulated, renderer, mended, presses, stated, runs)
    if baseline is not None and renderer is None and simulated is None:
        raise OptionError("--baseline is of another simulator: name it by --simulated or --renderer")
    forces = None if simulated is None else _forces(simulated, of_forces.simulated_unit)
    best = None if baseline is None or simulated is None else _forces(baseline, of_forces.simulated_unit)
    if corrected and not str(corrected).endswith((".csv", ".csv.gz")):
        raise OptionError(f"--corrected '{corrected}' must end in .csv or .csv.gz")
    sealed = None if truth is None else opened(seal_of(Path(str(recording))), truth)
    source, measured = given_model(model, file), read_recording(recording)
    with call.progress("diagnose") as show_progress:
        if source is None:
            made = reconstruct(measured, progress=lambda s, x: show_progress(f"model: {s}", 0.3 * x)).model
            begun = 0.3
        else:
            plain = load(source, progress=show_progress)
            made, begun = plain.replaced(presses=presses_on(measured, plain)), 0.0
        if options.exact:
            places = deepest_of_sites(made.presses.site, made.presses.deepest)
            call.out.say(f"--exact: {said_beforehand(len(places), len(LAWS))}")
        rules: dict[str, Any] = {"nuisance": nuisance, "attribution": attribution}

        def rest(stage: str, share: float) -> None:
            show_progress(stage, begun + (1 - begun) * share)

        result: Any
        if renderer is None and forces is None:
            result = diagnosed(measured, made, options, rest, **rules)
        else:
            from palpate.diagnosis.other_simulator.declared_parameters import stated_of
            from palpate.diagnosis.other_simulator.pipeline import Asked, diagnose_simulated
            from palpate.diagnosis.other_simulator.result import Mended

            if forces is not None:
                simulation = Asked(forces, stated_of(stated, made), of_forces, base=best)
                result = diagnose_simulated(measured, made, simulation, options, rest, **rules)
            else:
                assert renderer is not None
                rest_of_it = part(show_progress, begun, 1.0)
                half = part(rest_of_it, 0.0, 0.5)
                simulations = _simulations(
                    [simulator(renderer, *each, made) for each in runs],
                    measured,
                    presses,
                    stated,
                    of_forces,
                    half,
                )
                first, again = simulations[0], simulations[1:]
                if baseline is not None:
                    first, again = replace(first, base=again[0].forces), again[1:]
                result = diagnose_simulated(
                    measured, made, first, options, part(rest_of_it, 0.5, 0.9), **rules
                )
                for each in again:
                    left = diagnose_simulated(
                        measured,
                        made,
                        each,
                        options,
                        part(rest_of_it, 0.9, 1.0),
                        reality=result.reality,
                        **rules,
                    )
                    found = Mended(each.run_as, left.gap_before_n, left.effects)
                    result = replace(result, mended=found)
    own: Diagnosis = getattr(result, "reality", result)
    following = []
    if sealed is not None:
        from palpate.show.diagnosis.truth import judged, truth_lines

        call.then(partial(truth_lines, own, sealed))
        call.figures = {"truth": {"effects": sealed["effects"], "verdict": judged(own, sealed)[0]}}
    if apply:
        call.then(partial(_applied, own, apply))
        following.append(f"next: feel it: palpate touch {typed_word(apply)}")
    if corrected:
        from palpate.operations._written import reconstruct_words

        assert own.model is not None, "of presses on a model"
        call.then(partial(_corrected, own, corrected))
        following.append(f"next: reconstruct what is left: {reconstruct_words(corrected, own.model)}")
    call.following = following or call.following
    call.then_report(result, report)
    return result


def _applied(own: Diagnosis, into: str) -> list[str]:
    """What was written, and how far off its force is."""
    found = own.improvement()
    better = found.model.save(into)
    kept = [name for name in own.effects if name in better.effects]
    before, after = (f"{1e3 * gap:.3g} mN" for gap in (found.given_n, found.improved_n))
    return [
        f"improved model ({', '.join(kept) or 'modulus only'}; Young's modulus "
        f"{better.material.young_modulus_pa / 1e3:.4g} kPa): {into}",
        f"  replayed over the recording its force is {after} off, the given model's {before}",
        *([f"  {unsettled_words(found.unsettled, found.samples)}"] if found.unsettled else []),
        *(
            f"  {name.replace('_', ' ')} is left out: with it the replayed force was farther off"
            for name in found.left_out
        ),
    ]


def _corrected(own: Diagnosis, into: str) -> list[str]:
    """What was written, and what was not taken off."""
    from palpate.diagnosis.apply import unsure
    from palpate.operations._written import with_geometry_of

    assert own.model is not None, "of presses on a model"
    with_geometry_of(own.model, own.corrected()).save(into)
    return [
        *(
            f"{name.replace('_', ' ')}: smaller than twice its own error, not taken off"
            for name in unsure(own)
        ),
        f"corrected recording: {into}",
    ]


def _simulations(
    made: Sequence[SimulatorRenderer],
    measured: Recording,
    presses: int | None,
    given: Any,
    of_forces: ForcesOptions,
    show_progress: Progress,
) -> list[Asked]:
    """What each gave along the recorded path, over the same presses; and what it says of itself."""
    import numpy as np

    from palpate.diagnosis.other_simulator.declared_parameters import stated_of, stated_values
    from palpate.diagnosis.other_simulator.forces import Forces
    from palpate.diagnosis.other_simulator.frame import AS_RECORDED
    from palpate.diagnosis.other_simulator.pipeline import Asked

    most = presses or fewest(made)
    share = 1 / len(made)
    runs = [
        run_along(each, measured, part(show_progress, k * share, (k + 1) * share), most=most)
        for k, each in enumerate(made)
    ]
    chosen = np.logical_and.reduce([ran.chosen for ran in runs])
    along, there = int(chosen.sum()), len(chosen)
    some = f", spread over its places (--presses {there}: all)" if along < there else ""
    simulations = []
    for each, ran in zip(made, runs, strict=True):
        notes = (
            f"run here along {along} of the {there} recorded presses{some}: {ran.said}",
            *(note for other in runs for note in other.notes),
            *(f"it cannot say: {x}" for x in ran.adapter.cannot),
        )
        forces = Forces(measured.t, ran.force, each.name, notes, chosen)
        # what the adapter gave it, but for what is said
        stated = stated_of({**ran.adapter.stated, **stated_values(given)}, each.model)
        of_adapter = ran.adapter.version, ran.adapter.advice, ran.said, ran.adapter.poisson_limit
        plain = replace(of_forces, clock_offset_s=0.0, simulated_axes=AS_RECORDED, simulated_unit="N")
        simulations.append(Asked(forces, stated, plain, *of_adapter))
    return simulations


def _check(
    simulated: Any,
    renderer: str | None,
    mended: str | None,
    presses: int | None,
    stated: Any,
    runs: Sequence[tuple[str, str]],
) -> None:
    """Before the work: what is said of a simulator is of one that is named."""
    if simulated is not None and renderer is not None:
        raise OptionError("--simulated and --renderer both name a simulator: name one")
    if mended is not None and renderer is None:
        raise OptionError("--mended runs a simulator once more: name it by --renderer")
    if presses is not None and renderer is None:
        raise OptionError("--presses says over how many a simulator is run: name it by --renderer")
    if renderer is not None:
        for each in runs:
            check_settings(renderer, *each)
    elif stated and simulated is None:
        words = "name its forces by --simulated, or the simulator by --renderer"
        raise OptionError(f"--stated says what a simulator was given: {words}")
    if stated:
        from palpate.diagnosis.other_simulator.declared_parameters import stated_values

        modulus_pa = stated_values(stated).get("young_modulus_pa")
        if modulus_pa is not None:
            warn_of_modulus(modulus_pa, "--stated young_modulus_pa", "--stated young_modulus_pa=")


def _forces(simulated: Any, unit: str | None) -> Any:
    """The simulated forces, looked at before the work."""
    from palpate.diagnosis.other_simulator.forces import sorted_forces
    from palpate.importing.simulated_forces import read_forces

    if isinstance(simulated, tuple | list):
        import numpy as np

        t, force = (np.asarray(each, dtype=float) for each in simulated)
        if t.ndim != 1 or force.shape != (len(t), 3):
            raise OptionError(f"simulated needs t (n,) and force (n, 3); got {t.shape} and {force.shape}")
        return sorted_forces(t, force, "simulated")
    return read_forces(simulated, unit)
