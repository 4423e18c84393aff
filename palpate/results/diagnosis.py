"""A diagnosis that prints and draws itself: the gap, its cause, and how far it shrinks."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from diagnose.verdict import result as room
from palpate.results.base import Result
from palpate.results.model import Model, model_of
from palpate.results.recording import Recording, recording_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.report.view3d import View


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Result, room.Diagnosis):
    """The sim-to-real gap: where, which effect, how far it shrinks; gaps in N rms over held-out samples.

    Every field is that of `result.Diagnosis`: kind, effects, candidates, gap_before_n, gap_after_n,
    entries (one an effect, with parameters), where, next_touch. recording, model: what was diagnosed. `plot`:
    what each effect would take away. `show`: the object coloured by the gap, with the next touch as an arrow.
    """

    recording: Recording = field(kw_only=True)
    model: Model = field(kw_only=True)

    def improved(self) -> Model:
        """The model with the object's, contact's and boundary's effects that were named; the instrument's are
        not the object's and stay out. Its modulus is that at which the renderer meets the recording best."""
        from diagnose.apply import corrected, improved, with_replayed_modulus

        better, _ = improved(self.model, self)
        return model_of(with_replayed_modulus(better, corrected(self.recording, self)).replaced(path=None))

    def corrected(self) -> Recording:
        """The recording with the instrument's effects taken off."""
        from diagnose.apply import corrected

        return recording_of(corrected(self.recording, self))

    def report(self, path: Path | str) -> Path:
        """Write the three answers with pictures as one HTML page."""
        from palpate.report.diagnosis import write_report

        return write_report(path, self.recording, self.model, self)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        return self.words()

    def _draw(self, ax: Axes) -> None:
        from palpate.report.diagnosis_figures import gains

        gains(ax, self)

    def view(self) -> View:
        """The object to be turned, and each press beside what was simulated."""
        from palpate.report.diagnosis_figures import view_of

        return view_of(self.model, self)

    def _place(self, plotter: Plotter) -> None:
        from palpate.report.diagnosis_figures import gap_at, sites_of
        from palpate.report.quantities import ERROR
        from palpate.results.scenery import add_arrow, add_dots, add_object, surface_of

        gap = gap_at(self, surface_of(self.model)[0]) * 1e3
        add_object(plotter, self.model, gap, label="gap [mN]", colour_map=ERROR.colour_map)
        add_dots(plotter, sites_of(self), colour="#2a9d8f")
        touch = self.next_touch
        if touch is not None and self.candidates:
            along = np.array(touch.direction)
            add_arrow(plotter, np.array([touch.x, touch.y, touch.z]) - 0.03 * along, along, 0.03)
