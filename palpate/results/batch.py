"""A batch that prints and draws itself: what came out of many recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.batching import summary as room
from palpate.batching.plan import MODEL
from palpate.batching.summary import COLUMNS, Row
from palpate.results.base import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

_NAMED = 12
_SHOWN = 12


@dataclass(frozen=True, eq=False, repr=False)
class Batch(Result, room.Batch):
    """A row a recording, and how far explorations of one object agree. Moduli Pa, gaps N rms, lengths m.

    Iterate over its rows, or take `table`, name -> column, which `pandas.DataFrame` reads. entries: with what
    every step returned; agreements: objects explored more than once; folder: has a folder a recording,
    summary.csv and index.html. `plot`: moduli over the mean of their object, or over the recordings. `show`:
    the first objects side by side.
    """

    @property
    def rows(self) -> list[Row]:
        """As in summary.csv, in the order of the recordings' paths."""
        return [entry.row for entry in self.entries]

    @property
    def failed(self) -> list[Row]:
        """Those that failed; `reason` says why."""
        return [row for row in self.rows if row.status == "failed"]

    @property
    def table(self) -> dict[str, list[Any]]:
        """The columns of summary.csv by name; None where nothing is known."""
        return {name: [getattr(row, name) for row in self.rows] for name in COLUMNS}

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.entries)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        from palpate.report.batch import lead, verdict_words

        lines = [f"{lead(self)} {self.tasks} tasks, {self.reused} of them finished before."]
        for entry in self.entries[:_NAMED]:
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
        if len(self) > _NAMED:
            lines.append(f"  and {len(self) - _NAMED} more (table, or summary.csv)")
        for a in self.agreements[:_NAMED]:
            lines.append(
                f"{a.object}: {a.count} explorations, {a.young_modulus_pa / 1e3:.2f} kPa, spread "
                f"{100 * a.spread:.1f} %, of their own intervals {100 * a.expected:.1f} %"
            )
        if self.undescribed:
            names = ", ".join(path.name for path in self.undescribed[:3])
            more = f" and {len(self.undescribed) - 3} more" if len(self.undescribed) > 3 else ""
            lines.append(f"left aside, as no .toml beside describes them: {names}{more}")
        return [*lines, f"written to {self.folder / 'index.html'}"]

    def as_json(self) -> dict[str, Any]:
        """The keys of `palpate batch --json`."""
        return {
            "folder": str(self.folder),
            "recordings": [asdict(row) for row in self.rows],
            "objects": [asdict(a) for a in self.agreements],
        }

    def _draw(self, ax: Axes) -> None:
        if self.agreements:
            from palpate.report.batch import draw_agreement

            draw_agreement(ax, self)
            return
        known = [row for row in self.rows if row.young_modulus_pa is not None]
        e, low, high = (
            np.array([getattr(row, f"young_modulus_{end}pa") or np.nan for row in known], dtype=float) / 1e3
            for end in ("", "lo_", "hi_")
        )
        ax.errorbar(e, np.arange(len(known)), xerr=[e - low, high - e], fmt="o", ms=4, color="#1d3557")
        ax.set_yticks(range(len(known)), [row.recording for row in known], fontsize=9)
        ax.invert_yaxis()
        ax.set_xlabel("Young's modulus with its 95 % interval [kPa]")

    def _place(self, plotter: Plotter) -> None:
        import pyvista

        from mechanics.model_files import read_model
        from palpate.results.scenery import OBJECT_COLOUR, surface_of

        folders = [
            self.folder / row.recording / MODEL for row in self.rows if row.young_modulus_pa is not None
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
