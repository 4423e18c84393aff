"""The sim-to-real gap: where the simulated force leaves the measured one, which effect was left out, how far
the gap shrinks.

REC is a recording's .csv, .csv.gz or .toml. Without --model the recording is reconstructed first. The answer
may be one effect, several, a set that the touches cannot tell apart, "none" (the gap is noise) or "unknown".
Forces in N (rms of the 3-vector over contact samples of held-out places), lengths in m, moduli in Pa.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mechanics.errors import OptionError
from mechanics.model import read_model, write_model
from mechanics.recording import read_recording, write_recording
from palpate.arguments import add_json, add_options, add_seed, emit_json, options_from, progress_bar, say

SUMMARY = "the sim-to-real gap: where, which effect, how far it shrinks"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, --model, --apply, --corrected, --report, options, --json, --seed."""
    from diagnose.judging import AttributionOptions
    from diagnose.pipeline import DiagnoseOptions
    from diagnose.whiten import NuisanceOptions

    parser.add_argument("recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    parser.add_argument(
        "--model", metavar="MODEL", help="its model; without it the recording is reconstructed"
    )
    parser.add_argument(
        "--apply", metavar="MODEL2", help="write the improved model (object, contact, boundary effects)"
    )
    parser.add_argument(
        "--corrected",
        metavar="REC2",
        help="write the recording with the instrument's effects taken off (.csv.gz, .csv)",
    )
    parser.add_argument(
        "--report", metavar="HTML", help="write the three answers with pictures as one HTML page"
    )
    add_options(parser, DiagnoseOptions, skip=("seed",))
    add_options(parser, AttributionOptions)
    add_options(parser, NuisanceOptions)
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, say it, and write what was asked for."""
    from diagnose.apply import corrected, improved, with_replayed_modulus
    from diagnose.judging import AttributionOptions
    from diagnose.pipeline import DiagnoseOptions, diagnose
    from diagnose.whiten import NuisanceOptions

    if arguments.corrected and not arguments.corrected.endswith((".csv", ".csv.gz")):
        raise OptionError(f"--corrected '{arguments.corrected}' must end in .csv or .csv.gz")
    recording = read_recording(arguments.recording)
    options = options_from(arguments, DiagnoseOptions, seed=arguments.seed)
    chosen = {}
    if hasattr(arguments, "most"):
        chosen["most"] = arguments.most
    elif options.fast:
        chosen["most"] = 1
    with progress_bar("diagnose") as progress:
        if arguments.model:
            from reconstruct.placing import presses_on

            model = read_model(arguments.model)
            model = model.replaced(presses=presses_on(recording, model))
        else:
            from reconstruct.pipeline import ReconstructOptions, reconstruct

            model = reconstruct(
                recording, ReconstructOptions(), lambda s, x: progress(f"model: {s}", 0.3 * x)
            )
        result = diagnose(
            recording,
            model,
            options,
            lambda s, x: progress(s, x if arguments.model else 0.3 + 0.7 * x),
            nuisance=options_from(arguments, NuisanceOptions),
            attribution=options_from(arguments, AttributionOptions, **chosen),
        )
    say(arguments, *result.words())
    if arguments.apply:
        better, kept = improved(model, result)
        better = with_replayed_modulus(better, corrected(recording, result))
        write_model(arguments.apply, better)
        say(arguments, f"improved model ({', '.join(kept) or 'modulus only'}): {arguments.apply}")
    if arguments.corrected:
        write_recording(Path(arguments.corrected), corrected(recording, result))
        say(arguments, f"corrected recording: {arguments.corrected}")
    if arguments.report:
        from palpate.report.diagnosis import write_report

        say(arguments, f"report: {write_report(arguments.report, recording, model, result)}")
    emit_json(result.as_json(), arguments.json)
    return 0
