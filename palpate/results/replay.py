"""A replay that prints and draws itself: rendered against measured force along a recorded path."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanics.samples import runs
from palpate.results.base import Result
from palpate.results.model import Model
from palpate.results.recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

MEASURED, RENDERED = "#a8bccb", "#c1121f"


@dataclass(frozen=True, eq=False, repr=False)
class ReplayResult(Result):
    """Forces of a renderer along a recorded path, against those measured.

    t: (n,) s. force_n: (n, 3) N rendered, on the tool, device frame. contact: (n,) bool, the samples that
    count: phase II, from first touch to its loss and 50 ms around. rmse_n: N, rms length of the error over
    them; force_rms_n: of the measured force; relative: their ratio. `plot`: both forces over time. `show`:
    the object, each touch coloured by its rms error.
    """

    recording: Recording
    model: Model
    renderer: str
    t: np.ndarray
    force_n: np.ndarray
    contact: np.ndarray
    rmse_n: float
    force_rms_n: float
    relative: float

    @property
    def error_n(self) -> np.ndarray:
        """(n, 3) N, rendered less measured force."""
        return self.force_n - self.recording.force_on_tool

    @property
    def noise_n(self) -> float | None:
        """N, rms length of the sensor's noise, where the recording states it."""
        noise = self.recording.force_noise_std_n
        return None if noise is None else float(noise * np.sqrt(3.0))

    def save(self, path: Path | str) -> Path:
        """Write `t,fx,fy,fz` (s, and N on the tool) as `palpate replay` does."""
        from render.replay import write_forces

        write_forces(path, self.t, self.force_n)
        return Path(path)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        return [
            f"{self.renderer}: error {self.rmse_n:.4g} N rms over {int(self.contact.sum())} contact samples, "
            f"{100 * self.relative:.3g} % of the measured {self.force_rms_n:.4g} N rms"
            + (f" (sensor noise {self.noise_n:.3g} N)" if self.noise_n is not None else "")
        ]

    def as_json(self) -> dict[str, Any]:
        """The figures of `palpate replay --json`, keys with units."""
        figures = {
            "renderer": self.renderer,
            "samples": len(self.force_n),
            "contact_samples": int(self.contact.sum()),
            "rmse_n": self.rmse_n,
            "force_rms_n": self.force_rms_n,
            "relative_rmse": self.relative,
            "peak_force_n": float(np.linalg.norm(self.force_n, axis=1).max()),
        }
        return figures if self.noise_n is None else {**figures, "noise_n": self.noise_n}

    def touches(self) -> tuple[np.ndarray, np.ndarray]:
        """Places (k, 3) m where the tip met the object, and the rms error (k,) N of each touch."""
        size = np.linalg.norm(self.force_n, axis=1)
        places, errors = [], []
        for first, last in runs(self.contact):
            felt = np.flatnonzero(size[first:last] > 0)
            if len(felt):
                at = first + felt[0]
                normal = self.force_n[at] / size[at]
                places.append(self.recording.position[at] - self.recording.tip_radius_m * normal)
                errors.append(np.sqrt((self.error_n[first:last] ** 2).sum(axis=1).mean()))
        return np.array(places).reshape(-1, 3), np.array(errors)

    def _draw(self, ax: Axes) -> None:
        ax.plot(self.t, self.recording.force_n, lw=1.6, color=MEASURED, label="measured")
        ax.plot(self.t, np.linalg.norm(self.force_n, axis=1), lw=0.7, color=RENDERED, label=self.renderer)
        counted = self.contact if self.contact.any() else np.ones_like(self.contact)
        most = max(self.recording.force_n[counted].max(), np.linalg.norm(self.force_n, axis=1).max())
        ax.set(
            xlabel="time [s]",
            ylabel="force magnitude [N]",
            xlim=(self.t[counted][0], self.t[counted][-1]),
            ylim=(0, 1.05 * most),
            title=f"error {self.rmse_n:.3f} N rms, {100 * self.relative:.1f} %",
        )
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, ncols=2)

    def _place(self, plotter: Plotter) -> None:
        from palpate.report.quantities import ERROR
        from palpate.results.scenery import add_dots, add_object

        add_object(plotter, self.model)
        places, errors = self.touches()
        add_dots(plotter, places, errors * 1e3, label=ERROR.label, colour_map=ERROR.colour_map)
