"""The conformance kit: its truth beside the virtual laboratory, its flaws' scores, and simulators' scores.

The laboratory is another code with another mesh inside the kit's own boundary: it presses the bodies by the
same depths at small strains, its tip sticking, and then moves it sideways as far as the shipped solution
does, from which the slides are made (`truth`). Told is its force over the shipped one of that law, and how
much of the bound that is; sideways against the share of the force that the bound holds for slides. Forces of
simulators are those that the kit's adapters wrote, each in a folder of its name.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import io
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.output import progress_bar
from palpate.scenes.conformance.cases import (
    BODIES,
    POISSON,
    SHARES,
    SLIP_SHARE,
    STUCK,
    TIP_M,
    YOUNG_PA,
    Body,
)
from palpate.scenes.conformance.flaws import FLAWS
from palpate.scenes.conformance.kit import write_kit
from palpate.scenes.conformance.truth import alone
from palpate.scenes.laboratory.mesh import boundary_faces
from palpate.scenes.laboratory.specimen import Fineness, Specimen, build
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.phantoms import Phantom

FINENESS = Fineness(1.2, 6.0, 0.45)
"""Of the laboratory's mesh: some 0.4 radii of the contact."""
SOLVED_BY_IT = tuple(body for body in BODIES if body.name != "half-space")
"""The half-space's truth is closed."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which bodies; where simulators' forces are."""
    names = [body.name for body in SOLVED_BY_IT]
    parser.add_argument("--bodies", nargs="*", choices=names, default=names, help="for the laboratory")
    parser.add_argument("--work", type=Path, help="folder of forces: NAME/CASE.csv of simulators NAME")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Solve, score, print; return the figures."""
    figures = beside_laboratory([body for body in SOLVED_BY_IT if body.name in arguments.bodies])
    with tempfile.TemporaryDirectory() as name:
        began, folder = time.process_time(), Path(name) / "kit"
        made = write_kit(folder)
        figures.append(
            Figure("making the kit, processor time", time.process_time() - began, unit="s").at_most(60)
        )
        figures.append(Figure("size of the kit", made.size_bytes / 1e6, unit="MB").at_most(20))
        score, rows = scorer(folder), []
        for flaw in FLAWS:
            found = score(folder / "examples" / flaw)
            rows.append([flaw, *_cells(found)])
            figures.append(Figure(f"score of the truth with {flaw}", found["score"]).at_most(0.999))
        for forces in sorted(arguments.work.iterdir()) if arguments.work else ():
            if forces.is_dir():
                found = score(forces)
                rows.append([forces.name, *_cells(found)])
                figures += _of_simulator(forces.name, found)
        print(table(["forces", "score", *(b.name for b in BODIES), "two-tips"], rows))
    return {"figures": figures}


def _cells(found: dict[str, Any]) -> list[str]:
    cases = [f"{100 * row['within']:.0f} %, {1e3 * row['off_n']:.1f} mN" for row in found["rows"]]
    return [f"{found['score']:.4f}", *cases]


def _of_simulator(name: str, found: dict[str, Any]) -> list[Figure]:
    """Of the cases that it ran; a score only where it ran all."""
    ran = [row for row in found["rows"] if not any(note.startswith("no ") for note in row["notes"])]
    figures = [Figure(f"score of {name}'s adapter", found["score"])] if len(ran) == len(found["rows"]) else []
    for row in ran:
        share = row["off_n"] / row["force_n"]
        figures.append(Figure(f"{name}, {row['name']}: within the bound", 100 * row["within"], unit="%"))
        figures.append(Figure(f"{name}, {row['name']}: rms error over the force", 100 * share, unit="%"))
    return figures


def scorer(kit: Path) -> Callable[[Path], dict[str, Any]]:
    """score(folder of forces) by the kit's own file: {"score": 0 to 1, "rows": [...]}."""
    spec = importlib.util.spec_from_file_location("kit_score", kit / "score.py")
    assert spec is not None and spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def score(forces: Path) -> dict[str, Any]:
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            assert module.main([str(forces)]) == 0
        return {"score": float(said.getvalue().split()[-1]), "rows": module.scored(forces)[1]}

    return score


def beside_laboratory(bodies: list[Body]) -> list[Figure]:
    """The laboratory's force over the shipped one of its law, and the difference over the bound."""
    progress, rows, figures = progress_bar("laboratory"), [], []
    heads = ["body", *(f"{x:g} of the depth" for x in SHARES), "over the bound", "sideways", "CPU s"]
    for done, body in enumerate(bodies):
        began = time.process_time()
        whole = in_laboratory(body)
        spent = time.process_time() - began
        other, along = whole[:-1], body.solved.along
        held, shipped = (float(f[-1] @ along - f[-2] @ along) for f in (whole, body.solved.force[0]))
        aside = held / shipped - 1
        own, tip = body.solved.force[0, : len(SHARES)], alone(body)
        over = np.einsum("ki,ki->k", other, own) / np.einsum("ki,ki->k", own, own) - 1
        bound = np.array(
            [
                tip.bound[np.argmin(np.abs(tip.way[: int(np.argmax(tip.way[:, 0])) + 1, 0] - d))]
                for d in SHARES * body.depth_m
            ]
        )
        share = np.linalg.norm(other - own, axis=1) / bound
        worst = 100 * float(np.abs(over).max())
        rows.append(
            [
                body.name,
                *(f"{100 * x:+.2f} %" for x in over),
                f"{share.max():.2f}",
                f"{100 * aside:+.2f} %",
                f"{spent:.0f}",
            ]
        )
        figures.append(
            Figure(f"{body.name}: worst of {len(over)} depths over the laboratory", worst, unit="%")
        )
        figures.append(
            Figure(f"{body.name}: that difference over the bound", float(share.max())).at_most(1.0)
        )
        sideways = Figure(f"{body.name}: force sideways over the laboratory", 100 * abs(aside), unit="%")
        figures.append(sideways.at_most(100 * SLIP_SHARE))
        progress("laboratory", (done + 1) / len(bodies))
    progress.close()
    if rows:
        print(table(heads, rows))
    return figures


def in_laboratory(body: Body) -> np.ndarray:
    """(depths + 1, 3) N on a tip that sticks, small strains, at SHARES of the body's depth, then STUCK of it
    along."""
    solved = body.solved
    faces, _ = boundary_faces(solved.tetrahedra.astype(int))
    thing = Phantom(body.name, body.name, solved.points, faces, 1.0, POISSON)
    at = TriangleSurface(1e3 * thing.vertices, thing.faces).nearest(1e3 * solved.place)[0][0]
    specimen = Specimen(POISSON, 1e3 * TIP_M)
    problem = build(thing, specimen, at, travel=0.0, fineness=FINENESS)
    radius, force, depth = 1e3 * TIP_M, [], 0.0
    state: Any = problem.rest(at + radius * solved.normal)
    for share in SHARES:
        for part in np.linspace(depth, 1e3 * share * body.depth_m, 4)[1:]:
            state = problem.advance(state, at + (radius - part) * solved.normal)
        depth = 1e3 * share * body.depth_m
        force.append(1e-6 * YOUNG_PA * state.force)
    for slid in np.linspace(0, STUCK * depth, 3)[1:]:
        state = problem.advance(state, at + (radius - depth) * solved.normal + slid * solved.along)
    force.append(1e-6 * YOUNG_PA * state.force)
    return np.array(force)
