"""The modulus from a mesh and contacts, factorisation included, against the paper's 3 s."""

from __future__ import annotations

import argparse
from typing import Any

from benchmarks.timing import measure, table
from mechanics.recording import read_recording
from mechanics.sites import touch_sites, touch_solver
from reconstruct.casting import cast
from reconstruct.contacts import explore
from reconstruct.meshing import mesh_surface
from reconstruct.modulus import fit_modulus
from reconstruct.modulus_paper import PaperOptions, fit_paper_modulus
from reconstruct.surface import SurfaceOptions, evidence_of, reconstruct_surface
from scenes.embedded import embedded_recording

SUMMARY = "the modulus, K_G and its factorisation included"
PAPER_S = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC and repeats."""
    parser.add_argument("recording", nargs="?", help="recording (default: the embedded one)")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--indentation", type=float, default=0.005, help="m, for the paper's method")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Time the paper's method (point load, linear) and the finite-tip one (sites, then the fit)."""
    recording = read_recording(arguments.recording or embedded_recording())
    nu = recording.poisson_ratio or 0.49
    exploration, papers = explore(recording), explore(recording, method="paper")
    surface = reconstruct_surface(evidence_of(exploration), SurfaceOptions())
    mesh = mesh_surface(surface).mesh
    where = cast(surface.vertices, surface.triangles, exploration.points, exploration.normals)
    options = PaperOptions(indentation_m=arguments.indentation)
    solver = touch_solver(mesh, nu)
    sites = touch_sites(mesh, where.points, where.normals, nu, solver=solver)
    work = {
        "paper: K_G, factorisation, (12), (13)": lambda: fit_paper_modulus(papers, mesh, nu, options),
        "finite tip: refined mesh, factorisation": lambda: touch_solver(mesh, nu),
        "finite tip: sites": lambda: touch_sites(mesh, where.points, where.normals, nu, solver=solver),
        "finite tip: fit and interval": lambda: fit_modulus(exploration, sites),
    }
    rows, result = [], {"nodes": len(mesh.points), "fine_nodes": len(solver.mesh.points)}
    for name, call in work.items():
        timing = measure(call, repeats=arguments.repeats)
        rows.append([name, timing.median_s, timing.spread, timing.cpu_median_s, PAPER_S / timing.median_s])
        result[name] = {"median_s": timing.median_s, "spread": timing.spread, "cpu_s": timing.cpu_median_s}
    print(f"{len(mesh.points)} linear nodes, {len(solver.mesh.points)} of the refined quadratic mesh")
    print(table(["step", "median [s]", "spread", "CPU [s]", "paper's 3 s over it"], rows))
    return result
