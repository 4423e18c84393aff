"""Bench instruments: one place of one specimen, or one place of many, pressed in a machine that logs travel
and load.

The curves are brought to the size of a hand's tip by similarity (lengths, forces and times), which
elasticity, memory and all effects here are indifferent to; so a cantilever of an AFM, a texture analyser and
a finger are diagnosed by one machinery on a half-space or a layer. What is found is turned back into the
machine's own units.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import trapezoid
from scipy.stats import t as student

from diagnose.forward.touches import LEAST_PRESSES
from diagnose.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from diagnose.pipeline import diagnose
from diagnose.search.descent import Descent
from diagnose.search.fit import settings_of
from diagnose.search.whiten import Whitener
from diagnose.verdict.result import Diagnosis
from mechanics.dent import dent_law
from mechanics.errors import ContactError
from mechanics.material import Material
from mechanics.model import Model, Support, Tool
from mechanics.press_cutting import FoundAround, FoundPresses, cut
from mechanics.presses import HOLDING
from mechanics.progress import Progress, silent
from mechanics.quantities import USUAL_POISSON_RATIO, USUAL_TIP_RADIUS_M, parse_unit, unit_of_key
from mechanics.recording import Recording
from mechanics.robust import spread_about_zero
from reconstruct.geometry.slab import flat_mesh, half_space_size
from reconstruct.steps.s1_filter.low_pass import white_noise_std
from reconstruct.steps.s3_contacts.contact_law import Loading, first_touches

HAND_TIP_M, PEAK_N = USUAL_TIP_RADIUS_M, 1.0
"""The size to which curves are brought: tip's radius, and the force of the middle one at its peak."""
HAND_S, RATE_HZ = 2.0, 200.0
"""The pace to which they are brought: how long the middle curve takes, and readings a second at most."""
_BETWEEN_S = 2.0
_FLOOR = {False: 0.005, True: 0.02}
"""Share of the peak by which the law may miss what no name covers: of one piece, of different ones."""
_CELLS = 20
_WAY_ROWS = 60
_MARGIN = 2.0
_BASELINE = 0.1
_LEAST_NOISE = 1e-3
_CONTACT = 8.0
"""A curve must rise above so many standard deviations of its noise."""
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Curve:
    """One cycle of a machine: t (n,) s increasing, travel (n,) m into the sample from any zero, force (n,) N
    that pushes the tip out, from any level. name: of its file. level_n: what it reads in free air; None: what
    the first rows read."""

    t: np.ndarray
    travel: np.ndarray
    force: np.ndarray
    name: str = ""
    level_n: float | None = None


@dataclass(frozen=True)
class Similarity:
    """Factors from a machine's metres, newtons and seconds to those of a hand."""

    length: float
    force: float
    time: float

    def back(self, keys: Mapping[str, Any]) -> dict[str, Any]:
        """Parameters in the machine's size: each by the powers of metres, newtons and seconds in the unit
        that its key states."""
        return {key: _times(value, 1 / self._factor(unit_of_key(key))) for key, value in keys.items()}

    def _factor(self, unit: str) -> float:
        return parse_unit(unit).factor(self.length, self.force, self.time)

    @property
    def modulus(self) -> float:
        """Factor from Pa to Pa."""
        return self._factor("Pa")


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, list | tuple):
        return [_times(v, factor) for v in value]
    return float(value) * factor if isinstance(value, int | float) and not isinstance(value, bool) else value


@dataclass(frozen=True)
class Bench:
    """Curves as a recording of one place on a model, in a hand's size.

    similarity: what brought them there. onset_m: (c,) m, travel at first touch, in the machine's own zero;
    modulus_pa: (c,) Pa, of each curve's way in by itself, by the exact sphere on a half-space. used: (c,)
    bool, curves with a contact. specimens: every curve is of another piece.
    """

    recording: Recording
    model: Model
    similarity: Similarity
    onset_m: np.ndarray
    modulus_pa: np.ndarray
    used: np.ndarray
    specimens: bool


