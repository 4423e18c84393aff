"""A finding of the check-up, and the two bars that every one of them has passed.

The check-up of a recording as a result: what may be wrong with it, and what was measured on the way.

What came out: a modulus that a soft object can have, an interval, and a force that the model explains.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.stats import binom

from palpate.mechanics.plausible import EXPLORATION
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.result import Result

SURE_P = 1e-6
"""A statistic's probability on a sound recording must be below this before it makes a finding."""
SURE_ODDS = 1e3
"""Where two readings of the same samples are compared, the better must be so much more probable."""
GRAVE = 0.25
"""A finding that may move the modulus by this share, or makes it meaningless, is grave."""


PRESSES = "presses that can be used"
"""Words of what is seen."""


@dataclass(frozen=True)
class Way:
    """A way to go on with the same file. says: where it is right. options: of `palpate open`, by name; a
    column is named by its role, '-fz' is its negative."""

    says: str
    options: Mapping[str, Any]


OF_A_KNOWN_OBJECT = (
    Way("the object's shape is a file", {"shape": "SHAPE.stl", "unit": "mm"}),
    Way("it is a slab, here 20 mm thick", {"slab_m": 0.02}),
    Way("it is flat, deep and wide compared with every contact", {"half_space": True}),
)
"""Ways that need no traced base."""
OF_A_SHAPE = OF_A_KNOWN_OBJECT[:1]
"""Those where walls were pressed too: nothing flat has them."""
ALL_THE_SAME = Way("go on all the same", {"force": True})


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with a recording.

    name: of the kind. saw: what was seen, with figures. sure: how sure, by which
    statistic. todo: what to do. error: relative standard error that it adds to the modulus, infinite where
    nothing can be said. decades: -log10 of the probability on a sound recording, or log10 of the odds.
    stretch: (start, end) s of the recording as it is, worth a look. channels: columns of the recording.
    ways: to go on with the same file.
    """

    name: str
    saw: str
    sure: str
    todo: str
    error: float
    decades: float
    stretch: tuple[float, float] | None = None
    channels: tuple[str, ...] = ()
    ways: tuple[Way, ...] = (ALL_THE_SAME,)

    @property
    def grave(self) -> bool:
        """Whether the modulus is not reliable."""
        return not self.error < GRAVE

    def line(self) -> str:
        """One line for a person."""
        found = f"{'GRAVE' if self.grave else 'note'}: {self.name}: {self.saw} ({self.sure})"
        return found if self.todo in self.saw else f"{found}; {self.todo}"

    def as_json(self) -> dict[str, Any]:
        """Its figures, keys with units."""
        return {
            "name": self.name,
            "grave": self.grave,
            "saw": self.saw,
            "sure": self.sure,
            "todo": self.todo,
            "modulus_error": self.error,
            "decades": self.decades,
            "stretch_s": self.stretch,
            "channels": self.channels,
            "ways": [{"says": way.says, "options": dict(way.options)} for way in self.ways * self.grave],
        }


def decades_of_tail(count: int, among: int, share: float) -> float:
    """-log10 of the probability that `count` or more of `among` happen where each does with this share."""
    if count <= 0 or among <= 0:
        return 0.0
    return float(-binom.logsf(count - 1, among, min(max(share, 1e-12), 1.0)) / np.log(10))


def sure(decades: float) -> bool:
    """Whether a probability of 10^-decades is beyond the bar."""
    return decades > -np.log10(SURE_P)


def p_words(decades: float) -> str:
    """The probability in words."""
    return f"p = 1e-{min(decades, 300):.0f}"


@dataclass(frozen=True, eq=False, repr=False)
class Checkup(Result):
    """What may be wrong with a recording; the gravest first.

    findings: each with name, saw, sure, todo, grave, error (relative, of the modulus), stretch (s), channels.
    seen: what was measured on the way: words with the unit, value, what is usual (NaN where nothing is).
    full: whether the modulus was looked at too. opened: what `palpate open` was given, by name, and under
    "names" the column of each role; {} for a recording of its own. `plot`: force over time, stretches
    shaded. `show`: the path.
    """

    recording: Recording
    findings: tuple[Finding, ...]
    seen: tuple[tuple[str, float, float], ...] = ()
    full: bool = False
    opened: Mapping[str, Any] = field(default_factory=dict)

    @property
    def presses(self) -> int | None:
        """How many presses reconstruction would find; None where something grave stands before them."""
        return next((int(value) for words, value, _ in self.seen if words == PRESSES), None)

    @property
    def grave(self) -> tuple[Finding, ...]:
        """Findings for which `reconstruct` refuses the recording."""
        return tuple(f for f in self.findings if f.grave)


_MISFIT = 0.5


@dataclass(frozen=True)
class ReconstructionOutcome:
    """What is looked at of a reconstruction: modulus and its 95 % interval, Pa; of each press (k,) the misfit
    rms (NaN where unknown) and the force rms, N, and first touch, s; name of the shape's file, '' of none."""

    modulus_pa: float
    ci95_pa: tuple[float, float]
    misfit_n: np.ndarray
    force_n: np.ndarray
    onset_s: np.ndarray
    shape: str = ""


