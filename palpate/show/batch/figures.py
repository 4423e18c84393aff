"""How far explorations of one object agree, as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.batching.run import Batch
from palpate.show.page import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_OBJECTS = 12
"""That are drawn; the table beside has all."""


def agreement_figure(result: Batch) -> Figure:
    """Moduli of the explorations of every object with their intervals, over the object's mean."""
    count = min(len(result.agreements), MOST_OBJECTS)
    figure = new_figure(7, 1.1 + 0.55 * count, layout="constrained")
    draw_agreement(figure.subplots(), result)
    return figure


def draw_agreement(ax: Axes, result: Batch) -> Axes:
    """One line an object: each exploration's modulus over their mean, with its 95 % interval."""
    shown = result.agreements[:MOST_OBJECTS]
    for k, found in enumerate(shown):
        rows = [e.row for e in result.entries if e.object == found.object and e.row.young_modulus_pa]
        e, low, high = (
            np.array([getattr(row, f"young_modulus_{end}pa") for row in rows], dtype=float)
            / found.young_modulus_pa
            for end in ("", "lo_", "hi_")
        )
        at = k + (np.linspace(-0.3, 0.3, len(rows)) if len(rows) > 1 else np.zeros(1))
        ax.errorbar(e, at, xerr=[np.maximum(e - low, 0), np.maximum(high - e, 0)], fmt="o", ms=3.5,
                    lw=1, color="#1d3557", ecolor="#8fa3bd")  # fmt: skip
        ax.fill_betweenx(
            [k - 0.42, k + 0.42], 1 - found.spread, 1 + found.spread, color="#2a9d8f", alpha=0.15
        )
    ax.axvline(1, color="#8a96a5", lw=0.8)
    labels = [f"{a.object}\n{a.young_modulus_pa / 1e3:.1f} kPa" for a in shown]
    ax.set_yticks(range(len(shown)), labels, fontsize=9)
    ax.invert_yaxis()
    ax.set_xlabel("modulus over the mean of its object; band: one standard deviation")
    return ax
