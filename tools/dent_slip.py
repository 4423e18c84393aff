"""Solve what slip takes off the dent's normal force (mechanics/contact/dent_slip.csv).

A tip of 5 mm presses straight into the middle of a large block (mechanics.press_solver), with Coulomb's
friction between it and the surface; each force is divided by that of a tip that sticks.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from benchmarks.press_solver import RADIUS_M, Block
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.press_solver.press import PressOptions
from tools.script import script

DEPTHS = np.array([0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5])
"""Tip radii."""
RATIOS, FRICTIONS = (0.35, 0.49), (0.0, 0.05, 0.1, 0.2, 0.4)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where it is written."""
    parser.add_argument("-o", "--output", metavar="CSV", help="write the table")


def run(arguments: argparse.Namespace) -> dict[str, np.ndarray]:
    """Solve, print, and write."""
    rows, block = [], Block()

    def pressed(nu: float, friction: float | None) -> np.ndarray:
        return block.pressed(RADIUS_M * DEPTHS, PressOptions(coupled=True, friction=friction), nu)[0]

    for nu in RATIOS:
        sticking = pressed(nu, None)
        for friction in FRICTIONS:
            # two solutions of one press differ by a thousandth or two
            share = np.minimum(pressed(nu, friction) / sticking, 1.0)
            rows.append([nu, friction, *share])
            print(nu, friction, " ".join(f"{x:.4f}" for x in share), flush=True)
    if arguments.output:
        header = (
            "normal force over that of a sticking sphere, neo-Hookean, made by 'python -m tools.dent_slip'\n"
            "0, 0, depths in tip radii; then rows of Poisson's ratio, friction, and the shares there"
        )
        with atomic_file(Path(arguments.output)) as temporary:
            table, form = [[0.0, 0.0, *DEPTHS], *rows], ["%.2f", "%.2f", *len(DEPTHS) * ["%.4f"]]
            np.savetxt(temporary, table, fmt=form, delimiter=",", header=header)
    return {"rows": np.array(rows)}


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
