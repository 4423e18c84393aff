"""Recompute what the load patch misses beside a sharp rim and above the base, from presses that are solved.

Bodies of unit modulus stand on their base: a tip of 5 mm presses, sticking, into the top of prisms beside a
rim, into their flanks above the base, and into flat layers (mechanics.press_solver, neo-Hookean). At each
depth the dent's table and the far field under the patch leave something of the displacement; over the force
it is a compliance. The amounts of mechanics.contact.edges are fitted to it, by what they change of the force.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.felt_surface import meshed
from mechanics.compliance.patch import usual_width
from mechanics.compliance.sites import LoadPatch, patch_width, touch_sites, touch_solver
from mechanics.contact.dent import dent_law, grid
from mechanics.contact.edges import fitted, laid
from mechanics.disk.files import atomic_file
from mechanics.press_solver.press import PressOptions, PressSolver
from mechanics.shape.box_mesh import box_mesh
from mechanics.shape.tetmesh import TetMesh
from tools.script import script

RADIUS_M, NU = 5e-3, 0.49
HEIGHT_M, LENGTH_M, WIDTH_M = 0.040, 0.080, 0.080
DEPTHS_M = 1e-3 * np.array([1.0, 2.0, 3.5, 5.0])
ANGLES = (90.0, 120.0)
LAYERS_M = (0.006, 0.010)
FROM_RIM_M = 1e-3 * np.array([1.5, 2.5, 3.5, 5.0, 8.0])
FROM_BASE_M = 1e-3 * np.array([5.0, 6.5, 8.5])
DEEPEST_OF_LAYER = 0.6
LEAST = 0.5
"""Of a place's whole compliance times the patch's width, by which what is left is divided."""


@dataclass(frozen=True)
class Prism:
    """A prism along y whose top ends at x = 0 in a rim of that inner angle, degrees; metres."""

    angle: float

    @property
    def outline(self) -> np.ndarray:
        """(4, 2) x and z of its section, from the base's left corner against the clock."""
        foot = -HEIGHT_M / np.tan(np.radians(self.angle))
        return np.array([[-LENGTH_M, 0.0], [foot, 0.0], [0.0, HEIGHT_M], [-LENGTH_M, HEIGHT_M]])

    @property
    def vertices(self) -> np.ndarray:
        """(8, 3) m."""
        flat = np.insert(self.outline, 1, 0.0, axis=1)
        return np.vstack([flat - [0, WIDTH_M / 2, 0], flat + [0, WIDTH_M / 2, 0]])

    @property
    def triangles(self) -> np.ndarray:
        """(12, 3) outward."""
        faces = [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]
        for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)):
            faces += [[i, i + 4, j + 4], [i, j + 4, j]]
        return np.array(faces)

    def places(self, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Points and normals (k, 3): on the top at FROM_RIM_M, then on the flank at FROM_BASE_M."""
        count = len(FROM_RIM_M)
        y = np.random.default_rng(seed).uniform(-0.015, 0.015, count + len(FROM_BASE_M))
        turn, (foot, _) = np.radians(self.angle), self.outline[1]
        top = np.column_stack([-FROM_RIM_M, y[:count], np.full(count, HEIGHT_M)])
        flank = [foot + FROM_BASE_M * np.cos(turn), y[count:], FROM_BASE_M * np.sin(turn)]
        up, out = [0.0, 0.0, 1.0], [np.sin(turn), 0.0, -np.cos(turn)]
        return np.vstack([top, np.column_stack(flank)]), np.repeat(
            [up, out], [count, len(FROM_BASE_M)], axis=0
        )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which bodies, where to write."""
    parser.add_argument("--angles", type=float, nargs="+", default=list(ANGLES), help="of the rims, degrees")
    parser.add_argument("--layers", type=float, nargs="*", default=list(LAYERS_M), help="how thick, m")
    parser.add_argument("--seed", type=int, default=0, help="of where along the edges (default: 0)")
    parser.add_argument("-o", "--output", help="CSV of widths and amounts (mechanics.contact.edges)")


def left_over(
    mesh: TetMesh, points: np.ndarray, normals: np.ndarray, depths: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compliance that the law lacks, (places, depths), and the whole; what unit amounts add (places, g); all
    times the patch's width. NaN past the deepest, and where there is no equilibrium."""
    solver, width = touch_solver(mesh, NU), usual_width(mesh)
    patch = LoadPatch(patch_width(solver.mesh))
    sites = touch_sites(mesh, points, normals, NU, solver=solver, curvature=0.0, patch=patch)
    truth = PressSolver(
        mesh.linear(), None, young_modulus_pa=1.0, poisson_ratio=NU, tip_radius_m=RADIUS_M,
        options=PressOptions(coupled=True),
    )  # fmt: skip
    law, depth = dent_law("neo-hookean", NU), grid() * RADIUS_M
    table = law.force(depth, 1.0, NU, RADIUS_M)
    missed, whole = np.full((2, len(points), len(DEPTHS_M)), np.nan)
    for k, (point, normal) in enumerate(zip(points, normals, strict=True)):
        force = truth.press(point, normal, depths).force
        along, of_patch = force @ normal, force @ (sites.far[k] @ normal)
        missed[k, : len(depths)] = width * (depths - np.interp(along, table, depth) - of_patch) / along
        whole[k, : len(depths)] = width * depths / along
        print(" ".join(f"{value:8.4f}" for value in (*(1e3 * point), *missed[k], *whole[k])), flush=True)
    return missed, whole, laid(mesh, points, normals)


def fit(missed: np.ndarray, whole: np.ndarray, unit: np.ndarray) -> tuple[np.ndarray, float, float]:
    """(g,) amounts, and rms of what is left of the force without and with them. What places far from any
    edge lack at a depth is no matter of edges: a constant a depth is fitted beside."""
    some, depth = np.nonzero(np.isfinite(missed))
    weight = 1 / np.maximum(whole[some, depth], LEAST)
    columns = np.hstack([unit[some], np.eye(missed.shape[1])[depth]]) * weight[:, None]
    target = missed[some, depth] * weight
    found = np.linalg.lstsq(columns, target, rcond=None)[0]
    plain = target - columns[:, unit.shape[1] :] @ found[unit.shape[1] :]
    left = target - columns @ found
    before, after = (float(np.sqrt((part**2).mean())) for part in (plain, left))
    return found[: unit.shape[1]], before, after


def run(arguments: argparse.Namespace) -> dict[str, np.ndarray | float]:
    """Solve, print, fit, and write."""
    found = []
    for angle in arguments.angles:
        prism = Prism(angle)
        found.append(left_over(meshed(prism, 0.01), *prism.places(arguments.seed), DEPTHS_M))
    for height in arguments.layers:
        mesh = box_mesh((8, 8, max(1, round(height / 5e-3))), (LENGTH_M, WIDTH_M, height))
        depths = DEPTHS_M[DEPTHS_M < DEEPEST_OF_LAYER * height]
        found.append(left_over(mesh, np.array([[0.003, 0.004, height]]), np.array([[0, 0, 1.0]]), depths))
    missed, whole, unit = (np.vstack(part) for part in zip(*found, strict=True))
    amounts, before, after = fit(missed, whole, unit)
    widths, over_base, _ = fitted()
    print(
        f"amounts {np.round(amounts, 4)}; {100 * before:.1f} % of the force without, {100 * after:.1f} % with"
    )
    if arguments.output:
        header = (
            f"prisms with rims of {arguments.angles} degrees and flanks above the base, layers of "
            f"{arguments.layers} m,\ntip {RADIUS_M} m, nu {NU}, neo-Hookean, sticking sphere; "
            "made by 'python -m tools.dent_edge'\nwidth over the patch's, 0 along rims or 1 over the base, "
            "amount"
        )
        table = np.column_stack([widths, over_base, amounts])
        with atomic_file(Path(arguments.output)) as temporary:
            np.savetxt(temporary, table, fmt=["%.2f", "%d", "%.4f"], delimiter=",", header=header)
    return {"amounts": amounts, "left_without": before, "left": after}


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
