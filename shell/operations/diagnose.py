"""What is wrong with a simulation: where its force leaves the measured one, which effect was left out, and
how far the gap between them shrinks with it.

REC is a recording, or the name of an embedded one. Without --model it is reconstructed first. The answer
may be one effect, several, a set that the touches cannot tell apart, "none" (the gap is noise) or "unknown".
Forces in N (root mean square in contact, at places that the fit had not seen), lengths in m, moduli in Pa.
With --simulated FORCES.csv (t,fx,fy,fz: s, and N on the tool, along the recorded path) it is the gap of that
simulator, in three parts: its numerics, the parameters that it was given, and what every ideal elastic
simulation lacks.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from typing import TYPE_CHECKING, Any

from palpate.diagnosis.forward.touches import LEAST_PRESSES
from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from palpate.diagnosis.other_simulator.forces import ForcesOptions
from palpate.mechanics.errors import OptionError
from palpate.mechanics.progress import part
from palpate.operations._declare import Call, operand, operation
from palpate.operations._run import say_next
from palpate.operations._shared import (
    MODEL,
    SAMPLES,
    MeshFileOptions,
    given_model,
    model_flag,
    recording_operand,
    report_operand,
    seed_operand,
)
from palpate.operations._simulators import (
    fewest,
    mended,
    numbers_operand,
    run_along,
    settings_operand,
    simulator,
    simulator_operand,
)
from palpate.operations.load import load
from palpate.operations.read_recording import read_recording
from palpate.operations.reconstruct import reconstruct
from palpate.output import Output
from palpate.render.registry import check_settings
from palpate.words import mn, spaced

if TYPE_CHECKING:
    from palpate.diagnosis.other_simulator.result import SimulatedGap
    from palpate.diagnosis.verdict.result import Diagnosis
    from palpate.mechanics.model.model import Model
    from palpate.mechanics.progress import Progress
    from palpate.mechanics.recording.recording import Recording
    from palpate.operations._shared import ModelLike, RecordingLike


@dataclass(frozen=True)
class DiagnoseOperands:
    """What is diagnosed, and what is written."""

    recording: RecordingLike = recording_operand()
    model: ModelLike | None = model_flag(
        "of this recording or of another of the same object; without it the recording is reconstructed"
    )
    _: KW_ONLY
    simulated: Any = operand(
        None,
        "forces of another simulator along the recorded path: t,fx,fy,fz (in Python also (t, force) arrays)",
        metavar="FORCES.csv",
        reads=True,
    )
    renderer: str | None = simulator_operand(
        "a simulator that is run along the recorded path, instead of --simulated"
    )
    simulator_settings: str = settings_operand()
    simulator_set: str = numbers_operand()
    mended: str | None = operand(
        None,
        "run --renderer once more as the advice says, and measure the gap that is left: best, or numbers of "
        "its settings (KEY=VALUE, comma separated)",
        metavar="SETTINGS",
    )
    presses: int | None = operand(
        None,
        "run --renderer over so many of the recording's presses, spread over its places; default: of a dear "
        "simulator 12, of the others all",
        low=LEAST_PRESSES,
    )
    stated: Any = operand(
        None,
        "what that simulator was given (repeatable): young_modulus_pa, poisson_ratio, friction, "
        "tip_radius_m; default: the model's",
        metavar="KEY=VALUE",
        count="repeat",
    )
    apply: str | None = operand(
        None,
        "write the improved model (object, contact, boundary effects)",
        metavar="MODEL2",
        writes=MODEL,
        only="command",
    )
    corrected: str | None = operand(
        None,
        "write the recording with the instrument's effects taken off (.csv.gz, .csv)",
        metavar="REC2",
        writes=SAMPLES,
        only="command",
    )
    report: str | None = report_operand("write the three answers with pictures as one HTML page")
    seed: int = seed_operand()


def _answer(result: Any, asked: DiagnoseOperands, out: Output) -> int:
    from palpate.diagnosis.apply import unsure

    out.say(*result.lines())
    own: Diagnosis = getattr(result, "reality", result)
    if asked.apply:
        found = own.improvement()
        better = found.model.save(asked.apply)
        kept = [name for name in own.effects if name in better.effects]
        out.say(f"improved model ({', '.join(kept) or 'modulus only'}): {asked.apply}")
        before, after = (mn(gap, ".3g") for gap in (found.given_n, found.improved_n))
        out.say(f"  replayed over the recording its force is {after} off, the given model's {before}")
        for name in found.left_out:
            out.say(f"  {spaced(name)} is left out: with it the replayed force was farther off")
    if asked.corrected:
        own.corrected().save(asked.corrected)
        for name in unsure(own):
            out.say(f"{spaced(name)}: smaller than twice its own error, not taken off")
        out.say(f"corrected recording: {asked.corrected}")
    if asked.report:
        out.say(f"report: {result.report(asked.report)}")
    if asked.apply:
        out.say(f"next: feel it: palpate touch {asked.apply}")
    else:
        say_next(result, out)
    out.json(result.as_json())
    return 0


@operation(
    DiagnoseOperands,
    MeshFileOptions,
    DiagnoseOptions,
    AttributionOptions,
    NuisanceOptions,
    ForcesOptions,
    often="fast without",
    answer=_answer,
)
def diagnose(asked: DiagnoseOperands, call: Call) -> Diagnosis | SimulatedGap:
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

    forces = _forces(asked)

    if asked.corrected and not str(asked.corrected).endswith((".csv", ".csv.gz")):
        raise OptionError(f"--corrected '{asked.corrected}' must end in .csv or .csv.gz")
    options = call.of(DiagnoseOptions, seed=asked.seed)
    source, measured = given_model(asked.model, call), read_recording(asked.recording)
    with call.progress("diagnose") as tell:
        if source is None:
            made = reconstruct(measured, progress=lambda s, x: tell(f"model: {s}", 0.3 * x)).model
            begun = 0.3
        else:
            plain = load(source, progress=tell)
            made, begun = plain.replaced(presses=presses_on(measured, plain)), 0.0
        if options.exact:
            places = deepest_of_sites(made.presses.site, made.presses.deepest)
            call.out.say(f"--exact: {said_beforehand(len(places), len(LAWS))}")
        rules: dict[str, Any] = {
            "nuisance": call.of(NuisanceOptions),
            "attribution": call.of(AttributionOptions),
        }

        def rest(stage: str, share: float) -> None:
            tell(stage, begun + (1 - begun) * share)

        if asked.renderer is None and forces is None:
            return diagnosed(measured, made, options, rest, **rules)
        from palpate.diagnosis.other_simulator.pipeline import Asked, diagnose_simulated
        from palpate.diagnosis.other_simulator.result import Mended
        from palpate.diagnosis.other_simulator.stated import stated_of

        if forces is not None:
            simulation = Asked(forces, stated_of(asked.stated, made), call.of(ForcesOptions))
            return diagnose_simulated(measured, made, simulation, options, rest, **rules)
        told = part(tell, begun, 1.0)
        simulations = _simulations(asked, call, measured, made, part(told, 0.0, 0.5))
        found = diagnose_simulated(measured, made, simulations[0], options, part(told, 0.5, 0.9), **rules)
        for again in simulations[1:]:
            left = diagnose_simulated(
                measured, made, again, options, part(told, 0.9, 1.0), reality=found.reality, **rules
            )
            found = replace(found, mended=Mended(again.run_as, left.gap_before_n, left.effects))
        return found


def _settings(asked: DiagnoseOperands) -> list[tuple[str, str]]:
    """(settings, numbers) of each run of --renderer: as asked, then mended."""
    settings, numbers = asked.simulator_settings, asked.simulator_set
    runs = [(settings, numbers)]
    return runs if asked.mended is None else [*runs, mended(settings, numbers, asked.mended)]


def _simulations(
    asked: DiagnoseOperands, call: Call, measured: Recording, model: Model, tell: Progress
) -> list[Any]:
    """What --renderer gave along the recorded path as asked, then mended, over the same presses; and what it
    says of itself."""
    import numpy as np

    from palpate.diagnosis.other_simulator.forces import Forces
    from palpate.diagnosis.other_simulator.pipeline import Asked
    from palpate.diagnosis.other_simulator.stated import stated_of, stated_values

    assert asked.renderer is not None
    made = [simulator(asked.renderer, *each, model) for each in _settings(asked)]
    most = asked.presses or fewest(made)
    share = 1 / len(made)
    runs = [
        run_along(each, measured, part(tell, k * share, (k + 1) * share), most=most)
        for k, each in enumerate(made)
    ]
    chosen = np.logical_and.reduce([ran.chosen for ran in runs])
    along, there = int(chosen.sum()), len(chosen)
    some = f", spread over its places (--presses {there}: all)" if along < there else ""
    simulations = []
    for ran in runs:
        notes = (
            f"run here along {along} of the {there} recorded presses{some}: {ran.said}",
            *(note for each in runs for note in each.notes),
            *(f"it cannot say: {x}" for x in ran.adapter.cannot),
        )
        forces = Forces(measured.t, ran.force, asked.renderer, notes, chosen)
        # what the adapter gave it, but for what is said
        stated = stated_of({**ran.adapter.stated, **stated_values(asked.stated)}, model)
        of_adapter = ran.adapter.version, ran.adapter.advice, ran.said, ran.adapter.poisson_limit
        own_clock = call.of(ForcesOptions, clock_offset_s=0.0)
        simulations.append(Asked(forces, stated, own_clock, *of_adapter))
    return simulations


def _forces(asked: DiagnoseOperands) -> Any:
    """The simulated forces, looked at before the work; None where there are none."""
    if asked.simulated is not None and asked.renderer is not None:
        raise OptionError("--simulated and --renderer both name a simulator: name one")
    if asked.mended is not None and asked.renderer is None:
        raise OptionError("--mended runs a simulator once more: name it by --renderer")
    if asked.presses is not None and asked.renderer is None:
        raise OptionError("--presses says over how many a simulator is run: name it by --renderer")
    if asked.renderer is not None:
        for each in _settings(asked):
            check_settings(asked.renderer, *each)
    if asked.simulated is None:
        if asked.stated and asked.renderer is None:
            words = "name its forces by --simulated, or the simulator by --renderer"
            raise OptionError(f"--stated says what a simulator was given: {words}")
    if asked.stated:
        from palpate.diagnosis.other_simulator.stated import stated_values

        stated_values(asked.stated)
    if asked.simulated is None:
        return None
    from palpate.diagnosis.other_simulator.forces import read_forces, sorted_forces

    if isinstance(asked.simulated, tuple | list):
        import numpy as np

        t, force = (np.asarray(each, dtype=float) for each in asked.simulated)
        if t.ndim != 1 or force.shape != (len(t), 3):
            raise OptionError(f"simulated needs t (n,) and force (n, 3); got {t.shape} and {force.shape}")
        return sorted_forces(t, force, "simulated")
    return read_forces(asked.simulated)
