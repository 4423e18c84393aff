"""The paper's three silicones, whose truth is known: modulus, surface, replay (README's table).

Each recording is reconstructed with default options; the modulus stands beside the known one, the surface's
mean distance from the true shape beside that of the paper's convex hull, and the force replayed along the
recorded path beside the measured one. The recordings are those of another simulator (PALPATE_SHARED).
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._surface_truth import phantom_truth
from benchmarks.evidence import Figure
from benchmarks.surface import deviation
from benchmarks.timing import table
from palpate.mechanics.errors import OptionError
from palpate.mechanics.recording.recording import Recording, read_recording
from palpate.reconstruction.pipeline import reconstruct_fully
from palpate.reconstruction.steps.s4_surface import SurfaceOptions, evidence_of, reconstruct_surface
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.render.replay import replay_error, replay_recording

SAMPLES = {
    "silicone-1-cylinder": "cylinder",
    "silicone-2-block": "block",
    "silicone-3-halfsphere": "half-sphere",
}
_FOLDER = Path(os.environ.get("PALPATE_SHARED", Path(__file__).parents[2] / "shared")) / "recordings"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the recordings are, and which."""
    parser.add_argument("--recordings", type=Path, default=_FOLDER, metavar="FOLDER", help="of the samples")
    parser.add_argument("--sample", nargs="+", choices=tuple(SAMPLES), default=list(SAMPLES))


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Reconstruct, measure, print a row a sample."""
    missing = [n for n in arguments.sample if not (arguments.recordings / f"{n}.toml").is_file()]
    if missing:
        raise OptionError(f"'{arguments.recordings}' holds no {missing[0]}.toml: give --recordings FOLDER")
    figures: list[Figure] = []
    rows = []
    for name in arguments.sample:
        of = _sample(read_recording(arguments.recordings / f"{name}.toml"), SAMPLES[name])
        figures += of
        rows.append([SAMPLES[name], *(f"{f.value:.3g} {f.unit}" for f in of), of[0].spread, of[0].met])
    header = [
        "sample",
        "modulus",
        "surface",
        "hull",
        "replay",
        "of the force",
        "95 % interval",
        "holds the truth",
    ]
    print(table(header, rows))
    return {"figures": figures}


def _sample(recording: Recording, shape: str) -> list[Figure]:
    """Modulus, surface, hull, replay, replay over the force."""
    truth = recording.truth or {}
    made = reconstruct_fully(recording)
    low, high = made.model.material.young_modulus_ci95_pa
    known = float(truth["young_modulus_pa"])
    modulus = Figure(
        f"{shape}, Young's modulus with its 95 % interval", made.model.material.young_modulus_pa / 1e3,
        (low / 1e3, high / 1e3), "kPa", f"interval holds {known / 1e3:g} kPa", bool(low <= known <= high),
    )  # fmt: skip
    turn = np.array(truth.get("device_from_object_rotation", np.eye(3)))
    shift = 1e-3 * np.array(truth.get("device_from_object_shift_mm", np.zeros(3)))
    away = []
    for kind in ("auto", "hull"):
        found = reconstruct_surface(evidence_of(made.exploration), SurfaceOptions(surface=kind))
        error = deviation(phantom_truth(shape), (found.vertices - shift) @ turn, found.triangles)
        away.append((1e3 * error["mean_m"], (1e3 * error["mean_m"], 1e3 * error["p95_m"])))
    forces = replay_recording(FemRenderer(made.model, RenderOptions()), recording)
    replayed = replay_error(recording, made.model.presses, forces)
    return [
        modulus,
        Figure(f"{shape}, surface to the true shape, mean (to the 95th percentile)", *away[0], "mm"),
        Figure(f"{shape}, convex hull to the true shape, mean (to the 95th percentile)", *away[1], "mm"),
        Figure(f"{shape}, replayed against measured force, rms", replayed.rmse_n, unit="N"),
        Figure(f"{shape}, replayed against measured force, of its rms", 100 * replayed.relative, unit="%"),
    ]
