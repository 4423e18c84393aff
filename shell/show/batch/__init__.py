"""A batch: what came out of many recordings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.batching.plan import Batch
from palpate.batching.steps import MODEL
from palpate.mechanics.model.files import read_model
from palpate.show.batch.page import draw_agreement, story
from palpate.show.colours import COLOURS
from palpate.show.scenery import surface_of
from palpate.show.story import Key

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

__all__ = ["KEYS", "draw", "place", "story"]

_SHOWN = 12


KEYS: tuple[Key, ...] = ("folder", "recordings=rows", "objects=agreements")


def draw(result: Batch, ax: Axes) -> None:
    """Moduli over the mean of their object, or over the recordings."""
    if result.agreements:
        draw_agreement(ax, result)
        return
    known = [row for row in result.rows if row.young_modulus_pa is not None]
    e, low, high = (
        np.array([getattr(row, f"young_modulus_{end}pa") or np.nan for row in known], dtype=float) / 1e3
        for end in ("", "lo_", "hi_")
    )
    ax.errorbar(e, np.arange(len(known)), xerr=[e - low, high - e], fmt="o", ms=4, color=COLOURS["modulus"])
    ax.set_yticks(range(len(known)), [row.recording for row in known], fontsize=9)
    ax.invert_yaxis()
    ax.set_xlabel("Young's modulus with its 95 % interval [kPa]")


def place(result: Batch, plotter: Plotter) -> None:
    """The first objects side by side."""
    import pyvista

    folders = [
        result.folder / row.recording / MODEL for row in result.rows if row.young_modulus_pa is not None
    ]
    start = 0.0
    for folder in folders[:_SHOWN]:
        model = read_model(folder)
        points, triangles = surface_of(model)
        used = points[np.unique(triangles)]
        low, high = used.min(axis=0), used.max(axis=0)
        moved = np.array(points) - [low[0] - start, (low[1] + high[1]) / 2, low[2]]
        plotter.add_mesh(pyvista.PolyData.from_regular_faces(moved, triangles), color=COLOURS["object"])
        start += 1.2 * (high[0] - low[0])
