"""What a simulator's numerics add: its force against our law's at its own stated parameters, on one path.

The search is the one for physical effects (`diagnose.search`) with the numerical effects in its library. Its
modulus is stated, not fitted; its noise is not a sensor's but what our own law may miss
(mechanics.law_errors).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.numerics.base import NumericalEffect, Signal
from palpate.diagnosis.numerics.registry import numericals
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.other_simulator.declared_parameters import StatedForward
from palpate.diagnosis.search.attribution import Attribution, attribute
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import Fit, parameter_intervals, settings_of
from palpate.diagnosis.search.limits import SEEN
from palpate.diagnosis.search.rivals import Explanation, likeliest, names_of, without
from palpate.diagnosis.verdict.held_out import neighbours, never_worse
from palpate.mechanics.effects.base import Effect, Role
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.law_errors import DepthLaw, FirstTouch, Level, Repeats, Smallest, Stiffness, Unnamed
from palpate.mechanics.presses.table import Noise
from palpate.mechanics.progress import Progress, silent
from palpate.render.replay import rms_n

LEAST_SHARE = Smallest.simulator.value
"""Of the typical force, below which a numerical effect is not named: our own law is no better everywhere."""
NUISANCE = NuisanceOptions(
    onset_m=FirstTouch.simulator.value,
    site_stiffness=Stiffness.simulator.value,
    press_stiffness=Repeats.simulator.value,
    law=DepthLaw.simulator.value,
    floor_share=Unnamed.share_simulator.value,
    floor_along=Unnamed.along_simulator.value,
    latency_s=0.0,
    floor_n=Unnamed.force_simulator.value,
)
"""One standard deviation of what our law misses on the surface that a simulator was given too."""
COMMON_ERROR = Level.simulator.value
"""Share by which our law may be off everywhere alike: a stiffness within it is no mesh's."""


@dataclass(frozen=True)
class Numerics:
    """named: strongest first. candidates: what else may be there. explanations: every set that was weighed,
    the likeliest first.

    By name: keys of every effect that was looked at; intervals at 95 %; probability, gain;
    detectable_n, N rms from which these presses show it at all; values, of its parameters, where it is named;
    force, the (n, 3) N that it adds: of those named to the law with the others, of the others to the law
    alone, of a fit that has not seen the place ("all": of those named together). law: (n, 3) N, our law at
    the stated parameters; with_numerics: with what was named; local frames. strain: finite strain, where the
    simulator has it. remainder: something is left that nothing here explains. reasons: in words."""

    named: tuple[str, ...]
    candidates: tuple[str, ...]
    explanations: tuple[Explanation, ...]
    keys: dict[str, dict[str, Any]]
    intervals: dict[str, dict[str, Any]]
    probability: dict[str, float]
    force: dict[str, np.ndarray]
    law: np.ndarray
    with_numerics: np.ndarray
    strain: tuple[Effect, ...]
    remainder: bool
    reasons: tuple[str, ...]
    gain: dict[str, float] = field(default_factory=dict)
    detectable_n: dict[str, float] = field(default_factory=dict)
    values: dict[str, np.ndarray] = field(default_factory=dict)
    found: Attribution | None = None


def numerics_of(
    forward: StatedForward,
    rules: AttributionOptions,
    progress: Progress = silent,
    *,
    beside_own: bool = False,
) -> Numerics:
    """Search the numerical effects in the forces of forward.touches, which are a simulator's. beside_own:
    what it has of its own is taken off, and with it what is built in."""
    t = forward.touches
    typical = t.force_rms_n
    own = Noise(*(2 * [LEAST_SHARE * typical / np.sqrt(3)]))
    # nothing smaller than LEAST_SHARE of the force is named: the rule counts in units of the noise
    forward.touches = dataclasses.replace(t, noise=own)
    rules = dataclasses.replace(rules, smallest=1.0)
    strain = next(e for e in effects() if e.role is Role.KNOWN)
    search = Search(
        forward, forward.stated.young_modulus_pa, nuisance=NUISANCE, options=rules,
        site_sd=np.full(len(t), NUISANCE.site_stiffness), finite_strain=strain,
    )  # fmt: skip
    tried = [e for e in numericals() if e.see is None and not (beside_own and e.built_in)]
    found = attribute(search, tried, progress=progress)
    ratio_only = _within_common_error(found)
    names = tuple(n for n in found.chosen if n not in ratio_only)
    plain = _squares(search, found.base.found)

    def after(kept: tuple[str, ...]) -> np.ndarray:
        return _squares(search, _with(search, found, kept).found)

    counts = search.whitener.counts()
    kept = never_worse(names, plain, after, counts, search.whitener.explained)
    best = _with(search, found, kept.names)
    law, together, added = _held_out(search, best.found, kept.names)
    force = {"all": together - law, **added}
    keys, intervals, probability, gain = {}, {}, {}, {}
    rng = np.random.default_rng(0)
    for name, score in found.scores.items():
        fitted = best.found if name in kept.names else score.candidate.found
        if name not in kept.names:
            force[name] = _predicted(forward, fitted, [name]) - _predicted(forward, fitted)
        keys[name] = score.effect.report(fitted.of(name), forward, fitted.modulus)
        intervals[name] = parameter_intervals(fitted, name, forward, search.dof, rng)
        probability[name] = (
            score.probability if name not in kept.names else max(score.probability, rules.sure)
        )
        gain[name] = score.gain
    left = float(best.chi)
    missed = rms_n(best.residual[t.counted])
    remainder = left > rules.unknown_chi and missed > LEAST_SHARE * typical
    reasons = [
        f"{n.replace('_', ' ')}: within the {100 * COMMON_ERROR:.0f} % that our own law may be off "
        "everywhere, so it is not named" for n in ratio_only
    ]  # fmt: skip
    if remainder:
        reasons.append(
            f"the simulator's force is {1e3 * missed:.0f} mN from our law even with the named effects: "
            "something else is in its numerics, or it was given other parameters than those stated"
        )
    limits = {n: max(x, LEAST_SHARE * typical) for n, x in _limits(search, found, tried).items()}
    forward.touches = t
    explanations = without(found.explanations, {*found.chosen} - {*kept.names})
    likely = names_of(likeliest(explanations, 1 - rules.doubt))
    candidates = tuple(n for n in likely if n not in kept.names)
    return Numerics(
        kept.names, candidates, explanations, keys, intervals, probability, force, law, together,
        tuple(e for e in best.found.effects if e.role is Role.KNOWN), remainder, tuple(reasons), gain, limits,
        {name: best.found.of(name) for name in kept.names}, found,
    )  # fmt: skip


