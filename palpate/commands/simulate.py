"""The virtual laboratory: a person explores a phantom, and what a device would have read is written down.

PHANTOM is a name (cylinder, block, half-sphere, bean, dome, wedge, bowl) or a closed STL, PLY or VTU
surface in metres that stands on its lowest plane. Without --effect the object is the ideal model: linear
elastic, bonded to its support, sticking to the tip, readings exact but for white and slow noise. Solved
touches are kept in the user's cache (PALPATE_CACHE), so that another seed, modulus, hand or instrument
costs seconds, and an interrupted run goes on where it stopped.
"""

from __future__ import annotations

import argparse

from mechanics.errors import OptionError
from mechanics.files import JSON, PNG, atomic_file
from mechanics.recording import SAMPLES
from palpate import api
from palpate.arguments import (
    add_input,
    add_json,
    add_options_of,
    add_output,
    add_seed,
    emit_json,
    given_for,
    natural,
    say,
)
from palpate.show.page import PAGE
from scenes.laboratory.effects import REGISTRY
from scenes.laboratory.sealing import write_sealed
from scenes.phantoms import PHANTOMS

SUMMARY = "the virtual laboratory: a person's exploration of a phantom"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Phantom, output, effects, sealing, and the options of the exploration and of the hand."""
    add_input(parser, "phantom", help=f"{', '.join(PHANTOMS)}, or a surface file")
    add_output(
        parser, "-o", "--output", kind=SAMPLES, required=True, metavar="REC",
        help="recording to write (.csv.gz, .csv)",
    )  # fmt: skip
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME=STRENGTH",
        help="an effect and its strength (repeatable; 1 is the table's, 0 leaves it out): "
        f"{', '.join(REGISTRY)}",
    )
    parser.add_argument("--seal", action="store_true", help="withhold the truth; needs --truth")
    add_output(
        parser,
        "--truth",
        kind=JSON,
        metavar="PATH",
        help="where truth (JSON) and, when sealed, salt go",
    )
    parser.add_argument(
        "--person", type=natural, default=0, help="whose hand: 0 the average, 1... others (default: 0)"
    )
    parser.add_argument(
        "--sizes",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="state each effect's size in newtons, which solves without it too (default: yes)",
    )
    add_output(
        parser,
        "--pictures",
        kind=PNG,
        metavar="PNG",
        help="also draw the path, the force and every press beside the ideal object",
    )
    add_output(
        parser, "--report", kind=PAGE, metavar="HTML",
        help="write the object to be turned, and every touch beside the ideal object's, as one HTML page",
    )  # fmt: skip
    parser.add_argument("--workers", type=natural, help="processes that solve touches (default: one a core)")
    add_options_of(parser, "simulate")
    add_seed(parser)
    add_json(parser)


def effects_from(texts: list[str]) -> dict[str, float]:
    """{name: strength} of 'NAME=STRENGTH' or 'NAME'; raises OptionError for anything else."""
    out = {}
    for text in texts:
        name, _, value = text.partition("=")
        if name not in REGISTRY:
            raise OptionError(f"--effect {text}: '{name}' is unknown; allowed are {', '.join(REGISTRY)}")
        try:
            out[name] = float(value) if value else 1.0
        except ValueError:
            raise OptionError(
                f"--effect {text}: '{value}' is no number; write NAME=STRENGTH, such as {name}=1"
            ) from None
    return out


def run(arguments: argparse.Namespace) -> int:
    """Simulate and write."""
    if arguments.seal and not arguments.truth:
        raise OptionError("--seal withholds the truth: say with --truth PATH where it shall be kept")
    if arguments.seal and arguments.report:
        raise OptionError("--seal withholds the truth, which --report would tell: give one of them")
    result = api.simulate(
        arguments.phantom,
        effects_from(arguments.effect),
        seed=arguments.seed,
        person=arguments.person,
        sizes=arguments.sizes,
        ideal=arguments.pictures is not None or arguments.report is not None,
        workers=arguments.workers,
        save=None if arguments.seal else arguments.output,
        **given_for(arguments, "simulate"),
    )
    path = result.recording.path
    if arguments.seal:
        path = write_sealed(arguments.output, result.recording, result.truth, arguments.truth)
    elif arguments.truth:
        emit_json({"truth": result.truth}, arguments.truth)
    if arguments.pictures:
        from palpate.show.simulation import simulation_figure

        with atomic_file(arguments.pictures, PNG) as picture:
            simulation_figure(result).savefig(picture, dpi=110, format="png")
        say(arguments, f"pictures: {arguments.pictures}")
    if arguments.report:
        say(arguments, f"report: {result.report(arguments.report)}")
    summary = {**result.as_json(), "recording": str(path), "sealed": bool(arguments.seal)}
    if arguments.seal:
        del summary["truth"]
    words = result.lines()
    say(arguments, *(words[:1] if arguments.seal else words), f"written to {path}")
    emit_json(summary, arguments.json)
    return 0