def bench_of(
    curves: Sequence[Curve],
    tip_radius_m: float,
    *,
    layer_m: float | None = None,
    poisson_ratio: float = USUAL_POISSON_RATIO,
    specimens: bool = False,
) -> Bench:
    """layer_m: thickness of the sample on its plate, None is a half-space. specimens: each curve is of
    another piece, so each force is taken over its own stiffness. Raises ContactError where no curve has a
    contact."""
    length = HAND_TIP_M / tip_radius_m
    pace = HAND_S / float(np.median([np.ptp(c.t) for c in curves]))
    ready = [_levelled(c, pace) for c in curves]
    found = [_way_in(c) for c in ready]
    used = np.array([f is not None for f in found])
    if not used.any():
        raise ContactError(
            f"none of the {len(curves)} curves rises above its noise as the tip goes in: are travel and load "
            "the right columns, and their signs (travel into the sample, load that pushes the tip out)? say "
            "--column depth=NAME, --column load=NAME, --travel out or --compression negative"
        )
    kept = [(c, f) for c, f in zip(ready, found, strict=True) if f is not None]
    noise = float(np.median([n for _, (_, _, n) in kept]))
    loadings = [Loading(length * u, push, np.zeros(3), UP) for _, (u, push, _) in kept]
    top = float(np.median([each.push.max() for each in loadings]))
    loadings = [Loading(each.u, each.push / top, each.origin, UP) for each in loadings]
    try:
        onset, error = first_touches(loadings, noise / top)
    except ValueError as wrong:
        raise ContactError("the curves have fewer than four samples on their way in") from wrong
    law = dent_law("sphere")
    own = np.array([_modulus(each, at, law, poisson_ratio) for each, at in zip(loadings, onset, strict=True)])
    middle = float(np.median(own))
    scale = middle / own if specimens else np.ones(len(own))
    recording, times = _side_by_side([c for c, _ in kept], onset, length, scale / top, noise / top)
    deepest = max(float(each.u.max() - at) for each, at in zip(loadings, onset, strict=True))
    contact = float(np.sqrt(HAND_TIP_M * max(deepest, 0.1 * HAND_TIP_M)))
    if layer_m is None:
        size = half_space_size(contact)
    else:
        thick = length * layer_m
        if deepest >= thick:
            raise ContactError(
                f"the tip goes {deepest / length:.3g} m into a layer of {layer_m:g} m: state its thickness"
            )
        wide = 2 * _MARGIN * thick + 4 * contact
        size = np.array([wide, wide, thick])
    mesh = flat_mesh(size, 0.01, _CELLS)
    at_top = np.array([0.0, 0.0, size[2]])
    rows = [slice(a, b) for a, b in times]
    peak = [rows[i].start + int(np.argmax(recording.force_on_tool[rows[i], 2])) for i in range(len(rows))]
    first = [
        r.start + int(np.argmax(recording.position[r, 2] <= HAND_TIP_M)) for r in rows
    ]  # the first row in contact
    centre = np.tile([0.0, 0.0, size[2] + HAND_TIP_M], (len(rows), 1))
    lifted = dataclasses.replace(recording, position=recording.position + at_top)
    presses = cut(
        lifted,
        FoundPresses(lifted.t[first], lifted.t[peak], centre, np.tile(UP, (len(rows), 1)), error),
        FoundAround(others_s=[(lifted.t[a], lifted.t[b - 1]) for a, b in times], noise_n=noise / top),
    )
    model = Model(
        mesh=mesh.quadratic(), material=Material(middle, poisson_ratio), support=Support(np.zeros(3), UP),
        tool=Tool(HAND_TIP_M), mesh_size_m=0.01, presses=presses,
    )  # fmt: skip
    similarity = Similarity(length, 1 / top, pace)
    every = np.full((2, len(curves)), np.nan)
    every[:, used] = onset / length, own / similarity.modulus
    return Bench(lifted, model, similarity, every[0], every[1], used, specimens)


