"""The virtual laboratory against another simulator's labelled recordings, at the same places and paths.

(That it solves what it says is a test: tests/scenes/laboratory.)
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.recording.recording import Recording, read_recording
from palpate.render.replay import rms_n
from palpate.scenes.laboratory.curves import PathJob, Solving, curves
from palpate.scenes.laboratory.specimen import Specimen
from palpate.scenes.phantoms import Phantom, phantom

SHARES = np.array([0.0, 0.04, 0.1, 0.18, 0.28, 0.4, 0.52, 0.64, 0.76, 0.88, 0.97])
"""Depths that are compared, as shares of a press's greatest depth."""


@dataclass(frozen=True)
class Press:
    """The way in of one recorded press: point and normal (object frame, mm); travel (k, 3) mm; force (k, 3)
    N.
    """

    point: np.ndarray
    normal: np.ndarray
    travel: np.ndarray
    force: np.ndarray


Shape = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def cylinder_shape(radius: float, height: float) -> Shape:
    """Nearest-surface function of an upright cylinder, mm: position (3,) -> (surface point,
    outward normal).
    """

    def nearest(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        r = np.hypot(x[0], x[1])
        if x[2] > height and r < radius:
            return np.array([x[0], x[1], height]), np.array([0.0, 0.0, 1.0])
        n = np.array([x[0] / r, x[1] / r, 0.0])
        return radius * n + [0, 0, x[2]], n

    return nearest


def block_shape(length: float, height: float) -> Shape:
    """Nearest-surface function of a square block, mm."""

    def nearest(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        half = length / 2
        if x[2] > height and max(abs(x[0]), abs(x[1])) < half:
            return np.array([x[0], x[1], height]), np.array([0.0, 0.0, 1.0])
        axis = int(abs(x[1]) > abs(x[0]))
        n = np.zeros(3)
        n[axis] = np.sign(x[axis])
        p = x.copy()
        p[axis] = half * n[axis]
        return p, n

    return nearest


def recorded_presses(recording: Recording, nearest: Shape) -> list[Press]:
    """The ways in of all presses; first touch is where the known shape puts it, not where the force rises."""
    truth = recording.truth or {}
    turn = np.array(truth.get("device_from_object_rotation", np.eye(3).tolist()))
    shift = np.array(truth.get("device_from_object_shift_mm", [0.0, 0.0, 0.0]))
    position = (1e3 * recording.position - shift) @ turn
    force = recording.force_on_tool @ turn
    if recording.boundary_phase is None:
        raise RecordingError(f"'{recording.name}' does not say where phase I ends")
    radius = 1e3 * recording.tip_radius_m
    position = gaussian_filter1d(position, 4.0, axis=0)
    smooth = gaussian_filter1d(force, 4.0, axis=0)
    strong = (np.linalg.norm(smooth, axis=1) > 0.1) & (recording.t > recording.boundary_phase[1] + 0.5)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], strong.astype(int), [0]])))
    presses = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start < 60:
            continue
        peak = start + int(np.linalg.norm(smooth[start:end], axis=1).argmax())
        foot, normal = nearest(position[start])
        offset = (position[: peak + 1] - foot) @ normal - radius
        first = peak - int(np.argmax(offset[::-1] > 0)) if (offset > 0).any() else 0
        foot, normal = nearest(position[first])
        depth = radius - (position[first : peak + 1] - foot) @ normal
        depth -= depth[0]
        deepest = int(depth.argmax())
        if depth[deepest] < 2.5 or first < 20:
            continue
        depth, rows = np.maximum.accumulate(depth[: deepest + 1]), np.arange(first, first + deepest + 1)
        at = np.searchsorted(depth, SHARES * depth[-1])
        centre = foot + radius * normal
        travel = position[rows[at]] - centre
        travel[0] = 0.0
        presses.append(Press(foot, normal, travel, smooth[rows[at]]))
    return presses


def compare(
    phantom: Phantom,
    recording: Recording,
    nearest: Shape,
    *,
    count: int = 8,
    workers: int | None = None,
) -> list[tuple[Press, np.ndarray]]:
    """(press, our force (k, 3) N along its recorded path) for `count` presses spread over the recording."""
    presses = recorded_presses(recording, nearest)
    chosen = [presses[k] for k in np.unique(np.linspace(0, len(presses) - 1, count).round().astype(int))]
    jobs = [PathJob(p.point.round(3), p.normal, p.travel.round(4)) for p in chosen]
    radius = round(1e3 * recording.tip_radius_m, 6)
    specimen = Specimen(poisson_ratio=recording.poisson_ratio or 0.49, tip_radius=radius, finite=True)
    solved = curves(phantom, specimen, jobs, Solving(workers, label=f"comparing the {phantom.name}"))
    modulus = float((recording.truth or {})["young_modulus_pa"])
    return [(press, 1e-6 * modulus * curve.force) for press, curve in zip(chosen, solved, strict=True)]


def by_depth(pairs: list[tuple[Press, np.ndarray]]) -> np.ndarray:
    """(len(SHARES) - 1, 4): mean depth mm, mean recorded normal force N, sum of ours / sum of theirs - 1,
    its standard error from the scatter among presses.

    Noise of single presses averages out here, so that shallow depths can be judged too.
    """
    ours = np.array([force @ press.normal for press, force in pairs])[:, 1:]
    theirs = np.array([press.force @ press.normal for press, _ in pairs])[:, 1:]
    depth = np.array([-press.travel @ press.normal for press, _ in pairs])[:, 1:]
    difference = ours - theirs
    spread = difference.std(axis=0, ddof=1) / np.sqrt(len(pairs)) if len(pairs) > 1 else np.nan
    mean = theirs.mean(axis=0)
    return np.column_stack(
        [depth.mean(axis=0), mean, difference.mean(axis=0) / mean, np.broadcast_to(spread / mean, mean.shape)]
    )


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
                    1e3 * rms_n(ours - press.force),
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
