"""Recompute what the load patch misses beside a sharp rim or above the base, from presses that are solved.

Bodies of unit modulus stand on their base: a tip of 5 mm presses, sticking, into the top of prisms beside a
rim, or into their flanks above the base, into flat layers and into known shapes (mechanics.press_solver,
neo-Hookean). The amounts of that part of mechanics.contact.edges that are not zero are fitted to the
logarithm of the forces, through the touch law; those of the other part stay.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from benchmarks._known_shapes import KnownShape
from benchmarks._more_shapes import EIGHT, thickness
from benchmarks._pressed_places import meshed
from palpate.mechanics.compliance.patch import usual_width
from palpate.mechanics.compliance.sites import (
    LoadPatch,
    patch_width,
    principal_curvatures,
    touch_sites,
    touch_solver,
)
from palpate.mechanics.contact import edges
from palpate.mechanics.contact.dent import ellipse_curvature
from palpate.mechanics.contact.edges import fitted, laid
from palpate.mechanics.contact.touch import TouchedPlaces, touch_forces
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.press_solver.press import PressOptions, PressSolver
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from tools.script import script

RADIUS_M, NU = 5e-3, 0.49
HEIGHT_M, LENGTH_M, WIDTH_M = 0.040, 0.080, 0.080
DEPTHS_M = 1e-3 * np.array([1.0, 2.0, 3.5, 5.0, 6.5, 8.0, 10.0, 12.0])
ANGLES = (90.0, 120.0)
LAYERS_M = (0.015, 0.022, 0.030, 0.040, 0.060, 0.100)
FROM_RIM_M = 1e-3 * np.array([1.5, 2.5, 3.5, 5.0, 8.0])
FROM_BASE_M = 1e-3 * np.array([6.5, 8.5, 11.0, 15.0, 21.0])
RIMS, BASE = "rims", "base"
UP = np.array([0.0, 0.0, 1.0])
SHALLOWEST = slice(6)
"""Of DEPTHS_M, on flanks: a base that holds their foot lets no sphere deeper."""
KNOWN = ("dome", "kidney", "block", "cylinder", "waist", "bowl", "wedge")
KNOWN_DEPTHS_M = 1e-3 * np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.5, 8.0])
LOW_M, CLEAR_M, THIN_M = 0.024, 0.010, 0.012
"""Half the places of a known shape lie lower; all farther from its rims, with more of it below them."""
DEEPEST_OF_LAYER = 0.5
STEPS = 61
_FAR_OFF = 0.02


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

    def places(self, part: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Points and normals (k, 3): on the top at FROM_RIM_M, or on the flank at FROM_BASE_M; then the
        middle of the top, which is far from both."""
        away = FROM_RIM_M if part == RIMS else FROM_BASE_M
        y = np.random.default_rng(seed).uniform(-0.015, 0.015, len(away))
        turn, (foot, _) = np.radians(self.angle), self.outline[1]
        if part == RIMS:
            points = np.column_stack([-away, y, np.full(len(away), HEIGHT_M)])
            normal = UP
        else:
            points = np.column_stack([foot + away * np.cos(turn), y, away * np.sin(turn)])
            normal = np.array([np.sin(turn), 0.0, -np.cos(turn)])
        far = np.array([-LENGTH_M / 2, 0.0, HEIGHT_M])
        return np.vstack([points, far]), np.vstack([np.tile(normal, (len(away), 1)), UP])


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which part and bodies, where to write."""
    parser.add_argument("--part", choices=(RIMS, BASE), required=True, help="whose amounts are fitted")
    parser.add_argument("--angles", type=float, nargs="+", default=list(ANGLES), help="of the rims, degrees")
    parser.add_argument(
        "--layers", type=float, nargs="*", default=list(LAYERS_M), help="for the base: how thick, m"
    )
    parser.add_argument("--known", nargs="*", choices=KNOWN, default=list(KNOWN), help="for the base: shapes")
    parser.add_argument("--places", type=int, default=14, help="of each known shape (default: 14)")
    parser.add_argument("--seed", type=int, default=0, help="of where along the edges (default: 0)")
    parser.add_argument("-o", "--output", help="CSV of widths and amounts (palpate.mechanics.contact.edges)")


@dataclass(frozen=True)
class Pressed:
    """A place that was pressed. depths: (d,) m. force: (d,) m^2 along the normal, nan where there was no
    equilibrium. far: (3, 3) 1/m, under the patch alone. laid: (g,) 1/m, of mechanics.contact.edges over the
    patch's width. curvature: 1/m, of the surface (mechanics.contact.dent.ellipse_curvature)."""

    normal: np.ndarray
    depths: np.ndarray
    force: np.ndarray
    far: np.ndarray
    laid: np.ndarray
    curvature: float

    def by_law(self, amounts: np.ndarray, bracing: np.ndarray, curvature: np.ndarray) -> np.ndarray:
        """(d,) m^2: the touch law's with these amounts (g,)."""
        way = np.unique(np.concatenate([np.linspace(0.0, self.depths[-1], STEPS), self.depths]))
        along = np.outer(self.normal, self.normal)
        place = TouchedPlaces(
            self.normal[None],
            (self.far + self.laid @ amounts * along)[None],
            np.array([self.curvature + self.laid @ curvature]),
            np.array([self.laid @ bracing]),
        )
        force = touch_forces(
            -way[:, None] * self.normal, np.array([0, len(way)]), place,
            young_modulus_pa=1.0, poisson_ratio=NU, tip_radius_m=RADIUS_M, law="neo-hookean",
        )  # fmt: skip
        return np.interp(self.depths, way, force @ self.normal)


