"""A batch: what came out of many recordings."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.batching.plan import Batch
from palpate.batching.steps import MODEL
from palpate.mechanics.model.files import read_model
from palpate.show.batch.page import draw_agreement, lead, next_steps, report, verdict_words
from palpate.show.scenery import OBJECT_COLOUR, surface_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

__all__ = ["as_json", "draw", "lines", "next_steps", "place", "report"]

_NAMED = 12
_SHOWN = 12


def lines(result: Batch) -> list[str]:
    """What `print` says, with units."""
    lines = [f"{lead(result)} {result.tasks} tasks, {result.reused} of them finished before."]
    for entry in result.entries[:_NAMED]:
        row = entry.row
        words = [f"  {row.recording}: "]
        if row.young_modulus_pa is not None:
            low, high = row.young_modulus_lo_pa or np.nan, row.young_modulus_hi_pa or np.nan
            words.append(f"{row.young_modulus_pa / 1e3:.2f} kPa ({low / 1e3:.2f} to {high / 1e3:.2f})")
        if row.gap_before_n is not None and row.gap_after_n is not None:
            gaps = f"gap {1e3 * row.gap_before_n:.0f} to {1e3 * row.gap_after_n:.0f} mN"
            words.append(f"; {verdict_words(entry)}, {gaps}")
        if row.status != "done":
            words.append(f"; {row.status}" if len(words) > 1 else row.status)
        lines.append("".join(words) + (f": {row.reason}" if row.reason else ""))
    if len(result.entries) > _NAMED:
        lines.append(f"  and {len(result.entries) - _NAMED} more (table, or summary.csv)")
    for a in result.agreements[:_NAMED]:
        lines.append(
            f"{a.object}: {a.count} explorations, {a.young_modulus_pa / 1e3:.2f} kPa, spread "
            f"{100 * a.spread:.1f} %, of their own intervals {100 * a.expected:.1f} %"
        )
    if result.undescribed:
        names = ", ".join(path.name for path in result.undescribed[:3])
        more = f" and {len(result.undescribed) - 3} more" if len(result.undescribed) > 3 else ""
        lines.append(f"left aside, as no .toml beside describes them: {names}{more}")
    return [*lines, f"written to {result.folder / 'index.html'}"]


def as_json(result: Batch) -> dict[str, Any]:
    """The keys of `palpate batch --json`."""
    return {
        "folder": str(result.folder),
        "recordings": [asdict(row) for row in result.rows],
        "objects": [asdict(a) for a in result.agreements],
    }


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
    ax.errorbar(e, np.arange(len(known)), xerr=[e - low, high - e], fmt="o", ms=4, color="#1d3557")
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
        plotter.add_mesh(pyvista.PolyData.from_regular_faces(moved, triangles), color=OBJECT_COLOUR)
        start += 1.2 * (high[0] - low[0])