def _levelled(curve: Curve, pace: float) -> Curve:
    """At a hand's pace, of at most RATE_HZ by means."""
    rate = (len(curve.t) - 1) / float(curve.t[-1] - curve.t[0]) / pace
    # a long hold must not thin a quick way in
    block = max(1, min(round(rate / RATE_HZ), int(np.argmax(curve.force)) // _WAY_ROWS))
    count = len(curve.t) // block
    t, travel, force = (
        v[: count * block].reshape(count, block).mean(axis=1) for v in (curve.t, curve.travel, curve.force)
    )
    return Curve(pace * (t - t[0]), travel, force, curve.name, curve.level_n)


def _way_in(curve: Curve) -> tuple[np.ndarray, np.ndarray, float] | None:
    """(travel, force over the level before contact, noise N) from the start to the peak; None without a
    contact."""
    peak = int(np.argmax(curve.force))
    early = slice(0, max(3, int(_BASELINE * peak)))
    force = curve.force - _level(curve, peak)
    noise = white_noise_std(curve.force[:, None])
    if curve.level_n is None:
        noise = max(noise, spread_about_zero(force[early]) / np.sqrt(2))
    noise = max(noise, _LEAST_NOISE * float(force.max()))
    if peak < 4 or not force[peak] > _CONTACT * noise:
        return None
    return curve.travel[: peak + 1], force[: peak + 1], noise


def _level(curve: Curve, peak: int) -> float:
    """N, what the curve reads in free air."""
    early = curve.force[: max(3, int(_BASELINE * peak))]
    return float(np.median(early)) if curve.level_n is None else curve.level_n


def _modulus(each: Loading, onset: float, law: Any, poisson_ratio: float) -> float:
    shape = np.asarray(law.force(np.maximum(each.u - onset, 0.0), 1.0, poisson_ratio, HAND_TIP_M))
    return float(shape @ each.push / max(shape @ shape, 1e-300))


def _side_by_side(
    curves: Sequence[Curve], onset: np.ndarray, length: float, factor: np.ndarray, noise: float
) -> tuple[Recording, list[tuple[int, int]]]:
    """One recording of all curves in a hand's size, the surface at z = 0; (first, last) rows of each."""
    rate = min((len(c.t) - 1) / float(np.ptp(c.t)) for c in curves)
    times, heights, forces, spans = [], [], [], []
    clock, rows = 0.0, 0
    for curve, at, scale in zip(curves, onset, factor, strict=True):
        t = np.arange(0.0, curve.t[-1], 1 / rate)
        travel, force = (np.interp(t, curve.t, v) for v in (curve.travel, curve.force))
        peak = int(np.argmax(force))
        level = _level(Curve(t, travel, force, level_n=curve.level_n), peak)
        times.append(clock + t)
        heights.append(HAND_TIP_M + at - length * travel)
        forces.append(scale * (force - level))
        spans.append((rows, rows + len(t)))
        rows += len(t)
        clock += t[-1] + _BETWEEN_S
    height, push = np.concatenate(heights), np.concatenate(forces)
    recording = Recording(
        t=np.concatenate(times),
        position=np.column_stack([0 * height, 0 * height, height]),
        force_on_tool=np.column_stack([0 * push, 0 * push, push]),
        sample_rate_hz=rate,
        tip_radius_m=HAND_TIP_M,
        force_noise_std_n=noise,
        object_name="specimen",
    )
    return recording, spans


def diagnose_bench(
    bench: Bench, *, fast: bool = False, seed: int = 0, progress: Progress = silent
) -> Diagnosis | None:
    """The sim-to-real gap of the curves, each held out; None with fewer than 6, of which none can be."""
    if len(bench.model.presses) < LEAST_PRESSES:
        return None
    return diagnose(
        bench.recording,
        bench.model,
        DiagnoseOptions(fast=fast, seed=seed),
        progress,
        nuisance=_nuisance(bench),
        attribution=AttributionOptions(most=1 if fast else 3),
    )


def _nuisance(bench: Bench) -> NuisanceOptions:
    """Pieces differ in more than their stiffness, and a machine's zero is worth what its load is: the
    floor is a share of the greatest."""
    floor = _FLOOR[bench.specimens] * PEAK_N
    plain = NuisanceOptions(floor_n=floor, floor_share=0.0)
    if not bench.specimens:
        return plain
    return dataclasses.replace(plain, press_stiffness=0.07, law=0.1, onset_m=0.5e-3)


_FOLDS, _ITERATIONS, _LEAST_HOLD = 6, 6, 8


def unseen_holds(bench: Bench, made: Diagnosis) -> tuple[float, float] | None:
    """rms error over rms force of holds that nothing has seen, by the ideal model and by the verdict: law
    and effects from the other curves, the curve's own stiffness from its way in. None where fewer than 6
    curves hold."""
    forward, found = made.forward, made.attribution
    if forward is None or found is None:
        return None
    t = forward.touches
    hold = (t.phase == HOLDING) & (t.t > t.peak_s[t.press])
    way = t.counted & (t.t <= t.peak_s[t.press]) & (t.travel[:, 0] > 0)
    holds = np.flatnonzero(np.bincount(t.press[hold], minlength=len(t)) >= _LEAST_HOLD)
    if len(holds) < LEAST_PRESSES:
        return None
    errors = []
    named = set(made.effects)
    for candidate in (found.ideal, found.final):
        fit = candidate.found
        effects = tuple(
            e for e in fit.effects if candidate is found.ideal or e.name in named or not e.parameters
        )
        values = np.concatenate([fit.values[:1], *(fit.of(e.name) for e in effects)])
        settings = settings_of(forward, effects, values, fit.onset)
        whitener = Whitener(forward, settings, _nuisance(bench))
        missed = 0.0
        for k in range(_FOLDS):
            held = np.arange(len(t)) % _FOLDS == k
            weights = np.where([held[t.site == s].any() for s in range(t.sites)], 0.0, 1.0)
            again = Descent(forward, whitener, effects, weights).run(values, fit.onset, _ITERATIONS)
            predicted = forward.predict(settings_of(forward, effects, again.values, again.likeliest))[:, 0]
            for press in np.intersect1d(holds, np.flatnonzero(held)):
                own, rest = way & (t.press == press), hold & (t.press == press)
                f = predicted[own]
                scale = float(f @ t.local_force[own, 0] / max(float(f @ f), 1e-300))
                missed += float(((scale * predicted[rest] - t.local_force[rest, 0]) ** 2).sum())
        rows = hold & np.isin(t.press, holds)
        errors.append(float(np.sqrt(missed / (t.local_force[rows, 0] ** 2).sum())))
    return errors[0], errors[1]


APPROACH_LAWS = ("hertz", "sphere", "linear", "neo-hookean")
_BLOCKS = 8
_SHIFTS = np.linspace(-0.1, 0.1, 41)


def modulus_interval(bench: Bench, made: Diagnosis) -> tuple[float, float]:
    """Pa, 95 %, in the machine's size, of the fit whose modulus the diagnosis states: it is fitted again
    without each group of curves (delete-a-group jackknife of log E)."""
    forward, found = made.forward, made.attribution
    assert forward is not None and found is not None
    t, fit = forward.touches, found.final.found
    settings = settings_of(forward, fit.effects, fit.values, fit.onset)
    whitener = Whitener(forward, settings, _nuisance(bench))
    folds = min(_FOLDS, len(t))
    again = []
    for k in range(folds):
        kept = np.arange(len(t)) % folds != k
        weights = np.where([kept[t.site == s].any() for s in range(t.sites)], 1.0, 0.0)
        left = Descent(forward, whitener, fit.effects, weights).run(fit.values, fit.onset, _ITERATIONS)
        again.append(float(left.values[0]))
    error = np.sqrt((folds - 1) / folds * ((np.array(again) - np.mean(again)) ** 2).sum())
    half = float(np.exp(student.ppf(0.975, folds - 1) * error))
    e = fit.modulus / bench.similarity.modulus
    return e / half, e * half


@dataclass(frozen=True)
class Approach:
    """What a few curves tell, none of which can be held out: each way in, block by block of it left out in
    turn.

    error: dent law (and 'hunt-crossley', 'regression', 'constant') -> rms error over rms force, median of
    the curves. law: the best of the dents. modulus_pa: (c,) by it. hysteresis: share of the work that does
    not come back (NaN: the curves end in a hold); pull_n: (c,) N, greatest pull on the way out.
    """

    error: dict[str, float]
    law: str
    modulus_pa: np.ndarray
    hysteresis: float
    pull_n: np.ndarray


def approach_of(bench: Bench) -> Approach:
    """The ways in of a bench's curves on a half-space."""
    presses, nu = bench.model.presses, bench.model.material.poisson_ratio
    errors: dict[str, list[float]] = {}
    moduli: dict[str, list[float]] = {}
    work, pull = [], []
    for part in presses.parts:
        u, push = presses.depth[part], presses.push[part]
        top = int(np.argmax(push))
        ways = u[: top + 1], push[: top + 1]
        for name in APPROACH_LAWS:
            error, modulus = _left_out(*ways, dent_law(name), nu)
            errors.setdefault(name, []).append(error)
            moduli.setdefault(name, []).append(modulus)
        for name, order in (("hunt-crossley", 0), ("regression", 5)):
            errors.setdefault(name, []).append(_plainly_left_out(*ways, order))
        errors.setdefault("constant", []).append(_constant(ways[1]))
        back = slice(top, top + int(np.argmax(np.append(u[top:] <= 0, True))))
        given = max(trapezoid(push[: top + 1], u[: top + 1]), 1e-300)
        # a curve that ends in its hold gives nothing back to be weighed
        gone = 1 + trapezoid(push[back], u[back]) / given
        work.append(gone if u[part.stop - part.start - 1] < 0.5 * u.max() else np.nan)
        pull.append(max(0.0, -float(push[top:].min())) / bench.similarity.force)
    medians = {name: float(np.median(values)) for name, values in errors.items()}
    law = min(APPROACH_LAWS, key=lambda name: medians[name])
    own = np.array(moduli[law]) / bench.similarity.modulus
    return Approach(medians, law, own, float(np.median(work)), np.array(pull))


def _blocks(count: int) -> np.ndarray:
    return np.minimum(np.arange(count) * _BLOCKS // max(count, 1), _BLOCKS - 1)


def _left_out(u: np.ndarray, push: np.ndarray, law: Any, nu: float) -> tuple[float, float]:
    """(held-out rms over rms, modulus) of one way in; first touch and modulus are free."""
    span = float(u.max())
    shapes = np.array([law.force(np.maximum(u - s * span, 0.0), 1.0, nu, HAND_TIP_M) for s in _SHIFTS])

    def fitted(seen: np.ndarray) -> tuple[int, float]:
        power = np.maximum((shapes[:, seen] ** 2).sum(axis=1), 1e-300)
        e = shapes[:, seen] @ push[seen] / power
        k = int(np.argmin(((e[:, None] * shapes[:, seen] - push[seen]) ** 2).sum(axis=1)))
        return k, float(e[k])

    block, predicted = _blocks(len(u)), np.zeros(len(u))
    for b in range(1, _BLOCKS - 1):
        k, e = fitted(block != b)
        predicted[block == b] = e * shapes[k, block == b]
    return _relative(predicted, push, block), fitted(np.ones(len(u), dtype=bool))[1]


def _plainly_left_out(u: np.ndarray, push: np.ndarray, order: int) -> float:
    """The same of k u^r (order 0) or of a polynomial of the depth."""
    block, predicted = _blocks(len(u)), np.zeros(len(u))
    x = np.maximum(u, 0.0) / max(float(u.max()), 1e-300)
    exponents = np.linspace(0.5, 3.0, 26)
    for b in range(1, _BLOCKS - 1):
        seen = block != b
        if order:
            basis = x[:, None] ** np.arange(1, order + 1)
            predicted[~seen] = basis[~seen] @ np.linalg.lstsq(basis[seen], push[seen], rcond=None)[0]
            continue
        k = np.array(
            [(x[seen] ** r) @ push[seen] / max((x[seen] ** (2 * r)).sum(), 1e-300) for r in exponents]
        )
        cost = [float(((k[i] * x[seen] ** r - push[seen]) ** 2).sum()) for i, r in enumerate(exponents)]
        best = int(np.argmin(cost))
        predicted[~seen] = k[best] * x[~seen] ** exponents[best]
    return _relative(predicted, push, block)


def _constant(push: np.ndarray) -> float:
    """The same of the mean force: what says nothing of the depth."""
    block = _blocks(len(push))
    inner = push[(block > 0) & (block < _BLOCKS - 1)]
    return _relative(np.full(len(push), inner.mean() if len(inner) else 0.0), push, block)


def _relative(predicted: np.ndarray, push: np.ndarray, block: np.ndarray) -> float:
    """Over the blocks between the ends, where nothing has to be carried on."""
    inner = (block > 0) & (block < _BLOCKS - 1)
    missed, whole = (predicted - push)[inner], push[inner]
    return float(np.sqrt((missed**2).mean() / max((whole**2).mean(), 1e-300)))
