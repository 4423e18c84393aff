"""Effects of the contact and of time in the material."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from scenes.laboratory.effects.base import Bench, Effect, Parameters
from scenes.laboratory.motion import Motion
from scenes.laboratory.paths import WAY_OUT
from scenes.laboratory.tracing import RATE_HZ


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


def _poroelastic(force: np.ndarray, motion: Motion, normals: np.ndarray, p: Parameters) -> np.ndarray:
    """Drainage under the tip: the force relaxes at a rate that falls with the square of the contact's radius.

    A law on the force with the time constants of Hu, Zhao, Vlassak & Suo (2010), not a solved pore pressure.
    """
    out = force.copy()
    for number in np.unique(motion.touch[motion.touch >= 0]):
        rows = np.flatnonzero(motion.touch == number)
        branch, last = np.zeros(3), np.zeros(3)
        for k in rows:
            radius2 = max(p["tip_radius_m"] * 1e-3 * max(motion.s[k], 0.0), 1e-8)
            if motion.leg[k] == 1:
                radius2 = p["tip_radius_m"] * 1e-3 * max(motion.s[rows].max(), 0.1)
            decay = np.exp(-p["diffusivity_m2_per_s"] / radius2 / RATE_HZ)
            branch = decay * (branch + p["share"] * (force[k] - last))
            last = force[k]
            out[k] = force[k] + branch
    return let_go(out, force, motion, normals)


def _seeping(strength: float, bench: Bench) -> dict[str, Any]:
    return {
        "share": 0.35 * strength,
        "diffusivity_m2_per_s": 4e-5,
        "tip_radius_m": bench.tip_radius_m,
    }


def _fibres(strength: float, bench: Bench) -> dict[str, Any]:
    angle = float(np.round(bench.rng.uniform(0, np.pi), 3))
    return {
        "fibre_over_shear": 2.0 * strength,
        "direction": [float(np.cos(angle)), float(np.sin(angle)), 0.0],
    }


EFFECTS = (
    Effect(
        "viscoelasticity",
        "object",
        lambda strength, bench: {"g": [0.3 * strength], "tau_s": [0.3]},
        on_force=_viscoelastic,
    ),
    Effect(
        "tip_radius",
        "contact",
        lambda strength, bench: {"tip_radius_m": bench.tip_radius_m * (1 + 0.3 * strength)},
        lambda s, p: replace(s, tip_radius=1e3 * p["tip_radius_m"]),
    ),
    Effect(
        "friction_slip",
        "contact",
        lambda strength, bench: {"mu": 0.1 / strength},
        lambda s, p: replace(s, friction=p["mu"]),
    ),
    Effect(
        "adhesion",
        "contact",
        lambda strength, bench: {"pull_off_n": 0.1 * strength, "range_m": 0.0006},
        on_force=_adhere,
    ),
)
"""Effects of contact and of relaxation."""

UNNAMED = (
    Effect(
        "plasticity",
        "object",
        lambda strength, bench: {"share": 0.8 * strength, "yield_over_shear": 0.12},
        lambda s, p: replace(s, plastic=(p["share"], p["yield_over_shear"])),
        needs_finite=True,
    ),
    Effect(
        "anisotropy",
        "object",
        _fibres,
        lambda s, p: replace(s, fibre=(p["fibre_over_shear"], *p["direction"])),
        needs_finite=True,
    ),
    Effect("poroelasticity", "object", _seeping, on_force=_poroelastic),
)
"""Effects that no library entry names: for these "unknown" is the right answer."""
