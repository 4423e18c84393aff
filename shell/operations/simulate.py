"""The virtual laboratory: a person explores a phantom, and what a device would have read is recorded.

PHANTOM is a name (cylinder, block, half-sphere, bean, dome, wedge, bowl) or a closed STL, PLY or VTU
surface. Without --effect the object is the ideal model: linear
elastic, bonded to its support, sticking to the tip, readings exact but for white and slow noise. Solved
touches are kept in the user's cache (PALPATE_CACHE), so that another seed, modulus, hand or instrument
takes seconds, and an interrupted run goes on where it stopped.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.mechanics.disk.writing import JSON, PNG, atomic_file
from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import number, pairs, unknown
from palpate.mechanics.recording.recording import read_recording
from palpate.operations._call import Call
from palpate.operations._declare import Given, argument, operation, option
from palpate.operations._shared import SAMPLES, PhantomFileOptions, Seed, report_option, save_option
from palpate.operations._to_argparse import natural
from palpate.operations._written import typed
from palpate.output import emit_json
from palpate.scenes.laboratory.effects import REGISTRY
from palpate.scenes.laboratory.hand import HandOptions
from palpate.scenes.laboratory.session import SimulateOptions
from palpate.scenes.phantoms import PHANTOMS

if TYPE_CHECKING:
    from palpate.scenes.laboratory.simulate import Simulation
    from palpate.scenes.phantoms import Phantom


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


@operation(common="young_modulus_pa presses protocol")
def simulate(
    phantom: Annotated[
        str | Path | Phantom,
        argument(f"{', '.join(PHANTOMS)}, or a surface file", metavar="PHANTOM", reads=True),
    ],
    effects: Annotated[
        Mapping[str, float] | None,
        option(
            "an effect and its strength (repeatable; docs/reference/strengths.md: what 1 is; 0 leaves it "
            f"out): {', '.join(REGISTRY)}",
            flag="--effect",
            metavar="NAME=STRENGTH",
            count="repeat",
        ),
    ] = None,
    *,
    save: Annotated[
        str | Path | None, save_option("recording to write (.csv.gz, .csv)", "REC", SAMPLES, needed=True)
    ] = None,
    seal: Annotated[bool, option("withhold the truth; needs --truth", only="command")] = False,
    truth: Annotated[
        str | None,
        option(
            "file for the truth (JSON) and, with --seal, the salt",
            metavar="PATH",
            writes=JSON,
            only="command",
        ),
    ] = None,
    person: Annotated[
        int, option("whose hand: 0 the average, 1... others", low=0, high=2**63 - 1, parse=natural)
    ] = 0,
    sizes: Annotated[
        bool, option("state each effect's size in newtons, which solves without it too", advanced=True)
    ] = True,
    ideal: Annotated[bool, option("also what the ideal object would answer", only="python")] = False,
    pictures: Annotated[
        str | None,
        option(
            "also draw the path, the force and every press compared with the ideal object",
            metavar="PNG",
            writes=PNG,
            only="command",
        ),
    ] = None,
    report: Annotated[
        str | None,
        report_option("write one HTML page: the object in 3D, every touch compared with the ideal object's"),
    ] = None,
    workers: Annotated[
        int | None,
        option(
            "processes that solve touches; None: one per core",
            low=1,
            high=2**63 - 1,
            parse=natural,
            advanced=True,
        ),
    ] = None,
    seed: Seed = 0,
    file: Given[PhantomFileOptions],
    options: SimulateOptions,
    hand: Given[HandOptions],
    call: Call,
) -> Simulation:
    """The virtual laboratory: a person explores a phantom, and what a device would have read is recorded.

    phantom: one of the names or a closed STL, PLY or VTU surface. effects: name to strength; none is the
    ideal model. save: NAME.csv.gz, with the truth in NAME.toml. Solved touches are kept in the user's cache.
    Raises OptionError or SceneError.
    """
    from palpate.scenes.laboratory.curves import Solving
    from palpate.scenes.laboratory.hand import cohort_hand
    from palpate.scenes.laboratory.sealing import seal_of, write_sealed
    from palpate.scenes.laboratory.session import Staging
    from palpate.scenes.laboratory.simulate import simulate as simulated
    from palpate.scenes.phantoms import Phantom
    from palpate.scenes.phantoms import phantom as named
    from palpate.show import next_lines

    if seal and not truth:
        raise OptionError("--seal withholds the truth: give --truth PATH, where it is kept")
    if seal and report:
        raise OptionError("--seal withholds the truth, which --report would show: give one of them")
    acting = effects_from(effects)
    thing = phantom if isinstance(phantom, Phantom) else named(phantom, **file)
    with call.progress("simulate") as show_progress:
        made = simulated(
            thing,
            acting,
            options,
            seed=seed,
            sizes=sizes,
            ideal=ideal or pictures is not None or report is not None,
            staging=Staging(dataclasses.replace(cohort_hand(person), **hand)),
            solving=Solving(workers, progress=show_progress),
        )
    result = made if save is None or seal else made.save(save)
    if truth and not seal:
        emit_json({"truth": result.truth}, truth)
    if pictures:
        _draw(result, pictures)
        call.out.say(f"pictures: {pictures}")
    if report:
        call.out.say(f"report: {result.report(report)}")
    call.figures = {"sealed": bool(seal)}
    if not seal:
        call.then(f"written to {result.recording.path}")
        return result
    path = write_sealed(str(save), result.recording, result.truth, str(truth))
    call.then(
        f"written to {path}, without its truth",
        f"sealed: {seal_of(path)} holds a hash of the truth; truth and salt: {truth}",
    )
    unlabelled = dataclasses.replace(result, recording=read_recording(path))
    call.following = [
        partial(next_lines, unlabelled),
        "      judge a verdict by what was sealed: " + typed("diagnose", {"recording": path, "truth": truth}),
    ]
    sealed: Any = _Sealed(result, path)
    return sealed


def _draw(result: Simulation, path: str) -> None:
    from palpate.show.simulation import simulation_figure

    with atomic_file(path, PNG) as picture:
        simulation_figure(result).savefig(picture, dpi=110, format="png")


@dataclasses.dataclass(frozen=True)
class _Sealed:
    """A simulation that does not show its truth."""

    made: Simulation
    path: Path

    def lines(self) -> list[str]:
        return self.made.lines()[:1]

    def as_json(self) -> dict[str, Any]:
        kept = {key: value for key, value in self.made.as_json().items() if key != "truth"}
        return {**kept, "recording": str(self.path)}
