"""A reconstruction that prints and draws itself: the model, and how it came about."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.results.base import Result, dressed
from palpate.results.check import finding_json
from palpate.results.model import Model, model_of
from palpate.results.recording import Recording, recording_of
from reconstruct import pipeline as room

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.report.view3d import View

_NAMED = 12


@dataclass(frozen=True, eq=False, repr=False)
class Reconstruction(Result, room.Reconstruction):
    """The model and every step on the way to it; goes wherever a model goes. Moduli Pa, lengths m, forces N.

    Every field is that of `reconstruct.pipeline.Reconstruction`. `plot`: force over time with the touches
    that were found. `show`: the model.
    """

    model: Model

    @property
    def recording(self) -> Recording:
        """What it was made from."""
        return recording_of(self.exploration.recording)

    @property
    def young_modulus_pa(self) -> float:
        """The global Young's modulus, Pa."""
        return self.model.material.young_modulus_pa

    @property
    def young_modulus_ci95_pa(self) -> tuple[float, float]:
        """Its 95 % interval (low, high), Pa."""
        return self.model.material.young_modulus_ci95_pa

    def report(self, path: Path | str, beside: dict[str, Any] | None = None) -> Path:
        """Write the paper's figures and table, remade, as an HTML page; beside: other models by name."""
        from palpate.report.reconstruction import write_report

        return write_report(path, self, beside)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        model, exploration, surface = self.model, self.exploration, self.surface
        quality = self.meshing.report
        low, high = model.material.young_modulus_ci95_pa
        not_used = [*exploration.rejected, *(self.paper_fit.not_used if self.paper_fit else ())]
        more = len(not_used) - _NAMED
        lines = [
            f"{exploration.recording.name}: {len(exploration.presses)} palpations"
            + (f", {len(not_used)} contacts not used:" if not_used else ""),
            *(f"  at {t:.2f} s: {reason}" for t, reason in not_used[:_NAMED]),
            *([f"  and {more} more (as_json, or --json, names all)"] if more > 0 else []),
            f"Young's modulus {model.material.young_modulus_pa / 1e3:.2f} kPa, "
            f"95 % interval {low / 1e3:.2f} to {high / 1e3:.2f} kPa",
        ]
        lines += [f.line() for f in self.findings]
        if self.modulus:
            misfit = float((self.modulus.press.rms_n**2).mean() ** 0.5)
            lines.append(f"  {self.modulus.reason}; misfit of a press {misfit:.3f} N")
        if exploration.delay_s:
            lines.append(
                f"the force reads {exploration.delay_s * 1e3:.0f} +- {exploration.delay_error_s * 1e3:.1f} "
                "ms late (first against last touch); corrected before everything else"
            )
        lines += [
            f"surface: {surface.method} ({surface.reason}), {surface.volume_m3 * 1e6:.1f} cm^3",
            *(f"  {note}" for note in (self.placed.notes if self.placed else ())),
            f"mesh: {len(model.mesh.points)} nodes, {len(model.mesh.tetrahedra)} tetrahedra, "
            f"l = {model.mesh_size_m * 1e3:g} mm; radius-edge ratio {_spread(quality.radius_edge_ratio)}, "
            f"distance to the surface {_spread(1e3 * quality.surface_distance_m)} mm (50, 95, 100 %)",
        ]
        return lines

    def as_json(self) -> dict[str, Any]:
        """The figures of `palpate reconstruct --json`, keys with units."""
        model, exploration, fit = self.model, self.exploration, self.modulus
        figures = {
            "method": model.provenance["method"],
            "young_modulus_pa": model.material.young_modulus_pa,
            "young_modulus_ci95_pa": model.material.young_modulus_ci95_pa,
            "poisson_ratio": model.material.poisson_ratio,
            "palpations": len(exploration.presses),
            "rejected": [{"t_s": t, "reason": reason} for t, reason in exploration.rejected],
            "findings": [finding_json(f) for f in self.findings],
            "noise_n": exploration.noise_n,
            "force_delay_s": exploration.delay_s,
            "force_delay_sd_s": exploration.delay_error_s,
            "surface": {
                "method": self.surface.method,
                "reason": self.surface.reason,
                "volume_m3": self.surface.volume_m3,
            },
            "geometry": {**self.placed.about, "notes": list(self.placed.notes)} if self.placed else None,
            "mesh": {
                "radius_edge_ratio": _percentiles(self.meshing.report.radius_edge_ratio),
                "surface_distance_m": _percentiles(self.meshing.report.surface_distance_m),
                "volume_m3": self.meshing.report.volume_m3,
            },
            "press_modulus_pa": self.press_modulus_pa,
            "seconds": self.seconds,
        }
        if fit:
            figures |= {
                "dent_law": fit.press.law,
                "by_law": {
                    k: {"young_modulus_pa": e, "misfit_n": m, "share": s}
                    for k, (e, m, s) in fit.by_law.items()
                },
                "by_depth": [
                    {"depth_m": d, "young_modulus_pa": e, "consistent": c} for d, e, c in fit.by_depth
                ],
                "between_sites": fit.between,
                "shape_error": fit.shape_error,
            }
        if self.paper_fit:
            figures["not_used"] = [{"t_s": t, "reason": reason} for t, reason in self.paper_fit.not_used]
        return figures

    def _draw(self, ax: Axes) -> None:
        from palpate.report.exploration_figures import force_over_time

        force_over_time(ax, self.exploration)

    def view(self) -> View:
        """The object to be turned, and each press beside what was simulated."""
        from palpate.report.reconstruction import view_of

        return view_of(self)

    def _place(self, plotter: Plotter) -> None:
        self.model._place(plotter)


def _percentiles(values: np.ndarray) -> dict[str, float]:
    return {name: float(np.percentile(values, at)) for name, at in (("p50", 50), ("p95", 95), ("max", 100))}


def _spread(values: np.ndarray) -> str:
    return " / ".join(f"{v:.2f}" for v in _percentiles(values).values())


def reconstruction_of(plain: room.Reconstruction, path: Path | None = None) -> Reconstruction:
    """The room's reconstruction as the door gives it; path: the MODEL folder that it was written to."""
    model = plain.model if path is None else plain.model.replaced(path=path)
    return dressed(Reconstruction, plain, model=model_of(model))
