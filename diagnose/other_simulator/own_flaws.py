"""What a simulator has of its own at its best settings, and which errors make up for each other.

A simulator that is off already is no base of nothing: a contact that is too soft makes up for a mesh that is
too stiff, and seems to mend it. So where its force at its best settings is known along the same path, that is
diagnosed first: at each place it has a curve of its own, so much force where our law has so much. Whatever is
changed changes that curve's force: a contact that gives is felt at a lesser depth of it. So a force that is
asked about is read off the curve as our law's, less what the curve leaves, and what is left beside our law is
what was changed. Both runs are given the same parameters, right or wrong: what a mesh is off by changes with
Poisson's ratio, and only the recording says that a parameter is wrong.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.diagnosis.options import AttributionOptions
from palpate.diagnosis.other_simulator.against_law import Numerics
from palpate.diagnosis.other_simulator.forces import Aligned
from palpate.diagnosis.other_simulator.gap_decomposition import GapSums, StatedParameter
from palpate.diagnosis.other_simulator.paired_presses import Sides, named_numerics
from palpate.diagnosis.other_simulator.result import MadeUp, OwnFlaws
from palpate.mechanics.errors import DiagnosisError
from palpate.mechanics.progress import Progress

OWN = "its own"
"""How the force that a simulator is off by at its best settings is named in a pair."""
_LITTLE = 0.02
"""Of the typical force: where either has less, how many times the other it is says nothing."""
_KNOTS = 16
"""Of a place's curve, alike many samples between them."""


def with_same_presses(one: Aligned, two: Aligned) -> tuple[Aligned, Aligned]:
    """Both, of the presses that both have. Raises DiagnosisError where there are none."""
    usable = one.usable & two.usable
    if not usable.any():
        raise DiagnosisError(
            "the baseline has rows in no press that the simulation has: is it the same path?"
        )
    both = [dataclasses.replace(each, usable=usable) for each in (one, two)]
    return both[0], both[1]


@dataclass(frozen=True)
class Own:
    """base, law: (n, 3) N, local, the simulator's force at its best and our law's; curves: by place (k,) N of
    either, increasing from 0; site: (n,) the place of each row; numerics: what the base was named."""

    base: np.ndarray
    law: np.ndarray
    curves: dict[int, tuple[np.ndarray, np.ndarray]]
    site: np.ndarray
    numerics: Numerics

    @property
    def force(self) -> np.ndarray:
        """(n, 3) N that it adds."""
        return self.base - self.law

    def without(self, force: np.ndarray) -> np.ndarray:
        """(n, 3) N that our law would have: the simulator's force (n, 3) N without what is its own."""
        return self._read(force) + self.law - self._read_base

    def times(self) -> np.ndarray:
        """(n, 1) how many times our law's force the simulator's is."""
        read = np.linalg.norm(self._read_base, axis=1)
        size = np.linalg.norm(self.base, axis=1)
        return np.where(read > 0, size / np.maximum(read, 1e-12), 1.0)[:, None]

    def at(self, weighing: GapSums) -> OwnFlaws:
        """What is said of it."""
        return OwnFlaws(self.numerics.named, self.numerics.candidates, weighing.rms_n(self.force))

    @cached_property
    def _read_base(self) -> np.ndarray:
        return self._read(self.base)

    def _read(self, force: np.ndarray) -> np.ndarray:
        """(n, 3) N of our law where the base has this force; beyond its greatest, in proportion."""
        size = np.linalg.norm(force, axis=1)
        out = force.copy()
        for site, (own, law) in self.curves.items():
            rows = (self.site == site) & (size > 0)
            read = np.interp(size[rows], own, law) * np.maximum(size[rows] / own[-1], 1.0)
            out[rows] *= (read / size[rows])[:, None]
        return out


def own_of(sides: Sides, rules: AttributionOptions, progress: Progress) -> Own:
    """What a simulator's force at its best settings has of its own."""
    found = named_numerics(sides, rules, progress)
    t = sides.forward.touches
    base, site = t.local_force, t.site[t.press]
    own, law = (np.linalg.norm(each, axis=1) for each in (base, found.law))
    told = t.counted & (np.minimum(own, law) > _LITTLE * t.force_rms_n)
    curves = {}
    for place in np.unique(site[told]):
        rows = np.flatnonzero(told & (site == place))
        parts = np.array_split(rows[np.argsort(own[rows], kind="stable")], min(_KNOTS, len(rows)))
        knots = np.array([[0.0, 0.0], *([np.median(own[p]), np.median(law[p])] for p in parts)])
        curves[int(place)] = knots[:, 0], np.maximum.accumulate(knots[:, 1])
    return Own(base, found.law, curves, site, found)


def made_up(
    numerics: Numerics,
    wrong: Sequence[StatedParameter],
    own: Own | None,
    weighing: GapSums,
    least_n: float,
) -> tuple[MadeUp, ...]:
    """Pairs of errors that together change the force less than the larger of them alone, by least_n or more,
    N: what hides most first."""
    forces = {name: numerics.force[name] for name in numerics.named}
    # what a parameter takes off the gap is what was missing: given wrongly it adds the contrary
    forces |= {p.name: -p.force for p in wrong}
    if own is not None:
        forces[OWN] = own.force
    found = []
    for (one, a), (two, b) in itertools.combinations(forces.items(), 2):
        alone = weighing.rms_n(a), weighing.rms_n(b)
        together = weighing.rms_n(a + b)
        if together < max(alone) - least_n:
            found.append(MadeUp((one, two), alone, together))
    return tuple(sorted(found, key=lambda pair: pair.together_n - max(pair.alone_n)))
