"""The diagnosis from recording and model to verdict: where, which, how far."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from diagnose.attribution import LINEAR_UNLESS, Attribution, attribute
from diagnose.confusable import alike
from diagnose.finite import predicted_size
from diagnose.fit import settings_of
from diagnose.forward import Forward, build_forward
from diagnose.freeair import FreeAir, free_air_of
from diagnose.gaps import closed_share, gap
from diagnose.inclusions import inclusion_starts
from diagnose.intervals import parameter_intervals
from diagnose.judging import EVERYWHERE, AttributionOptions, Candidate, Score, Search, sideways_off
from diagnose.library import NAMES, effect
from diagnose.next_touch import next_touch
from diagnose.result import Diagnosis, EffectEntry
from diagnose.settled import Settled, settle
from diagnose.shape import heterogeneity, repeat_scatter, site_factors, site_stiffness_sd
from diagnose.touches import touches_of
from diagnose.validation import held_out_by_refit
from diagnose.where import locate
from diagnose.whiten import NuisanceOptions
from mechanics.model import Model
from mechanics.options import option
from mechanics.progress import Progress, silent
from mechanics.recording import Recording

FAST_LEAVES_OUT = (
    "poisson_ratio",
    "unbonded_base",
    "compliant_base",
    "skin_layer",
    "modulus_gradient",
)


FINITE_STRAIN_LEAST = 0.7
"""Finite strain is named where it must be larger than this share of the noise ..."""
FINITE_STRAIN_GAIN = 20.0
"""... and the neo-Hookean law fits better than the linear one by this log likelihood."""
FINITE_STRAIN_BEYOND_SCALE = 0.65
"""Share of its size that another modulus cannot take up; by it the asserted effects are put in order."""


@dataclass(frozen=True)
class DiagnoseOptions:
    """What a diagnosis may be told."""

    fast: bool = option(
        False, "half a minute instead of three: fewer effects, one in an answer, less sampling"
    )
    without: str = option("", "effects to leave out of the library, comma separated (for tests of 'unknown')")
    bootstrap: int = option(400, "resamplings of sites for intervals")
    shape_gain: float = option(
        12.0, "gain in log likelihood from which sites differ by more than their shape may"
    )
    seed: int = option(0, "seed of flips and resamplings")


def diagnose(
    recording: Recording,
    model: Model,
    options: DiagnoseOptions | None = None,
    progress: Progress = silent,
    *,
    nuisance: NuisanceOptions | None = None,
    attribution: AttributionOptions | None = None,
) -> Diagnosis:
    """Diagnose the gap between a recording and its model. Raises DiagnosisError where the data cannot carry
    it."""
    options = options or DiagnoseOptions()
    nuisance = nuisance or NuisanceOptions()
    rules = attribution or AttributionOptions(most=1 if options.fast else 3)
    seconds: dict[str, float] = {}
    clock = time.perf_counter()

    def lap(name: str) -> None:
        nonlocal clock
        now = time.perf_counter()
        seconds[name] = round(now - clock, 2)
        clock = now

    progress("touches", 0.02)
    touches = touches_of(recording, model)
    free = free_air_of(recording, model, touches.raw_noise_n)
    lap("touches")
    progress("sites", 0.05)
    forward = build_forward(touches, model)
    lap("sites")
    excluded = {n.strip() for n in options.without.split(",") if n.strip()}
    for name in excluded:
        effect(name)
    settled = settle(forward, free, excluded)
    site_sd = site_stiffness_sd(touches, model, nuisance)
    search = Search(
        forward, model.young_modulus_pa, nuisance=nuisance, options=rules, site_sd=site_sd,
        finite_strain=effect("finite_strain"),
    )  # fmt: skip
    left_out = set(FAST_LEAVES_OUT) if options.fast else set()
    skip = excluded | left_out | {"force_bias", "force_drift", "tool_gravity_inertia"} | {"surface_shape"}
    library = [effect(n) for n in NAMES if n not in skip]
    progress("baseline", 0.12)
    base = search.judge([search.finite_strain])
    if "inclusion" not in excluded:
        inclusion_starts(forward, base.found, site_sd)
    lap("baseline")
    found = attribute(search, library, progress=lambda s, x: progress(s, 0.15 + 0.7 * x))
    lap("effects")
    forward.stages["modulus"] = found.final.found.modulus
    result = _conclude(recording, forward, search, found, free, settled, site_sd, options, excluded, lap)
    progress("done", 1.0)
    return Diagnosis(**{**result, "seconds": seconds, "left_out": tuple(sorted(left_out))})


def _conclude(recording, forward, search, found, free, settled, site_sd, options, excluded, lap):  # type: ignore[no-untyped-def]
    t = forward.touches
    noise = float(np.sqrt(3) * t.raw_noise_n)
    added = 3 * (t.raw_noise_n**2 - t.noise_n**2)
    counts = search.whitener.counts()
    rng = np.random.default_rng(options.seed)
    plain_before = found.ideal.plain + settled.plain(search.whitener, found.ideal)
    after = found.final.plain
    held: dict[str, tuple[float, float]] = {}
    if not options.fast:
        old = held_out_by_refit(search, found.ideal.found, settled.residual, added)
        new = held_out_by_refit(search, found.final.found, None, added)
        plain_before, after = old.plain, new.plain
        held = {"deepest": (old.deepest_n, new.deepest_n), "fastest": (old.fastest_n, new.fastest_n)}
        lap("held out")
    gap_before = gap(plain_before, counts, added)
    deep_size = predicted_size(forward, found.base.found)
    with_fs = "finite_strain" not in excluded and deep_size > FINITE_STRAIN_LEAST * noise
    with_fs = with_fs and found.finite_strain_gain > FINITE_STRAIN_GAIN
    names = list(settled.names) + list(found.chosen)
    factor, error = site_factors(found.final.found, t)
    per_site = np.array([site_sd[t.site == s].mean() for s in range(t.sites)])
    shape_gain, spread = heterogeneity(factor, error, per_site)
    # an extra spread of stiffness between sites that no effect explains, large enough to be felt
    shape_n = spread * float(np.sqrt((t.f[t.counted] ** 2).sum(axis=1).mean()))
    uneven = shape_gain > options.shape_gain and shape_n > 0.6 * noise
    reasons = list(settled.reasons)
    candidates = list(found.rivals)
    chi = found.final.chi
    slack = max([effect(n).extra.get("slack", 1.0) for n in found.chosen], default=1.0)
    misfit = chi > slack * search.options.unknown_chi
    rest, lone = found.final.chi_but_for_one(counts)
    lone_place = misfit and rest < slack * search.options.unknown_chi
    if lone_place:
        # one touch that slipped or met something else is no law that is missing
        misfit = False
        x, y, z = 1e3 * t.site_point[lone]
        reasons.append(
            f"the touches at ({x:.0f}, {y:.0f}, {z:.0f}) mm fit nothing, the others miss by "
            f"{np.sqrt(rest):.1f} times the noise: touch there again"
        )
    remainder = misfit
    slipping = sideways_off(forward, found.final)
    if slipping and "friction_slip" not in names:
        # sticking is only trusted to a quarter, press by press, so a fit may let the sideways force go wrong
        candidates = ["friction_slip", *candidates]
        remainder = True
        reasons.append(f"the sideways force is off by {slipping:.0%} of itself: the tip may slip")
    displacing = any(n in (*EVERYWHERE, "skin_layer") for n in found.chosen)
    if displacing and not with_fs and "finite_strain" not in excluded:
        ever = "finite_strain" in (*found.final.found.names, *found.base.found.names)
        if ever and deep_size > FINITE_STRAIN_LEAST * noise:
            # deep enough for it, and it fitted no worse than the linear law until another took its place
            candidates.append("finite_strain")
    if with_fs:
        sizes = {n: max(s[n].size_n for s in found.steps if n in s) for n in found.chosen}
        beyond = FINITE_STRAIN_BEYOND_SCALE * deep_size
        place = next((i for i, n in enumerate(names) if sizes.get(n, np.inf) < beyond), len(names))
        names.insert(place, "finite_strain")
        reasons.append(
            f"the presses are deep enough that small-strain elasticity is off by about {deep_size:.3f} N"
        )
    if uneven and not any(n in ("inclusion",) for n in found.chosen):
        if "surface_shape" not in excluded and not remainder:
            names.append("surface_shape")
            candidates += [
                s.name
                for s in sorted(found.scores.values(), key=lambda s: -s.gain)
                if s.name in ("inclusion", "modulus_gradient", "unbonded_base", "compliant_base")
                and s.gain > 10
            ][:2]
        reasons.append(
            f"places differ in stiffness by {100 * spread:.0f} % more than the shape's uncertainty"
        )
    # with nothing named the gap is there all the same
    remainder = remainder or (lone_place and not names)
    kind = _kind(names, candidates, remainder or (uneven and "surface_shape" in excluded))
    entries = _entries(
        forward, search, found, names, settled, counts, plain_before, noise, added, deep_size, options, rng
    )
    gap_after = gap(after, counts, added) if names else gap_before
    closed, interval = closed_share(plain_before, after, counts, noise, added, rng, options.bootstrap)
    if not names:
        closed, interval = (0.0, (0.0, 0.0)) if gap_before > noise else (None, None)
    singles = {
        n: s.candidate
        for n, s in found.scores.items()
        if s.gain > 0.1 * max((x.gain for x in found.scores.values()), default=0)
    }
    pairs = alike(search, found.base, singles)
    touch = _next(search, found, candidates)
    if not names and not remainder:
        reasons.append("what is left is no larger than noise, first touch and shape can explain")
    if misfit:
        reasons.append(
            f"the best answer still misses by {np.sqrt(chi):.1f} times the noise: something else is there"
        )
    where = locate(forward, found.ideal.residual + settled.residual, free, site_sd, seed=options.seed)
    lap("verdict")
    return {
        "noise_n": noise,
        "gap_before_n": gap_before,
        "gap_after_n": gap_after,
        "gap_closed": closed,
        "gap_closed_ci95": interval,
        "kind": kind,
        "effects": tuple(names),
        "candidates": tuple(dict.fromkeys(candidates)),
        "where": where,
        "entries": entries,
        "young_modulus_pa": found.final.found.modulus,
        "next_touch": touch,
        "held_out_n": held,
        "errors_n": _errors(forward, found, site_sd, noise),
        "reasons": tuple(reasons),
        "confusable": tuple(pairs),
        "forward": forward,
        "attribution": found,
        "free_air": free,
        "residual_before": found.ideal.residual + settled.residual,
        "residual_after": found.final.residual,
    }


def _kind(names: list[str], candidates: list[str], remainder: bool) -> str:
    if names and remainder:
        return "effect+unknown"
    if remainder:
        return "unknown"
    if not names:
        return "none"
    return "ambiguous" if candidates else "effect"


def _entries(forward, search, found, names, settled, counts, before, noise, added, deep_size, options, rng):  # type: ignore[no-untyped-def]
    gains = {n: max(s.gain, 0.0) for n, s in found.scores.items()}
    best = max(gains.values(), default=0.0)
    entries = []
    for name, score in found.scores.items():
        closed, interval = closed_share(
            before, score.candidate.plain, counts, noise, added, rng, max(100, options.bootstrap // 4)
        )
        fitted = found.final.found if name in found.chosen else score.candidate.found
        values = fitted.of(name)
        entries.append(
            EffectEntry(
                name,
                effect(name).domain,
                _probability(score, search, best, name in found.chosen),
                gap(score.candidate.plain, counts, added),
                closed,
                interval,
                effect(name).report(values, forward),
                score.gain,
                parameter_intervals(fitted, name, forward, search.dof, rng),
            )
        )
    if found.finite_strain_gain > LINEAR_UNLESS or "finite_strain" in names:
        deep = found.deep
        closed, interval = closed_share(
            before, deep.plain, counts, noise, added, rng, max(100, options.bootstrap // 4)
        )
        probability = 0.95 if "finite_strain" in names else 0.1
        entries.append(
            EffectEntry(
                "finite_strain", "object", probability, gap(deep.plain, counts, added), closed, interval, {},
                found.finite_strain_gain,
            )
        )  # fmt: skip
    entries += settled.entries(before, found.ideal, counts, noise, added, rng)
    if "surface_shape" in names:
        entries.append(
            EffectEntry(
                "surface_shape", "boundary", 0.6, gap(found.final.plain, counts, added), 0.0, None, {}
            )
        )
    place = {n: i for i, n in enumerate(names)}
    entries.sort(key=lambda e: (place.get(e.name, 99), -e.probability, -e.gain))
    return tuple(entries)


def _probability(score: Score, search: Search, best: float, chosen: bool) -> float:
    """Rough odds from the share of the best gain and from how far the threshold is passed."""
    need = search.options.spatial_gain if score.name in ("inclusion",) else search.options.gain
    over = 1 / (1 + np.exp(np.clip(-(score.gain - need) / max(0.25 * need, 1.0), -50, 50)))
    rank = np.exp(min(0.0, (score.gain - best) / max(0.1 * best, 20.0)))
    value = float(over * rank)
    return float(np.clip(max(value, 0.9) if chosen else min(value, 0.25), 0.0, 0.99))


def _errors(forward: Forward, found: Attribution, site_sd: np.ndarray, noise: float) -> dict[str, float]:
    """Our own errors in newtons rms: sensor noise, repeatability of sites, shape, and the rest of the
    model."""
    t = forward.touches
    rms = float(np.sqrt((t.f[t.counted] ** 2).sum(axis=1).mean()))
    residual = found.final.residual
    return {
        "sensor": noise,
        "repeatability": repeat_scatter(residual, t),
        "shape": float(np.sqrt(np.mean(site_sd**2)) * rms),
        "model": float(np.sqrt(max((residual[t.counted] ** 2).sum(axis=1).mean() - 3 * t.noise_n**2, 0))),
    }


def _next(search: Search, found: Attribution, candidates: list[str]):  # type: ignore[no-untyped-def]
    """The press that parts the two explanations that stand closest."""
    for scores, name in zip(found.steps, found.picked, strict=False):
        rival = next((c for c in candidates if c in scores and c != name), None)
        if rival is not None:
            return _parting(search, scores, name, rival)
    ranked = sorted(found.scores.values(), key=lambda s: -s.gain)
    if len(ranked) < 2:
        return None
    first = found.picked[0] if found.picked else ranked[0].name
    second = next(s.name for s in ranked if s.name != first)
    return _parting(search, found.scores, first, second)


def _parting(search: Search, scores: dict[str, Score], first: str, second: str):  # type: ignore[no-untyped-def]
    pair = ((first, scores[first].candidate), (second, scores[second].candidate))
    return next_touch(search.forward, *pair, search.nuisance)


__all__ = ["Candidate", "DiagnoseOptions", "Diagnosis", "FreeAir", "Settled", "diagnose", "settings_of"]
