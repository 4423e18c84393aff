"""From evidence to verdict: what is named, what cannot be told apart, whether something is left over."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.instrument.free_air_offsets import InstrumentOffsets
from palpate.diagnosis.instrument.readings import Readings
from palpate.diagnosis.search.attribution import Attribution
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import Fit, settings_of
from palpate.diagnosis.search.gaps import modulus_share
from palpate.diagnosis.search.rivals import likeliest, names_of
from palpate.diagnosis.search.site_stiffness import heterogeneity, site_factors
from palpate.mechanics.effects.base import Role
from palpate.mechanics.effects.registry import effect, effects
from palpate.mechanics.law_errors import FiniteStrain

SLIDES = 0.4
"""Missing share of the sideways force from which a shape alone does not explain it: of 47 sound objects
two miss up to 0.34 of it, where presses beside an edge lean the object."""


@dataclass(frozen=True)
class Findings:
    """All that a verdict rests on. refit: report gaps of folds fitted anew (else of the linearised fits)."""

    forward: Forward
    search: Search
    found: Attribution
    readings: Readings
    instrument_offsets: InstrumentOffsets
    site_sd: np.ndarray
    excluded: frozenset[str]
    bootstrap: int
    seed: int
    refit: bool

    @property
    def noise_n(self) -> float:
        """N, rms of the force 3-vector's noise."""
        return self.forward.touches.vector_noise_n


@dataclass
class Answer:
    """What is said: names (strongest first), what else may be there, reasons in words, and whether something
    is left over. shape_gain: log likelihood of places that differ, where that is named."""

    names: list[str]
    candidates: list[str]
    reasons: list[str] = field(default_factory=list)
    remainder: bool = False
    nameless_shape: bool = False
    shape_gain: float = 0.0

    @property
    def kind(self) -> str:
        """The contract's word."""
        remainder = self.remainder or self.nameless_shape
        if self.names and remainder:
            return "effect+unknown"
        if remainder:
            return "unknown"
        if not self.names:
            return "none"
        return "ambiguous" if self.rivals else "effect"

    @property
    def rivals(self) -> tuple[str, ...]:
        """What else may be there, once each."""
        return tuple(n for n in dict.fromkeys(self.candidates) if n not in self.names)


def answer_of(findings: Findings, counts: np.ndarray) -> Answer:
    """Weigh the search's outcome. counts: (g,) thinned contact samples of each site."""
    found, offsets = findings.found, findings.instrument_offsets
    left = likeliest(found.explanations, 1 - findings.search.options.doubt)
    answer = Answer([*offsets.names, *found.chosen], list(names_of(left)), list(offsets.reasons))
    misfit, lone = _misfit(findings, counts, answer)
    answer.remainder = misfit
    _slipping(findings, answer)
    _finite_strain(findings, answer)
    _shape(findings, answer)
    _unconfirmed_lump(findings, answer)
    # with nothing named the gap is there all the same
    answer.remainder = answer.remainder or (lone and not answer.names)
    if not answer.names and not answer.remainder:
        answer.reasons.append("the remaining gap is no larger than noise, first touch and shape can explain")
    if misfit:
        over, what = max((found.final.chi, "the noise"), (found.final.place_chi, "what places may be off by"))
        answer.reasons.append(
            f"the best answer still misses by {np.sqrt(over):.1f} times {what}: something else is there"
        )
    return answer


def _misfit(findings: Findings, counts: np.ndarray, answer: Answer) -> tuple[bool, bool]:
    """(something is left that no law explains, it is one place alone)."""
    found, search = findings.found, findings.search
    slack = max([effect(n).hints.slack for n in found.chosen], default=1.0)
    most = slack * search.options.unknown_chi
    if np.sqrt(found.final.place_chi) > most:
        return True, False
    if found.final.chi <= most:
        return False, False
    rest, site = found.final.chi_but_for_one(counts)
    if rest >= most:
        return True, False
    # one touch that slipped or met something else is no law that is missing
    x, y, z = 1e3 * findings.forward.touches.site_point[site]
    answer.reasons.append(
        f"the touches at ({x:.0f}, {y:.0f}, {z:.0f}) mm fit no effect, the others miss by "
        f"{np.sqrt(rest):.1f} times the noise: touch there again"
    )
    return False, True


def _slipping(findings: Findings, answer: Answer) -> None:
    """Sticking is only trusted to a quarter, press by press, so a fit may let the sideways force go wrong."""
    off = findings.search.sideways_off(findings.found.final)
    slips = [e.name for e in effects() if e.hints.slips]
    if off and not set(slips) & set(answer.names):
        answer.candidates[:0] = slips
        answer.remainder |= off > SLIDES
        answer.reasons.append(f"the sideways force is off by {100 * off:.0f} % of itself: the tip may slip")


