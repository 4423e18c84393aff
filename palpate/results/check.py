"""A check-up that prints and draws itself: what may be wrong with a recording, before it is believed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.results.base import Result
from palpate.results.recording import Recording
from reconstruct.checks.finding import Finding

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


@dataclass(frozen=True, eq=False, repr=False)
class Checkup(Result):
    """What may be wrong with a recording; the gravest first.

    findings: each with name, saw, sure, todo, grave, error (relative, of the modulus), stretch (s), channels.
    seen: what was measured on the way: words with the unit, value, what is usual (NaN where nothing is).
    full: whether the modulus was looked at too. `plot`: force over time, stretches shaded. `show`: the path.
    """

    recording: Recording
    findings: tuple[Finding, ...]
    seen: tuple[tuple[str, float, float], ...] = ()
    full: bool = False

    @property
    def grave(self) -> tuple[Finding, ...]:
        """Findings for which `reconstruct` refuses the recording."""
        return tuple(f for f in self.findings if f.grave)

    def report(self, path: Path | str) -> Path:
        """Write the findings, with a picture of each one's stretch, as an HTML page."""
        from palpate.report.check import write_report

        return write_report(path, self)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        found, grave = len(self.findings), len(self.grave)
        looked = "samples, presses and modulus" if self.full else "samples and presses"
        head = f"{self.recording.name}, {self.recording.duration_s:.1f} s: "
        if not found:
            return [f"{head}nothing to find fault with in its {looked}"]
        return [
            f"{head}{found} finding{'s' * (found > 1)}, {grave} grave",
            *(f.line() for f in self.findings),
        ]

    def as_json(self) -> dict[str, Any]:
        """The figures of `palpate check --json`, keys with units."""
        return {
            "recording": self.recording.name,
            "grave": len(self.grave),
            "findings": [finding_json(f) for f in self.findings],
            "seen": [{"what": words, "value": value, "usual": usual} for words, value, usual in self.seen],
        }

    def _draw(self, ax: Axes) -> None:
        from palpate.report.check import over_time

        over_time(ax, self)

    def _place(self, plotter: Plotter) -> None:
        from palpate.results.scenery import add_path, look_around

        flagged = np.zeros(len(self.recording.t))
        for k, finding in enumerate(reversed(self.findings)):
            if finding.stretch:
                a, b = np.searchsorted(self.recording.t, finding.stretch)
                flagged[a : b + 1] = k + 1
        add_path(plotter, self.recording.position, flagged, "finding (0: none)")
        look_around(plotter, np.array([0.0, 0.0, 1.0]), self.recording.position)


def finding_json(finding: Finding) -> dict[str, Any]:
    """A finding's figures, keys with units."""
    return {
        "name": finding.name,
        "grave": finding.grave,
        "saw": finding.saw,
        "sure": finding.sure,
        "todo": finding.todo,
        "modulus_error": finding.error,
        "decades": finding.decades,
        "stretch_s": finding.stretch,
        "channels": finding.channels,
    }
