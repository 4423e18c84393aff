"""How far the law is off at every place of known shapes, by depth, beside the laboratory's whole bodies.

The shapes are files of chords (benchmarks._known_shapes). At places spread over each, the laboratory presses
a sticking tip of 5 mm straight in (finite strain, nu 0.49, its mesh graded towards the touch); the renderer
follows the same path on its own mesh, with the exact modulus. Depths are counted from each one's own surface.
`without` is the same renderer whose dent knows of the surface's curvature by the effective radius alone.
Solved presses are kept in the user's cache.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from benchmarks._known_shapes import SHAPES, KnownShape
from benchmarks._pressed_places import FINENESS, TIP_M, in_laboratory, kept_force, meshed, rendered
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.disk.store import content_key
from palpate.output import progress_bar
from palpate.render.force_error import law_share
from palpate.scenes.laboratory.specimen import Fineness

DEPTHS_M = 1e-3 * np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])
BANDS_MM = ((1, 2), (2, 4), (4, 6), (6, 8))
SHALLOW, SHALLOW_M = Fineness(1.3, 4.0, 0.35), 2e-3
"""Of the laboratory down to that depth: in the middle of the block the finer one is 0.7 to 0.9 % harder
from 1 to 2 mm, at most 0.25 % from 3 mm on. Its penalty takes 0.5 % off at 1 mm and 0.3 % from 3 mm
on (axisymmetric elements at the apex of the dome)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which shapes, how many places."""
    parser.add_argument("--shapes", nargs="+", choices=tuple(SHAPES), default=list(SHAPES))
    parser.add_argument("--places", type=int, default=10, help="of each shape (default: 10)")
    parser.add_argument("--size-mm", type=float, default=10.0, help="of the renderer's mesh (default: 10)")
    parser.add_argument("--seed", type=int, default=11, help="of the places (default: 11)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Press both; print a table by depth; return the errors and the figures."""
    progress, rows, found, figures = progress_bar("places"), [], {}, []
    for k, name in enumerate(arguments.shapes):
        shape = SHAPES[name]()
        points, normals = shape.places(arguments.places, arguments.seed)
        mesh = meshed(shape, 1e-3 * arguments.size_mm)
        truth = np.array([_solved(shape, *place) for place in zip(points, normals, strict=True)])
        progress("places", (k + 1) / len(arguments.shapes))
        for tag, bent in (("without", False), ("law", True)):
            force, numbers = rendered(mesh, points, normals, DEPTHS_M, bent=bent)
            error = 100 * (force / truth - 1)
            found[f"{name}, {tag}"] = {"points_m": points, "error_percent": error, "place": numbers}
            rows.append([name, tag, *(_band(error, low, high) for low, high in BANDS_MM), *_whole(error)])
            if bent:
                rms = float(np.sqrt(np.nanmean(error**2)))
                each = np.sqrt(np.nanmean(error**2, axis=1))
                figures.append(
                    Figure(f"normal force beside the laboratory, {name}, rms", rms, _ends(each), "%").at_most(
                        1.5
                    )
                )
                worst = float(np.nanmax(np.abs(error)))
                figures.append(Figure(f"the same, {name}, worst", worst, unit="%").at_most(4.0))
    progress.close()
    figures += _bounds([found[f"{name}, law"] for name in arguments.shapes])
    print(table(["shape", "law", *(f"{a} to {b} mm" for a, b in BANDS_MM), "rms", "worst"], rows))
    return {"errors": found, "figures": figures}


def _bounds(found: list[dict[str, np.ndarray]]) -> list[Figure]:
    """How often the stated 95 % width holds, and how wide it is beside the errors themselves."""
    error = np.concatenate([one["error_percent"] for one in found]) / 100
    numbers = np.concatenate([one["place"] for one in found], axis=1)
    stated = law_share(DEPTHS_M / TIP_M, *numbers[:, :, None])
    known = np.isfinite(error)
    beyond = float((np.abs(error) > stated)[known].mean())
    wide = float(np.median(stated[known]) / np.sqrt((error[known] ** 2).mean()))
    return [
        Figure("forces beyond the stated width of the law's error", beyond).at_most(0.05),
        Figure("median stated width over the rms error", wide).at_most(2.0),
    ]


def _ends(values: np.ndarray) -> tuple[float, float]:
    return float(np.nanmin(values)), float(np.nanmax(values))


def _band(error: np.ndarray, low: float, high: float) -> str:
    some = error[:, (DEPTHS_M >= 1e-3 * low - 1e-9) & (DEPTHS_M < 1e-3 * high + 1e-9)]
    return f"{np.nanmean(some):+.1f} ± {np.nanmean(np.nanstd(some, axis=0)):.1f} %"


def _whole(error: np.ndarray) -> tuple[str, str]:
    return f"{np.sqrt(np.nanmean(error**2)):.1f} %", f"{error.flat[np.nanargmax(np.abs(error))]:+.1f} %"


def _solved(shape: KnownShape, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(depths,) m^2 by the laboratory's whole body: normal force over the modulus, by its finer mesh as deep
    as that goes; NaN from where it finds no equilibrium."""
    force = _kept(shape, point, normal, FINENESS, DEPTHS_M[-1], repr(FINENESS))
    shallow = DEPTHS_M <= SHALLOW_M
    force[shallow] = _kept(shape, point, normal, SHALLOW, SHALLOW_M, repr((SHALLOW, SHALLOW_M)))[shallow]
    return force


def _kept(
    shape: KnownShape, point: np.ndarray, normal: np.ndarray, fineness: Fineness, to_m: float, made_of: str
) -> np.ndarray:
    """(depths,) m^2 down to `to_m`, NaN below; from the user's cache where it is there."""

    def solve() -> np.ndarray:
        depths, force = DEPTHS_M[DEPTHS_M <= to_m], np.full(len(DEPTHS_M), np.nan)
        force[: len(depths)] = in_laboratory(shape, point, normal, depths, fineness=fineness)
        return force

    at = (shape.vertices, shape.triangles, point, normal, DEPTHS_M)
    return kept_force(content_key("law by place 2", *at, made_of), solve)
