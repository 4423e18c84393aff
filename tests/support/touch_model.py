"""The touch model against recordings with known truth: true shape, true modulus, nothing fitted.

For each recording of a folder whose `[truth]` names one of the paper's samples: every stay of the tip inside
the true surface is one touch; its force is predicted by each dent law, on the mesh as it is and refined at
its surface. Printed are the root mean square of the difference (N, 3-vector) over all samples in contact, and
the factor on the predicted force that fits best.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.timing import table
from palpate.mechanics.compliance.sites import LoadPatch, patch_width, touch_sites, touch_solver
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import OptionError
from palpate.mechanics.recording.recording import Recording, read_recording

from .sample_shapes import sample_mesh

WAYS = (
    ("hertz", False),
    ("sphere", False),
    ("neo-hookean", False),
    ("linear", True),
    ("neo-hookean", True),
)
_LEAST_SAMPLES = 60


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Folder, mesh size."""
    parser.add_argument(
        "--recordings", required=True, metavar="FOLDER", help="holds NAME.csv.gz and NAME.toml"
    )
    parser.add_argument("--mesh-size", type=float, default=0.010, metavar="M")


def sample_of(recording: Recording) -> str | None:
    """Which of the paper's samples the truth names."""
    shape = str((recording.truth or {}).get("shape", ""))
    names = {
        "cylinder": "cylinder radius 0.040",
        "block": "square block 0.105",
        "half-sphere": "sphere radius 0.060",
    }
    return next((name for name, begin in names.items() if shape.startswith(begin)), None)


def gap(sample: str, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(signed distance (n,), outward normal (n, 3), mean curvature (n,)) of points in the object's frame."""
    x, y, z = points.T
    if sample == "half-sphere":
        out = points - [0, 0, -0.005]
        length = np.linalg.norm(out, axis=1)
        return length - 0.060, out / length[:, None], np.full(len(points), 1 / 0.060)
    if sample == "cylinder":
        rho = np.hypot(x, y)
        faces = np.stack([rho - 0.040, z - 0.080], axis=1)
        side = np.stack([x / rho, y / rho, 0 * z], axis=1)
        normals = np.stack([side, np.broadcast_to([0, 0, 1.0], side.shape)], axis=1)
        curvature = np.array([0.5 / 0.040, 0.0])
    else:
        faces = np.stack([x, -x, y, -y, z + 0.0525 - 0.047], axis=1) - 0.0525
        normals = np.broadcast_to(
            np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1.0]]), (len(points), 5, 3)
        )
        curvature = np.zeros(5)
    face = faces.argmax(axis=1)
    every = np.arange(len(points))
    return faces[every, face], normals[every, face], curvature[face]


def touches(recording: Recording, sample: str) -> tuple[np.ndarray, ...]:
    """(paths, forces (n, 3), starts (k + 1,), points, normals (k, 3), curvature), object's frame."""
    truth = recording.truth or {}
    turn = np.array(truth.get("device_from_object_rotation", np.eye(3)))
    shift = 1e-3 * np.array(truth.get("device_from_object_shift_mm", np.zeros(3)))
    centre = (recording.position - shift) @ turn
    force = recording.force_on_tool @ turn
    distance, normals, curvature = gap(sample, centre)
    distance = distance - recording.tip_radius_m
    inside = (distance < 0) & (recording.t > (recording.boundary_phase or (0.0, 0.0))[1] + 0.2)
    edges = np.flatnonzero(np.diff(inside.astype(int)))
    paths, forces, starts, where = [], [], [0], []
    for begin, end in zip(edges[:-1], edges[1:], strict=True):
        if not inside[begin + 1] or end - begin < _LEAST_SAMPLES or centre[begin, 2] < 0.004:
            continue
        share = distance[begin] / (distance[begin] - distance[begin + 1])
        first = centre[begin] + share * (centre[begin + 1] - centre[begin])
        paths.append(centre[begin + 1 : end + 1] - first)
        forces.append(force[begin + 1 : end + 1])
        starts.append(starts[-1] + end - begin)
        where.append((first - recording.tip_radius_m * normals[begin], normals[begin], curvature[begin]))
    points, outward, bent = (np.array(column) for column in zip(*where, strict=True))
    return np.vstack(paths), np.vstack(forces), np.array(starts), points, outward, bent


def run(arguments: argparse.Namespace) -> dict:
    """Print a row a recording and way."""
    rows, result = [], {}
    for path in sorted(Path(arguments.recordings).glob("*.toml")):
        recording = read_recording(path)
        sample = sample_of(recording)
        truth = recording.truth or {}
        if sample is None or truth.get("dominant_effect") != "finite_strain":
            continue
        nu = recording.poisson_ratio or 0.49
        displacement, measured, starts, points, normals, bent = touches(recording, sample)
        mesh = sample_mesh(sample, arguments.mesh_size)
        sites = {}
        for refined in (False, True):
            solver = touch_solver(mesh, nu) if refined else Solver(mesh.quadratic(), nu)
            width = patch_width(solver.mesh)
            sites[refined] = touch_sites(
                solver.mesh, points, normals, nu, solver=solver, patch=LoadPatch(width), curvature=bent
            )
        for law, refined in WAYS:
            predicted = forces_at(
                sites[refined],
                displacement,
                starts,
                young_modulus_pa=float(truth["young_modulus_pa"]),
                tip_radius_m=recording.tip_radius_m,
                law=law,
            )
            rms = float(np.sqrt(((predicted - measured) ** 2).sum(axis=1).mean()))
            factor = float((predicted * measured).sum() / (predicted**2).sum())
            rows.append(
                [path.stem, law, "refined" if refined else "as it is", len(points), rms, f"{factor:.3f}"]
            )
            result[f"{path.stem}, {law}, {rows[-1][2]}"] = {"rms_n": rms, "best_factor": factor}
    if not rows:
        raise OptionError(f"'{arguments.recordings}' holds no recording of a sample whose truth is known")
    print(table(["recording", "dent", "mesh", "touches", "rms [N]", "best factor"], rows))
    return result
