"""A before-and-after that prints and draws itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnose.compare import before_after as room
from palpate.results.base import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.report.view3d import View


@dataclass(frozen=True, eq=False, repr=False)
class Changes(Result, room.Changes):
    """Two recordings of one object: the moduli (Pa), their ratio and difference with 95 % intervals, and
    which effect explains it.

    Every field is that of `before_after.Changes`. `plot`: both moduli, and each shared place's
    ratio. `show`: the first object, coloured at shared places by the ratio.
    """

    def report(self, path: Path | str) -> Path:
        """Write the answer with pictures as one HTML page."""
        from palpate.report.changes import write_report

        return write_report(path, self)

    def view(self) -> View:
        """The first object to be turned, coloured by what changed where both pressed."""
        from palpate.report.changes import view_of

        return view_of(self)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        text = [self.summary]
        for side, words in ((self.before, "first"), (self.after, "second")):
            low, high = side.model.material.young_modulus_ci95_pa
            named = f"; {side.diagnosis.summary}" if side.diagnosis is not None else ""
            text.append(
                f"{words}, {side.recording.name}: {side.modulus_pa / 1e3:.2f} kPa (95 % interval "
                f"{low / 1e3:.2f} to {high / 1e3:.2f} kPa){named}"
            )
        low, high = self.difference_ci95_pa
        text.append(
            f"difference {self.difference_pa / 1e3:+.2f} kPa (95 % interval {low / 1e3:+.2f} to "
            f"{high / 1e3:+.2f})"
        )
        if self.places:
            apart = [p for p in self.places if not p.ci95[0] <= 1 <= p.ci95[1]]
            ratios = np.array([p.ratio for p in self.places])
            text.append(
                f"{len(self.places)} places that both pressed: ratio {ratios.min():.2f} to "
                f"{ratios.max():.2f}, {len(apart)} of them beyond their interval"
            )
        return [*text, *(f"  {reason}" for reason in self.reasons)]

    def as_json(self) -> dict[str, Any]:
        """The figures of `palpate compare REC REC2 --json`."""

        def side(each: room.Side) -> dict[str, Any]:
            verdict = None
            if each.diagnosis is not None:
                d = each.diagnosis
                verdict = {"kind": d.kind, "effects": list(d.effects), "candidates": list(d.candidates)}
            return {
                "recording": each.recording.name,
                "young_modulus_pa": each.modulus_pa,
                "young_modulus_ci95_pa": list(each.model.material.young_modulus_ci95_pa),
                "beside_effects_pa": each.beside_effects_pa,
                "verdict": verdict,
            }

        return {
            "before": side(self.before),
            "after": side(self.after),
            "ratio": self.ratio,
            "ratio_ci95": list(self.ratio_ci95),
            "difference_pa": self.difference_pa,
            "difference_ci95_pa": list(self.difference_ci95_pa),
            "differs": self.differs,
            "ratio_beside_effects": None if self.beside is None else self.beside[0],
            "ratio_beside_effects_ci95": None if self.beside is None else list(self.beside[1]),
            "places": [
                {
                    **dict(zip("xyz", map(float, p.point), strict=True)),
                    "ratio": p.ratio,
                    "ratio_ci95": list(p.ci95),
                }
                for p in self.places
            ],
            "explained_by": list(self.explained_by),
            "shifted": self.shifted,
            "reasons": list(self.reasons),
        }

    def _draw(self, ax: Axes) -> None:
        from palpate.report.changes import draw

        draw(self, ax)

    def _place(self, plotter: Plotter) -> None:
        from palpate.results.scenery import add_dots, add_object

        add_object(plotter, self.before.model)
        if self.places:
            points = np.array([p.point for p in self.places])
            add_dots(
                plotter,
                points,
                np.array([p.ratio for p in self.places]),
                label="ratio",
                colour_map="coolwarm",
            )
