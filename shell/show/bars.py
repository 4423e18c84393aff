"""Two or three bars that differ: how far each of a few models is from the measured force."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Any

from palpate.show.colours import COLOURS
from palpate.words import mn

_INK = COLOURS["noise"]


def height_of(bars: int) -> float:
    """Inches, of a figure that holds so many bars."""
    return 1.1 + 0.42 * bars


def draw_errors(ax: Any, bars: Sequence[tuple[str, float, str]], noise_n: float, label: str) -> None:
    """Draw (name, error N rms, colour) each as a bar in mN; the line is the sensor's noise, N rms."""
    names, values, colours = zip(*bars, strict=True)
    ax.barh([fill(name, 26) for name in names], [1e3 * v for v in values], color=colours, height=0.62)
    most = 1e3 * max(*values, noise_n)
    for k, value in enumerate(values):
        ax.text(1e3 * value + 0.02 * most, k, mn(value), va="center", fontsize=9.5)
    ax.axvline(1e3 * noise_n, color=_INK, lw=1.2, ls=(0, (4, 3)))
    ax.text(1e3 * noise_n + 0.012 * most, -0.62, "sensor's noise", color=_INK, va="bottom", fontsize=8.5)
    ax.set(xlim=(0, 1.22 * most), ylim=(len(bars) - 0.5, -1.05), xlabel=label)
    ax.tick_params(axis="y", length=0)
    ax.spines[["top", "right", "left"]].set_visible(False)
