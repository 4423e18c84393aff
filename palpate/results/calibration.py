"""A calibration that prints, draws and saves itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanics import calibration as room
from mechanics.errors import OptionError
from palpate.results.base import Result
from palpate.results.recording import Recording, recording_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

_SHOWN = (
    ("tip_radius_m", "tip's radius", 1e3, "mm"),
    ("stiffness_n_per_m", "tool's stiffness", 1.0, "N/m"),
    ("play_m", "play", 1e3, "mm"),
    ("delay_s", "the force reads late by", 1e3, "ms"),
)


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Result, room.Calibration):
    """What an instrument does to a recording: tip_radius_m, stiffness_n_per_m, play_m, matrix, bias_n (N),
    delay_s.

    None where it was not told, interval holds 95 % of each. A recording names it: [tool] calibration =
    "TOOL.toml". `plot`: what the sensor's matrix makes of each axis. `show`: nothing, it has no place in
    space.
    """

    def save(self, path: Path | str) -> Path:
        """Write TOOL.toml; returns its path."""
        return room.write_calibration(path, self)

    def corrected(self, recording: Recording) -> Recording:
        """The recording as an ideal instrument had read it."""
        return recording_of(recording.corrected(self))

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        text = [
            f"calibrated on {self.about.get('on', 'something')}, {self.about.get('presses', '?')} presses"
        ]
        for key, words, scale, unit in _SHOWN:
            value = getattr(self, key)
            between = self.interval.get(key)
            if value is not None:
                within = ""
                if between is not None:
                    within = f" (95 % interval {scale * between[0]:.4g} to {scale * between[1]:.4g})"
                text.append(f"  {words}: {scale * value:.4g} {unit}{within}")
        if self.matrix is not None:
            rows = ["[" + ", ".join(f"{v:.3f}" for v in row) + "]" for row in np.asarray(self.matrix)]
            text.append(f"  sensor: read = [{', '.join(rows)}] true")
        if self.bias_n is not None:
            text.append(f"  bias: {', '.join(f'{v:.4f}' for v in self.bias_n)} N")
        absent = self.about.get("not_told", [])
        if absent:
            text.append(f"  not found or not told: {', '.join(absent)}")
        return text

    def as_json(self) -> dict[str, Any]:
        """What the TOML holds."""
        return self.table()

    def _draw(self, ax: Axes) -> None:
        matrix = np.eye(3) if self.matrix is None else np.asarray(self.matrix)
        ax.imshow(matrix - np.eye(3), cmap="RdBu", vmin=-0.2, vmax=0.2)
        ax.set_xticks(range(3), ["true x", "true y", "true z"])
        ax.set_yticks(range(3), ["read x", "read y", "read z"])
        for (i, k), value in np.ndenumerate(matrix):
            ax.text(k, i, f"{value:.3f}", ha="center", va="center")

    def _place(self, plotter: Plotter) -> None:
        raise OptionError("a calibration has no place in space: use .plot()")
