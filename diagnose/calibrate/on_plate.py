"""An instrument calibrated by presses on a rigid plate, where only the tool gives: force over travel is its
stiffness, a loop of constant width its play, one that grows with the rate a delay."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.mechanics.errors import ContactError
from palpate.mechanics.recording.calibration import Calibration
from palpate.mechanics.recording.segments import delayed
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s1_filter.noise import low_pass

_DELAYS_S = np.arange(-0.04, 0.0401, 0.001)
_BRISK, _TAKES_UP, _PRESSED = 0.2, 0.3, 0.1
_CORRELATED = 10.0
_LEAST_SAMPLES = 20
_UNLIKE = 0.1
"""Share by which the presses' own compliances may differ on a rigid plate."""
_PLAIN_Z = 4.0
_LAW_SD = (1e-3, 5e-6, 2e-4)
"""What filter and sampling leave besides noise: share of the tool's give, m of half the play, s of the delay
(twenty drawn plates; `palpate bench calibrate`)."""


def calibrate_on_plate(measured: Measured) -> Calibration:
    """measured: its contacts with a rigid plate. Raises ContactError where no press goes in and out."""
    recording, presses = measured.recording, measured.presses
    normal = presses.contact_normal.mean(axis=0)
    normal /= np.linalg.norm(normal)
    plate = _plate_normal(presses.centre, normal)
    net = (presses.force - presses.free_air).copy()
    rate = presses.sample_rate_hz
    u, push, way, press = [], [], [], []
    shifted = {tau: delayed(presses.parts, presses.t, net, -tau) for tau in _DELAYS_S}
    for i, part in enumerate(presses.parts):
        inside = (presses.t[part] >= presses.onset_s[i]) & (presses.t[part] <= presses.end_s[i])
        if inside.sum() < _LEAST_SAMPLES:
            continue
        deep = -low_pass(presses.position[part], rate, 25.0) @ plate
        moving = np.gradient(deep, 1 / rate)
        brisk = np.abs(moving) > _BRISK * np.abs(moving[inside]).max()
        turned = inside & (np.arange(len(deep)) > np.argmax(np.where(inside, deep, -np.inf)))
        # right after it turned round the tool takes up its play, and the force stands still
        taking_up = turned & (deep.max() - deep < _TAKES_UP * np.ptp(deep[inside]))
        pressed = net[part] @ plate > _PRESSED * (net[part] @ plate).max()
        rows = np.flatnonzero(inside & brisk & pressed & ~taking_up) + part.start
        u.append(deep[rows - part.start])
        way.append(np.sign(moving[rows - part.start]))
        push.append(rows)
        press.append(np.full(len(rows), i))
    if len(u) < 3:
        raise ContactError(f"{len(u)} presses go in and out of the plate's contact; at least 3 are needed")
    rows, each = np.concatenate(push), np.concatenate(press)
    travel, sense = np.concatenate(u), np.concatenate(way)
    offset = (each[:, None] == np.unique(each)).astype(float)

    def fitted(tau: float) -> tuple[float, np.ndarray, np.ndarray]:
        columns = np.column_stack([shifted[tau][rows] @ plate, sense, offset])
        found, *_ = np.linalg.lstsq(columns, travel, rcond=None)
        left = travel - columns @ found
        spread = np.linalg.pinv(columns.T @ columns) * (left @ left) / max(len(left) - columns.shape[1], 1)
        return float(left @ left), found, np.sqrt(np.maximum(np.diag(spread)[:2] * _CORRELATED, 0.0))

    costs = np.array([fitted(tau)[0] for tau in _DELAYS_S])
    best = int(np.argmin(costs))
    delay, delay_sd = _refined(costs, best, len(travel))
    _, found, sd = fitted(_DELAYS_S[best])
    give, half = float(found[0]), float(found[1])
    sd = np.hypot(sd, [_LAW_SD[0] * abs(give), _LAW_SD[1]])
    delay_sd = float(np.hypot(delay_sd, _LAW_SD[2]))
    stiff = give > _PLAIN_Z * sd[0]
    unlike = _unlike(shifted[_DELAYS_S[best]][rows] @ plate, travel, sense, each)
    if stiff and unlike > _UNLIKE:
        raise ContactError(
            f"the compliance differs from press to press by {100 * unlike:.0f} % of {1e3 * give:.3g} "
            "mm/N, and a tool on a rigid plate has the same compliance at every place (to "
            f"{100 * _UNLIKE:.0f} %): this is no rigid plate, or it moves; press a clamped plate of metal or "
            "glass, or give --modulus of a known object"
        )
    interval: dict[str, Any] = {"delay_s": [delay - 1.96 * delay_sd, delay + 1.96 * delay_sd]}
    if stiff:
        interval["stiffness_n_per_m"] = [1 / (give + 1.96 * sd[0]), 1 / max(give - 1.96 * sd[0], 1e-9)]
    interval["play_m"] = [2 * (half - 1.96 * sd[1]), 2 * (half + 1.96 * sd[1])]
    read = net[rows]
    lean = read.sum(axis=0) / max(float((read @ plate).sum()), 1e-300) - plate
    free = presses.within("free", recording.t)
    bias = recording.force_on_tool[free].mean(axis=0) if free.sum() > rate else None
    absent = ["tip_radius_m", "gains", "cross-talk of sideways forces"]
    return Calibration(
        stiffness_n_per_m=1 / give if stiff else None,
        play_m=2 * half if abs(half) > _PLAIN_Z * sd[1] else None,
        bias_n=bias,
        delay_s=delay if abs(delay) > _PLAIN_Z * delay_sd else None,
        interval=interval,
        about={
            "on": "a rigid plate",
            "recording": recording.name,
            "presses": len(u),
            "normal": plate.tolist(),
            "sideways_reading_per_newton": lean.tolist(),
            "not_told": absent + ([] if stiff else ["tool's bending: too stiff to be measured"]),
        },
    )


