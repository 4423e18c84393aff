"""Make what `palpate conformance` ships: a graded mesh of each body, and its forces by two laws."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._known_shapes import SHAPES
from benchmarks._pressed_places import meshed
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.errors import MeshError
from palpate.mechanics.press_solver.graded_mesh import graded_mesh
from palpate.mechanics.press_solver.press import PressOptions, PressSolver
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.scenes.conformance.cases import (
    BESIDE_M,
    BODIES,
    POISSON,
    SHARES,
    SLIDE,
    SOLVED,
    STUCK,
    TIP_M,
    YOUNG_PA,
    Body,
)
from tools.script import script

FINEST, GROWTH = 0.4, 0.6
"""Edges of the kit's meshes: of a contact's radius under the tip, and over their distance from its way."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which bodies, where to."""
    names = [body.name for body in BODIES]
    parser.add_argument("--only", nargs="+", choices=names, default=names)
    parser.add_argument("--folder", type=Path, default=SOLVED, help="of the files (default: the package's)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Solve; write a file a body; say nodes and times."""
    said = {}
    for body in BODIES:
        if body.name in arguments.only:
            began = time.process_time()
            solved = solve(body)
            arguments.folder.mkdir(parents=True, exist_ok=True)
            with (
                atomic_file(arguments.folder / f"{body.name}.npz") as temporary,
                temporary.open("wb") as file,
            ):
                np.savez_compressed(file, allow_pickle=False, **solved)
            said[body.name] = {"nodes": len(solved["points"]), "cpu_s": time.process_time() - began}
            print(f"{body.name}: {said[body.name]}", flush=True)
    return said


def coarse(body: Body) -> tuple[TetMesh, tuple[np.ndarray, np.ndarray] | None, np.ndarray, np.ndarray]:
    """(mesh, surface of its file or None where it is plane, place (3,) m, outward normal (3,))."""
    place = np.array(body.place, dtype=float)
    up = np.array([0.0, 0.0, 1.0])
    if body.name in ("half-space", "slab"):
        size = (0.8, 0.8, 0.4) if body.name == "half-space" else (0.16, 0.16, 0.008)
        cells = (4, 4, 2) if body.name == "half-space" else (16, 16, 1)
        return box_mesh(cells, size), None, place, up
    shape = SHAPES[body.name]()
    found = place[None]
    for _ in range(8):
        found = found - shape.distance(found)[:, None] * shape.normals(found)
    return meshed(shape, 0.012), (shape.vertices, shape.triangles), found[0], shape.normals(found)[0]


def solve(body: Body) -> dict[str, np.ndarray]:
    """The arrays of `Solved`."""
    mesh, surface, place, normal = coarse(body)
    along = np.array(body.along, dtype=float)
    along -= (along @ normal) * normal
    along /= np.linalg.norm(along)
    depths, way = SHARES * body.depth_m, (STUCK * body.depth_m * along)[None]
    forces = []
    for law in ("linear", "neo-hookean"):  # one solid where strains are small
        options = PressOptions(law=law, coupled=True, finest=0.8)
        solver = PressSolver(
            mesh, surface, young_modulus_pa=YOUNG_PA, poisson_ratio=POISSON, tip_radius_m=TIP_M,
            options=options,
        )  # fmt: skip
        place = solver.on_surface(place)
        found = solver.press(place, normal, depths, way)
        if not found.converged.all():
            raise MeshError(f"{body.name}, {law}: no equilibrium at every depth; press less deep")
        forces.append(found.force)
    points, tetrahedra, fixed = graded(solver, body, place, along)
    return {
        "points": points, "tetrahedra": tetrahedra, "fixed": fixed, "place": place, "normal": normal,
        "along": along, "force": np.array(forces),
    }  # fmt: skip


def graded(
    solver: PressSolver, body: Body, place: np.ndarray, along: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3) m to 0.1 um, linear tetrahedra (m, 4) and the base's nodes, fine under the tips."""
    feet = [place, place + SLIDE * body.depth_m * along]
    if body.name == "half-space":
        feet.append(place + BESIDE_M * np.array([1.0, 0.0, 0.0]))
    contact = np.sqrt(TIP_M * body.depth_m)

    def size(at: np.ndarray) -> np.ndarray:
        far = np.min([np.linalg.norm(at - foot, axis=1) for foot in feet], axis=0)
        return np.asarray(1.3 * np.maximum(FINEST * contact, GROWTH * (far - 0.9 * contact)))

    fine = graded_mesh(solver.mesh, solver._surface, size)
    corners = fine.cells[:, :4]
    used, tetrahedra = np.unique(corners, return_inverse=True)
    kind = np.uint16 if len(used) < 1 << 16 else np.int32
    points = np.round(fine.points[used], 7)
    return points, tetrahedra.reshape(-1, 4).astype(kind), np.flatnonzero(fine.fixed[used]).astype(kind)


if __name__ == "__main__":
    sys.exit(script(sys.modules[__name__]))
