"""Whether the stated width of the law's error holds: presses drawn over eight shapes beside solved ones.

Places of each shape are drawn by kind (benchmarks._more_shapes: saddle, concave, thin, near the base, rim,
convex, flat), depths evenly to 30 % of the object under the place or 2.5 radii of the tip, Poisson's ratio
from 0.3 to 0.49 and Coulomb's friction from 0.1 to 1, or sticking, place by place. The tip has 5 mm and goes
straight in. Truth is our own solver of a press (finite strain, the energy of the dent's tables, `coupled`).
The virtual laboratory, another code, solves some of the places too; its energy holds the volume otherwise
(`split`, mechanics.press_solver.solid), so our solver takes that one beside it. All are kept in the user's
cache, so that what was interrupted goes on.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks._known_shapes import KnownShape
from benchmarks._more_shapes import EIGHT, KINDS, kinds, thickness
from benchmarks._pressed_places import TIP_M, in_laboratory, kept_force, meshed, rendered
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.disk.store import content_key
from palpate.mechanics.press_solver.press import PressOptions, PressSolver
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.output import progress_bar
from palpate.render.force_error import law_share

OF_THICKNESS, DEEPEST_M, LEAST_M, FIRST = 0.3, 2.5 * TIP_M, 2e-3, 0.12
"""Depths go to that share of what lies below, at most so deep, but always to LEAST_M; from that share on."""
RATIOS, FRICTIONS, STICKING = (0.3, 0.49), (0.1, 1.0), 0.4
"""Poisson's ratios; coefficients of friction, even in their logarithm; the share of places that stick."""
CANDIDATES = 300


@dataclass(frozen=True)
class Drawn:
    """A place of a shape: its kind, point and outward normal (3,) m, depths (d,) m; friction None sticks."""

    shape: str
    kind: str
    point: np.ndarray
    normal: np.ndarray
    depths: np.ndarray
    poisson_ratio: float
    friction: float | None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which shapes, how many places and depths."""
    parser.add_argument("--shapes", nargs="+", choices=tuple(EIGHT), default=list(EIGHT))
    parser.add_argument("--places", type=int, default=4, help="of each shape (default: 4)")
    parser.add_argument("--depths", type=int, default=10, help="of each place (default: 10)")
    parser.add_argument("--seed", type=int, default=31, help="of places and depths (default: 31)")
    parser.add_argument(
        "--laboratory", type=int, default=0, help="sticking places solved by it too (default: none)"
    )


def drawn(name: str, shape: KnownShape, places: int, depths: int, seed: int) -> list[Drawn]:
    """Places of a shape, of as many kinds as it has."""
    rng = np.random.default_rng([seed, list(EIGHT).index(name)])
    points, normals = shape.places(CANDIDATES, int(rng.integers(2**31)))
    of_kind, below = kinds(shape, points, normals), thickness(shape, points, normals)
    left = {kind: list(np.flatnonzero(of_kind == kind)) for kind in KINDS}
    found: list[Drawn] = []
    while len(found) < places and any(left.values()):
        for kind in KINDS:
            if left[kind] and len(found) < places:
                k = left[kind].pop(0)
                deepest = max(min(OF_THICKNESS * below[k], DEEPEST_M), LEAST_M)
                share = FIRST + (1 - FIRST) * (np.arange(depths) + rng.random(depths)) / depths
                friction = float(np.exp(rng.uniform(*np.log(FRICTIONS))))
                sticks, ratio = rng.random() < STICKING, float(rng.uniform(*RATIOS))
                found.append(
                    Drawn(
                        name,
                        kind,
                        points[k],
                        normals[k],
                        share * deepest,
                        ratio,
                        None if sticks else friction,
                    )
                )
    return found


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Solve and render all places; print tables; return errors, stated widths and figures."""
    progress, rows = progress_bar("places"), []
    laboratory = arguments.laboratory
    for name in arguments.shapes:
        shape = EIGHT[name]()
        mesh = meshed(shape, 0.01)
        for one in drawn(name, shape, arguments.places, arguments.depths, arguments.seed):
            truth = {"coupled": kept("press solver 2, its usual mesh", shape, one, own_solver(mesh))}
            if one.friction is None and laboratory > 0:
                laboratory -= 1
                truth["split"] = kept("press solver 3, split", shape, one, own_solver(mesh, coupled=False))
                truth["laboratory"] = kept("laboratory 2", shape, one, by_laboratory)
            force, numbers = rendered(
                mesh, one.point[None], one.normal[None], one.depths,
                poisson_ratio=one.poisson_ratio, friction=one.friction,
            )  # fmt: skip
            rows.append({"place": one, "truth": truth, "force_m2": force[0], "numbers": numbers[:, 0]})
            progress("places", len(rows) / (len(arguments.shapes) * arguments.places))
    progress.close()
    return report(rows)


Solve = Callable[[KnownShape, Drawn], np.ndarray]


