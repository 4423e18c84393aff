"""The virtual laboratory against another simulator's labelled recordings, at the same places and paths.

(That it solves what it says is a test: tests/scenes/laboratory.)
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._laboratory_comparison import block_shape, by_depth, compare, cylinder_shape
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.recording.recording import read_recording
from palpate.scenes.phantoms import phantom

KNOWN = {
    "silicone-1-cylinder": ("cylinder", cylinder_shape(40.0, 80.0)),
    "silicone-2-block": ("block", block_shape(105.0, 47.0)),
}
"""Recordings of known shape that may be compared: phantom and nearest-surface function (mm)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where labelled recordings are."""
    parser.add_argument("--recordings", type=Path, required=True, help=f"folder with {' and '.join(KNOWN)}")
    parser.add_argument("--presses", type=int, default=6, help="presses a recording (default: 6)")
    parser.add_argument("--workers", type=int, help="processes (default: one a core)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print both tables; returns their figures."""
    figures, rows, shares = {}, [], []
    for name, (shape, nearest) in KNOWN.items():
        recording = read_recording(arguments.recordings / f"{name}.csv.gz")
        pairs = compare(
            phantom(shape), recording, nearest, count=arguments.presses, workers=arguments.workers
        )
        for press, ours in pairs:
            along, theirs = ours @ press.normal, press.force @ press.normal
            depth = -press.travel @ press.normal
            deep = depth > 1.5
            difference = along[deep] / theirs[deep] - 1
            shallow = np.abs(along - theirs)[~deep].max(initial=0.0)
            rows.append(
                [
                    shape,
                    ", ".join(f"{x:.0f}" for x in press.point),
                    float(depth[-1]),
                    float(100 * difference.mean()),
                    float(100 * np.abs(difference).max()),
                    float(1e3 * shallow),
                    float(1e3 * np.sqrt(((ours - press.force) ** 2).sum(axis=1).mean())),
                ]
            )
        together = by_depth(pairs)
        shares += [[shape, d, f, f"{100 * x:+.2f} ± {100 * e:.2f}"] for d, f, x, e in together]
        figures[shape] = {
            "presses": [row[1:] for row in rows if row[0] == shape],
            "by_depth": together.tolist(),
        }
    print(
        table(
            [
                "phantom",
                "place [mm]",
                "depth [mm]",
                "mean difference [%]",
                "greatest [%]",
                "greatest above 1.5 mm [mN]",
                "rms of the vector [mN]",
            ],
            rows,
        )
    )
    print()
    header = ["phantom", "mean depth [mm]", "mean force [N]", "all presses together: difference [%]"]
    print(table(header, shares))
    every = np.array([row[3] for row in rows])
    what = "force against another simulator's, mean difference of a press"
    figure = Figure(what, float(every.mean()), (float(every.min()), float(every.max())), "%")
    return {"comparison": figures, "figures": [figure]}
