"""What was understood of a table: its columns in lines, and the recording as a recording is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.importing.imported import Imported
from palpate.show import recording as measured

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


def lines(result: Imported) -> list[str]:
    """What `print` says, line by line."""
    recording = result.understood.recording
    size = " x ".join(f"{v:.3g}" for v in 1e3 * np.ptp(recording.position, axis=0))
    greatest = float(np.linalg.norm(recording.force_on_tool, axis=1).max())
    how = "quasi-static points" if result.understood.quasi_static else f"{np.ptp(recording.t):.4g} s"
    return [
        f"{len(recording.t)} samples, {how}; path within {size} mm; force up to {greatest:.4g} N",
        *(f"  {column}" for column in result.understood.columns.values()),
        *(f"  {note}" for note in result.understood.notes),
    ]


def as_json(result: Imported) -> dict[str, Any]:
    """The figures of `palpate import --json`."""
    recording = result.understood.recording
    return {
        "samples": len(recording.t),
        "duration_s": float(np.ptp(recording.t)),
        "sample_rate_hz": recording.sample_rate_hz,
        "quasi_static": result.understood.quasi_static,
        "columns": {role: str(c).partition(" = ")[2] for role, c in result.understood.columns.items()},
        "notes": list(result.understood.notes),
    }


def draw(result: Imported, ax: Axes) -> None:
    """Force over time."""
    measured.draw(result.recording, ax)


def place(result: Imported, plotter: Plotter) -> None:
    """The tip's path, coloured by force."""
    measured.place(result.recording, plotter)
