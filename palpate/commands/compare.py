"""FEM against the interpolated 1D models on held-out palpations and held-out regions of one recording.

Of --model only the geometry is used; every parameter is refitted in each fold. Errors are rms force vectors
over contact samples that the fit has not seen, N; bias is the share by which the predicted force is too
large.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from palpate.arguments import (
    add_json,
    add_options,
    add_seed,
    emit_json,
    options_from,
    progress_bar,
    say,
)

if TYPE_CHECKING:
    from palpate.comparison import Comparison

SUMMARY = "FEM against interpolated 1D models on held-out palpations"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, --model, --report, folds, --json, --seed."""
    from palpate.comparison import CompareOptions

    parser.add_argument("recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    parser.add_argument("--model", metavar="MODEL", help="take the geometry from it (default: reconstruct)")
    parser.add_argument("-o", "--report", metavar="REPORT.html", help="write tables and pictures as one page")
    add_options(parser, CompareOptions)
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Compare, print, report."""
    from mechanics.model import read_model
    from mechanics.recording import read_recording
    from palpate.comparison import CompareOptions, compare

    recording = read_recording(arguments.recording)
    model = read_model(arguments.model) if arguments.model else None
    with progress_bar("compare") as progress:
        result = compare(
            recording,
            model,
            options_from(arguments, CompareOptions),
            seed=arguments.seed,
            progress=progress,
        )
    say(arguments, *lines(result))
    if arguments.report:
        from palpate.report.comparison import write_report

        say(arguments, f"report: {write_report(arguments.report, result, recording.name)}")
    emit_json(as_json(result), arguments.json)
    return 0


def as_json(result: Comparison) -> dict[str, Any]:
    """The contract's keys, and what stands behind them."""
    return {
        "palpations": len(result.presses),
        "rmse_n": result.rmse_n,
        "relative_rmse": result.relative_rmse,
        "regions": [
            {
                "name": r.region.name,
                "palpations": int(r.region.members.sum()),
                "rmse_n": r.rmse_n,
                "relative_rmse": r.relative_rmse,
                "bias": r.bias,
            }
            for r in result.regions
        ],
        "wins": {name: result.wins(name) for name in result.rmse_n},
        "noise_n": result.noise_n,
        "young_modulus_pa": result.moduli_pa,
    }


def lines(result: Comparison) -> list[str]:
    """The table and the verdict in words."""
    from palpate.comparison import verdict

    names = list(result.rmse_n)
    text = [f"{'held out':<22}{'presses':>8}  " + "".join(f"{name:>26}" for name in names)]

    def row(label: str, count: int, rmse: dict, share: dict, bias: dict | None) -> str:
        cells = []
        for name in names:
            cell = f"{rmse[name]:.3f} N {100 * share[name]:.1f} %"
            cells.append(cell + (f" bias {100 * bias[name]:+.0f} %" if bias else ""))
        return f"{label:<22}{count:>8}  " + "".join(f"{cell:>26}" for cell in cells)

    text.append(row("folds over sites", len(result.presses), result.rmse_n, result.relative_rmse, None))
    for r in result.regions:
        text.append(row(r.region.name, int(r.region.members.sum()), r.rmse_n, r.relative_rmse, r.bias))
    return [*text, f"sensor noise {result.noise_n:.3f} N; {verdict(result)}"]
