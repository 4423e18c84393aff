"""A recording becomes a model: contacts, base, surface, tetrahedra, modulus, 1D models of every press.

REC is a recording's .csv, .csv.gz or .toml. MODEL is a folder: model.toml, mesh.vtu and surface.vtp
(ParaView opens them), palpations.csv. Lengths in m, forces in N, moduli in Pa.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanics.errors import ModelError
from mechanics.model import read_model, write_model
from mechanics.recording import read_recording
from palpate.arguments import add_json, add_options, add_seed, emit_json, options_from, progress_bar, say
from render.felt import felt_surface

if TYPE_CHECKING:
    from reconstruct.pipeline import Reconstruction

_NAMED = 12
SUMMARY = "a recording becomes a model"


def _steps() -> dict[str, type]:
    from reconstruct.boundary import BoundaryOptions
    from reconstruct.contacts import ContactOptions
    from reconstruct.filtering import FilterOptions
    from reconstruct.meshing import MeshingOptions
    from reconstruct.modulus import ModulusOptions
    from reconstruct.modulus_paper import PaperOptions
    from reconstruct.surface import SurfaceOptions

    return {
        "filter": FilterOptions,
        "boundary": BoundaryOptions,
        "contact": ContactOptions,
        "surface": SurfaceOptions,
        "meshing": MeshingOptions,
        "modulus": ModulusOptions,
        "paper": PaperOptions,
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, -o MODEL, the options of every step, --json, --seed."""
    from reconstruct.pipeline import ReconstructOptions

    parser.add_argument("recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    parser.add_argument("-o", "--output", metavar="MODEL", required=True, help="folder of the model to write")
    parser.add_argument(
        "--report",
        metavar="HTML",
        help="write the paper's figures and table, remade; PNGs into HTML's folder",
    )
    parser.add_argument(
        "--beside",
        metavar="MODEL",
        action="append",
        default=[],
        help="with --report: another model to draw beside (repeatable)",
    )
    add_options(parser, ReconstructOptions, skip=("seed",))
    for kind in _steps().values():
        add_options(parser, kind)
    add_json(parser)
    add_seed(parser)


def run(arguments: argparse.Namespace) -> int:
    """Reconstruct and write the model."""
    from reconstruct.pipeline import ReconstructOptions, reconstruct_fully

    output = Path(arguments.output)
    if (
        output.exists()
        and not (output / "model.toml").exists()
        and (output.is_file() or any(output.iterdir()))
    ):
        raise ModelError(f"'{output}' exists and is no MODEL folder: name another output")
    steps = {name: options_from(arguments, kind) for name, kind in _steps().items()}
    options = options_from(arguments, ReconstructOptions, seed=arguments.seed, **steps)
    beside = {Path(name).name: read_model(name) for name in arguments.beside}
    recording = read_recording(arguments.recording)
    with progress_bar("reconstruct") as progress:
        result = reconstruct_fully(recording, options, progress)
    result = replace(result, model=result.model.replaced(path=write_model(output, result.model)))
    felt_surface(result.model, result.sites)
    if arguments.report:
        from palpate.report.reconstruction import write_report

        say(arguments, f"report: {write_report(arguments.report, result, beside)}")
    say(arguments, *_words(result), f"written to {output}")
    emit_json({"model": output, **_figures(result)}, arguments.json)
    return 0


def _words(result: Reconstruction) -> list[str]:
    model, exploration, surface = result.model, result.exploration, result.surface
    quality = result.meshing.report
    low, high = model.material.young_modulus_ci95_pa
    not_used = [*exploration.rejected, *(result.paper_fit.not_used if result.paper_fit else ())]
    lines = [
        f"{exploration.recording.name}: {len(exploration.presses)} palpations"
        + (f", {len(not_used)} contacts not used:" if not_used else ""),
        *(f"  at {t:.2f} s: {reason}" for t, reason in not_used[:_NAMED]),
        *([f"  and {len(not_used) - _NAMED} more (--json names all)"] if len(not_used) > _NAMED else []),
        f"Young's modulus {model.material.young_modulus_pa / 1e3:.2f} kPa, "
        f"95 % interval {low / 1e3:.2f} to {high / 1e3:.2f} kPa",
    ]
    if result.modulus:
        misfit = float((result.modulus.press.rms_n**2).mean() ** 0.5)
        lines.append(f"  {result.modulus.reason}; misfit of a press {misfit:.3f} N")
    if exploration.delay_s:
        lines.append(
            f"the force reads {exploration.delay_s * 1e3:.0f} +- {exploration.delay_error_s * 1e3:.1f} ms "
            "late (first against last touch); corrected before everything else"
        )
    lines += [
        f"surface: {surface.method} ({surface.reason}), {surface.volume_m3 * 1e6:.1f} cm^3",
        f"mesh: {len(model.mesh.points)} nodes, {len(model.mesh.tetrahedra)} tetrahedra, "
        f"l = {model.mesh_size_m * 1e3:g} mm; radius-edge ratio {_spread(quality.radius_edge_ratio)}, "
        f"distance to the surface {_spread(1e3 * quality.surface_distance_m)} mm (50, 95, 100 %)",
    ]
    return lines


def _percentiles(values: np.ndarray) -> dict[str, float]:
    return {name: float(np.percentile(values, at)) for name, at in (("p50", 50), ("p95", 95), ("max", 100))}


def _spread(values: np.ndarray) -> str:
    return " / ".join(f"{v:.2f}" for v in _percentiles(values).values())


def _figures(result: Reconstruction) -> dict[str, Any]:
    model, exploration, fit = result.model, result.exploration, result.modulus
    figures = {
        "method": model.provenance["method"],
        "young_modulus_pa": model.material.young_modulus_pa,
        "young_modulus_ci95_pa": model.material.young_modulus_ci95_pa,
        "poisson_ratio": model.material.poisson_ratio,
        "palpations": len(exploration.presses),
        "rejected": [{"t_s": t, "reason": reason} for t, reason in exploration.rejected],
        "noise_n": exploration.noise_n,
        "force_delay_s": exploration.delay_s,
        "force_delay_sd_s": exploration.delay_error_s,
        "surface": {
            "method": result.surface.method,
            "reason": result.surface.reason,
            "volume_m3": result.surface.volume_m3,
        },
        "mesh": {
            "radius_edge_ratio": _percentiles(result.meshing.report.radius_edge_ratio),
            "surface_distance_m": _percentiles(result.meshing.report.surface_distance_m),
            "volume_m3": result.meshing.report.volume_m3,
        },
        "press_modulus_pa": result.press_modulus_pa,
        "seconds": result.seconds,
    }
    if fit:
        figures |= {
            "dent_law": fit.press.law,
            "by_law": {
                k: {"young_modulus_pa": e, "misfit_n": m, "share": s} for k, (e, m, s) in fit.by_law.items()
            },
            "by_depth": [{"depth_m": d, "young_modulus_pa": e, "consistent": c} for d, e, c in fit.by_depth],
            "between_sites": fit.between,
            "shape_error": fit.shape_error,
        }
    if result.paper_fit:
        figures["not_used"] = [{"t_s": t, "reason": reason} for t, reason in result.paper_fit.not_used]
    return figures