def kept(name: str, shape: KnownShape, one: Drawn, solve: Solve) -> np.ndarray:
    """(d,) m^2 what `solve` answers at a place: normal force over the modulus; nan where it found no
    equilibrium. From the user's cache where it is there."""
    words = (name, repr(one.friction), repr(one.poisson_ratio))
    key = content_key("law bound", *words, shape.vertices, shape.triangles, one.point, one.normal, one.depths)
    return kept_force(key, lambda: solve(shape, one))


def own_solver(mesh: TetMesh, *, coupled: bool = True) -> Solve:
    """mechanics.press_solver on the tetrahedra of a mesh, by either energy."""

    def solve(shape: KnownShape, one: Drawn) -> np.ndarray:
        options = PressOptions(coupled=coupled, friction=one.friction)
        solver = PressSolver(
            mesh.linear(), (shape.vertices, shape.triangles), young_modulus_pa=1.0,
            poisson_ratio=one.poisson_ratio, tip_radius_m=TIP_M, options=options,
        )  # fmt: skip
        return solver.press(one.point, one.normal, one.depths).force @ one.normal

    return solve


def by_laboratory(shape: KnownShape, one: Drawn) -> np.ndarray:
    """The virtual laboratory's whole body."""
    return in_laboratory(
        shape, one.point, one.normal, one.depths, poisson_ratio=one.poisson_ratio, friction=one.friction
    )


def report(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Print errors by kind of place; return them and the figures."""
    for row in rows:
        one = row["place"]
        row["error"] = row["force_m2"] / row["truth"]["coupled"] - 1
        mu = np.inf if one.friction is None else one.friction
        stated = law_share(one.depths / TIP_M, *row["numbers"], poisson_ratio=one.poisson_ratio, friction=mu)
        row["stated"] = np.broadcast_to(stated, row["error"].shape)
    groups = {kind: [r for r in rows if r["place"].kind == kind] for kind in KINDS}
    groups |= {
        "sticking or friction over 0.4": [r for r in rows if (r["place"].friction or 1) > 0.4],
        "friction to 0.4": [r for r in rows if (r["place"].friction or 1) <= 0.4],
        "Poisson's ratio to 0.4": [r for r in rows if r["place"].poisson_ratio <= 0.4],
        "all": rows,
    }
    lines, figures = [], []
    for name, some in groups.items():
        if not (found := _counted(some)):
            continue
        count, missing, beyond, rms, worst, wide = found
        lines.append([name, str(len(some)), str(count), str(missing), f"{100 * beyond:.1f} %",
                      f"{rms:.2f} %", f"{worst:+.1f} %", f"{wide:.2f}"])  # fmt: skip
        figures.append(Figure(f"rms error, {name}, {count} presses", rms, (-abs(worst), abs(worst)), "%"))
        if name == "all":
            figures.append(Figure("forces beyond the stated width of the law's error", beyond).at_most(0.05))
            figures.append(Figure("median stated width over the rms error", wide).at_most(2.0))
            figures.append(Figure("presses whose solver found no equilibrium", missing))
    print(
        table(
            ["kind of place", "places", "presses", "unsolved", "beyond", "rms", "worst", "width / rms"], lines
        )
    )
    figures += _two_truths(rows)
    kept_rows = [
        {"shape": r["place"].shape, "kind": r["place"].kind, "friction": r["place"].friction,
         "poisson_ratio": r["place"].poisson_ratio, "depths_m": r["place"].depths, "error": r["error"],
         "stated": r["stated"], "numbers": r["numbers"], "truth": r["truth"]}
        for r in rows
    ]  # fmt: skip
    return {"places": kept_rows, "figures": figures}


def _counted(rows: list[dict[str, Any]]) -> tuple[int, int, float, float, float, float] | None:
    """(presses, unsolved, share beyond, rms %, worst %, median width over rms); None for no presses."""
    if not rows:
        return None
    error, stated = (np.concatenate([row[key] for row in rows]) for key in ("error", "stated"))
    known = np.isfinite(error)
    if not known.any():
        return None
    error, stated = error[known], stated[known]
    rms = float(np.sqrt((error**2).mean()))
    beyond, worst = float((np.abs(error) > stated).mean()), float(error[np.abs(error).argmax()])
    return len(error), int((~known).sum()), beyond, 100 * rms, 100 * worst, float(np.median(stated) / rms)


def _two_truths(rows: list[dict[str, Any]]) -> list[Figure]:
    """Two codes of one energy, and two energies of one code, where the laboratory was asked."""
    truths = [row["truth"] for row in rows if "laboratory" in row["truth"]]
    compared = {
        "our own solver beside the laboratory, of one energy (split)": ("split", "laboratory"),
        "the energy of the law's tables (coupled) beside the laboratory's (split)": ("coupled", "split"),
    }
    figures = []
    for what, (one, other) in compared.items() if truths else ():
        off = np.concatenate([100 * (truth[one] / truth[other] - 1) for truth in truths])
        off = off[np.isfinite(off)]
        worst = float(np.abs(off).max())
        rms = float(np.sqrt((off**2).mean()))
        figures.append(Figure(f"{what}, rms, {len(off)} presses", rms, (-worst, worst), "%"))
    return figures
