"""What a simulator has of its own at its best settings, and which errors make up for each other.

A simulator that is off already is no base of nothing: a contact that is too soft makes up for a mesh that is
too stiff, and seems to mend it. So where its force at its best settings is known along the same path, that is
diagnosed first; how far it is off our law, in proportion to the modulus, is taken off the force that is
asked about, and what is left is what was changed.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.options import AttributionOptions
from palpate.diagnosis.other_simulator.against_law import Numerics
from palpate.diagnosis.other_simulator.declared_parameters import Stated
from palpate.diagnosis.other_simulator.forces import Aligned
from palpate.diagnosis.other_simulator.gap_decomposition import GapSums, StatedParameter
from palpate.diagnosis.other_simulator.paired_presses import Sides, named_numerics
from palpate.diagnosis.other_simulator.result import MadeUp, OwnFlaws
from palpate.mechanics.errors import DiagnosisError
from palpate.mechanics.progress import Progress

OWN = "its own"
"""How the force that a simulator is off by at its best settings is named in a pair."""


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
    """stated: what the simulator was given at its best; off: (n, 3) N, local, by which its force was off our
    law; numerics: what that was named."""

    stated: Stated
    off: np.ndarray
    numerics: Numerics

    def force(self, stated: Stated) -> np.ndarray:
        """(n, 3) N that it adds where other parameters are given: all force is in proportion to the
        modulus."""
        return self.off * (stated.young_modulus_pa / self.stated.young_modulus_pa)

    def at(self, stated: Stated, weighing: GapSums) -> OwnFlaws:
        """What is said of it."""
        return OwnFlaws(self.numerics.named, self.numerics.candidates, weighing.rms_n(self.force(stated)))


def own_of(sides: Sides, rules: AttributionOptions, progress: Progress) -> Own:
    """What a simulator's force at its best settings has of its own."""
    found = named_numerics(sides, rules, progress)
    return Own(sides.forward.stated, sides.forward.touches.local_force - found.law, found)


def made_up(
    numerics: Numerics,
    wrong: Sequence[StatedParameter],
    own: Own | None,
    stated: Stated,
    weighing: GapSums,
    least_n: float,
) -> tuple[MadeUp, ...]:
    """Pairs of errors that together change the force less than the larger of them alone, by least_n or more,
    N: what hides most first."""
    forces = {name: numerics.force[name] for name in numerics.named}
    # what a parameter takes off the gap is what was missing: given wrongly it adds the contrary
    forces |= {p.name: -p.force for p in wrong}
    if own is not None:
        forces[OWN] = own.force(stated)
    found = []
    for (one, a), (two, b) in itertools.combinations(forces.items(), 2):
        alone = weighing.rms_n(a), weighing.rms_n(b)
        together = weighing.rms_n(a + b)
        if together < max(alone) - least_n:
            found.append(MadeUp((one, two), alone, together))
    return tuple(sorted(found, key=lambda pair: pair.together_n - max(pair.alone_n)))
