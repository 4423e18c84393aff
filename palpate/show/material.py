"""The material found from a bench test: modulus, law, held-out errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnose.specimen.result import Material
from mechanics.quantities import fitting_unit, quantity_words, split_key

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def lines(result: Material) -> list[str]:
    """What `print` says, with units."""
    text = [f"{result.kind}: {result.curves} curve{'s' * (result.curves != 1)}; {_first(result)}"]
    if np.isfinite(result.young_modulus_pa):
        low, high = result.young_modulus_ci95_pa
        unit, factor = fitting_unit("young_modulus_pa", result.young_modulus_pa)
        between = (
            f" (95 % sure: {factor * low:.3g} to {factor * high:.3g} {unit})" if np.isfinite(low) else ""
        )
        text.append(f"Young's modulus {factor * result.young_modulus_pa:.3g} {unit}{between}")
    ranked = sorted(result.error.items(), key=lambda item: item[1])
    text.append(f"held out ({result.held_out}): " + ", ".join(f"{n} {100 * e:.2g} %" for n, e in ranked))
    if result.closed is not None and result.closed_ci95 is not None:
        closed, low, high = (min(share, 1.0) for share in (result.closed, *result.closed_ci95))
        text.append(f"closed {closed:.0%} of the gap (95 % interval {low:.0%} to {high:.0%})")
    text += [f"  {name.replace('_', ' ')}: {in_words(name, v)}" for name, v in result.parameters.items()]
    text += [f"  {note}" for note in result.notes]
    if result.unknown:
        text.append(f"not told by such a test: {', '.join(result.unknown)}")
    return text


def _first(result: Material) -> str:
    """The verdict, after what makes it worth less."""
    doubts = []
    if result.beyond_constant:
        doubts.append(
            f"NO ANSWER: held-out errors of {result.missed:.0%} exceed the "
            f"{result.error['constant']:.0%} of a constant"
        )
    elif result.beaten_by is not None:
        doubts.append(f"{result.beaten_by} predicts held-out data better")
    carried = ", which carries the modulus: NO ANSWER" if result.bound_carries else ""
    doubts += [f"{each} stands at the end of its range{carried}" for each in result.at_bound]
    return "; ".join([*doubts, result.verdict])


def in_words(name: str, value: Any) -> str:
    """A parameter, or those of an effect, as people write them: 'stiffness 68 N/mm'."""
    if isinstance(value, Mapping):
        return ", ".join(
            f"{split_key(key)[0].replace('_', ' ')} {in_words(key, v)}" for key, v in value.items()
        )
    if isinstance(value, list | tuple):
        return ", ".join(in_words(name, v) for v in value) or "none"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return quantity_words(name, value)


def as_json(result: Material) -> dict[str, Any]:
    """The figures of `palpate material --json`."""
    finite = np.isfinite(result.young_modulus_pa)
    return {
        "kind": result.kind,
        "files": list(result.files),
        "curves": result.curves,
        "held_out": result.held_out,
        "young_modulus_pa": result.young_modulus_pa if finite else None,
        "young_modulus_ci95_pa": (
            list(result.young_modulus_ci95_pa) if np.isfinite(result.young_modulus_ci95_pa).all() else None
        ),
        "law": result.law,
        "relative_error": result.error,
        "verdict": result.verdict,
        "effects": list(result.effects),
        "gap_closed": result.closed,
        "gap_closed_ci95": None if result.closed_ci95 is None else list(result.closed_ci95),
        "parameters": result.parameters,
        "notes": list(result.notes),
        "unknown": list(result.unknown),
        "predicts": result.predicts,
        "at_bound": list(result.at_bound),
        "bound_carries_modulus": result.bound_carries,
    }


def draw(result: Material, ax: Axes) -> None:
    """Measured and predicted, else the held-out errors."""
    if result.seen is None:
        names, values = zip(*sorted(result.error.items(), key=lambda item: item[1]), strict=True)
        ax.barh(names, [100 * v for v in values])
        ax.set(xlabel="held-out error [%]")
        return
    x, measured, predicted, across, up = result.seen
    ax.plot(x, measured, ".", ms=2, color="#c1121f", label="measured")
    ax.plot(x, predicted, "-", lw=1, color="#1d3557", label=result.law)
    ax.set(xlabel=across, ylabel=up)
    ax.legend(frameon=False)
