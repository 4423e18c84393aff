"""A simulated exploration that prints and draws itself: the recording and the truth about it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from mechanics.recording import write_recording
from palpate.results.base import Result, dressed
from palpate.results.recording import Recording, recording_of
from scenes.laboratory import simulate as room

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.report.view3d import View
    from scenes.phantoms import Phantom


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Result, room.Simulation):
    """A recording of the virtual laboratory, and the truth about it; goes wherever a recording goes.

    Every field is that of `scenes.laboratory.simulate.Simulation`: recording, truth, clean_n (n, 3) N on the
    tool without noise, touches, motion. body: the phantom as it was explored. `plot`: force over time.
    `show`: the tip's path.
    """

    recording: Recording
    phantom: str = field(kw_only=True)
    body: Phantom = field(kw_only=True)

    def save(self, path: Path | str) -> Simulation:
        """Write the recording with its truth; returns the simulation whose recording knows its file."""
        from mechanics.recording import read_recording

        written = write_recording(path, self.recording, truth=self.truth)
        return dressed(Simulation, self, recording=recording_of(read_recording(written)))

    def report(self, path: Path | str) -> Path:
        """Write the object to be turned and every touch beside the ideal object's as one HTML page."""
        from palpate.report.laboratory import write_report

        return write_report(path, self, self.body)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        recording = self.recording
        words = [
            f"Simulation {recording.name}: {recording.t[-1]:.0f} s, {len(self.touches)} palpations of the "
            f"{self.phantom}",
            f"  effects: {', '.join(self.truth['strengths']) or 'none'}",
        ]
        for name, size in self.truth.get("sizes", {}).items():
            refit = size["rms_after_best_scale_n"]
            words.append(f"  {name}: {size['rms_n']:.4f} N, {refit:.4f} N after a refit of the modulus")
        return words

    def _draw(self, ax: Axes) -> None:
        self.recording._draw(ax)

    def view(self) -> View:
        """The object to be turned, and each press beside what was simulated."""
        from palpate.report.laboratory import view_of

        return view_of(self, self.body)

    def _place(self, plotter: Plotter) -> None:
        self.recording._place(plotter)


def simulation_of(plain: room.Simulation, phantom: str, body: Phantom) -> Simulation:
    """The room's simulation as the door gives it."""
    return dressed(Simulation, plain, recording=recording_of(plain.recording), phantom=phantom, body=body)
