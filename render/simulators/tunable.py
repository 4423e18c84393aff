"""Which settings of another simulator a person may tune: numerics alone, never what the object is."""

from __future__ import annotations

import math
from dataclasses import dataclass

APART = 1.5
"""Ratio of two values that tell something of a setting."""


@dataclass(frozen=True)
class Tunable:
    """One number of a simulator's settings.

    rungs: values to try, increasing, whose ends are its bounds; whole: none between them. term: as that
    simulator's own files and calls name it. mends: numerical effects (`diagnose.numerics`), strongest first.
    dear: whether larger values cost more.
    """

    name: str
    rungs: tuple[float, ...]
    term: str
    mends: tuple[str, ...]
    whole: bool = False
    dear: bool = False

    def beside(self, value: float, up: bool) -> float | None:
        """The next rung up or down that tells something, or the last one; None at the end."""
        beyond = [r for r in self.rungs if (r > value if up else r < value)]
        beyond = beyond if up else beyond[::-1]
        far = [r for r in beyond if self.whole or max(r / value, value / r) > APART]
        return next(iter(far or beyond[-1:]), None)

    def place(self, value: float) -> float:
        """Where a value lies on the ladder: 0 its first rung, 1 the next; between and beyond by ratio."""
        if value in self.rungs:
            return float(self.rungs.index(value))
        last = len(self.rungs) - 1
        above = next((k for k, rung in enumerate(self.rungs) if rung > value), last) or 1
        below, over = self.rungs[above - 1], self.rungs[above]
        if self.whole or not math.isfinite(over):
            return above - 0.5
        return above - 1 + math.log(value / below) / math.log(over / below)

    def at(self, place: float) -> float:
        """The value there, 0 at least and the last rung at most; the nearest rung where there is none between
        them."""
        if self.whole:
            return self.rungs[round(place)]
        below = min(math.floor(place), len(self.rungs) - 2)
        one, two = self.rungs[below : below + 2]
        return one if place == below else one * (two / one) ** (place - below)

    def size(self, start: float, value: float) -> float:
        """How large a change is: the logarithm of the ratio; infinity lies twice the ladder beyond it."""
        if start == value:
            return 0.0
        if math.isfinite(start) and math.isfinite(value):
            return abs(math.log(value / start))
        ends = [rung for rung in self.rungs if math.isfinite(rung)]
        beyond = 2 * math.log(ends[-1] / ends[0])
        return beyond + math.log(ends[-1] / min(start, value))


EDGES = Tunable(
    "edge_radii",
    (0.35, 0.5, 0.7, 1.0, math.inf),
    "edges of the object's mesh under the tip, in the tip's radii (inf: as the model has them)",
    ("contact_nodes", "mesh_stiffness", "contact_offset", "tunnelling"),
    whole=True,
)
"""Every one of them is given a mesh."""


def density(term: str) -> Tunable:
    """Mass where all is slow: recordings are quasi-static, and what swings is the simulation's own."""
    return Tunable(
        "density_kg_m3", (10.0, 30.0, 100.0, 300.0, 1000.0), term, ("numerical_damping", "lost_contact")
    )
