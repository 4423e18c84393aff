"""What else predicts a curve that was held out: 1D models as floor, a flexible regression as ceiling.

All are fitted to the other curves and predict the normal force along the held-out path from its first touch.
The regression has no mechanics: powers of the depth and what fading memories of many times keep of them, with
a ridge chosen on the curves that it sees. What it cannot predict either is no law's fault.

The diagnosis of a bench's curves: each held out, unseen holds, and the interval of the modulus.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.stats import t as student

from palpate.diagnosis.forward.touches import LEAST_PRESSES
from palpate.diagnosis.options import DiagnoseOptions, NuisanceOptions
from palpate.diagnosis.pipeline import diagnose
from palpate.diagnosis.search.descent import Descent
from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.search.whiten import Whitener
from palpate.diagnosis.specimen.bench import PEAK_N, Bench
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.law_errors import DepthLaw, FirstTouch, Repeats, Unnamed
from palpate.mechanics.presses.table import HOLDING, Presses
from palpate.mechanics.progress import Progress, silent

FOLDS = 8
_EXPONENTS = np.linspace(0.5, 3.0, 26)
_POWERS = (0.5, 1.0, 1.5, 2.0, 3.0)
_TIMES_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 20.0)
_RIDGES = np.geomspace(1e-8, 1e1, 10)


def held_out_rivals(presses: Presses) -> dict[str, np.ndarray]:
    """(n,) N for every row: the held-out normal force by each rival. presses: thinned, net of free air; every
    press is a unit."""
    fold = np.arange(len(presses)) % min(FOLDS, len(presses))
    depth, rate = np.maximum(presses.depth, 0.0), presses.speed
    push, press = presses.push, presses.press
    memory = _features(presses)
    out = {name: np.zeros(len(push)) for name in ("kelvin-voigt", "hunt-crossley", "regression")}
    for k in np.unique(fold):
        held = fold[press] == k
        seen = ~held & presses.counted
        out["kelvin-voigt"][held] = _power(depth, rate, push, seen, held, (1.0,))
        out["hunt-crossley"][held] = _power(depth, rate, push, seen, held, tuple(_EXPONENTS))
        out["regression"][held] = _regressed(memory, push, press, seen, held)
    return out


def _power(
    depth: np.ndarray,
    rate: np.ndarray,
    push: np.ndarray,
    seen: np.ndarray,
    held: np.ndarray,
    exponents: tuple[float, ...],
) -> np.ndarray:
    """Force of u^r (k + b v) at the held rows (Kelvin-Voigt: k u + b v), least squares over the seen ones."""
    best, found = np.inf, np.zeros(int(held.sum()))
    for r in exponents:
        damped = rate * (depth > 0) if exponents == (1.0,) else depth**r * rate
        basis = np.column_stack([depth**r, damped])
        k = np.linalg.lstsq(basis[seen], push[seen], rcond=None)[0]
        cost = float(((basis[seen] @ k - push[seen]) ** 2).sum())
        if cost < best:
            best, found = cost, np.maximum(basis[held] @ k, 0.0)
    return found


def _features(presses: Presses) -> np.ndarray:
    """(n, m) powers of the depth, what exponential memories keep of their rates, and the rate."""
    columns = []
    for power in _POWERS:
        u = np.maximum(presses.depth / max(float(presses.depth_m.max()), 1e-12), 0.0) ** power
        columns.append(u)
        if power in (1.0, 1.5, 2.0):
            columns += [_faded(presses, u, tau) for tau in _TIMES_S]
    columns.append(presses.speed / max(float(np.abs(presses.speed).max()), 1e-12))
    return np.column_stack(columns)


def _faded(presses: Presses, u: np.ndarray, tau: float) -> np.ndarray:
    """What a memory of time tau keeps of the changes of u, press by press."""
    out = np.zeros_like(u)
    for part in presses.parts:
        t, x, held = presses.t[part], u[part], 0.0
        for i in range(1, len(t)):
            held = held * np.exp(-(t[i] - t[i - 1]) / tau) + x[i] - x[i - 1]
            out[part.start + i] = held
    return out


def _regressed(
    features: np.ndarray, push: np.ndarray, press: np.ndarray, seen: np.ndarray, held: np.ndarray
) -> np.ndarray:
    """Ridge regression, its penalty chosen on every other press that is seen."""
    rows = np.flatnonzero(seen)
    scale = np.maximum(features[rows].std(axis=0), 1e-12)
    x = features / scale
    own = np.unique(press[rows])
    inner = np.isin(press, own[::2]) & seen
    check = seen & ~inner
    errors = [
        float(((x[check] @ _ridge(x[inner], push[inner], a) - push[check]) ** 2).sum()) for a in _RIDGES
    ]
    return x[held] @ _ridge(x[rows], push[rows], float(_RIDGES[int(np.argmin(errors))]))


def _ridge(x: np.ndarray, y: np.ndarray, penalty: float) -> np.ndarray:
    matrix = x.T @ x / len(x) + penalty * np.eye(x.shape[1])
    return np.linalg.solve(matrix, x.T @ y / len(x))


_FOLDS, _ITERATIONS, _LEAST_HOLD = 6, 6, 8


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
    )


def _nuisance(bench: Bench) -> NuisanceOptions:
    """Pieces differ in more than their stiffness, and a machine's zero is worth what its load is: the
    floor is a share of the greatest. Each curve has a first touch of its own; nothing is held sideways."""
    of_peak = Unnamed.peak_pieces if bench.specimens else Unnamed.peak_one_piece
    plain = NuisanceOptions(
        floor_n=of_peak.value * PEAK_N, floor_share=Unnamed.share_curves.value, latency_s=0.0
    )
    if not bench.specimens:
        return plain.each_by_itself()
    of_pieces = dataclasses.replace(
        plain,
        press_stiffness=Repeats.pieces.value,
        law=DepthLaw.pieces.value,
        onset_m=FirstTouch.pieces.value,
    )
    return of_pieces.each_by_itself()


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
