"""What an exploration is for, how far it has come, and when it may end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import erf

from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import option
from palpate.reconstruction.shapes.fit import LEAST_TOUCHES
from palpate.reconstruction.steps.s4_surface import Surface


@dataclass(frozen=True)
class GoalOptions:
    """When to stop; a goal that is None is not asked for."""

    modulus_within: float | None = option(
        0.05, "half the 95 % interval of the modulus, as a share of it", flag="--modulus-within"
    )
    surface_within_m: float | None = option(
        0.002, "where 95 % of the surface must lie within", unit="m", flag="--surface-within"
    )
    cause_at: float | None = option(
        None, "probability that one cause alone, or none, explains the touches (0.95)", flag="--cause-at"
    )
    complete: bool = option(
        False,
        "at the end, press the bare support, wave, and trace the base once more: this separates the "
        "instrument from the object, and shows whether it moved",
        flag="--complete",
    )
    most: int = option(40, "greatest number of presses, and of tracings", flag="--most")

    def __post_init__(self) -> None:
        """Raises OptionError for goals that cannot be."""
        if self.modulus_within is not None and not 0 < self.modulus_within < 1:
            raise OptionError(f"--modulus-within is {self.modulus_within}; it must lie between 0 and 1")
        if self.surface_within_m is not None and not self.surface_within_m > 0:
            raise OptionError(f"--surface-within is {self.surface_within_m} m; it must be greater than 0")
        if self.cause_at is not None and not 0.5 <= self.cause_at < 1:
            raise OptionError(f"--cause-at is {self.cause_at}; it must lie between 0.5 and 1 (0.95)")
        if self.most < LEAST_TOUCHES:
            raise OptionError(f"--most is {self.most}; a surface needs {LEAST_TOUCHES} presses or more")


@dataclass(frozen=True)
class GoalState:
    """How far one goal has come. now, goal: in its own unit; inf where nothing is known yet."""

    name: str
    now: float
    goal: float

    @property
    def met(self) -> bool:
        """Whether it is reached."""
        return self.now <= self.goal

    @property
    def missing(self) -> float:
        """Log of how many times too uncertain it still is; 0 where it is met."""
        return max(0.0, float(np.log(min(self.now, 1e3 * self.goal) / self.goal)))


def surface_error(deviation_m: np.ndarray, area: np.ndarray, share: float = 0.95) -> float:
    """m: `share` of a surface's area lies within this, for Gaussian errors of standard deviation (n,) m."""
    deviation = np.maximum(np.asarray(deviation_m, dtype=float), 1e-9)
    weight = np.asarray(area, dtype=float) / np.sum(area)

    def short(x: float) -> float:
        return float(weight @ erf(x / (deviation * np.sqrt(2)))) - share

    return float(brentq(short, 0.0, 10 * float(deviation.max())))


def off_support(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """((n,) bool, the vertices of a surface that are off the support; (k,) m^2 of those)."""
    free = (surface.vertices - surface.support_point) @ surface.support_normal > 1e-6
    return free, vertex_areas(surface.vertices, surface.triangles)[free]


def vertex_areas(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n,) m^2: a third of the triangles around each vertex."""
    corner = vertices[triangles]
    size = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 2
    return np.bincount(triangles.ravel(), np.repeat(size / 3, 3), minlength=len(vertices))


def check_goals(goals: GoalOptions) -> None:
    """Raises OptionError where nothing is asked for."""
    if goals.modulus_within is None and goals.surface_within_m is None and goals.cause_at is None:
        raise OptionError("no goal is given: give --modulus-within, --surface-within or --cause-at")
