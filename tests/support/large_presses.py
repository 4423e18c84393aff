"""How deep the linear model holds: the renderer's dent laws against whole-body finite strain, and recordings.

laboratory: straight presses on the cylinder phantom, solved once in linear elasticity and once as a
neo-Hookean body, far field and all (scenes.laboratory, which shares no code with the renderer). The share by
which linear is too stiff stands beside the one that the renderer's two dent laws give at the same places,
which is what mechanics.contact.linear_range stores with a model.
recordings (--models, --recordings): whole paths replayed under both laws, each with the modulus that suits it
best; error and bias by depth.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import table
from palpate.mechanics.compliance.sites import touch_sites
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.model.files import read_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import Recording, read_recording
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.reconstruction.presses_on_model import presses_on
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.render.replay import replay_recording, rms_n
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
SHARE = 0.1
BANDS_MM = ((0, 2), (2, 4), (4, 6), (6, 8), (8, 12))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How deep, and where recordings and their models are."""
    parser.add_argument("--deepest", type=float, default=10.0, help="of the laboratory's presses [mm]")
    parser.add_argument("--step", type=float, default=0.25, help="load steps of the laboratory [mm]")
    parser.add_argument("--places", type=int, default=len(PLACES), help="how many of the places")
    parser.add_argument("--models", type=Path, help="folder with a MODEL folder for each recording's name")
    parser.add_argument("--recordings", type=Path, help="folder with NAME.csv.gz")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print both tables; returns their figures."""
    result: dict[str, Any] = {}
    if arguments.places > 0:
        result["laboratory"] = _laboratory(arguments.deepest, arguments.step, arguments.places)
    if arguments.models is not None and arguments.recordings is not None:
        result["recordings"] = _recordings(arguments.models, arguments.recordings)
    return result


def _laboratory(deepest_mm: float, step_mm: float, places: int) -> dict[str, Any]:
    thing = phantom("cylinder")
    points, tetrahedra = coarse_mesh(thing)
    fixed = points[:, 2] < 1e-6
    bare = TetMesh(points * 1e-3, tetrahedra, fixed, ~fixed)
    outer = np.zeros(len(points), dtype=bool)
    outer[bare.surface] = True
    mesh = TetMesh(points * 1e-3, tetrahedra, fixed, outer & ~fixed)
    depths = np.arange(1, round(deepest_mm / step_mm) + 1) * step_mm
    figures, rows = {}, []
    for name, (point, normal) in list(PLACES.items())[:places]:
        at, outward = np.array(point), np.array(normal)
        solved = {
            law: straight_press(thing, Specimen(finite=law != "linear"), at, outward, depths, Fineness())[0]
            for law in LAWS
        }
        ours = {law: _dent_forces(mesh, at * 1e-3, outward, depths * 1e-3, law) * 1e6 for law in LAWS}
        theirs_error, our_error = (f["linear"] / f["neo-hookean"] - 1 for f in (solved, ours))
        figures[name] = {
            "depths_mm": depths.tolist(),
            "laboratory": {law: force.tolist() for law, force in solved.items()},
            "dent_laws": {law: force.tolist() for law, force in ours.items()},
            "depth_at_10_percent_mm": {
                "laboratory": _first_beyond(depths, theirs_error),
                "dent_laws": _first_beyond(depths, our_error),
            },
        }
        for depth in (2.0, 4.0, 6.0, 8.0, 10.0):
            k = int(np.argmin(np.abs(depths - depth)))
            if abs(depths[k] - depth) > 0.5 * step_mm:
                continue
            rows.append(
                [
                    name,
                    depth,
                    f"{100 * theirs_error[k]:+.1f}",
                    f"{100 * our_error[k]:+.1f}",
                    f"{100 * (ours['linear'][k] / solved['neo-hookean'][k] - 1):+.1f}",
                    f"{100 * (ours['neo-hookean'][k] / solved['neo-hookean'][k] - 1):+.1f}",
                ]
            )
    header = ["place", "mm", "linear / finite, laboratory %", "the same, dent laws %"]
    header += ["rendered linear / laboratory finite %", "rendered neo-hookean / laboratory finite %"]
    print(table(header, rows))
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


def _first_beyond(depths: np.ndarray, error: np.ndarray) -> float | None:
    """The least depth from which on the error is beyond SHARE; None where it never is."""
    inside = np.flatnonzero(np.abs(error) <= SHARE)
    first = 0 if not len(inside) else int(inside[-1]) + 1
    return float(depths[first]) if first < len(depths) else None


def _recordings(models: Path, recordings: Path) -> dict[str, Any]:
    figures: dict[str, Any] = {}
    rows: list[list[Any]] = []
    for folder in sorted(path for path in models.iterdir() if (path / "model.toml").exists()):
        source = recordings / f"{folder.name}.csv.gz"
        if not source.exists():
            continue
        model, recording = read_model(folder), read_recording(source)
        figures[folder.name] = found = {}
        depth = _depths(model, recording)
        for law in LAWS:
            force = replay_recording(FemRenderer(model, RenderOptions(dent_law=law)), recording)
            contact = presses_on(recording, model).touching(recording.t)
            measured = recording.force_on_tool
            scale = (force[contact] * measured[contact]).sum() / (force[contact] ** 2).sum()
            error = scale * force - measured
            bands = [contact & (depth >= low) & (depth < high) for low, high in np.array(BANDS_MM) * 1e-3]
            bias = [
                float((error[b] * measured[b]).sum() / (measured[b] ** 2).sum()) if b.any() else None
                for b in bands
            ]
            found[law] = {
                "young_modulus_pa": float(scale * model.material.young_modulus_pa),
                "rmse_n": rms_n(error[contact]),
                "bias_by_depth": bias,
                "rmse_by_depth_n": [rms_n(error[b]) if b.any() else None for b in bands],
            }
            shares = ["-" if b is None else f"{100 * b:+.1f}" for b in bias]
            rows.append(
                [
                    folder.name,
                    law,
                    scale * model.material.young_modulus_pa / 1e3,
                    rms_n(error[contact]),
                    *shares,
                ]
            )
    header = ["recording", "dent law", "best modulus kPa", "rms error N"]
    header += [f"bias at {low}-{high} mm %" for low, high in BANDS_MM]
    print(table(header, rows))
    return figures


def _depths(model: Model, recording: Recording) -> np.ndarray:
    """(n,) m, depth of the tip below the undeformed surface, by the renderer's own contact."""
    renderer = FemRenderer(model, RenderOptions())
    state = renderer.start([recording.tip_radius_m])
    depth = np.zeros(len(recording.t))
    for i, tip in enumerate(np.ascontiguousarray(recording.position)[:, None]):
        renderer.step(state, tip)
        depth[i] = state.depths[0]
    return depth
