"""FEM against the 1D models on presses that none has seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from diagnose.compare.comparison import Comparison, verdict
from diagnose.compare.models import RIVALS
from palpate.show.comparison.figures import draw, view
from palpate.show.comparison.page import report
from palpate.show.quantities import ERROR
from palpate.show.scenery import add_dots, add_object

if TYPE_CHECKING:
    from pyvista import Plotter

__all__ = ["as_json", "draw", "lines", "place", "report", "view"]


def lines(result: Comparison) -> list[str]:
    """What `print` says, with units."""
    names = list(result.rmse_n)
    text = [f"{'held out':<22}{'presses':>8}  " + "".join(f"{name:>26}" for name in names)]

    def row(label: str, count: int, rmse: dict, share: dict, bias: dict | None) -> str:
        cells = []
        for name in names:
            cell = f"{rmse[name]:.3f} N {100 * share[name]:.1f} %"
            cells.append(cell + (f" bias {100 * bias[name]:+.0f} %" if bias else ""))
        return f"{label:<22}{count:>8}  " + "".join(f"{cell:>26}" for cell in cells)

    text.append(row("folds over sites", len(result.presses), result.rmse_n, result.relative_rmse, None))
    for r in result.regions:
        text.append(row(r.region.name, int(r.region.members.sum()), r.rmse_n, r.relative_rmse, r.bias))
    noise, constant = result.noise_n, result.constant_n
    best = min(RIVALS, key=lambda name: result.rmse_n[name])
    fem, rival = result.rmse_n["fem"], result.rmse_n[best]
    lost = f"{best} predicts held-out presses better: {rival:.3f} N, FEM {fem:.3f} N"
    return [
        *([lost] if rival < fem else []),
        *text,
        f"floor: the sensor noise {noise:.3f} N, {best} {rival:.3f} N; ceiling: a constant push "
        f"{constant:.3f} N; {verdict(result)}",
    ]


def as_json(result: Comparison) -> dict[str, Any]:
    """The contract's keys, and what stands behind them."""
    return {
        "palpations": len(result.presses),
        "rmse_n": result.rmse_n,
        "relative_rmse": result.relative_rmse,
        "regions": [
            {
                "name": r.region.name,
                "palpations": int(r.region.members.sum()),
                "rmse_n": r.rmse_n,
                "relative_rmse": r.relative_rmse,
                "bias": r.bias,
            }
            for r in result.regions
        ],
        "wins": {name: result.wins(name) for name in ("fem", *RIVALS)},
        "noise_n": result.noise_n,
        "constant_rmse_n": result.constant_n,
        "young_modulus_pa": result.moduli_pa,
        "folds_with_a_field": sum(field is not None for field in result.fields),
    }


def place(result: Comparison, plotter: Plotter) -> None:
    """The object, each press coloured by the FEM's error."""
    add_object(plotter, result.model)
    error = result.press_rmse_n["fem"] * 1e3
    label = "rms error of FEM, press held out [mN]"
    add_dots(plotter, result.presses.point, error, label=label, colour_map=ERROR.colour_map)
