"""The modulus from a mesh and contacts, factorisation included, against the paper's 3 s."""

from __future__ import annotations

import argparse
from typing import Any

from benchmarks._recording import add_indentation, add_recording, recording_of, timed
from palpate.mechanics.compliance.sites import touch_sites, touch_solver
from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct_fully
from palpate.reconstruction.steps.s6_one_d import profiles
from palpate.reconstruction.steps.s7_modulus.modulus import fit_modulus
from palpate.reconstruction.steps.s7_modulus.modulus_paper import PaperOptions, fit_paper_modulus

PAPER_S = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, repeats, indentation."""
    add_recording(parser, repeats=3)
    add_indentation(parser)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Time the paper's method (point load, linear) and the finite-tip one (sites, then the fit)."""
    recording = recording_of(arguments)
    options = PaperOptions(indentation_m=arguments.indentation)
    papers = reconstruct_fully(recording, ReconstructOptions(method="paper", paper=options))
    own = reconstruct_fully(recording)
    mesh, nu, where = own.meshing.mesh, own.model.material.poisson_ratio, own.cast
    sites = own.sites
    assert sites is not None, "the finite-tip method fits to sites"
    solver = touch_solver(mesh, nu)
    curves = profiles(papers.model.presses)
    work = {
        "paper: K_G, factorisation, (12), (13)": lambda: fit_paper_modulus(
            curves, papers.meshing.mesh, nu, options
        ),
        "finite tip: refined mesh, factorisation": lambda: touch_solver(mesh, nu),
        "finite tip: sites": lambda: touch_sites(mesh, where.points, where.normals, nu, solver=solver),
        "finite tip: fit and interval": lambda: fit_modulus(
            own.model.presses, sites, own.exploration.noise_n
        ),
    }
    nodes = {
        "paper": len(papers.meshing.mesh.points), "linear": len(mesh.points), "fine": len(solver.mesh.points)
    }  # fmt: skip
    print(
        f"{nodes['paper']} nodes of the paper's mesh; {nodes['linear']} of ours, {nodes['fine']} of the "
        "quadratic mesh "
        "refined from it"
    )
    return {"nodes": nodes, **timed(work, arguments.repeats, PAPER_S)}
