"""Does the modulus depend on the mesh? The whole reconstruction of recordings at several mesh sizes.

Change is (greatest - least) / mean of the moduli of one recording. Beside it stands the paper's method, whose
point load has no limit as the mesh is refined.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from benchmarks.timing import table
from palpate.mechanics.errors import ContactError
from palpate.mechanics.recording.recording import read_recording
from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct_fully
from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions
from palpate.reconstruction.steps.s7_modulus.modulus_paper import PaperOptions
from palpate.scenes.embedded import embedded_recording


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recordings, sizes, repeats."""
    parser.add_argument("recordings", nargs="*", metavar="REC", help="recordings (default: the embedded one)")
    parser.add_argument("--mesh-size", type=float, nargs="+", default=[0.010, 0.007, 0.005], metavar="M")
    parser.add_argument("--repeats", type=int, default=1, help="meshes a size (no two are alike)")
    parser.add_argument("--method", nargs="+", choices=("finite-tip", "paper"), default=["finite-tip"])
    parser.add_argument("--indentation", type=float, default=0.005, help="m, for the paper's method")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print a row a mesh and the change a recording; return the figures."""
    rows: list[list[Any]] = []
    result: dict[str, Any] = {}
    for path in arguments.recordings or [embedded_recording()]:
        recording = read_recording(path)
        for method in arguments.method:
            found = []
            for size in np.repeat(arguments.mesh_size, arguments.repeats):
                options = ReconstructOptions(
                    method=method,
                    meshing=MeshingOptions(mesh_size_m=float(size)),
                    paper=PaperOptions(indentation_m=arguments.indentation),
                )
                try:
                    model = reconstruct_fully(recording, options).model
                except ContactError as error:
                    print(f"{recording.name}, {method}: {error}")
                    break
                low, high = model.material.young_modulus_ci95_pa
                found.append(model.material.young_modulus_pa)
                rows.append([recording.name, method, f"{1e3 * size:g}", len(model.mesh.points)]
                            + [f"{e / 1e3:.2f}" for e in (found[-1], low, high)])  # fmt: skip
                print(*rows[-1], flush=True)
            if found:
                change = (max(found) - min(found)) / float(np.mean(found))
                result[f"{recording.name}, {method}"] = {"young_modulus_pa": found, "change": change}
    print(table(["recording", "method", "l [mm]", "nodes", "modulus [kPa]", "from", "to"], rows))
    changes = [[name, f"{100 * value['change']:.2f} %"] for name, value in result.items()]
    print("", table(["recording, method", "change over the meshes"], changes), sep="\n")
    return result
