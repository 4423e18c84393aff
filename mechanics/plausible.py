"""The one table of what is plausible: of each quantity what is possible at all, and what is usual.

Readers of files refuse what is impossible. Checks and importing tell by the usual which unit a column without
one is in: it is wide and log-normal. What a number can be before any arithmetic stands in `mechanics.bounds`;
how far an option may be set, in `mechanics.options`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from palpate.mechanics.disk.schema import FileKey

YOUNG_MODULUS = FileKey(low=1.0, high=1e9, unit="Pa", required=True)
"""From the softest gel to stiff rubber."""
PART_MODULUS = replace(YOUNG_MODULUS, low=0.0)
"""Of a part of a mesh: what has none exerts no force, and is left out."""
POISSON_RATIO = FileKey(low=0.0, high=0.4999)
"""The one range of Poisson's ratio. Below 0 there is no soft solid that a hand explores, and the tables of
the dent (from 0.10 on for 'linear', from 0.40 on for 'neo-hookean', extended in a straight line) know
nothing; towards 0.5 the stiffness of the displacement elements grows as 1 / (1 - 2 nu) until no digits are
left, and 0.5 has none."""
USUAL_POISSON_RATIO = 0.49
"""Of silicone and soft tissue, where nothing is stated."""
TIP_RADIUS = FileKey(low=1e-4, high=0.04, unit="m", required=True)
"""Of a rigid spherical tip that a hand or a device holds."""
SPHERE = FileKey(str, choices=("sphere",))
"""The tip's form, where only that is answered: models and scenes are touched by a sphere."""
USUAL_TIP_RADIUS_M = 0.005
MACHINE_TIP_RADIUS = FileKey(low=1e-9, high=0.1, unit="m")
"""Of a tip of any machine: an AFM's is the smallest."""
TOOL_MASS = FileKey(low=0.0, high=5.0, unit="kg")
SAMPLE_RATE = FileKey(low=60.0, high=1e5, unit="Hz")
READ_RATE = FileKey(low=1e-3, high=1e5, unit="Hz")
"""Of a sensor that is read more slowly than samples are written."""
QUICKEST_HZ = 2e4
"""No hand's exploration is sampled faster: a slower clock is then no clock in milliseconds."""
MOST_SAMPLES = 10_000_000
"""Of a recording, also where its clock is filled at the sample rate: 2.7 hours at 1 kHz."""


@dataclass(frozen=True)
class Quantity:
    """What is plausible of one quantity, in its SI unit ("1": a ratio).

    low, high: what is possible. usual: the median, factor: one standard deviation of the logarithm. powers:
    how the value goes with the units of time, position, force and tip. stated: a ratio to what the recording
    says, which may be wrong too. likely: range of what is no odd unit.
    """

    name: str
    unit: str
    usual: float = math.nan
    factor: float = math.nan
    powers: tuple[float, float, float, float] = (0, 0, 0, 0)
    stated: bool = False
    low: float = 0.0
    high: float = math.inf
    likely: tuple[float, float] = (0.0, math.inf)

    @property
    def words(self) -> str:
        """'duration [s]'."""
        return self.name if self.unit == "1" else f"{self.name} [{self.unit}]"

    def off(self, value: float, shift: float = 0.0) -> float:
        """Standard deviations from the usual, ln of a factor taken off."""
        import numpy as np

        return float((np.log(value / self.usual) - shift) / np.log(self.factor))


EXPLORATION = {
    "duration": Quantity("duration", "s", 100.0, 3.0, (1, 0, 0, 0)),
    "rate": Quantity("rate over the stated one", "1", 1.0, 1.2, (-1, 0, 0, 0), stated=True, high=1.5),
    "speed": Quantity("speed in the air", "m/s", 0.06, 2.5, (-1, 1, 0, 0)),
    "touch": Quantity("time from first touch to the peak", "s", 0.4, 2.5, (1, 0, 0, 0)),
    "extent": Quantity("extent of the path", "m", 0.15, 2.0, (0, 1, 0, 0), high=1.5, likely=(0.02, 0.6)),
    "tip": Quantity("tip's radius", "m", 0.0045, 2.2, (0, 0, 0, 1), low=TIP_RADIUS.low, high=TIP_RADIUS.high),
    "ratio": Quantity("extent of the path over the tip's radius", "1", 33.0, 2.0, (0, 1, 0, -1)),
    "depth": Quantity("depth of a press over the tip's radius", "1", 0.9, 2.0, (0, 1, 0, -1)),
    "resolution": Quantity(
        "step of the positions over the stated one", "1", 1.0, 1.3, (0, 1, 0, 0), stated=True
    ),
    "peak": Quantity("greatest force of a press", "N", 1.2, 3.0, (0, 0, 1, 0)),
    "noise": Quantity("force noise an axis", "N", 0.012, 3.0, (0, 0, 1, 0)),
    "noise stated": Quantity("force noise over the stated one", "1", 1.0, 1.3, (0, 0, 1, 0), stated=True),
    "modulus": Quantity("modulus by Hertz", "Pa", 5e4, 4.6, (0, -1.5, 1, -0.5), low=500.0, high=5e6),
}
"""Of an object by a hand; objects are at most 1 m."""
COLUMN = {
    "position": Quantity("width of the path", "m", 0.05, 4.0, high=3.0),
    "force": Quantity("greatest force", "N", high=100.0),
    "time": Quantity("interval of the rows", "s", high=0.5),
}
"""Of a column whose unit nobody said, by a hand, an arm or a robot: a wider path than an exploration's."""
CURVE = {
    "position": Quantity("depth over the tip's radius", "1", 0.5, 4.0, high=20.0),
    "force": Quantity("modulus by Hertz", "Pa", 2e4, 20.0),
}
"""Of a machine's curve without units: what its lengths give, then its loads."""
UNIT_SHARES = {"position": {"m": 1.0, "mm": 1.0, "um": 0.3}, "force": {"N": 0.85, "mN": 0.1, "gf": 0.05}}
"""How often a column of a machine is in a unit that it does not say; the first is taken where none is."""
