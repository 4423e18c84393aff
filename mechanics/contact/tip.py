"""The form of a machine's tip, and the laws of what it is pushed back by on an elastic half-space.

A sphere has the dent laws of `mechanics.contact.dent`. The others have one closed form each, F = E* k d^p,
with E* = E / (1 - nu^2), depth d, radius a or half angle theta (between axis and flank):
    punch      2 a E* d                         (Sneddon 1965: flat end, frictionless)
    cone       (2 / pi) tan(theta) E* d^2       (Sneddon 1965)
    pyramid    0.7453 tan(theta) E* d^2         (Bilodeau 1992: four sides, theta of a face)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.errors import OptionError
from palpate.mechanics.plausible import MACHINE_TIP_RADIUS

POWERS = {"sphere": 1.5, "punch": 1.0, "cone": 2.0, "pyramid": 2.0}
"""Form -> power of the depth that the force grows by at small depths."""
FORMS = tuple(POWERS)
POINTED = ("cone", "pyramid")
WORDS = {"sphere": "a sphere", "punch": "a flat punch", "cone": "a cone", "pyramid": "a pyramid"}
_SPHERE_LAWS = ("sphere", "hertz", "linear", "neo-hookean")
_OF_TANGENT = {"cone": 2 / np.pi, "pyramid": 0.7453}


def other_tip(
    form: str,
    where: str,
    file: str = "FILE",
    radius_m: float | None = None,
    angle_deg: float | None = None,
    *,
    own: bool = False,
) -> str:
    """Why presses of an object by a tip of another form are refused, and the command that reads them.
    radius_m, angle_deg: where known; own: the file is a recording, whose columns have names and units of
    their own."""
    size = f"--tip-angle {angle_deg or 'DEGREES'}" if form in POINTED else f"--tip-radius {radius_m or 'M'}"
    said = " --column t=t --column depth=-z --column load=fz --units position=m,force=N" if own else ""
    return (
        f"{where} is {form}, and shapes, models and their forces are of a sphere alone, under whose laws "
        f"{WORDS[form]} gives a wrong modulus. Straight presses of one flat piece are read as a machine's "
        f"curves: palpate material {file} --tip {form} {size}{said}"
    )


@dataclass(frozen=True)
class Tip:
    """form: of FORMS. radius_m: m, of a sphere or of a punch's end; half_angle_deg: of a cone or pyramid.

    Raises OptionError for another form, and for a radius or angle that is missing or impossible.
    """

    form: str
    radius_m: float | None = None
    half_angle_deg: float | None = None

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise OptionError(f"--tip is '{self.form}'; allowed are {', '.join(FORMS)}")
        if self.form in POINTED:
            if self.half_angle_deg is None or not 0 < self.half_angle_deg < 90:
                given = "not given" if self.half_angle_deg is None else f"{self.half_angle_deg:g} degrees"
                raise OptionError(
                    f"the half angle of {WORDS[self.form]} is {given}; it must lie between 0 and 90: "
                    "--tip-angle DEGREES, from the axis to the flank"
                )
        elif self.radius_m is None or not MACHINE_TIP_RADIUS.takes(self.radius_m):
            low, high = MACHINE_TIP_RADIUS.low, MACHINE_TIP_RADIUS.high
            given = "not given" if self.radius_m is None else f"{self.radius_m:g} m"
            raise OptionError(
                f"--tip-radius is {given}; it must lie between {low:g} and {high:g} m: give metres"
            )

    @property
    def power(self) -> float:
        """Of the depth, by which the force grows."""
        return POWERS[self.form]

    @property
    def laws(self) -> tuple[str, ...]:
        """Names of those that a press may follow, the usual one first."""
        return _SPHERE_LAWS if self.form == "sphere" else (self.form,)

    def force(
        self, law: str, depth_m: np.ndarray, young_modulus_pa: float, poisson_ratio: float
    ) -> np.ndarray:
        """N by one of `laws` at depths (k,) m, 0 where not positive."""
        if self.form == "sphere":
            assert self.radius_m is not None
            return np.asarray(dent_law(law).force(depth_m, young_modulus_pa, poisson_ratio, self.radius_m))
        depth = np.maximum(np.asarray(depth_m, dtype=float), 0.0)
        return young_modulus_pa / (1 - poisson_ratio**2) * self._unit * depth**self.power

    @property
    def _unit(self) -> float:
        """Force over E* d^power of a closed form."""
        if self.form == "punch":
            assert self.radius_m is not None
            return 2 * self.radius_m
        assert self.half_angle_deg is not None
        return _OF_TANGENT[self.form] * float(np.tan(np.radians(self.half_angle_deg)))

    def guess_modulus(self, depth_m: float, force_n: float, poisson_ratio: float) -> float:
        """Pa, of one reading."""
        law = "hertz" if self.form == "sphere" else self.form
        return force_n / max(float(self.force(law, np.array([depth_m]), 1.0, poisson_ratio)[0]), 1e-300)

    def scaled(self, length: float) -> Tip:
        """With lengths so many times as large."""
        return self if self.radius_m is None else replace(self, radius_m=length * self.radius_m)

    @property
    def words(self) -> str:
        """'a flat punch of 5 mm radius'."""
        if self.form in POINTED:
            return f"{WORDS[self.form]} of {self.half_angle_deg:g} degrees half angle"
        return f"{WORDS[self.form]} of {1e3 * (self.radius_m or 0.0):.4g} mm radius"
