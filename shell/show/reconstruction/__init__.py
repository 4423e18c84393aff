"""A reconstruction: how the model came about, and the paper's figures and tables, remade."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.reconstruction.methods import SolvedPresses
from palpate.reconstruction.pipeline import Reconstruction
from palpate.reconstruction.steps.s7_modulus.held_out import HeldOutErrors
from palpate.show import model as made
from palpate.show.reconstruction.exploration import force_over_time
from palpate.show.reconstruction.page import least_known, lost, meaning, next_steps, report, tell, view

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

__all__ = ["as_json", "draw", "lines", "next_steps", "place", "report", "tell", "view"]

_NAMED = 12


def lines(result: Reconstruction) -> list[str]:
    """What `print` says, with units."""
    model, exploration, surface = result.model, result.exploration, result.surface
    quality = result.meshing.report
    low, high = model.material.young_modulus_ci95_pa
    not_used = [*exploration.rejected, *(result.paper_fit.not_used if result.paper_fit else ())]
    more = len(not_used) - _NAMED
    contacts = "1 contact" if len(not_used) == 1 else f"{len(not_used)} contacts"
    lines = [
        f"{exploration.recording.name}: {len(exploration.presses)} presses, {lost(result)}"
        f"Young's modulus {model.material.young_modulus_pa / 1e3:.2f} kPa "
        f"(95 % sure: {low / 1e3:.2f} to {high / 1e3:.2f} kPa)",
    ]
    if result.doubt:
        lines.append(f"not to be believed: {result.doubt}")
    else:
        lines += [f"  {said.removesuffix('.')}" for said in meaning(result).split(". ")]
    lines += [
        *(f.line() for f in result.findings),
        *([f"{contacts} not used:"] if not_used else []),
        *(f"  at {t:.2f} s: {reason}" for t, reason in not_used[:_NAMED]),
        *([f"  and {more} more (as_json, or --json, names all)"] if more > 0 else []),
    ]
    if result.modulus:
        lines.append(f"modulus: {result.modulus.reason}")
    if result.exact:
        lines.append(_solved(result.exact))
    if exploration.delay_s:
        lines.append(
            f"the force reads {exploration.delay_s * 1e3:.0f} +- {exploration.delay_error_s * 1e3:.1f} "
            "ms late (first against last touch); corrected before everything else"
        )
    lines += [
        *exploration.dropped,
        f"surface: {surface.method}, {surface.volume_m3 * 1e6:.1f} cm³; {surface.reason}",
        *([f"  {least_known(surface)}"] if surface.shape is None else []),
        *(f"  {note}" for note in (result.placed.notes if result.placed else ())),
        f"mesh: {len(model.mesh.tetrahedra)} tetrahedra of {model.mesh_size_m * 1e3:g} mm "
        f"({len(model.mesh.points)} nodes), at most {1e3 * quality.surface_distance_m.max():.2f} mm off the "
        "surface",
    ]
    return lines


def as_json(result: Reconstruction) -> dict[str, Any]:
    """The figures of `palpate reconstruct --json`, keys with units."""
    model, exploration, fit = result.model, result.exploration, result.modulus
    figures = {
        "method": model.provenance["method"],
        "young_modulus_pa": model.material.young_modulus_pa,
        "young_modulus_ci95_pa": model.material.young_modulus_ci95_pa,
        "poisson_ratio": model.material.poisson_ratio,
        "palpations": len(exploration.presses),
        "rejected": [{"t_s": t, "reason": reason} for t, reason in exploration.rejected],
        "findings": [f.as_json() for f in result.findings],
        "doubt": result.doubt,
        **_held_out(result.held_out),
        "noise_n": exploration.noise_n,
        "force_delay_s": exploration.delay_s,
        "force_delay_sd_s": exploration.delay_error_s,
        "dropped_corrections": list(exploration.dropped),
        "surface": {
            "method": result.surface.method,
            "reason": result.surface.reason,
            "volume_m3": result.surface.volume_m3,
            "least_known_at_m": result.surface.least_known[0].tolist(),
            "least_known_sd_m": result.surface.least_known[1],
        },
        "geometry": {**result.placed.about, "notes": list(result.placed.notes)} if result.placed else None,
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
    if result.exact:
        by_table = {"young_modulus_by_table_pa": result.exact.by_table.modulus_pa}
        figures["exact"] = {**by_table, **result.exact.presses.as_json()}
    if result.paper_fit:
        figures["not_used"] = [{"t_s": t, "reason": reason} for t, reason in result.paper_fit.not_used]
    return figures


def _solved(exact: SolvedPresses) -> str:
    """What solving the touched places changed."""
    return (
        f"  by the law's table it would be {exact.by_table.modulus_pa / 1e3:.2f} kPa ({exact.presses.said})"
    )


def _held_out(told: HeldOutErrors | None) -> dict[str, Any]:
    floor = told is not None and bool(told.floor)
    return {
        "held_out_rmse_n": told.model_n if told else None,
        "held_out_constant_rmse_n": told.constant_n if told else None,
        "held_out_floor": told.floor if told and floor else None,
        "held_out_floor_rmse_n": told.floor_n if told and floor else None,
        "beaten_by": (told.beaten_by or None) if told else None,
    }


def draw(result: Reconstruction, ax: Axes) -> None:
    """Force over time with the touches that were found."""
    force_over_time(ax, result.exploration)


def place(result: Reconstruction, plotter: Plotter) -> None:
    """The model."""
    made.place(result.model, plotter)


def _percentiles(values: np.ndarray) -> dict[str, float]:
    return {name: float(np.percentile(values, at)) for name, at in (("p50", 50), ("p95", 95), ("max", 100))}
