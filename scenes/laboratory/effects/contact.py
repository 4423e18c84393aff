"""Effects of the contact and of time in the material."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.signal import fftconvolve

from palpate.scenes.laboratory.effects.base import EffectContext, Parameters, SimulatedEffect
from palpate.scenes.laboratory.hand_path import Motion
from palpate.scenes.laboratory.paths import SIDEWAYS, WAY_OUT
from palpate.scenes.laboratory.tracing import RATE_HZ


def relaxed(force: np.ndarray, g: list[float], tau_s: list[float]) -> np.ndarray:
    """Force with Maxwell branches: g (shares of the equilibrium force) that decay with tau_s.

    Quasi-linear viscoelasticity (Fung 1981) of the solved elastic force: exact while the contact grows, an
    approximation while it shrinks (Ting 1966), where the solid would leave the tip a little earlier.
    """
    out = force.copy()
    step = 1 / RATE_HZ
    change = np.diff(force, axis=0, prepend=force[:1])
    for share, tau in zip(g, tau_s, strict=True):
        decay = np.exp(-step / tau)
        gain = share * (1 - decay) * tau / step
        branch = np.zeros(3)
        for k in range(len(force)):
            branch = decay * branch + gain * change[k]
            out[k] += branch
    return out


def let_go(force: np.ndarray, elastic: np.ndarray, motion: Motion, normals: np.ndarray) -> np.ndarray:
    """No force out of contact, and no pull in it: the tip has left the slower surface."""
    pressing = np.linalg.norm(elastic, axis=1) > 0
    pull = (force * normals).sum(axis=1)
    gone = pressing & (pull < 0)
    return np.where((pressing & ~gone)[:, None], force, 0.0)


def _viscoelastic(force: np.ndarray, motion: Motion, normals: np.ndarray, p: Parameters) -> np.ndarray:
    return let_go(relaxed(force, p["g"], p["tau_s"]), force, motion, normals)


def _adhere(force: np.ndarray, motion: Motion, normals: np.ndarray, p: Parameters) -> np.ndarray:
    """A pull along -n that grows over the first millimetre of the way out and breaks beyond `range_m`."""
    out = force.copy()
    reach = 1e3 * p["range_m"]
    for number in np.unique(motion.touch[motion.touch >= 0]):
        rows = np.flatnonzero((motion.touch == number) & (motion.leg == WAY_OUT))
        deepest = motion.s[motion.touch == number].max()
        s = motion.s[rows]
        grip = np.clip((deepest - s) / 1.0, 0, 1) * np.clip((s + reach) / reach, 0, 1)
        out[rows] -= p["pull_off_n"] * grip[:, None] * normals[rows]
    return out


def _power_law(force: np.ndarray, motion: Motion, normals: np.ndarray, p: Parameters) -> np.ndarray:
    """A springpot beside the solid: each touch's force and its fractional derivative, exact between
    samples."""
    out, rest = force.copy(), 1 - p["exponent"]
    for number in np.unique(motion.touch[motion.touch >= 0]):
        rows = np.flatnonzero(motion.touch == number)
        lags = np.arange(len(rows) + 1) / RATE_HZ
        kernel = np.diff(lags**rest) * RATE_HZ / rest  # the mean of a power over each step
        change = np.diff(force[rows], axis=0, prepend=0.0)
        for axis in range(3):
            out[rows, axis] += p["share"] * fftconvolve(change[:, axis], kernel)[: len(rows)]
    return let_go(out, force, motion, normals)


def _branch(give: float, lift: float, pull: float) -> tuple[np.ndarray, np.ndarray]:
    """(travel, contact radius) from pull-off on, of a sphere of radius 1 on a half-space with E* 1, in series
    with a spring; lift: 2 pi times the work of adhesion at the edge, pull: the same of the contact as a
    whole."""
    a = np.geomspace(1e-4, 3.0, 20001)
    travel = a**2 - np.sqrt(lift * a) + give * (4 / 3 * a**3 - 2 * a * np.sqrt(lift * a) - pull)
    first = int(np.argmin(travel))
    return travel[first:], a[first:]


def _at_the_edge(work: float, reach: float) -> float:
    """Share of the work, in E* R, that acts at the contact's edge where the attraction reaches so far, in R:
    1 is Johnson, Kendall & Roberts, 0 Derjaguin, Muller & Toporov (Carpick, Ogletree & Salmeron 1999)."""
    maugis = 1.157 * (work**2 / reach**3) ** (1 / 3)
    return 4.04 * maugis**1.4 / (1 + 4.04 * maugis**1.4)


def _sticky(force: np.ndarray, motion: Motion, normals: np.ndarray, p: Parameters) -> np.ndarray:
    """The contact holds until it is unstable, and begins with another work.

    Dents are Hertz's, in series with what the object gives as a whole, told by the deepest state. A contact
    whose edge is pinned, at the turn, is a flat punch. What does not act at the edge pulls on the contact as
    a whole, and beyond it over its range.
    """
    out, radius = force.copy(), p["tip_radius_m"]
    unit = p["plane_strain_modulus_pa"] * radius**2
    work, reach = p["work_j_per_m2"] * radius / unit, p["range_m"] / radius
    edge = _at_the_edge(work, reach)
    lift, whole = 2 * np.pi * work * edge, 2 * np.pi * work * (1 - edge)
    for number in np.unique(motion.touch[motion.touch >= 0]):
        rows = np.flatnonzero(motion.touch == number)
        aside = motion.leg[rows] == SIDEWAYS
        deepest = motion.s[rows[~aside]].max()
        travel = 1e-3 * np.where(aside, deepest, motion.s[rows]) / radius
        push = np.maximum((force[rows] * normals[rows]).sum(axis=1), 0.0) / unit
        inside = (travel > 0) & (push > 0)
        if not inside.any():
            continue
        give = np.zeros(len(rows))
        give[inside] = (travel[inside] - (0.75 * push[inside]) ** (2 / 3)) / push[inside]
        usual = max(float(give[np.argmax(push)]), 0.0)
        pulled = _branch(usual, lift, whole)
        begun = _branch(usual, p["healed"] * lift, p["healed"] * whole)
        elastic = 4 / 3 * np.where(travel > 0, np.interp(travel, *_without(usual)), 0.0) ** 3
        a, touched, turned = 0.0, False, 0.0
        for k, row in enumerate(rows):
            if not touched and not inside[k]:
                continue
            touched = True
            turned = float(np.clip(turned - (travel[k] - travel[max(k - 1, 0)]) / reach, 0, 1))
            pull = whole * (p["healed"] + turned * (1 - p["healed"]))
            grown, kept = (
                np.interp(travel[k], b[0], b[1]) if travel[k] >= b[0][0] else 0.0 for b in (begun, pulled)
            )
            a = max(min(a, kept), grown) if (a > 0 or travel[k] >= 0) else 0.0
            punch = 4 / 3 * a**3
            now = punch - 2 * a * (a**2 + usual * (punch - pull) - travel[k]) / (1 + 2 * a * usual) - pull
            if a == 0:
                # nothing touches: the pull falls in a straight line, and lifts the surface that it pulls on
                left = 1 - usual * pull / reach
                now = -min(pull, pull * max(1 + travel[k] / reach, 0.0) / left) if left > 0 else 0.0
            out[row] += (now - elastic[k]) * unit * normals[row]
    return out


def _without(give: float) -> tuple[np.ndarray, np.ndarray]:
    """(travel, contact radius) of the same without adhesion."""
    a = np.geomspace(1e-4, 3.0, 4001)
    return a**2 + give * 4 / 3 * a**3, a


_RANGES = (2e-4, 0.4)
"""Of the attraction, in tip radii, between which it is drawn: from the limit of Johnson, Kendall & Roberts
towards that of Derjaguin, Muller & Toporov."""


def _sticking(strength: float, bench: EffectContext) -> dict[str, Any]:
    plane_strain = bench.modulus_pa / (1 - 0.49**2)
    reach = float(np.exp(bench.rng.uniform(*np.log(_RANGES))))
    return {
        "work_j_per_m2": 0.02 * strength * plane_strain * bench.tip_radius_m,
        "healed": 0.2,
        "range_m": float(f"{reach * bench.tip_radius_m:.3g}"),
        "tip_radius_m": bench.tip_radius_m,
        "plane_strain_modulus_pa": plane_strain,
    }


_THINNED = 8


def _poroelastic(force: np.ndarray, motion: Motion, normals: np.ndarray, p: Parameters) -> np.ndarray:
    """Drainage under the tip: the fluid's share of the force relaxes by the master curve of Hu, Zhao, Vlassak
    & Suo (2010) for a sphere, in a time that goes with the square of the contact's radius.

    A law on the force, not a solved pore pressure. Every `_THINNED`-th sample is summed, what lies between is
    interpolated.
    """
    out = force.copy()
    for number in np.unique(motion.touch[motion.touch >= 0]):
        rows = np.flatnonzero(motion.touch == number)
        aside = motion.leg[rows] == SIDEWAYS
        depth = np.where(aside, motion.s[rows[~aside]].max(), motion.s[rows])
        rows, depth = rows[depth > 0], 1e-3 * depth[depth > 0]
        if len(rows) < 2:
            continue
        drained = np.cumsum(p["diffusivity_m2_per_s"] / (p["tip_radius_m"] * depth)) / RATE_HZ
        at = np.unique(np.append(np.arange(0, len(rows), _THINNED), len(rows) - 1))
        change = np.diff(force[rows[at]], axis=0, prepend=0.0)
        # a change between two samples happened half way between them
        middle = 0.5 * (drained[at] + drained[np.append(0, at[:-1])])
        since = drained[at][:, None] - middle[None, :]
        with np.errstate(invalid="ignore"):
            left = 0.491 * np.exp(-0.908 * np.sqrt(since)) + 0.509 * np.exp(-1.679 * since)
        fluid = np.where(since >= 0, left, 0.0) @ change
        for axis in range(3):
            out[rows, axis] += p["share"] * np.interp(np.arange(len(rows)), at, fluid[:, axis])
    return let_go(out, force, motion, normals)


def _seeping(strength: float, bench: EffectContext) -> dict[str, Any]:
    return {
        "share": 0.35 * strength,
        "diffusivity_m2_per_s": 3e-5,
        "tip_radius_m": bench.tip_radius_m,
    }


def _fibres(strength: float, bench: EffectContext) -> dict[str, Any]:
    angle = float(np.round(bench.rng.uniform(0, np.pi), 3))
    return {
        "fibre_over_shear": 2.0 * strength,
        "direction": [float(np.cos(angle)), float(np.sin(angle)), 0.0],
    }


EFFECTS = (
    SimulatedEffect(
        "viscoelasticity",
        "object",
        lambda strength, bench: {"g": [0.3 * strength], "tau_s": [0.3]},
        on_force=_viscoelastic,
        forgets=True,
    ),
    SimulatedEffect(
        "power_law_relaxation",
        "object",
        lambda strength, bench: {"share": 0.15 * strength, "exponent": 0.3},
        on_force=_power_law,
        forgets=True,
    ),
    SimulatedEffect("poroelasticity", "object", _seeping, on_force=_poroelastic, forgets=True),
    SimulatedEffect(
        "tip_radius",
        "contact",
        lambda strength, bench: {"tip_radius_m": bench.tip_radius_m * (1 + 0.3 * strength)},
        lambda s, p: replace(s, tip_radius=1e3 * p["tip_radius_m"]),
    ),
    SimulatedEffect(
        "friction_slip",
        "contact",
        lambda strength, bench: {"mu": 0.1 / strength},
        lambda s, p: replace(s, friction=p["mu"]),
    ),
    SimulatedEffect(
        "adhesion",
        "contact",
        lambda strength, bench: {"pull_off_n": 0.1 * strength, "range_m": 0.0006},
        on_force=_adhere,
        forgets=True,
    ),
    SimulatedEffect("jkr_adhesion", "contact", _sticking, on_force=_sticky, forgets=True),
)
"""Effects of contact and of relaxation."""

UNNAMED = (
    SimulatedEffect(
        "plasticity",
        "object",
        lambda strength, bench: {"share": 0.8 * strength, "yield_over_shear": 0.12},
        lambda s, p: replace(s, plastic=(p["share"], p["yield_over_shear"])),
        needs_finite=True,
    ),
    SimulatedEffect(
        "anisotropy",
        "object",
        _fibres,
        lambda s, p: replace(s, fibre=(p["fibre_over_shear"], *p["direction"])),
        needs_finite=True,
    ),
)
"""Effects that no library entry names: for these "unknown" is the right answer."""
