"""A calibration: each quantity with its interval, and what the sensor's matrix makes of each axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.quantities import fitting_unit
from palpate.mechanics.recording.calibration import Calibration
from palpate.show.story import Detail, Headline, Story
from palpate.words import signed, sure, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHOWN = {
    "tip_radius_m": "tip's radius",
    "stiffness_n_per_m": "tool's stiffness",
    "play_m": "play",
    "delay_s": "the force reads late by",
}


def story(result: Calibration) -> Story:
    """Each quantity that was found, with its interval."""
    yield Headline(
        f"calibrated on {result.about.get('on', 'something')}, {result.about.get('presses', '?')} presses"
    )
    for key, words in _SHOWN.items():
        value, between = getattr(result, key), result.interval.get(key)
        if value is not None:
            unit, scale = fitting_unit(key, value)
            words, sign = signed(words, value)
            scale, between = sign * scale, between and between[::sign]
            within = "" if between is None else f" ({sure(*(f'{scale * end:.4g}' for end in between))})"
            yield Detail(f"{words}: {with_unit(value, unit, scale)}{within}")
    if result.matrix is not None:
        rows = ["[" + ", ".join(f"{v:.3f}" for v in row) + "]" for row in np.asarray(result.matrix)]
        yield Detail(f"sensor: read = [{', '.join(rows)}] true")
    if result.bias_n is not None:
        yield Detail(f"bias: {', '.join(f'{v:.4f}' for v in result.bias_n)} N")
    if absent := result.about.get("not_told", []):
        yield Detail(f"not found or not measurable: {', '.join(absent)}")


def draw(result: Calibration, ax: Axes) -> None:
    """What the sensor's matrix makes of each axis."""
    matrix = np.eye(3) if result.matrix is None else np.asarray(result.matrix)
    ax.imshow(matrix - np.eye(3), cmap="RdBu", vmin=-0.2, vmax=0.2)
    ax.set_xticks(range(3), ["true x", "true y", "true z"])
    ax.set_yticks(range(3), ["read x", "read y", "read z"])
    for (i, k), value in np.ndenumerate(matrix):
        ax.text(k, i, f"{value:.3f}", ha="center", va="center")
