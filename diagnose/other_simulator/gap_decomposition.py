"""Which of what is named changes the force most: each alone, on a simulation that is right otherwise.

In the simulation as it came each acts on what the others did to its force, and which comes first would depend
on the others: a mesh that is half too soft takes half of what a wrong tip adds.

What a simulator's gap is made of: its numerics, its parameters, and what every ideal simulation lacks.

The parts are taken off one after another, each predicted at places that its fit has not seen; how much of the
mean square of the gap each takes is its share, so the shares and what is left add up to 1.

    d0 = measured - simulated
    d1 = d0 + what the named numerics add to our law
    d2 = d1 - (our law at the parameters that the recording says - at the stated ones)
    d3 = d2 - first touches of the object - what the named effects add to the ideal model

What first touches take is no part: it stays in what is unexplained, and is said.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.diagnosis.numerics.registry import numerical
from palpate.diagnosis.options import AttributionOptions
from palpate.diagnosis.other_simulator.against_law import COMMON_ERROR, Numerics
from palpate.diagnosis.other_simulator.declared_parameters import Stated, StatedForward
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import Fit, settings_of
from palpate.diagnosis.search.gaps import lower_closure
from palpate.diagnosis.verdict.answer import Findings
from palpate.diagnosis.verdict.held_out import neighbours
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.friction_slip import EFFECT as SLIP
from palpate.mechanics.effects.poisson_ratio import EFFECT as POISSON
from palpate.mechanics.effects.tip_radius import EFFECT as TIP
from palpate.render.replay import rms_n


def sizes_alone(
    forward: StatedForward,
    numerics: Numerics,
    wrong: Sequence[str],
    measured: Stated,
    weighing: GapSums,
) -> dict[str, float]:
    """{name: N rms over contact samples} of the named numerics and the wrong parameters, with everything else
    as the recording says. forward: of all presses of the simulation."""
    law = law_at(forward, measured, numerics)
    # what the samples themselves show is a share of the force that is there
    level = weighing.rms_n(law) / max(weighing.rms_n(numerics.with_numerics), 1e-12)
    sizes = {}
    for name in numerics.named:
        if name not in numerics.values:
            sizes[name] = level * weighing.rms_n(numerics.force[name])
            continue
        sizes[name] = weighing.rms_n(law_at(forward, measured, numerics, [name]) - law)
    for name in wrong:
        key = PARAMETER_OF[name]
        other = measured.but(key, getattr(forward.stated, key))
        sizes[name] = weighing.rms_n(law_at(forward, other, numerics) - law)
    return sizes


@dataclass(frozen=True)
class HeldOutForces:
    """Of real presses, each place by a fit that has not seen it: force (n, 3) N, local; modulus (n,) Pa."""

    force: np.ndarray
    modulus: np.ndarray


def held_out(search: Search, found: Fit) -> HeldOutForces:
    """The force that a set of effects predicts; its modulus is the one of the plain misfit, as in gaps."""
    t = search.forward.touches
    force, modulus = np.zeros_like(t.local_force), np.zeros(len(t.t))
    for fold in neighbours(t):
        weights = np.ones(search.whitener.groups)
        weights[fold] = 0.0
        again = search.without(found, fold)
        by_modulus = again.jacobian[:, :, 0]
        raw = search.whitener.raw_gram(np.stack([again.residual, by_modulus], axis=2))
        others = weights @ raw.reshape(len(raw), 4)
        level = others[1] / max(others[3], 1e-12)
        rows = np.isin(t.site, fold)[t.press]
        force[rows] = (t.local_force - again.residual + level * by_modulus)[rows]
        modulus[rows] = again.modulus * (1 + level)
    return HeldOutForces(force, modulus)


PARAMETER_OF = {
    "stated_modulus": "young_modulus_pa",
    "stated_poisson_ratio": "poisson_ratio",
    "stated_friction": "friction",
    "stated_tip_radius": "tip_radius_m",
}
"""Name in an answer -> field of Stated."""
INSTRUMENT = "instrument"
"""Domain of effects that change a reading and nothing of the object."""
ALSO_PARAMETERS = (POISSON.name, SLIP.name, TIP.name)
"""Effects of a diagnosis that say a parameter which a simulator is given."""


@dataclass(frozen=True)
class Reality:
    """The real side, at all of its touches' rows: ideal and full model as `HeldOut`, with the readings that
    the instrument adds put back onto the measured force (n, 3) N. names: of the effects between the two.
    modulus: (n,) Pa, of the ideal model read by the instrument as it is: a late sensor makes no object
    softer."""

    measured: np.ndarray
    ideal: HeldOutForces
    full: HeldOutForces
    names: tuple[str, ...]
    modulus: np.ndarray


def reality_of(findings: Findings, named: Sequence[str], strain: Sequence[Effect]) -> Reality:
    """named: what a diagnosis names. strain: finite strain, where the simulator has it too."""
    search, final = findings.search, findings.found.final.found
    also = [e for e in final.effects if e.name in named and e.name in ALSO_PARAMETERS]
    ideal = search.judge([*strain, *also], like=findings.found.final)
    names = tuple(n for n in named if n not in ALSO_PARAMETERS and n not in {e.name for e in strain})
    base = {e.name for e in findings.found.base.found.effects}
    acting = [e for e in final.effects if e.name in names or e.name in base or e in also]
    full = ideal if not names else search.judge(acting, like=findings.found.final)
    offsets = findings.instrument_offsets
    t = findings.forward.touches
    own = held_out(search, ideal.found)
    whole = own if full is ideal else held_out(search, full.found)
    if offsets.names:
        taken = offsets.residual if set(offsets.names) <= set(named) else np.zeros_like(offsets.residual)
        whole = dataclasses.replace(whole, force=whole.force + taken)
    reading = [e for e in final.effects if e.name in names and e.domain == INSTRUMENT]
    modulus = own.modulus
    if reading:
        read = search.judge([*strain, *also, *reading], like=findings.found.final)
        modulus = held_out(search, read.found).modulus
    return Reality(t.local_force + offsets.residual, own, whole, names, modulus)


def law_at(
    forward: StatedForward, stated: Stated, numerics: Numerics, flaws: Sequence[str] = ()
) -> np.ndarray:
    """(n, 3) N: our law at other parameters, with finite strain where the simulator has it, and with these of
    the flaws that were fitted to it (numerics.values)."""
    other = dataclasses.replace(forward, stated=stated)
    effects = (*numerics.strain, *(numerical(name) for name in flaws))
    values = [np.log([stated.young_modulus_pa]), *(numerics.values[name] for name in flaws)]
    return np.nan_to_num(other.predict(settings_of(other, effects, np.concatenate(values))))


def measured_parameters(
    findings: Findings, stated: Stated, modulus_pa: float, named: Mapping[str, Mapping[str, Any]]
) -> Stated:
    """What the recording says of each: the modulus of the ideal fit; Poisson's ratio, friction and tip as the
    diagnosis found them, else as the model and the recording state them."""
    forward = findings.forward
    model = forward.model
    slip = named.get(SLIP.name, model.effects.get(SLIP.name, {}))
    return dataclasses.replace(
        stated,
        young_modulus_pa=modulus_pa,
        poisson_ratio=float(
            named.get("poisson_ratio", {}).get("poisson_ratio", model.material.poisson_ratio)
        ),
        friction=float(slip.get("mu", np.inf)),
        tip_radius_m=float(named.get(TIP.name, {}).get("tip_radius_m", forward.tip_radius)),
    )


@dataclass(frozen=True)
class GapSums:
    """How gaps (n, 3) N are added up: group (n,) the place of each row, -1 where it does not count; added:
    N^2, the noise that thinning took off; noise_n: N, of the 3-vector."""

    group: np.ndarray
    added: float
    noise_n: float

    def squares(self, gap: np.ndarray) -> np.ndarray:
        """(g,) N^2 of each place."""
        rows = self.group >= 0
        return np.bincount(self.group[rows], weights=(gap[rows] ** 2).sum(axis=1), minlength=self.places)

    @property
    def places(self) -> int:
        """How many."""
        return int(self.group.max()) + 1

    @property
    def counts(self) -> np.ndarray:
        """(g,) rows of each place."""
        return np.bincount(self.group[self.group >= 0], minlength=self.places)

    def rms_n(self, force: np.ndarray) -> float:
        """N, rms of a 3-vector without noise: one that a law says."""
        return float(np.sqrt(self.squares(force).sum() / self.counts.sum()))

    def gap_n(self, gap: np.ndarray) -> float:
        """N, rms of the 3-vector."""
        return float(np.sqrt(self.squares(gap).sum() / self.counts.sum() + self.added))


@dataclass(frozen=True)
class StatedParameter:
    """A stated parameter that is named: what it adds to our law, (n, 3) N, and its two values."""

    name: str
    force: np.ndarray
    stated: float
    measured: float


def wrong_parameters(
    gap: np.ndarray,
    forward: StatedForward,
    numerics: Numerics,
    measured: Stated,
    modulus: np.ndarray,
    weighing: GapSums,
    rules: AttributionOptions,
) -> list[StatedParameter]:
    """The stated parameters that the recording contradicts, the one that takes most first.

    gap: (n, 3) N, without the numerics. modulus: (n,) Pa, the recording's, at each place by the others. Named
    is what changes the force by more than half the noise, and takes something in nine of ten resamplings.
    """
    least = rules.smallest * weighing.noise_n
    current = forward.stated
    found: list[StatedParameter] = []
    noise = max(weighing.noise_n**2 - weighing.added, 0.0)
    while True:
        law = law_at(forward, current, numerics)
        best: tuple[float, StatedParameter, np.ndarray] | None = None
        for name, key in PARAMETER_OF.items():
            was, now = getattr(current, key), getattr(measured, key)
            if was == now or any(p.name == name for p in found):
                continue
            if key == "young_modulus_pa":
                if abs(np.log(now / was)) < np.log1p(COMMON_ERROR):
                    continue
                change = law * (modulus / was - 1)[:, None]
            else:
                change = law_at(forward, current.but(key, now), numerics) - law
            if rms_n(change[weighing.group >= 0]) < least:
                continue
            before, after = weighing.squares(gap), weighing.squares(gap - change)
            if lower_closure(before, after, weighing.counts, noise, least**2, rules.doubt) <= 0:
                continue
            drop = float(before.sum() - after.sum())
            if best is None or drop > best[0]:
                best = drop, StatedParameter(name, change, was, now), gap - change
        if best is None:
            return found
        found.append(best[1])
        gap = best[2]
        current = current.but(PARAMETER_OF[best[1].name], best[1].measured)
