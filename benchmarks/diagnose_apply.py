"""Improved models: what they are worth on unseen presses.

First table: the first part of each recording is reconstructed and diagnosed, the rest replayed through the
renderer, by the ideal model (its modulus refitted), by the improved one as `--apply` writes it, and by one
with the effects of [truth], where the recording states it. Second table (--correct): effects of the
instrument are taken off the recording, which is diagnosed again. Kept in --work: a run that is stopped goes
on. (That effects are felt through the servo is a test: tests/support/effects_in_servo.py.)
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

from benchmarks._apply_replay import corrected_again, one
from benchmarks.evidence import Figure
from benchmarks.timing import table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recordings, where they are cut, and what is left out."""
    parser.add_argument("recordings", nargs="*", metavar="REC", help="recordings: .csv, .csv.gz or .toml")
    parser.add_argument(
        "--correct", nargs="*", default=[], metavar="REC", help="recordings to correct and diagnose again"
    )
    parser.add_argument("--share", type=float, default=0.7, help="of phase II that is fitted (default: 0.7)")
    parser.add_argument(
        "--work", metavar="FOLDER", help="keeps models and rows (default: a temporary folder)"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure, print both tables, return."""
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(arguments.work or temporary)
        work.mkdir(parents=True, exist_ok=True)
        result: dict[str, Any] = {"recordings": [], "corrected": []}
        if arguments.recordings:
            for path in arguments.recordings:
                result["recordings"].append(one(Path(path), arguments.share, work))
                _show(result["recordings"][-1:])
            _show(result["recordings"])
        for path in arguments.correct:
            result["corrected"].append(corrected_again(Path(path), work))
            _show_corrected(result["corrected"][-1:])
        if arguments.correct:
            _show_corrected(result["corrected"])
    result["figures"] = [
        Figure(f"{row['recording']}, unseen presses, {words}", 1e3 * row[f"{key}_n"], unit="mN")
        for row in result["recordings"]
        for key, words in (("ideal", "ideal model"), ("improved", "improved model"), ("noise", "noise"))
    ]
    return result


def _show_corrected(rows: list[dict[str, Any]]) -> None:
    header = [
        "recording",
        "truth",
        "named",
        "named once corrected",
        "plain gap, N",
        "once corrected",
        "noise",
    ]
    shown = []
    for row in rows:
        said = [
            (", ".join(row[f"named_{when}"]) or row[f"kind_{when}"])
            + "".join(f" (or {name})" for name in row[f"candidates_{when}"])
            for when in ("before", "after")
        ]
        gaps = [row["gap_before_n"], row["gap_after_n"], row["noise_n"]]
        shown.append([row["recording"], ", ".join(row["truth"]) or "-", *said, *gaps])
    print(table(header, shown), flush=True)


def _show(rows: list[dict[str, Any]]) -> None:
    header = ["recording", "truth", "named", "ideal, N rms", "finite strain alone", "improved"]
    header += ["with the truth's effects", "noise"]
    shown = [
        [
            row["recording"],
            ", ".join(row["truth"]) or "-",
            ", ".join(row["named"]) or "-",
            row["ideal_n"],
            row.get("finite_strain_alone_n", "-"),
            row["improved_n"],
            row.get("truth_n", "-"),
            row["noise_n"],
        ]
        for row in rows
    ]
    print(table(header, shown), flush=True)
