"""How far reconstructed surfaces lie from known shapes: mean and 95th percentile of the distance, error of
volume.

Every shape is touched at 28 places some 20 mm apart by a simulated hand (seeded); the peer is the paper's
hull of the same touches. Distances are taken both ways over the touchable part (from the truth to the surface
and back).
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

from benchmarks._surface_truth import OWN, Truth, phantom_truth, touch
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.shape.nearest import distance, sample
from palpate.output import progress_bar
from palpate.reconstruction.steps.s4_surface import SURFACES, SurfaceOptions, reconstruct_surface


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which shapes, how often, which surface."""
    parser.add_argument("--shapes", nargs="+", metavar="NAME", default=None, help="only these")
    parser.add_argument("--seeds", type=int, default=2, help="hands a shape (default: 2)")
    parser.add_argument(
        "--surface", choices=SURFACES, default="auto", help="the surface to measure (default: auto)"
    )


def truths() -> dict[str, Any]:
    """Makers of every known shape by name: the phantoms' and a few of which no phantom exists."""
    from palpate.scenes.phantoms import PHANTOMS

    return {**{name: (lambda name=name: phantom_truth(name)) for name in PHANTOMS}, **OWN}


def deviation(truth: Truth, vertices: np.ndarray, triangles: np.ndarray) -> dict[str, float]:
    """mean_m, p95_m, max_m of the distance both ways above the base, and volume_error (relative)."""
    kept = []
    for source, target in (
        ((truth.vertices, truth.triangles), (vertices, triangles)),
        ((vertices, triangles), (truth.vertices, truth.triangles)),
    ):
        points = sample(*source, 6000)
        kept.append(distance(*target, points[points[:, 2] > 0.0005]))
    corner = vertices[triangles]
    volume = np.einsum("ij,ij->i", np.cross(corner[:, 0], corner[:, 1]), corner[:, 2]).sum() / 6
    worst = max(kept, key=np.mean)
    return {
        "mean_m": float(worst.mean()),
        "p95_m": float(max(np.percentile(k, 95) for k in kept)),
        "max_m": float(max(k.max() for k in kept)),
        "volume_error": float(volume / truth.volume_m3 - 1),
    }


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure; print a table; return the figures."""
    makers = truths()
    names = arguments.shapes or list(makers)
    found: dict[str, Any] = {}
    rows = []
    progress = progress_bar("shapes")
    for k, name in enumerate(names):
        truth = makers[name]()
        for seed in range(arguments.seeds):
            evidence, back = touch(truth, seed)
            start = time.perf_counter()
            surface = reconstruct_surface(evidence, SurfaceOptions(surface=arguments.surface))
            seconds = time.perf_counter() - start
            hull = reconstruct_surface(evidence, SurfaceOptions(surface="hull"))
            own = deviation(truth, back(surface.vertices), surface.triangles)
            peer = deviation(truth, back(hull.vertices), hull.triangles)
            found[f"{name}-{seed}"] = {"method": surface.method, "seconds": seconds, **own, "hull": peer}
            rows.append(
                [f"{name} {seed}", surface.method]
                + [f"{1e3 * own[k]:.2f}" for k in ("mean_m", "p95_m", "max_m")]
                + [f"{100 * own['volume_error']:+.1f}"]
                + [f"{1e3 * peer[k]:.2f}" for k in ("mean_m", "p95_m")]
                + [f"{100 * peer['volume_error']:+.1f}", f"{seconds:.1f}"]
            )
        progress("shapes", (k + 1) / len(names))
    progress.close()
    header = [
        "shape",
        "surface",
        "mean mm",
        "95 % mm",
        "max mm",
        "volume %",
        "hull mean",
        "hull 95 %",
        "hull volume %",
        "s",
    ]
    print(table(header, rows))
    figures = []
    for words, measured in (
        ("surface", found),
        ("the paper's hull", {n: r["hull"] for n, r in found.items()}),
    ):
        away = np.array([1e3 * row["mean_m"] for row in measured.values()])
        what = f"{words}, mean distance to the true shape, median of {len(away)}"
        figures.append(Figure(what, float(np.median(away)), (float(away.min()), float(away.max())), "mm"))
    return {"shapes": found, "figures": figures}
