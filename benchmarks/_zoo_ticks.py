"""Drawn ticks on a zoo's shape: whether the force ever changes by more than the hand's motion explains.

A tip goes in along the normal of a drawn place, wanders about, over rims and down flanks, and goes out; each
tick it moves by some hundredths of its radius. Friction is drawn too. Explained is what the stiffest dent
changes by in that way, and what slip leaves open (render.fem.kernel); a snap, as of a tip that slips off a
rim, may take a tenth of the path's greatest force in one tick. A contact that ends falls to 0 at once.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks._zoo_presses import tip_of
from palpate.mechanics.model.model import Model, Tool
from palpate.render.base import Renderer
from palpate.render.registry import create

FRICTIONS = (0.0, 0.1, 0.3, 1.0, np.inf)
_WANDER, _IN, _SMOOTH = 1000, 150, 80
"""Ticks of wandering; of going in and out; over which the motion is smooth."""
_WANDER_RADII, _DEPTH_RADII, _IN_AND_OUT = (0.2, 2.0), (0.1, 0.6), 0.15
_STIFFEST, _LEFT, _SNAP = 4.0, 2e-3, 0.1


def drawn_ticks(model: Model, count: int, seed: int = 1) -> dict[str, Any]:
    """{"ticks", "jumps": ticks whose force changed by more than is explained, "worst_jump": the most that it
    did, of the path's greatest force; "held": ticks that did not settle and held the last force}, of one tip
    on the condensed object."""
    tip, rng = tip_of(model), np.random.default_rng(seed)
    base = create("fem", replace(model, tool=Tool(tip)))
    found: dict[str, Any] = {"ticks": 0, "jumps": 0, "worst_jump": 0.0, "held": 0}
    while found["ticks"] < count:
        renderer = base.with_friction(FRICTIONS[int(rng.integers(len(FRICTIONS)))])
        path = drawn(renderer, tip, rng)
        state = renderer.start([tip])
        force = renderer.follow(state, path[:, None].copy(), np.full(len(path), 1e-3))[:, 0]
        share = jumps(renderer, tip, path, force)
        found["ticks"] += len(path)
        found["jumps"] += int((share > _SNAP).sum())
        found["worst_jump"] = max(found["worst_jump"], float(share.max()))
        found["held"] += int(state.unsettled[0])
    return found


def drawn(renderer: Renderer, tip_m: float, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) m, a hand's path from the air into the object, about in it and out."""
    arrays, support = renderer.contact.arrays, renderer.model.support
    corners = arrays.triangles[rng.choice(np.flatnonzero(arrays.free))]
    point, normal = arrays.vertices[corners].mean(axis=0), arrays.normals[corners].mean(axis=0)
    normal /= np.linalg.norm(normal)
    bell = np.exp(-(np.arange(-3 * _SMOOTH, 3 * _SMOOTH + 1) ** 2) / 2 / _SMOOTH**2)
    bell *= rng.uniform(*_WANDER_RADII) * tip_m / np.sqrt((bell**2).sum())
    noise = rng.normal(size=(_WANDER + len(bell) - 1, 3))
    about = np.stack([np.convolve(axis, bell, "valid") for axis in noise.T], axis=1)
    about -= about[0] + (1 - _IN_AND_OUT) * ((about - about[0]) @ normal)[:, None] * normal
    into = tip_m * np.linspace(1.2, 1 - rng.uniform(*_DEPTH_RADII), _IN)[:, None] * normal
    path = point + np.vstack([into, into[-1] + about, into[::-1] + about[-1]])
    below = np.minimum(support.height(path) - tip_m, 0.0)  # the support is in the way
    return path - below[:, None] * support.normal


def jumps(renderer: Renderer, tip_m: float, path: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(n - 1,) by how much a force (n, 3) N changes in a tick beyond what a path (n, 3) m explains, over the
    path's greatest force."""
    material, size = renderer.model.material, np.linalg.norm(force, axis=1)
    # twice the dent's stiffness, 2 E* a, with a contact as wide as the tip
    stiffest = _STIFFEST * material.young_modulus_pa / (1 - material.poisson_ratio**2) * tip_m
    way, change = (np.linalg.norm(np.diff(each, axis=0), axis=1) for each in (path, force))
    beyond = np.maximum(change - stiffest * way - _LEFT * np.maximum(size[1:], size[:-1]), 0.0)
    beyond[size[1:] == 0] = 0.0
    return beyond / max(float(size.max()), 1e-300)
