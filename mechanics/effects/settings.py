"""The settings of a prediction, the ideal model until effects change them; and what effects see of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from palpate.mechanics.compliance.pressed_places import Places
from palpate.mechanics.contact.dent import DentLaw, dent_law
from palpate.mechanics.effects.law import PathLaw

STICKS = float("inf")


@dataclass
class TouchTerms:
    """What one tip feels where it touches; prediction and renderer read it.

    dent_law: name of the dent's law; factors: functions of Poisson's ratio that give what DentLaw.scaled
    takes, (k,) each, at mechanics.contact.dent.grid(). tip_ratio: radius of the
    tip over the stated one. friction: Coulomb's coefficient. numbers: (k,) of each law along the path.
    """

    dent_law: str = "linear"
    factors: list[Callable[[float], tuple[np.ndarray, ...]]] = field(default_factory=list)
    tip_ratio: float = 1.0
    friction: float = STICKS
    numbers: dict[PathLaw, np.ndarray] = field(default_factory=dict)

    def law_of_dent(self, poisson_ratio: float) -> DentLaw:
        """The dent's law at this friction, with all factors."""
        law = dent_law(self.dent_law, poisson_ratio, self.friction)
        for factor in self.factors:
            law = law.scaled(*factor(poisson_ratio))
        return law


@dataclass
class ForwardSettings:
    """The settings of a prediction; the defaults are the ideal model.

    modulus: Pa. nu: Poisson's ratio. far: (p, 3, 3) local, unit modulus. bracing: (p,) 1/m. dent_ratio: (p,)
    modulus under the tip over the global one. onset: (p,) m, how much earlier each press meets the surface.
    stiffness: (p,) factor. tool_compliance: m/N, of a spring in series at the stated modulus. unsure_m: (n,)
    standard deviation of where the tip is, along any axis, or None. moves: where the tip is, (n, 3) m, from
    where it reads. readings: what is read, (n, 3) N in the device frame, from what is felt; in the order of
    their numbers.
    """

    modulus: float
    nu: float
    far: np.ndarray
    bracing: np.ndarray
    dent_ratio: np.ndarray
    onset: np.ndarray
    stiffness: np.ndarray
    touch: TouchTerms = field(default_factory=TouchTerms)
    tool_compliance: float = 0.0
    unsure_m: np.ndarray | None = None
    moves: list[Callable[[np.ndarray], np.ndarray]] = field(default_factory=list)
    readings: list[tuple[int, Callable[[np.ndarray], np.ndarray]]] = field(default_factory=list)

    def move(self, where: Callable[[np.ndarray], np.ndarray]) -> None:
        """Add what takes the tip from its reading to where it is."""
        self.moves.append(where)

    def read(self, order: int, reading: Callable[[np.ndarray], np.ndarray]) -> None:
        """Add what the instrument does to the force."""
        self.readings.append((order, reading))


LATE, WEIGHED, MIXED, SHIFTED = range(4)
"""What an instrument does to a force, in order: reads it late, adds the tool, mixes axes, shifts its zero."""


class TouchedScene(Protocol):
    """What effects see of a recording's presses: p presses, n samples.

    places: the pressed places. start: (p + 1,) rows of each press. t: (n,) s, the recording's clock. press:
    (n,). lead, unsure: (n, 3) side of the tip in a play that the reading follows, and its standard deviation.
    quaternion: (n, 4) tool to device,
    or None. acceleration: (n, 3) m/s^2, device frame. tip_radius: m, of the recording, as stated.
    """

    places: Places

    @property
    def start(self) -> np.ndarray: ...
    @property
    def t(self) -> np.ndarray: ...
    @property
    def press(self) -> np.ndarray: ...
    @property
    def lead(self) -> np.ndarray: ...
    @property
    def unsure(self) -> np.ndarray: ...
    @property
    def quaternion(self) -> np.ndarray | None: ...
    @property
    def acceleration(self) -> np.ndarray: ...
    @property
    def tip_radius(self) -> float: ...
