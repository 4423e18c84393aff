"""The virtual laboratory verified: patch test, Hertz, halved mesh and steps, tangents, energy.

Where labelled recordings of another simulator are given, also the comparison with them at the same places.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import trapezoid

from benchmarks.timing import table
from mechanics.dent import dent_law
from mechanics.recording import read_recording
from scenes.laboratory.comparison import block_shape, by_depth, compare, cylinder_shape
from scenes.laboratory.solid import Material, Solid
from scenes.laboratory.specimen import Fineness, Specimen
from scenes.laboratory.verification import (
    box,
    dent_force,
    hertz_ratio,
    patch_test,
    straight_press,
    tangent_error,
)
from scenes.phantoms import phantom

SUMMARY = "verification of the virtual laboratory, and comparison with another simulator"

KNOWN = {
    "silicone-1-cylinder": ("cylinder", cylinder_shape(40.0, 80.0)),
    "silicone-2-block": ("block", block_shape(105.0, 47.0)),
}
"""Recordings of known shape that may be compared: phantom and nearest-surface function (mm)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which parts, and where labelled recordings are."""
    parser.add_argument("--recordings", type=Path, help=f"folder with {' and '.join(KNOWN)}")
    parser.add_argument("--presses", type=int, default=6, help="presses a recording (default: 6)")
    parser.add_argument("--skip-verification", action="store_true", help="only the comparison")
    parser.add_argument("--workers", type=int, help="processes (default: one a core)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print both tables; returns their figures."""
    figures: dict[str, Any] = {}
    if not arguments.skip_verification:
        figures["verification"] = _verification()
    if arguments.recordings is not None:
        figures["comparison"] = _comparison(arguments)
    return figures


def _verification() -> dict[str, float]:
    figures, rows = {}, []

    def note(name: str, value: float, target: str) -> None:
        figures[name] = value
        rows.append([name, value, target])

    note("patch test: inner residual / force", patch_test(), "1e-10")
    mesh = box(20.0, 12.0, 6.0, 0.8)
    for name, changes in (
        ("neo-Hookean", {}),
        ("stiffening", {"stiffening": 0.35}),
        ("softening", {"stiffening": -0.35}),
        ("fibres", {"fibre": np.array([2.0, 1.0, 0.0, 0.0])}),
        ("Maxwell branch", {"prony": np.array([[0.3, 0.3]])}),
    ):
        material = Material(len(mesh.cells), 0.49)
        for key, value in changes.items():
            setattr(material, key, value)
        note(f"tangent against differences, {name}", tangent_error(material, Solid(mesh, material)), "1e-7")
    note("force / Hertz - 1", hertz_ratio() - 1, "0.015")
    depths = np.array([1.0, 2.0, 3.0, 4.0, 6.0])
    known = dent_law("linear").force(1e-3 * depths, 1e6, 0.49, 0.005)
    force = dent_force(depths)
    for depth, ratio in zip(depths, force / known, strict=True):
        note(
            f"sticking sphere, linear, {depth:g} mm deep: force / axisymmetric solution - 1",
            ratio - 1,
            "0.03",
        )
    change = float(np.abs(dent_force(depths, step=1.0) / force - 1).max())
    note("the same with load steps of 1 mm instead of 0.2 mm: greatest change", change, "0.005")
    thing, point, normal = phantom("cylinder"), np.array([40.0, 0.0, 40.0]), np.array([1.0, 0.0, 0.0])
    depths = np.array([0.3, 0.7, 1.2, 1.8, 2.5, 3.3, 4.1, 5.0])
    finite = Specimen(finite=True)
    start = time.process_time()
    force, energy = straight_press(thing, finite, point, normal, depths, Fineness())
    note("CPU seconds of one finite-strain press to 5 mm", time.process_time() - start, "")
    halved = np.sort(np.concatenate([depths, (depths[1:] + depths[:-1]) / 2, [0.15]]))
    more, more_energy = straight_press(thing, finite, point, normal, halved, Fineness())
    note("load steps halved: change at 5 mm", force[-1] / more[-1] - 1, "0.02")
    work = trapezoid(np.concatenate([[0], more]), np.concatenate([[0], halved]))
    # the penalty's springs hold the rest of the work
    note("work of the tip / stored energy - 1", work / more_energy[-1] - 1, "0.02")
    start = time.process_time()
    coarse, _ = straight_press(thing, Specimen(), point, normal, depths, Fineness())
    note("CPU seconds of one linear press", time.process_time() - start, "")
    fine, _ = straight_press(thing, Specimen(), point, normal, depths, Fineness(1.5, 5.0, 0.35))
    for k in (1, 3, 7):
        note(f"mesh halved: change at {depths[k]:g} mm", coarse[k] / fine[k] - 1, "0.02")
    print(table(["check", "measured", "target"], rows))
    return figures


def _comparison(arguments: argparse.Namespace) -> dict[str, Any]:
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
    return figures
