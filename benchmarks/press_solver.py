"""Is the solver of a press converged, and how near is it to the tables and to the virtual laboratory?

A sticking tip is pressed into a large block (the axisymmetric tables stand beside it) and into a phantom
(the laboratory, which is another code, stands beside it). Mesh, zone of finite strain, load step and penalty
are each made finer alone. Told are the changes of force at every depth and the processor time.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.press_solver.press import PressOptions, PressSolver
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.scenes.phantoms import PHANTOMS, Phantom

RADIUS_M, POISSON_RATIO = 5e-3, 0.49
DEEPEST_MM = 8.0
FINER: Mapping[str, PressOptions] = {
    "a finer mesh": PressOptions(growth=0.5, finest=0.3),
    "a larger zone": PressOptions(zone=9.0),
    "shorter steps": PressOptions(step=0.1),
    "a stiffer contact": PressOptions(penalty=4500.0),
}
"""What is made finer, each alone."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which places, how many depths, what beside."""
    parser.add_argument("--depths", type=int, default=12, help=f"to {DEEPEST_MM:g} mm (default: 12)")
    parser.add_argument(
        "--phantom", choices=sorted(PHANTOMS), default="cylinder", help="beside the block (default: cylinder)"
    )
    parser.add_argument(
        "--at",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="the place is nearest to it, mm (default: top)",
    )
    parser.add_argument("--laboratory", action="store_true", help="solve the phantom there as well (minutes)")
    parser.add_argument("--convergence", action="store_true", help="make each fineness finer (minutes)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Press, compare, print; a row of changes in % of the force for every comparison."""
    depths = 1e-3 * np.linspace(0, DEEPEST_MM, arguments.depths + 1)[1:]
    rows, figures = [], []
    block = Block()
    for law, coupled in (("linear", False), ("neo-hookean", True)):
        force, cpu = block.pressed(depths, PressOptions(law=law, coupled=coupled))
        known = dent_law(law, POISSON_RATIO).force(depths, 1.0, POISSON_RATIO, RADIUS_M)
        rows.append(_row(f"block, {law}, over the table", force / known - 1, cpu))
        worst = 100 * float(np.abs(force / known - 1).max())
        figures.append(Figure(f"block, {law}: worst of {len(depths)} depths", worst, unit="%").at_most(1.5))
        figures.append(Figure(f"block, {law}: processor time of a place", cpu, unit="s").at_most(5.0))
    place = Place(arguments.phantom, arguments.at)
    force, cpu = place.pressed(depths, PressOptions())
    figures.append(Figure(f"{place.name}: processor time of a place", cpu, unit="s").at_most(5.0))
    print(f"{place.name}, force over E, mm^2: {' '.join(f'{1e6 * f:.3f}' for f in force)} ({cpu:.1f} CPU s)")
    for name, finer in FINER.items() if arguments.convergence else ():
        other, cpu = place.pressed(depths, finer)
        rows.append(_row(f"{place.name}, {name}", other / force - 1, cpu))
        worst = 100 * float(np.abs(other / force - 1).max())
        figures.append(Figure(f"{place.name}: change by {name}", worst, unit="%").at_most(0.5))
    if arguments.laboratory:
        other, cpu = place.laboratory(depths)
        rows.append(_row(f"{place.name}, over the laboratory", force / other - 1, cpu))
        worst = 100 * float(np.abs(force / other - 1).max())
        figures.append(Figure(f"{place.name}: worst over the laboratory", worst, unit="%").at_most(1.0))
    print(table(["place", *(f"{1e3 * d:.1f} mm" for d in depths), "CPU s"], rows))
    return {"figures": figures}


def _row(what: str, change: np.ndarray, cpu: float) -> list[str]:
    return [what, *(f"{100 * c:+.2f} %" for c in change), f"{cpu:.1f}"]


class Block:
    """A block of 120 by 60 tip radii, pressed in the middle of its top."""

    def __init__(self) -> None:
        self.mesh, self.surface = box_mesh((4, 4, 2), (0.6, 0.6, 0.3)), None
        self.point, self.normal = np.array([0.0, 0.0, 0.3]), np.array([0.0, 0.0, 1.0])

    def pressed(
        self, depths: np.ndarray, options: PressOptions, poisson_ratio: float = POISSON_RATIO
    ) -> tuple[np.ndarray, float]:
        """(normal force (k,) for unit modulus, processor time s)."""
        place = self.point, self.normal
        return _pressed(self.mesh, self.surface, place, depths, options, poisson_ratio)


class Place:
    """A place of a phantom, on its model's tetrahedra."""

    def __init__(self, name: str, near_mm: list[float] | None) -> None:
        from palpate.mechanics.shape.nearest import closest

        self.phantom: Phantom = PHANTOMS[name]()
        self.name = name if near_mm is None else f"{name} near {' '.join(f'{c:g}' for c in near_mm)} mm"
        vertices, faces = self.phantom.vertices, self.phantom.faces
        near = np.array([0, 0, 1.0]) if near_mm is None else 1e-3 * np.array(near_mm)
        found, face, _ = closest(vertices, faces, near[None])
        self.point = found[0]
        corner = vertices[faces[face[0]]]
        across = np.cross(corner[1] - corner[0], corner[2] - corner[0])
        self.normal = across / np.linalg.norm(across)
        self.mesh = _meshed(self.phantom)

    def pressed(self, depths: np.ndarray, options: PressOptions) -> tuple[np.ndarray, float]:
        """(normal force (k,) for unit modulus, processor time s)."""
        surface = (self.phantom.vertices, self.phantom.faces)
        return _pressed(self.mesh, surface, (self.point, self.normal), depths, options)

    def laboratory(self, depths: np.ndarray) -> tuple[np.ndarray, float]:
        """The same from the virtual laboratory, on fine elements."""
        from palpate.scenes.laboratory.specimen import Fineness, Specimen, build

        start = time.process_time()
        fine = Fineness(1.5, 4.0, 0.35)
        problem = build(
            self.phantom,
            Specimen(POISSON_RATIO, 1e3 * RADIUS_M, True),
            1e3 * self.point,
            travel=0,
            fineness=fine,
        )
        centre = 1e3 * (self.point + RADIUS_M * self.normal)
        state, force = problem.rest(centre), []
        for depth in depths:
            state = problem.advance(state, centre - 1e3 * depth * self.normal)
            force.append(1e-6 * float(state.force @ self.normal))
        return np.array(force), time.process_time() - start


def _pressed(
    mesh: TetMesh,
    surface: tuple[np.ndarray, np.ndarray] | None,
    place: tuple[np.ndarray, np.ndarray],
    depths: np.ndarray,
    options: PressOptions,
    poisson_ratio: float = POISSON_RATIO,
) -> tuple[np.ndarray, float]:
    solver = PressSolver(
        mesh,
        surface,
        young_modulus_pa=1.0,
        poisson_ratio=poisson_ratio,
        tip_radius_m=RADIUS_M,
        options=options,
    )
    start = time.process_time()
    force = solver.press(*place, depths).force
    return force @ place[1], time.process_time() - start


def _meshed(phantom: Phantom) -> TetMesh:
    import trimesh

    import palpate as pp

    shape = trimesh.Trimesh(phantom.vertices, phantom.faces, process=False)
    return pp.model_of(shape).mesh.linear()
