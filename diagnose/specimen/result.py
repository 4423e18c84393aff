"""What a bench test holds, and what it says of a material: a modulus, the law that predicts curves it has not
seen, what it cannot tell."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.contact.tip import Tip
from palpate.mechanics.result import Result
from palpate.reconstruction.machine_curves.uniaxial import Uniaxial
from palpate.reconstruction.steps.s7_modulus.held_out import BETTER

FLOORS = {
    "relaxation": ("spring",),
    "compression": ("linear",),
    "tension": ("linear",),
    "indentation": ("kelvin-voigt", "hunt-crossley"),
}
"""1D models, by kind of test."""


@dataclass(frozen=True)
class MachineTests:
    """The curves of one kind: curves of an indentation, with the tip; tests of compression or
    tension; holds (t s, value) of relaxation. poisson_ratio: as the files state it; stated_modulus_pa: by the
    maker's own software, NaN where not said. notes: what was understood of the files; odds: of the least sure
    of it. timed: the clock of the curves means something."""

    kind: str
    curves: tuple[MachineCycle, ...] = ()
    tests: tuple[Uniaxial, ...] = ()
    holds: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    tip: Tip | None = None
    poisson_ratio: float | None = None
    stated_modulus_pa: float = float("nan")
    notes: tuple[str, ...] = ()
    odds: float = float("inf")
    timed: bool = True


@dataclass(frozen=True, eq=False, repr=False)
class Material(Result):
    """kind: of the test. curves: how many. young_modulus_pa with its 95 % interval (NaN where the test tells
    none). law: what predicts best of those with physics; error: each predictor's held-out rms error over the
    rms (of N, Pa): 1D models are the floor, 'regression' has no physics and is the ceiling. closed: share of
    the gap beyond the noise that the verdict closes on held-out curves, with its interval. effects: what was
    named. parameters: by law or effect, SI. unknown: what such a test cannot tell. seen: (x, measured,
    predicted, axes' words). at_bound: parameters at the end of the search; bound_carries: the
    modulus goes with them, as without them it lies outside its interval. odds: of the least sure of
    what was understood of the files. tip, poisson_ratio: of an indentation; poisson_from: who said the ratio
    ("stated", "file" or "assumed"). `plot`: measured and predicted. `show`: nothing, it has no place in
    space.
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
    at_bound: tuple[str, ...] = ()
    bound_carries: bool = False
    odds: float = float("inf")
    tip: Tip | None = None
    poisson_ratio: float = float("nan")
    poisson_from: str = ""

    @property
    def missed(self) -> float:
        """Held-out rms error over the rms of what predicts here: the verdict, else the law."""
        return self.error.get("verdict", self.error[self.law] if self.law in self.error else float("nan"))

    @property
    def predicts(self) -> bool:
        """Whether held-out data are predicted better than by a constant, by a modulus that no end of a search
        decides."""
        return not (self.bound_carries or self.beyond_constant)

    @property
    def beyond_constant(self) -> bool:
        """Whether a constant predicts held-out data better."""
        return self.missed > self.error.get("constant", float("inf"))

    @property
    def in_vain(self) -> bool:
        """Whether what was named predicts held-out data worse than the ideal model does."""
        return self.missed > self.error.get("ideal", float("inf"))

    @property
    def beaten_by(self) -> str | None:
        """The 1D model that predicts held-out data better by more than `BETTER`, if one does."""
        limit = BETTER * self.missed
        floors = [name for name in FLOORS[self.kind] if self.error.get(name, float("inf")) < limit]
        return min(floors, key=lambda name: self.error[name]) if floors else None
