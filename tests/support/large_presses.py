"""How deep the linear model holds: the renderer's dent laws against whole-body finite strain.

Straight presses on the cylinder phantom, solved once in linear elasticity and once as a
neo-Hookean body, far field and all (scenes.laboratory, which shares no code with the renderer). The share by
which linear is too stiff stands beside the one that the renderer's two dent laws give at the same places,
which is what mechanics.contact.linear_range stores with a model.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from benchmarks.timing import table
from palpate.mechanics.compliance.sites import touch_sites
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.scenes.laboratory.mesh import coarse_mesh
from palpate.scenes.laboratory.specimen import Fineness, Specimen
from palpate.scenes.phantoms import phantom

from .laboratory_checks import straight_press

TIP_RADIUS_M = 0.005
PLACES = {
    "top, middle": ((0.0, 0.0, 80.0), (0.0, 0.0, 1.0)),
    "top, 10 mm from the rim": ((30.0, 0.0, 80.0), (0.0, 0.0, 1.0)),
    "side, half way up": ((40.0, 0.0, 40.0), (1.0, 0.0, 0.0)),
    "side, 10 mm up": ((40.0, 0.0, 10.0), (1.0, 0.0, 0.0)),
}
LAWS = ("linear", "neo-hookean")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How deep, in which steps, at how many places."""
    parser.add_argument("--deepest", type=float, default=10.0, help="of the laboratory's presses [mm]")
    parser.add_argument("--step", type=float, default=0.25, help="load steps of the laboratory [mm]")
    parser.add_argument("--places", type=int, default=len(PLACES), help="how many of the places")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print and return {place: {depths_mm, laboratory and dent_laws by law}}, forces over E in mm^2."""
    thing = phantom("cylinder")
    points, tetrahedra = coarse_mesh(thing)
    fixed = points[:, 2] < 1e-6
    bare = TetMesh(points * 1e-3, tetrahedra, fixed, ~fixed)
    outer = np.zeros(len(points), dtype=bool)
    outer[bare.surface] = True
    mesh = TetMesh(points * 1e-3, tetrahedra, fixed, outer & ~fixed)
    depths = np.arange(1, round(arguments.deepest / arguments.step) + 1) * arguments.step
    figures, rows = {}, []
    for name, (point, normal) in list(PLACES.items())[: arguments.places]:
        at, outward = np.array(point), np.array(normal)
        solved = {
            law: straight_press(thing, Specimen(finite=law != "linear"), at, outward, depths, Fineness())[0]
            for law in LAWS
        }
        ours = {law: _dent_forces(mesh, at * 1e-3, outward, depths * 1e-3, law) * 1e6 for law in LAWS}
        figures[name] = {
            "depths_mm": depths.tolist(),
            "laboratory": {law: force.tolist() for law, force in solved.items()},
            "dent_laws": {law: force.tolist() for law, force in ours.items()},
        }
        for k, depth in enumerate(depths):
            over = [100 * (ours[law][k] / solved["neo-hookean"][k] - 1) for law in LAWS]
            rows.append([name, depth, *(f"{each:+.1f}" for each in over)])
    print(table(["place", "mm", *(f"{law} over the body at finite strain %" for law in LAWS)], rows))
    return figures


def _dent_forces(
    mesh: TetMesh, at: np.ndarray, normal: np.ndarray, depths: np.ndarray, law: str
) -> np.ndarray:
    """Normal force over E, m^2, of a press with this dent law through the linear far field."""
    site = touch_sites(mesh, at[None], normal[None], 0.49)
    path = np.concatenate([[0.0], depths])[:, None] * -site.normals[0]
    force = forces_at(
        site,
        path,
        np.array([0, len(path)]),
        young_modulus_pa=1.0,
        tip_radius_m=TIP_RADIUS_M,
        law=law,
    )
    return force[1:] @ site.normals[0]