def _limits(search: Search, found: Attribution, tried: Sequence[Effect]) -> dict[str, float]:
    """{name: N rms over contact samples} of the smallest change by an effect that shows beside what our own
    law may miss, of the form of its starts that shows best."""
    forward, base = search.forward, found.base.found
    before = np.nan_to_num(forward.predict(settings_of(forward, base.effects, base.values, base.onset)))
    limits = {}
    for effect in tried:
        shown = []
        for start in effect.starts():
            moved = np.where(start == effect.ideal, start + [10 * p.step for p in effect.parameters], start)
            settings = settings_of(forward, base.effects, base.values, base.onset)
            effect.act(settings, moved, forward)
            change = np.nan_to_num(forward.predict(settings)) - before
            size = rms_n(change[forward.touches.counted])
            seen = np.sqrt(search.whitener.gram(change[:, :, None]).sum())
            shown.append(float(size * SEEN / max(seen, 1e-12)))
        limits[effect.name] = min(shown)
    return limits


def _within_common_error(found: Attribution) -> tuple[str, ...]:
    """A mesh's stiffness that is named for what our own law may be off everywhere alike."""
    name = "mesh_stiffness"
    if name not in found.chosen:
        return ()
    level = found.final.found.of(name)
    return (name,) if abs(level[0]) < np.log1p(COMMON_ERROR) and abs(level[1]) < COMMON_ERROR else ()


def _with(search: Search, found: Attribution, names: tuple[str, ...]) -> Any:
    if set(names) == set(found.chosen):
        return found.final
    base = found.base.found.effects
    keep = [e for e in found.final.found.effects if e.name in names]
    return search.judge([*base, *(e for e in keep if e not in base)], like=found.final)


def _squares(search: Search, found: Fit) -> np.ndarray:
    """(g,) N^2 of the places, each of a fit that has not seen it."""
    t = search.forward.touches
    out = np.zeros(search.whitener.groups)
    for fold in neighbours(t):
        again = search.without(found, fold)
        out[fold] = search.whitener.raw_gram(again.residual[:, :, None])[fold, 0, 0]
    return out


def _held_out(
    search: Search, found: Fit, names: tuple[str, ...]
) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """((n, 3) N our law alone, (n, 3) N with the effects of a fit, by name (n, 3) N what each adds to the
    others): at each place of a fit that has not seen it."""
    forward = search.forward
    t = forward.touches
    law, together = np.zeros_like(t.local_force), np.zeros_like(t.local_force)
    added = {name: np.zeros_like(law) for name in names}
    for fold in neighbours(t):
        again = search.without(found, fold)
        rows = np.isin(t.site, fold)[t.press]
        whole = _predicted(forward, again, names)
        together[rows] = whole[rows]
        law[rows] = _predicted(forward, again)[rows]
        for name in names:
            without = _predicted(forward, again, tuple(n for n in names if n != name))
            added[name][rows] = (whole - without)[rows]
    return law, together, added


def _predicted(forward: Forward, found: Fit, names: Sequence[str] = ()) -> np.ndarray:
    """(n, 3) N of our law with these of a fit's effects; its first touches go with them, not with the law."""
    effects = tuple(e for e in found.effects if e.role is Role.KNOWN or e.name in names)
    values = np.concatenate([found.values[:1], *(found.of(e.name) for e in effects)])
    onset = found.likeliest if names else None
    return np.nan_to_num(forward.predict(settings_of(forward, effects, values, onset)))


def seen_in_samples(signal: Signal) -> tuple[Signal, dict[str, tuple[NumericalEffect, dict[str, float]]]]:
    """(the signal without them, {name: (effect, keys)}) of what the samples themselves show."""
    found = {}
    for each in numericals():
        if each.see is not None:
            seen = each.see(signal)
            if seen.keys:
                found[each.name] = (each, seen.keys)
            signal = seen.signal
    return signal, found
