"""Uniaxial models of single presses: Kelvin-Voigt and Hunt-Crossley, equations (1) to (6) of the paper.

f is the force on the object along -n (N), u the depth (m), v its rate (m/s): push, depth and rate of the
table's rows where the tip is in the object (`profiles`). The paper's estimators are
linear least squares, Hunt-Crossley's on logarithms (4), which weights the noisy start of a press most. The
robust ones beside them keep every coefficient physical (k > 0, b >= 0, 0.5 <= r <= 3), weight samples equally
in newtons and bound the pull of a bad sample.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate.mechanics.presses.table import FITS, Presses
from palpate.reconstruction.steps.s1_filter.noise import FilterOptions, low_pass

EXPONENTS = (0.5, 3.0)
_SAMPLES = 200
_HUBER = 2.0


@dataclass(frozen=True)
class OneD:
    """Fitted parameters of one press (N/m, N s/m, N/m^r, N s/m^(r+1), 1) and how well they fit.

    valid: whether |v| < 0.1 k_hc / b_hc held throughout (the condition of (4)); slow: the share of samples
    where it did. rms_kv_n, rms_hc_n: misfit in N.
    """

    k_kv: float
    b_kv: float
    k_hc: float
    b_hc: float
    r_hc: float
    k_v: float
    k_c: float
    r_c: float
    k_h: float
    valid: bool
    slow: float
    rms_kv_n: float
    rms_hc_n: float


class _Profile(NamedTuple):
    """Samples of one press in the object: u (n,) m, v (n,) m/s, f (n,) N."""

    u: np.ndarray
    v: np.ndarray
    f: np.ndarray


def _profiles(presses: Presses, least_force_n: float) -> list[_Profile]:
    """Samples where the tip is in the object and pushed out with more than `least_force_n`."""
    inside = (presses.depth > 0) & (presses.push > least_force_n)
    columns = (presses.depth, presses.rate, presses.push)
    rows = [presses.rows([i]) for i in range(len(presses))]
    return [_Profile(*(c[r[inside[r]]] for c in columns)) for r in rows]


_Fitted = tuple[tuple[float, float], tuple[float, float, float], float, tuple[float, float]]


def fit_paper(presses: Presses, least_force_n: float = 0.0) -> list[OneD]:
    """Equations (3), (4), (5), (6) as the paper fits them; k_h is (6) again at the mean exponent of all
    presses."""
    seen = _profiles(presses, least_force_n)
    fits: list[_Fitted | None] = []
    for p in seen:
        if len(p.u) < 4:
            fits.append(None)
            continue
        k_kv, b_kv = np.linalg.lstsq(np.column_stack([p.u, p.v]), p.f, rcond=None)[0]
        log_u, log_f = np.log(p.u), np.log(np.maximum(p.f, 1e-6))
        ones = np.ones_like(log_u)
        c = np.linalg.lstsq(np.column_stack([ones, p.v, log_u]), log_f, rcond=None)[0]
        d = np.linalg.lstsq(np.column_stack([ones, log_u]), log_f, rcond=None)[0]
        k_hc = float(np.exp(c[0]))
        fits.append(
            ((k_kv, b_kv), (k_hc, k_hc * c[1], c[2]), float(p.u @ p.f / (p.u @ p.u)), (np.exp(d[0]), d[1]))
        )
    exponents = [f[3][1] for f in fits if f]
    mean_r = float(np.mean(exponents)) if exponents else 1.0
    result = []
    for p, f in zip(seen, fits, strict=True):
        if f is None:
            result.append(_nothing())
            continue
        kv, hc, k_v, c = f
        k_h = float(np.exp(np.mean(np.log(np.maximum(p.f, 1e-6)) - mean_r * np.log(p.u))))
        result.append(_assembled(p, kv, hc, k_v, c, k_h))
    return result


def fit_robust(presses: Presses, least_force_n: float = 0.0) -> list[OneD]:
    """The same models with bounded, robust estimators, all presses at once.

    For every exponent on a grid k and b follow in closed form (weighted least squares, b >= 0); the grid is
    refined four times. Weights are Huber's at 2 robust standard deviations of each press's residual.
    """
    seen = _profiles(presses, least_force_n)
    if not seen:
        return []
    u, v, f, used = _padded(seen)
    still = np.zeros_like(v)
    k_kv, b_kv = _linear(np.where(used, u, 0.0), v, f, used)
    k_v, _ = _linear(np.where(used, u, 0.0), still, f, used)
    k_hc, b_hc, r_hc = _exponent(u, v, f, used)
    k_c, _, r_c = _exponent(u, still, f, used)
    mean_r = float(np.mean(r_c[used.sum(axis=1) >= 4])) if (used.sum(axis=1) >= 4).any() else 1.0
    k_h, _ = _linear(np.where(used, u**mean_r, 0.0), still, f, used)
    return [
        _assembled(p, (k_kv[i], b_kv[i]), (k_hc[i], b_hc[i], r_hc[i]), k_v[i], (k_c[i], r_c[i]), k_h[i])
        if used[i].sum() >= 4
        else _nothing()
        for i, p in enumerate(seen)
    ]


def _padded(presses: Sequence[_Profile]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    shape = (len(presses), _SAMPLES)
    u, v, f, used = np.ones(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape, dtype=bool)
    for i, p in enumerate(presses):
        n = min(len(p.u), _SAMPLES)
        chosen = np.linspace(0, len(p.u) - 1, n).astype(int) if n else np.zeros(0, dtype=int)
        u[i, :n], v[i, :n], f[i, :n], used[i, :n] = p.u[chosen], p.v[chosen], p.f[chosen], True
    return u, v, f, used


def _linear(
    basis: np.ndarray, damped: np.ndarray, f: np.ndarray, used: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """k and b >= 0, (p,), of f = k basis + b damped; (p, n) samples; Huber weights, four rounds."""
    weight = used.astype(float)
    for _ in range(4):
        a11, a12 = (weight * basis * basis).sum(1), (weight * basis * damped).sum(1)
        a22 = (weight * damped * damped).sum(1)
        k, b = _solved(a11, a12, a22, (weight * basis * f).sum(1), (weight * damped * f).sum(1))
        size = np.where(used, np.abs(basis * k[:, None] + damped * b[:, None] - f), np.nan)
        empty = ~used.any(axis=1)
        size[empty] = 0.0
        limit = _HUBER * 1.4826 * np.maximum(np.nanmedian(size, axis=1), 1e-9)[:, None]
        weight = np.where(used, np.minimum(1.0, limit / np.maximum(size, 1e-12)), 0.0)
    return k, b


def _solved(
    a11: np.ndarray, a12: np.ndarray, a22: np.ndarray, y1: np.ndarray, y2: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """k > 0 and b >= 0 of the normal equations, element by element."""
    det = a11 * a22 - a12**2
    both = det > 1e-12 * a11 * np.maximum(a22, 1e-300)
    b = np.maximum(np.where(both, (a11 * y2 - a12 * y1) / np.where(both, det, 1.0), 0.0), 0.0)
    return np.maximum((y1 - a12 * b) / np.maximum(a11, 1e-300), 1e-9), b


def _exponent(
    u: np.ndarray, v: np.ndarray, f: np.ndarray, used: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """k, b and r, (p,): r of the least squared cost on a grid refined four times, then k and b with Huber
    weights."""
    presses = len(u)
    low, high = np.full(presses, EXPONENTS[0]), np.full(presses, EXPONENTS[1])
    log_u = np.where(used, np.log(u), 0.0)
    for _ in range(5):
        grid = np.linspace(low, high, 9, axis=1)
        basis = np.exp(grid[:, :, None] * log_u[:, None, :]) * used[:, None, :]
        damped = basis * v[:, None, :]
        a11, a12, a22 = (basis**2).sum(2), (basis * damped).sum(2), (damped**2).sum(2)
        y1, y2 = (basis * f[:, None]).sum(2), (damped * f[:, None]).sum(2)
        k, b = _solved(a11, a12, a22, y1, y2)
        cost = k**2 * a11 + 2 * k * b * a12 + b**2 * a22 - 2 * (k * y1 + b * y2)
        r = grid[np.arange(presses), np.argmin(cost, axis=1)]
        step = (high - low) / 8
        low, high = np.maximum(r - step, EXPONENTS[0]), np.minimum(r + step, EXPONENTS[1])
    basis = np.where(used, np.exp(r[:, None] * log_u), 0.0)
    k, b = _linear(basis, basis * v, f, used)
    return k, b, r


def predicted(p: _Profile, k: float, b: float, r: float) -> np.ndarray:
    """f = u^r (k + b v), equation (2)."""
    return p.u**r * (k + b * p.v)


def _assembled(
    p: _Profile, kv: Sequence[float], hc: Sequence[float], k_v: float, c: Sequence[float], k_h: float
) -> OneD:
    k, b, r = (float(x) for x in hc)
    limit = 0.1 * abs(k / b) if b else np.inf
    slow = float(np.mean(np.abs(p.v) < limit))
    rms_kv = float(np.sqrt(np.mean((kv[0] * p.u + kv[1] * p.v - p.f) ** 2)))
    rms_hc = float(np.sqrt(np.mean((predicted(p, k, b, r) - p.f) ** 2)))
    return OneD(
        float(kv[0]), float(kv[1]), k, b, r, float(k_v), float(c[0]), float(c[1]), float(k_h),
        slow == 1.0, slow, rms_kv, rms_hc,
    )  # fmt: skip


def _nothing() -> OneD:
    nan = float("nan")
    return OneD(nan, nan, nan, nan, nan, nan, nan, nan, nan, False, 0.0, nan, nan)


def columns(fits: Sequence[OneD], press_modulus_pa: np.ndarray) -> dict[str, np.ndarray]:
    """The table's fitted columns, (p,) each."""
    own = {n: np.array([getattr(f, n) for f in fits], dtype=float) for n in FITS if n != "e_pa"}
    return own | {"e_pa": np.asarray(press_modulus_pa, dtype=float)}


def low_passed(presses: Presses, cutoff_hz: float = FilterOptions.cutoff_hz) -> Presses:
    """The presses net of free air, position and force low-passed without phase shift; points without a time
    stay as they are."""
    net = presses.net
    if net.quasi_static:
        return net
    position, force = np.array(net.position), np.array(net.force)
    for part in net.parts:
        if part.stop - part.start > 3:
            position[part] = low_pass(position[part], net.sample_rate_hz, cutoff_hz)
            force[part] = low_pass(force[part], net.sample_rate_hz, cutoff_hz)
    return dataclasses.replace(net, position=position, force=force)


def profiles(presses: Presses, cutoff_hz: float = FilterOptions.cutoff_hz) -> Presses:
    """`low_passed`, from first touch to loss of touch: depth, rate and push of this view (along the table's
    normals) are u, v and f of equations (1) to (6)."""
    return low_passed(presses, cutoff_hz).window(0.0, 0.0)
