"""What a bench test says of a material: a modulus, the law that predicts curves it has not seen, what it
cannot tell."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanics.errors import OptionError
from palpate.results.base import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from diagnose.verdict.result import Diagnosis

FLOORS = {
    "relaxation": ("spring",),
    "compression": ("linear",),
    "tension": ("linear",),
    "indentation": ("kelvin-voigt", "hunt-crossley"),
}
"""1D models, by kind of test."""
CEILING = "regression"


@dataclass(frozen=True, eq=False, repr=False)
class Material(Result):
    """kind: of the test. curves: how many. young_modulus_pa with its 95 % interval (NaN where the test tells
    none). law: what predicts best of those with physics; error: each predictor's held-out rms error over the
    rms (of N, Pa): 1D models are the floor, 'regression' has no physics and is the ceiling. closed: share of
    the gap beyond the noise that the verdict closes on held-out curves, with its interval. effects: what was
    named. parameters: by law or effect, SI. unknown: what such a test cannot tell. seen: (x, measured,
    predicted, axes' words). `plot`: measured and predicted. `show`: nothing, it has no place in space.
    """

    kind: str
    files: tuple[str, ...]
    curves: int
    held_out: str
    young_modulus_pa: float
    young_modulus_ci95_pa: tuple[float, float]
    law: str
    error: dict[str, float]
    verdict: str
    effects: tuple[str, ...] = ()
    closed: float | None = None
    closed_ci95: tuple[float, float] | None = None
    parameters: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    seen: tuple[np.ndarray, np.ndarray, np.ndarray, str, str] | None = None
    diagnosis: Diagnosis | None = None

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        text = [f"{self.kind}: {self.curves} curve{'s' * (self.curves != 1)}; {self.verdict}"]
        if np.isfinite(self.young_modulus_pa):
            low, high = self.young_modulus_ci95_pa
            between = f" (95 % interval {low:.4g} to {high:.4g} Pa)" if np.isfinite(low) else ""
            text.append(f"Young's modulus {self.young_modulus_pa:.4g} Pa{between}")
        ranked = sorted(self.error.items(), key=lambda item: item[1])
        text.append(f"held out ({self.held_out}): " + ", ".join(f"{n} {100 * e:.2g} %" for n, e in ranked))
        if self.closed is not None and self.closed_ci95 is not None:
            low, high = self.closed_ci95
            text.append(f"closed {self.closed:.0%} of the gap (95 % interval {low:.0%} to {high:.0%})")
        text += [f"  {name}: {value}" for name, value in self.parameters.items()]
        text += [f"  {note}" for note in self.notes]
        if self.unknown:
            text.append(f"not told by such a test: {', '.join(self.unknown)}")
        return text

    def as_json(self) -> dict[str, Any]:
        """The figures of `palpate material --json`."""
        finite = np.isfinite(self.young_modulus_pa)
        return {
            "kind": self.kind,
            "files": list(self.files),
            "curves": self.curves,
            "held_out": self.held_out,
            "young_modulus_pa": self.young_modulus_pa if finite else None,
            "young_modulus_ci95_pa": (
                list(self.young_modulus_ci95_pa) if np.isfinite(self.young_modulus_ci95_pa).all() else None
            ),
            "law": self.law,
            "relative_error": self.error,
            "verdict": self.verdict,
            "effects": list(self.effects),
            "gap_closed": self.closed,
            "gap_closed_ci95": None if self.closed_ci95 is None else list(self.closed_ci95),
            "parameters": self.parameters,
            "notes": list(self.notes),
            "unknown": list(self.unknown),
        }

    def _draw(self, ax: Axes) -> None:
        if self.seen is None:
            names, values = zip(*sorted(self.error.items(), key=lambda item: item[1]), strict=True)
            ax.barh(names, [100 * v for v in values])
            ax.set(xlabel="held-out error [%]")
            return
        x, measured, predicted, across, up = self.seen
        ax.plot(x, measured, ".", ms=2, color="#c1121f", label="measured")
        ax.plot(x, predicted, "-", lw=1, color="#1d3557", label=self.law)
        ax.set(xlabel=across, ylabel=up)
        ax.legend(frameon=False)

    def _place(self, plotter: Plotter) -> None:
        raise OptionError("a bench test has no place in space: use .plot()")
