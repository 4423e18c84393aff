"""A recording that prints and draws itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mechanics import recording as room
from palpate.results.base import Result, dressed, quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Result, room.Recording):
    """What a device logged while a hand explored one object.

    t (n,) s; position (n, 3) m, the tip's centre; force_on_tool (n, 3) N; sample_rate_hz; tip_radius_m;
    boundary_phase (start, end) s of phase I, or None. Device frame; every field is that of
    `mechanics.recording.Recording`. `plot`: force over time. `show`: the tip's path, coloured by force.
    """

    @property
    def duration_s(self) -> float:
        """From the first sample to the last, s."""
        return float(self.t[-1] - self.t[0])

    @property
    def force_n(self) -> np.ndarray:
        """(n,) N, length of the force."""
        return np.linalg.norm(self.force_on_tool, axis=1)

    def save(self, path: Path | str) -> Path:
        """Write NAME.csv.gz (or .csv) and NAME.toml (docs/recording-format.md); returns the samples' path."""
        return room.write_recording(path, self)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        phase, noise = self.boundary_phase, self.force_noise_std_n
        size = np.ptp(self.position, axis=0) * 1e3
        return [
            f"Recording {self.name}: {self.object_name}, {self.duration_s:.1f} s, {len(self.t)} samples at "
            f"{self.sample_rate_hz:g} Hz",
            f"  tip radius {quantity(self.tip_radius_m, 'mm', 1e3)}; path within "
            f"{size[0]:.0f} x {size[1]:.0f} x {size[2]:.0f} mm; "
            f"force up to {quantity(self.force_n.max(), 'N')}"
            + ("" if noise is None else f"; sensor noise {quantity(noise, 'mN', 1e3)} an axis"),
            "  phase I (the base is traced): "
            + ("not stated, found by reconstruction" if phase is None else f"{phase[0]:g} to {phase[1]:g} s"),
        ]

    def _draw(self, ax: Axes) -> None:
        from palpate.report.exploration_figures import FORCE_COLOUR, PHASE_COLOUR

        ax.plot(self.t, self.force_n, lw=0.7, color=FORCE_COLOUR)
        if self.boundary_phase is not None:
            ax.axvspan(*self.boundary_phase, color=PHASE_COLOUR, zorder=0, label="phase I")
            ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
        ax.set(xlabel="time [s]", ylabel="force magnitude [N]", xlim=(self.t[0], self.t[-1]))

    def _place(self, plotter: Plotter) -> None:
        from palpate.results.scenery import add_path, look_around

        add_path(plotter, self.position, self.force_n, "force magnitude [N]")
        look_around(plotter, np.array([0.0, 0.0, 1.0]), self.position)


def recording_of(plain: room.Recording) -> Recording:
    """The room's recording as the door gives it."""
    return dressed(Recording, plain)
