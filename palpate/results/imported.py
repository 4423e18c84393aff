"""An imported recording that prints, draws and saves itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanics.files import atomic_file
from palpate.importing.convert import Understood
from palpate.importing.written import PICTURE, picture, write_imported
from palpate.results.base import Result
from palpate.results.recording import Recording, recording_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


@dataclass(frozen=True, eq=False, repr=False)
class Imported(Result):
    """What was understood of a table: `recording` goes wherever a recording goes.

    notes: what was done to it, one line each. thing: what was said of the object. sources: the files. `plot`:
    force (N) over time (s); `show`: the tip's path (m); `draw`: all columns as they were understood.
    """

    understood: Understood
    thing: Mapping[str, Any]
    sources: tuple[str, ...]

    @property
    def recording(self) -> Recording:
        """SI units, device frame, force on the tool."""
        return recording_of(self.understood.recording)

    def draw(self, path: Path | str) -> Path:
        """Write the picture of what was understood; returns its path. No other picture is replaced."""
        from matplotlib import pyplot as plt

        path = Path(path)
        figure = picture(self.understood)
        with atomic_file(path, PICTURE) as temporary:
            figure.savefig(temporary, dpi=110, metadata={"Title": PICTURE.holds.decode()})
        plt.close(figure)
        return path

    def save(self, path: Path | str) -> Path:
        """Write NAME.csv.gz (or .csv) and NAME.toml; returns the samples' path."""
        return write_imported(path, self.understood, self.thing, list(self.sources))

    def lines(self) -> list[str]:
        """What `print` says, line by line."""
        recording = self.understood.recording
        span = np.ptp(recording.position, axis=0)
        greatest = float(np.linalg.norm(recording.force_on_tool, axis=1).max())
        how = "quasi-static points" if self.understood.quasi_static else f"{np.ptp(recording.t):.4g} s"
        return [
            f"{len(recording.t)} samples, {how}; path within {_row(1e3 * span)} mm; "
            f"force up to {greatest:.4g} N",
            *(f"  {column}" for column in self.understood.columns.values()),
            *(f"  {note}" for note in self.understood.notes),
        ]

    def _draw(self, ax: Axes) -> None:
        self.recording._draw(ax)

    def _place(self, plotter: Plotter) -> None:
        self.recording._place(plotter)

    def as_json(self) -> dict[str, Any]:
        """The figures of `palpate import --json`."""
        recording = self.understood.recording
        return {
            "samples": len(recording.t),
            "duration_s": float(np.ptp(recording.t)),
            "sample_rate_hz": recording.sample_rate_hz,
            "quasi_static": self.understood.quasi_static,
            "columns": {role: str(c).partition(" = ")[2] for role, c in self.understood.columns.items()},
            "notes": list(self.understood.notes),
        }


def _row(values: np.ndarray) -> str:
    return " x ".join(f"{v:.3g}" for v in values)
