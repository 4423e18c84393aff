"""FEM against the 1D models on presses that none has seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from diagnose.compare.comparison import Comparison, verdict
from diagnose.compare.models import RIVALS
from palpate.show.comparison.figures import draw, view
from palpate.show.comparison.page import lead, meaning, next_steps, report
from palpate.show.quantities import ERROR
from palpate.show.scenery import add_dots, add_object

if TYPE_CHECKING:
    from pyvista import Plotter

__all__ = ["as_json", "draw", "lines", "next_steps", "place", "report", "view"]


def lines(result: Comparison) -> list[str]:
    """What `print` says, with units."""
    names = list(result.rmse_n)
    text = [
        lead(result),
        f"  {meaning(result)}",
        "error where no fit has looked, mN (in brackets: by how much the force is too large):",
        f"  {'left out':<16}{'presses':>8}" + "".join(f"{name:>17}" for name in names),
    ]

    def row(label: str, count: int, rmse: dict, bias: dict | None) -> str:
        cells = [
            f"{1e3 * rmse[name]:.0f}" + (f" ({100 * bias[name]:+.0f} %)" if bias else "") for name in names
        ]
        return f"  {label:<16}{count:>8}" + "".join(f"{cell:>17}" for cell in cells)

    text.append(row("single sites", len(result.presses), result.rmse_n, None))
    for r in result.regions:
        text.append(row(r.region.name, int(r.region.members.sum()), r.rmse_n, r.bias))
    return [
        *text,
        f"beside: the sensor's noise {1e3 * result.noise_n:.0f} mN, a constant push instead of a model "
        f"{1e3 * result.constant_n:.0f} mN",
        verdict(result),
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