def _unlike(push: np.ndarray, travel: np.ndarray, sense: np.ndarray, each: np.ndarray) -> float:
    """Standard deviation of the presses' own compliances, less what their errors make, over their mean (the
    random-effects estimate of DerSimonian and Laird, 1986).

    push (n,) N, travel (n,) m, sense (n,) in or out, each (n,) the press of every sample.
    """
    found = []
    for k in np.unique(each):
        own = each == k
        if own.sum() < _LEAST_SAMPLES:
            continue
        columns = np.column_stack([push[own], sense[own], np.ones(own.sum())])
        slope, *_ = np.linalg.lstsq(columns, travel[own], rcond=None)
        left = travel[own] - columns @ slope
        spread = np.linalg.pinv(columns.T @ columns)[0, 0] * (left @ left) / (own.sum() - 3)
        found.append((float(slope[0]), float(spread) * _CORRELATED))
    if len(found) < 3:
        return 0.0
    gives, variances = np.array(found).T
    weights = 1 / np.maximum(variances, 1e-300)
    mean = float(gives @ weights / weights.sum())
    excess = float(weights @ (gives - mean) ** 2) - (len(gives) - 1)
    between = max(excess, 0.0) / max(weights.sum() - (weights**2).sum() / weights.sum(), 1e-300)
    return float(np.sqrt(between) / max(abs(mean), 1e-300))


def _plate_normal(centre: np.ndarray, usual: np.ndarray) -> np.ndarray:
    """The normal of the plane through the touches, which no sensor bends; the forces' where they lie on a
    line."""
    offset = centre - centre.mean(axis=0)
    _, size, axes = np.linalg.svd(offset, full_matrices=False)
    if len(centre) < 4 or size[1] < 5 * size[2] or size[1] < 5e-3:
        return usual
    return axes[2] * np.sign(axes[2] @ usual)


def _refined(costs: np.ndarray, best: int, count: int) -> tuple[float, float]:
    """The least of a parabola through three delays, s, and its standard error."""
    step = float(_DELAYS_S[1] - _DELAYS_S[0])
    if not 0 < best < len(costs) - 1:
        return float(_DELAYS_S[best]), step
    left, here, right = costs[best - 1 : best + 2]
    bend = left - 2 * here + right
    delay = float(_DELAYS_S[best]) + 0.5 * step * (left - right) / max(bend, 1e-300)
    variance = _CORRELATED * here / max(count, 1) * 2 * step**2 / max(bend, 1e-300)
    return delay, float(np.sqrt(variance))
