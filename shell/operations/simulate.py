"""The virtual laboratory: a person explores a phantom, and what a device would have read is written down.

PHANTOM is a name (cylinder, block, half-sphere, bean, dome, wedge, bowl) or a closed STL, PLY or VTU
surface in metres that stands on its lowest plane. Without --effect the object is the ideal model: linear
elastic, bonded to its support, sticking to the tip, readings exact but for white and slow noise. Solved
touches are kept in the user's cache (PALPATE_CACHE), so that another seed, modulus, hand or instrument
costs seconds, and an interrupted run goes on where it stopped.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.mechanics.disk.writing import JSON, PNG, atomic_file
from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import number, pairs, unknown
from palpate.operations._declare import REQUIRED, Call, operand, operation
from palpate.operations._run import say_next
from palpate.operations._shared import SAMPLES, report_operand, save_operand, seed_operand
from palpate.operations._to_argparse import natural
from palpate.output import Output, emit_json
from palpate.scenes.laboratory.effects import REGISTRY
from palpate.scenes.laboratory.hand import HandOptions
from palpate.scenes.laboratory.session import SimulateOptions
from palpate.scenes.phantoms import PHANTOMS

if TYPE_CHECKING:
    from palpate.scenes.laboratory.simulate import Simulation
    from palpate.scenes.phantoms import Phantom


@dataclass(frozen=True)
class SimulateOperands:
    """What is explored, by whom, and what is written."""

    phantom: str | Path | Phantom = operand(
        REQUIRED, f"{', '.join(PHANTOMS)}, or a surface file", metavar="PHANTOM", positional=True, reads=True
    )
    effects: Mapping[str, float] | None = operand(
        None,
        "an effect and its strength (repeatable; docs/reference/strengths.md: what 1 is; 0 leaves it out): "
        f"{', '.join(REGISTRY)}",
        flag="--effect",
        metavar="NAME=STRENGTH",
        count="repeat",
    )
    _: KW_ONLY
    save: str | Path | None = save_operand("recording to write (.csv.gz, .csv)", "REC", SAMPLES, needed=True)
    seal: bool = operand(False, "withhold the truth; needs --truth", only="command")
    truth: str | None = operand(
        None,
        "where truth (JSON) and, when sealed, salt go",
        metavar="PATH",
        writes=JSON,
        only="command",
    )
    person: int = operand(0, "whose hand: 0 the average, 1... others", low=0, high=2**63 - 1, parse=natural)
    sizes: bool = operand(True, "state each effect's size in newtons, which solves without it too", rare=True)
    ideal: bool = operand(False, "also what the ideal object would answer", only="python")
    pictures: str | None = operand(
        None,
        "also draw the path, the force and every press beside the ideal object",
        metavar="PNG",
        writes=PNG,
        only="command",
    )
    report: str | None = report_operand(
        "write the object to be turned, and every touch beside the ideal object's, as one HTML page"
    )
    workers: int | None = operand(
        None,
        "processes that solve touches; None: one a core",
        low=1,
        high=2**63 - 1,
        parse=natural,
        rare=True,
    )
    seed: int = seed_operand()


def effects_from(given: Mapping[str, float] | Sequence[str] | None) -> dict[str, float] | None:
    """{name: strength} of 'NAME=STRENGTH' or 'NAME'; raises OptionError for anything else."""
    if given is None or isinstance(given, Mapping):
        return None if given is None else dict(given)
    out = {}
    flag, words = "--effect", [text if "=" in text else f"{text}=1" for text in given]
    for name, value in pairs(words, flag, "friction_slip=1"):
        if name not in REGISTRY:
            raise OptionError(f"{flag} {name}={value}: {unknown(name, 'effect', REGISTRY)}")
        out[name] = number(flag, name, value)
    return out


def _answer(result: Simulation, asked: SimulateOperands, out: Output) -> int:
    from palpate.scenes.laboratory.sealing import write_sealed

    path = result.recording.path
    if asked.seal:
        path = write_sealed(str(asked.save), result.recording, result.truth, str(asked.truth))
    elif asked.truth:
        emit_json({"truth": result.truth}, asked.truth)
    if asked.pictures:
        from palpate.show.simulation import simulation_figure

        with atomic_file(asked.pictures, PNG) as picture:
            simulation_figure(result).savefig(picture, dpi=110, format="png")
        out.say(f"pictures: {asked.pictures}")
    if asked.report:
        out.say(f"report: {result.report(asked.report)}")
    summary: dict[str, Any] = {**result.as_json(), "recording": str(path), "sealed": bool(asked.seal)}
    if asked.seal:
        del summary["truth"]
    words = result.lines()
    out.say(*(words[:1] if asked.seal else words), f"written to {path}")
    say_next(result, out)
    out.json(summary)
    return 0


@operation(
    SimulateOperands, SimulateOptions, HandOptions, often="young_modulus_pa presses protocol", answer=_answer
)
def simulate(asked: SimulateOperands, call: Call) -> Simulation:
    """The virtual laboratory: a person explores a phantom, and what a device would have read is written down.

    phantom: one of the names or a closed STL, PLY or VTU surface, m. effects: name to strength; none is the
    ideal model. save: NAME.csv.gz, with the truth in NAME.toml. Solved touches are kept in the user's cache.
    Raises OptionError or SceneError.
    """
    from palpate.scenes.laboratory.curves import Solving
    from palpate.scenes.laboratory.hand import cohort_hand
    from palpate.scenes.laboratory.session import Staging
    from palpate.scenes.laboratory.simulate import simulate as simulated
    from palpate.scenes.phantoms import Phantom
    from palpate.scenes.phantoms import phantom as named

    if asked.seal and not asked.truth:
        raise OptionError("--seal withholds the truth: say with --truth PATH where it shall be kept")
    if asked.seal and asked.report:
        raise OptionError("--seal withholds the truth, which --report would tell: give one of them")
    effects = effects_from(asked.effects)
    thing = asked.phantom if isinstance(asked.phantom, Phantom) else named(asked.phantom)
    with call.progress("simulate") as tell:
        result = simulated(
            thing,
            effects,
            call.of(SimulateOptions),
            seed=asked.seed,
            sizes=asked.sizes,
            ideal=asked.ideal or asked.pictures is not None or asked.report is not None,
            staging=Staging(dataclasses.replace(cohort_hand(asked.person), **call.values(HandOptions))),
            solving=Solving(asked.workers, progress=tell),
        )
    return result if asked.save is None or asked.seal else result.save(asked.save)
