"""The virtual laboratory: a person explores a phantom, and what a device would have read is written down.

PHANTOM is a name (cylinder, block, half-sphere, bean, dome, wedge, bowl) or a closed STL, PLY or VTU
surface in metres that stands on its lowest plane. Without --effect the object is the ideal model: linear
elastic, bonded to its support, sticking to the tip, readings exact but for white and slow noise. Solved
touches are kept in the user's cache (PALPATE_CACHE), so that another seed, modulus, hand or instrument
costs seconds, and an interrupted run goes on where it stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mechanics.errors import OptionError
from mechanics.files import atomic_file
from mechanics.recording import write_recording
from palpate.arguments import add_json, add_options, add_seed, emit_json, options_from, progress_bar, say
from scenes.laboratory.effects import REGISTRY
from scenes.laboratory.hand import HandOptions, cohort_hand
from scenes.laboratory.sealing import write_sealed
from scenes.laboratory.simulate import SimulateOptions, simulate
from scenes.phantoms import PHANTOMS, phantom

SUMMARY = "the virtual laboratory: a person's exploration of a phantom"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Phantom, output, effects, sealing, and the options of the exploration and of the hand."""
    parser.add_argument("phantom", help=f"{', '.join(PHANTOMS)}, or a surface file")
    parser.add_argument(
        "-o", "--output", required=True, metavar="REC", help="recording to write (.csv.gz, .csv)"
    )
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME=STRENGTH",
        help="an effect and its strength (repeatable; 1 is the table's, 0 leaves it out): "
        f"{', '.join(REGISTRY)}",
    )
    parser.add_argument("--seal", action="store_true", help="withhold the truth; needs --truth")
    parser.add_argument(
        "--truth", metavar="PATH", help="where the truth goes (JSON), with the salt when sealed"
    )
    parser.add_argument(
        "--person", type=int, default=0, help="whose hand: 0 the average, 1... others (default: 0)"
    )
    parser.add_argument(
        "--sizes",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="state each effect's size in newtons, which solves without it too (default: yes)",
    )
    parser.add_argument(
        "--pictures",
        metavar="PNG",
        help="also draw the path, the force and every press beside the ideal object",
    )
    parser.add_argument("--workers", type=int, help="processes that solve touches (default: one a core)")
    add_options(parser, SimulateOptions)
    add_options(parser, HandOptions)
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
    options = options_from(arguments, SimulateOptions)
    person = cohort_hand(arguments.person)
    given = {k: getattr(arguments, k) for k in HandOptions.__dataclass_fields__ if hasattr(arguments, k)}
    hand = HandOptions(**{**person.__dict__, **given})
    effects = effects_from(arguments.effect)
    thing = phantom(arguments.phantom)
    with progress_bar("simulate") as progress:
        result = simulate(
            thing,
            effects,
            options,
            hand=hand,
            seed=arguments.seed,
            sizes=arguments.sizes,
            ideal=arguments.pictures is not None,
            workers=arguments.workers,
            progress=progress,
        )
    if arguments.seal:
        path = write_sealed(arguments.output, result.recording, result.truth, arguments.truth)
    else:
        path = write_recording(arguments.output, result.recording, truth=result.truth)
        if arguments.truth:
            emit_json({"truth": result.truth}, arguments.truth)
    if arguments.pictures:
        from palpate.report.laboratory import simulation_figure

        with atomic_file(arguments.pictures) as picture:
            simulation_figure(result).savefig(picture, dpi=110, format="png")
        say(arguments, f"pictures: {arguments.pictures}")
    duration = float(result.recording.t[-1])
    summary = {
        "recording": str(path),
        "samples": len(result.recording.t),
        "duration_s": duration,
        "palpations": len(result.touches),
        "sealed": bool(arguments.seal),
    }
    if not arguments.seal:
        summary["truth"] = result.truth
    say(
        arguments,
        f"{path}: {duration:.0f} s, {len(result.touches)} palpations of the {Path(thing.name).name}",
    )
    if not arguments.seal and "sizes" in result.truth:
        for name, size in result.truth["sizes"].items():
            refit = size["rms_after_best_scale_n"]
            say(arguments, f"  {name}: {size['rms_n']:.4f} N, {refit:.4f} N after a refit of the modulus")
    emit_json(summary, arguments.json)
    return 0