def pressed(
    mesh: TetMesh,
    points: np.ndarray,
    normals: np.ndarray,
    depths: np.ndarray,
    shape: KnownShape | None = None,
) -> list[Pressed]:
    """Solve the places (k, 3) of a mesh, whose surface is plane there but for a known shape's."""
    solver, width = touch_solver(mesh, NU), usual_width(mesh)
    patch = LoadPatch(patch_width(solver.mesh))
    sites = touch_sites(mesh, points, normals, NU, solver=solver, curvature=0.0, patch=patch)
    truth = PressSolver(
        mesh.linear(), None if shape is None else (shape.vertices, shape.triangles), young_modulus_pa=1.0,
        poisson_ratio=NU, tip_radius_m=RADIUS_M, options=PressOptions(coupled=True),
    )  # fmt: skip
    bent = np.zeros(len(points))
    if shape is not None:
        bent = ellipse_curvature(principal_curvatures(mesh, points, normals, RADIUS_M), RADIUS_M)
    near, found = laid(mesh, points, normals) / width, []
    for k, (point, normal) in enumerate(zip(points, normals, strict=True)):
        force = truth.press(point, normal, depths).force @ normal
        found.append(Pressed(normal, depths, force, sites.far[k], near[k], float(bent[k])))
        print(" ".join(f"{value:8.3f}" for value in (*(1e3 * point), *(1e6 * force))), flush=True)
    return found


def fit(found: list[Pressed], part: str) -> tuple[np.ndarray, float, float]:
    """(3, g) compliances, bracing and curvature, and rms of what is left of the force without those of that
    part and with them.

    The Gaussian that has a curvature is of places on the rim itself, which no press here is, and stays. A few
    very deep presses are not met by any amounts: beyond _FAR_OFF they count in proportion, not by the square.
    """
    _, over, *amounts = fitted()
    given = np.stack(amounts)
    free = (given != 0) & (given[2] == 0) & ((over != edges.RIMS) == (part == BASE))
    known = np.isfinite(np.concatenate([one.force for one in found]))

    def left(numbers: np.ndarray) -> np.ndarray:
        amounts = given.copy()
        amounts[free] = numbers
        compliance, bracing, curvature = amounts
        forces = [one.by_law(compliance, bracing, curvature) / one.force for one in found]
        return np.log(np.concatenate(forces))[known]

    start = np.zeros(int(free.sum()))
    solved = least_squares(left, start, x_scale="jac", loss="soft_l1", f_scale=_FAR_OFF)
    given[free] = solved.x
    before, after = (float(np.sqrt((left(x) ** 2).mean())) for x in (start, solved.x))
    return given, before, after


def known_places(shape: KnownShape, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals (count, 3), half of them low."""
    points, normals = shape.places(400, 77)
    clear = (shape.rim_distance(points) > CLEAR_M) & (thickness(shape, points, normals) > THIN_M)
    points, normals = points[clear], normals[clear]
    low = points[:, 2] < LOW_M
    some = np.concatenate([np.flatnonzero(low)[: count // 2], np.flatnonzero(~low)[: count - count // 2]])
    return points[some], normals[some]


def run(arguments: argparse.Namespace) -> dict[str, np.ndarray | float]:
    """Solve, print, fit, and write."""
    found: list[Pressed] = []
    for angle in arguments.angles:
        prism = Prism(angle)
        depths = DEPTHS_M[SHALLOWEST] if arguments.part == BASE else DEPTHS_M
        found += pressed(meshed(prism, 0.01), *prism.places(arguments.part, arguments.seed), depths)
    for height in arguments.layers if arguments.part == BASE else ():
        side = max(LENGTH_M, 1.4 * height)
        across, down = round(side / 0.01), max(1, round(height / max(5e-3, 0.08 * height)))
        mesh = box_mesh((across, across, down), (side, side, height))
        depths = DEPTHS_M[DEPTHS_M < DEEPEST_OF_LAYER * height]
        found += pressed(mesh, np.array([[0.003, 0.004, height]]), UP[None], depths)
    for name in arguments.known if arguments.part == BASE else ():
        shape = EIGHT[name]()
        places = known_places(shape, arguments.places)
        found += pressed(meshed(shape, 0.01), *places, KNOWN_DEPTHS_M, shape)
    amounts, before, after = fit(found, arguments.part)
    widths, over, *_ = fitted()
    print(
        f"compliance, bracing, curvature {np.round(amounts, 4).tolist()}; {100 * before:.1f} % of the force "
        f"without, {100 * after:.1f} % with"
    )
    if arguments.output:
        bodies = f"prisms with rims of {arguments.angles} degrees"
        if arguments.part == BASE:
            bodies = f"flanks of {bodies}, layers of {arguments.layers} m, {', '.join(arguments.known)}"
        command = f"python -m tools.dent_edge --part {arguments.part}"
        header = (
            f"{arguments.part} last fitted: {bodies},\ntip {RADIUS_M} m, nu {NU}, neo-Hookean, sticking "
            f"sphere; made by '{command}' ({100 * after:.1f} % of the force is left)\n"
            "width over the patch's, 0 along rims, 1 over the base or 2 its inverse square, compliance, "
            "bracing, curvature"
        )
        table = np.column_stack([widths, over, amounts.T])
        with atomic_file(Path(arguments.output)) as temporary:
            np.savetxt(temporary, table, fmt=["%.2f", "%d", *3 * ["%.4f"]], delimiter=",", header=header)
    return {"amounts": amounts, "left_without": before, "left": after}


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
