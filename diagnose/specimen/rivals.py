"""What else predicts a curve that was held out: 1D models as floor, a flexible regression as ceiling.

All are fitted to the other curves and predict the normal force along the held-out path from its first touch.
The regression has no mechanics: powers of the depth and what fading memories of many times keep of them, with
a ridge chosen on the curves that it sees. What it cannot predict either is no law's fault.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.presses.table import Presses

FOLDS = 8
_EXPONENTS = np.linspace(0.5, 3.0, 26)
_POWERS = (0.5, 1.0, 1.5, 2.0, 3.0)
_TIMES_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 20.0)
_RIDGES = np.geomspace(1e-8, 1e1, 10)


def held_out_rivals(presses: Presses, folds: int = FOLDS) -> dict[str, np.ndarray]:
    """(n,) N for every row: the held-out normal force by each rival. presses: thinned, net of free air; every
    press is a unit."""
    fold = np.arange(len(presses)) % min(folds, len(presses))
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