def outcome_of(
    presses: Presses,
    modulus_pa: float,
    ci95_pa: tuple[float, float],
    misfit_n: np.ndarray | None,
    shape: str = "",
) -> ReconstructionOutcome:
    """Of fitted presses; misfit_n: (p,) N rms, None by the paper's method, which states none."""
    net, touched = presses.net, presses.press[presses.counted]
    squared = np.bincount(touched, (net.force[presses.counted] ** 2).sum(axis=1), len(presses))
    force = np.sqrt(squared / np.maximum(np.bincount(touched, minlength=len(presses)), 1))
    misfit = np.full(len(presses), np.nan) if misfit_n is None else misfit_n
    return ReconstructionOutcome(modulus_pa, ci95_pa, misfit, force, presses.onset_s, shape)


def outcome(result: ReconstructionOutcome) -> Iterator[Finding]:
    """A modulus or interval that is none; a modulus beyond soft objects; a misfit as large as the force."""
    modulus, (low, high) = result.modulus_pa, result.ci95_pa
    numbers, possible = np.array([modulus, low, high]), EXPLORATION["modulus"]
    if not np.isfinite(numbers).all() or not 0 < low <= high:
        yield Finding(
            "no interval",
            f"the modulus is {modulus:.4g} Pa with the interval {low:.4g} to {high:.4g} Pa",
            "no number",
            "presses contradict one another: see the other findings; press more places",
            np.inf,
            np.inf,
        )
    elif not possible.low < modulus < possible.high:
        yield Finding(
            "modulus",
            f"the modulus is {modulus:.4g} Pa; objects that can be felt have "
            f"{possible.low / 1e3:g} kPa to {possible.high / 1e6:g} MPa",
            f"{max(possible.low / modulus, modulus / possible.high):.3g} times beyond",
            "check the units of position and force, and the tip's radius",
            np.inf,
            np.inf,
        )
    known = np.isfinite(result.misfit_n) & (result.force_n > 0)
    if not known.any():
        return
    share = result.misfit_n[known] / result.force_n[known]
    typical = float(np.median(share))
    if typical < _MISFIT:
        return
    worst = int(np.flatnonzero(known)[np.argmax(share)])
    at = float(result.onset_s[worst])
    look = "see the other findings"
    if result.shape:
        look = (
            f"check that '{result.shape}' stands as the object did: --up (in a TOML shape_up) says which way "
            "is up in its file, +x, -z, ..."
        )
    yield Finding(
        "misfit",
        f"the model misses half of the presses by more than {100 * typical:.0f} % of their force (rms)",
        f"{known.sum()} presses; 5 to 20 % is usual",
        f"{look}; `palpate diagnose` names what the model lacks",
        float(typical),
        np.inf,
        (at - 0.2, at + 1.0),
        ("fx", "fy", "fz"),
    )
