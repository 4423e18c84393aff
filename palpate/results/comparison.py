"""A comparison that prints and draws itself: FEM against interpolated 1D models on held-out presses."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from diagnose.compare import comparison as room
from diagnose.compare.models import HOMOGENEOUS
from palpate.results.base import Result
from palpate.results.recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.report.view3d import View


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Result, room.Comparison):
    """Held-out rms force errors, N: rmse_n, relative_rmse by model; press_rmse_n model -> (p,); regions.

    Every field is that of `comparison.Comparison`. `plot`: the error of every held-out press. `show`:
    the object, each press coloured by the FEM's error.
    """

    recording: Recording = field(kw_only=True)

    def report(self, path: Path | str) -> Path:
        """Write tables and pictures as one HTML page."""
        from palpate.report.comparison import write_report

        return write_report(path, self, self.recording)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        names = list(self.rmse_n)
        text = [f"{'held out':<22}{'presses':>8}  " + "".join(f"{name:>26}" for name in names)]

        def row(label: str, count: int, rmse: dict, share: dict, bias: dict | None) -> str:
            cells = []
            for name in names:
                cell = f"{rmse[name]:.3f} N {100 * share[name]:.1f} %"
                cells.append(cell + (f" bias {100 * bias[name]:+.0f} %" if bias else ""))
            return f"{label:<22}{count:>8}  " + "".join(f"{cell:>26}" for cell in cells)

        text.append(row("folds over sites", len(self.presses), self.rmse_n, self.relative_rmse, None))
        for r in self.regions:
            text.append(row(r.region.name, int(r.region.members.sum()), r.rmse_n, r.relative_rmse, r.bias))
        return [*text, f"sensor noise {self.noise_n:.3f} N; {room.verdict(self)}"]

    def as_json(self) -> dict[str, Any]:
        """The contract's keys, and what stands behind them."""
        return {
            "palpations": len(self.presses),
            "rmse_n": self.rmse_n,
            "relative_rmse": self.relative_rmse,
            "regions": [
                {
                    "name": r.region.name,
                    "palpations": int(r.region.members.sum()),
                    "rmse_n": r.rmse_n,
                    "relative_rmse": r.relative_rmse,
                    "bias": r.bias,
                }
                for r in self.regions
            ],
            "wins": {name: self.wins(name) for name in room.MODELS if name != HOMOGENEOUS},
            "noise_n": self.noise_n,
            "young_modulus_pa": self.moduli_pa,
            "folds_with_a_field": sum(field is not None for field in self.fields),
        }

    def _draw(self, ax: Axes) -> None:
        from palpate.report.comparison import draw_by_press

        draw_by_press(self, ax)

    def view(self) -> View:
        """The object to be turned, and each press beside what was simulated."""
        from palpate.report.comparison import view_of

        return view_of(self)

    def _place(self, plotter: Plotter) -> None:
        from palpate.report.quantities import ERROR
        from palpate.results.scenery import add_dots, add_object

        add_object(plotter, self.model)
        error = self.press_rmse_n["fem"] * 1e3
        label = "rms error of FEM, press held out [mN]"
        add_dots(plotter, self.presses.point, error, label=label, colour_map=ERROR.colour_map)