def _finite_strain(findings: Findings, answer: Answer) -> None:
    found, strain = findings.found, findings.search.finite_strain
    if strain.name in findings.excluded:
        return
    size_n = finite_strain_size(findings.forward, found.base.found)
    if size_n <= findings.search.smallest_n:
        return
    likelier = found.finite_strain_gain > findings.search.options.beyond_doubt
    if likelier and found.finite_strain_closes > 0:
        sizes = {n: max(s[n].size_n for s in found.steps if n in s) for n in found.chosen}
        place = (i for i, n in enumerate(answer.names) if sizes.get(n, np.inf) < size_n)
        answer.names.insert(next(place, len(answer.names)), strain.name)
        answer.reasons.append(
            f"the presses are deep enough that small-strain elasticity is off by about {size_n:.3f} N"
        )
        return
    if likelier:
        answer.reasons.append("finite strain does not shrink the gap at held-out places: it is not named")
    if any(effect(n).hints.stands_for_strain for n in found.chosen):
        # deep enough for it, and it fitted no worse than the linear law until another took its place
        if strain in (*found.final.found.effects, *found.base.found.effects):
            answer.candidates.append(strain.name)


def finite_strain_size(forward: Forward, found: Fit) -> float:
    """N rms over contact samples: what finite strain is expected to change in these presses."""
    t = forward.touches
    depth = np.clip(t.travel[:, 0] + found.likeliest[t.press], 0, None) / forward.tip_radius
    force = np.linalg.norm(
        forward.predict(settings_of(forward, found.effects, found.values, found.likeliest)), axis=1
    )
    change = FiniteStrain.coefficient.value * depth**FiniteStrain.exponent.value * force
    return float(np.sqrt((change[t.counted] ** 2).mean()))


def _unconfirmed_lump(findings: Findings, answer: Answer) -> None:
    """A lump that one place alone speaks for may be a shape that is wrong there."""
    found = findings.found
    for scores, name in zip(found.steps, found.picked, strict=False):
        lives_in_few = name in scores and scores[name].effect.hints.few_places
        if lives_in_few and name in found.chosen and scores[name].by_one_place:
            answer.candidates += _rest()
            answer.reasons.append("only one place shows the lump: the shape may be wrong there instead")


def _shape(findings: Findings, answer: Answer) -> None:
    """Sites that differ by more than the shape's uncertainty, by what no effect explains, enough to be
    felt."""
    found, t = findings.found, findings.forward.touches
    factor, error = site_factors(found.final.found, t)
    per_site = np.array([findings.site_sd[t.site == s].mean() for s in range(t.sites)])
    gain, spread = heterogeneity(factor, error, per_site)
    felt_n = spread * t.force_rms_n
    if gain <= findings.search.options.shape_gain or felt_n <= findings.search.smallest_n:
        return
    allowed = [n for n in _rest() if n not in findings.excluded]
    if not any(effect(n).hints.few_places for n in found.chosen):
        if allowed and not answer.remainder:
            answer.names += allowed
            answer.shape_gain = gain
        answer.reasons.append(
            f"places differ in stiffness by {100 * spread:.0f} % more than the shape's uncertainty"
        )
    answer.nameless_shape = not allowed


def _rest() -> list[str]:
    """What stands for a difference between places that nothing else explains."""
    return [e.name for e in effects() if e.role is Role.REST]


def stated_gap(findings: Findings, answer: Answer) -> np.ndarray:
    """(n,) N^2, the squared length of the stated gap's 3-vector, at the touches' rows.

    Where effects are named and nothing is left over: their force in the final fit, beyond the law without
    them at the same first touches and its best factor (what another modulus takes up is no gap). Where
    something unknown remains: what the ideal model misses, less what noise and the shape's uncertainty are
    expected to add (so it may be negative). Of 'none': 0. What is read in free air too acts on every sample,
    and is left out.
    """
    found, t = findings.found, findings.forward.touches
    strain = findings.search.finite_strain.name
    if answer.remainder or answer.nameless_shape or any(effect(n).role is Role.REST for n in answer.names):
        missed = found.ideal.residual
        by_shape = findings.site_sd[t.press] ** 2 * ((t.local_force - missed) ** 2).sum(axis=1)
        return (missed**2).sum(axis=1) - 3 * t.noise_n**2 - by_shape
    if not {*found.chosen, strain} & set(answer.names):
        return np.zeros(len(t.t))
    final = found.final
    law = (found.ideal if strain in answer.names else found.base).found
    settings = settings_of(findings.forward, law.effects, law.values, final.found.likeliest)
    without = np.nan_to_num(findings.forward.predict(settings))
    gap = t.local_force - final.residual - without
    gap -= modulus_share(gap[t.counted], without[t.counted]) * without
    return (gap**2).sum(axis=1)
