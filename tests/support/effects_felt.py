"""Improved models at the contract's strength 1, the path that they are felt along, and what is felt on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.mechanics.frames import tangents
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import Recording

DEPTH_M = 0.004
SPEED_M_PER_S = 0.02
ABOVE_M = 0.006
DRAG_M = 0.003
RATE_HZ = 1000.0


@dataclass(frozen=True)
class Case:
    """name: of the effect, or several. effects: by the contract's keys. sense: what a hand must feel, in
    words; felt(with, without): the number that is shown; right(number): whether it is as it must be."""

    name: str
    effects: dict[str, dict[str, Any]]
    sense: str
    felt: Callable[[dict[str, float], dict[str, float]], float]
    right: Callable[[float], bool]


Felt = Callable[[dict[str, float], dict[str, float]], float]
SOFTER, STIFFER = (lambda x: x < 0.995), (lambda x: x > 1.005)


def cases(model: Model) -> list[Case]:
    """One for every effect of object, boundary and contact at strength 1, and one of three together."""
    normal = model.support.normal
    height = float(model.support.height(model.mesh.points).max())
    top, _ = places(model)
    radius, tip = height / 5, model.tool.tip_radius_m
    stiffness = model.material.young_modulus_pa / height
    keys: dict[str, dict[str, Any]] = {
        "finite_strain": {},
        "strain_stiffening": {"c20_over_c10": 0.35},
        "viscoelasticity": {"g": [0.3], "tau_s": [0.3]},
        "mullins_softening": {"r": 3.7, "m_rel": 1.0},
        "poisson_ratio": {"poisson_ratio": 0.35},
        "inclusion": {
            "centre_m": list(top[0] - 2 * radius * normal), "radius_m": radius, "modulus_ratio": 6.0
        },
        "modulus_gradient": {"ratio_base": 1.5, "ratio_top": 0.7},
        "skin_layer": {"thickness_m": 0.003, "modulus_ratio": 3.0},
        "unbonded_base": {"bonded_fraction": 0.5, "direction": list(_side(model))},
        "compliant_base": {"k_normal_pa_per_m": stiffness, "k_tangential_pa_per_m": stiffness / 3},
        "tip_radius": {"tip_radius_m": 1.3 * tip},
        "friction_slip": {"mu": 0.1},
        "adhesion": {"pull_off_n": 0.1, "range_m": 0.0006},
    }  # fmt: skip
    found = [Case(name, {name: keys[name]}, *_sense(name)) for name in keys]
    three = ("viscoelasticity", "friction_slip", "inclusion")
    together = {name: keys[name] for name in three}
    return [*found, Case(", ".join(three), together, *_sense("viscoelasticity"))]


def _sense(name: str) -> tuple[str, Felt, Callable[[float], bool]]:
    """(what a hand must feel, the number that is shown, whether it is as it must be) of an effect."""

    def over(key: str) -> Felt:
        return lambda own, plain: own[key] / plain[key]

    def share(key: str, of: str) -> Felt:
        return lambda own, plain: own[key] / own[of] / (plain[key] / plain[of])

    def itself(key: str) -> Felt:
        return lambda own, plain: own[key]

    held, pressed = "held on top, over the plain", "pressed from the side, over the plain"
    just, again = "just pressed, over the end of the hold", "half way down, again over the first time"
    stiffer = ("strain_stiffening", "inclusion", "skin_layer", "tip_radius")
    others: dict[str, tuple[str, Felt, Callable[[float], bool]]] = {
        "viscoelasticity": (just, share("reached", "held"), lambda x: x > 1.05),
        "mullins_softening": (again, share("second", "first"), lambda x: x < 0.95),
        "unbonded_base": (pressed, over("side"), SOFTER),
        "friction_slip": (
            "dragged: sideways over normal force", itself("sideways"), lambda x: 0.05 < x < 0.105
        ),
        "adhesion": ("greatest pull on the way out, N", itself("pull"), lambda x: 0.05 < x < 0.11),
    }  # fmt: skip
    return others.get(name, (held, over("held"), STIFFER if name in stiffer else SOFTER))


def _side(model: Model) -> np.ndarray:
    """(3,) unit, in the support's plane."""
    return tangents(model.support.normal)[0]


def places(model: Model) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """((point, normal) on top over the middle of the base, and at half height where a side is met)."""
    import pyvista

    mesh = model.mesh
    up = model.support.normal
    surface = pyvista.PolyData.from_regular_faces(mesh.points, mesh.surface[:, :3])
    middle = mesh.points[mesh.fixed].mean(axis=0)
    middle = middle - model.support.height(middle) * up
    height = model.support.height(mesh.points).max()

    def met(start: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        hit, face = surface.ray_trace(start, start + direction, first_point=False)
        nearest = int(np.argmin((hit - start) @ direction))
        corner = mesh.points[mesh.surface[face[nearest], :3]]
        across = np.cross(corner[1] - corner[0], corner[2] - corner[0])
        return hit[nearest], across / np.linalg.norm(across)

    side = _side(model)
    return met(middle + 2 * height * up, -up), met(middle + 0.5 * height * up + 0.5 * side, -side)


def path_of(model: Model) -> Recording:
    """A tip path (its forces zero): on top a press that is held and dragged, the same again, and one from the
    side. About 6 s."""
    (top, n), (edge, m) = places(model)
    radius = model.tool.tip_radius_m
    sideways = tangents(n)[0]
    ramp = (DEPTH_M + ABOVE_M) / SPEED_M_PER_S
    above, below = top + (radius + ABOVE_M) * n, top + (radius - DEPTH_M) * n
    aside = below + DRAG_M * sideways
    outside, inside = edge + (radius + ABOVE_M) * m, edge + (radius - DEPTH_M) * m
    high = outside + ((above - outside) @ n + 0.01) * n
    stops = [
        (2.0, above), (ramp, below), (0.6, below), (0.15, aside), (0.1, aside), (0.15, below), (ramp, above),
        (0.2, above), (ramp, below), (ramp, above), (0.5, high), (0.7, outside), (ramp, inside),
        (0.2, inside), (ramp, outside), (0.2, outside),
    ]  # fmt: skip
    times = np.cumsum([s for s, _ in stops])
    t = np.arange(0.0, times[-1], 1 / RATE_HZ)
    points = np.array([p for _, p in stops])
    position = np.stack(
        [np.interp(t, [0.0, *times], [points[0, k], *points[:, k]]) for k in range(3)], axis=1
    )
    return Recording(
        t=t, position=position, force_on_tool=np.zeros_like(position), sample_rate_hz=RATE_HZ,
        tip_radius_m=radius, poisson_ratio=model.material.poisson_ratio,
    )  # fmt: skip


def felt_on(model: Model, position: np.ndarray, force: np.ndarray) -> dict[str, float]:
    """What was felt along `path_of`, from ticks in order: position (n, 3) m, force (n, 3) N on the tool.

    reached, held: N, at full depth just after the press and at the end of the hold. first, second: N, half
    way down. sideways: over the normal force, at the end of the drag. pull: N, greatest on the way out. side:
    N, pressed from the side.
    """
    (top, n), (edge, m) = places(model)
    radius = model.tool.tip_radius_m
    depth = radius - (position - top) @ n
    aside = np.linalg.norm((position - top) - ((position - top) @ n)[:, None] * n, axis=1)
    push = force @ n
    on_top = aside < 2e-4
    full = np.flatnonzero(on_top & (depth > DEPTH_M - 2e-5))
    first_hold = full[full < full[0] + 650]
    dragged = np.flatnonzero((np.abs(aside - DRAG_M) < 2e-4) & (np.abs(depth - DEPTH_M) < 2e-5))
    normal = force[dragged] @ n
    shear = np.linalg.norm(force[dragged] - normal[:, None] * n, axis=1)
    moving_in = np.gradient(depth) > 0
    down = on_top & (np.abs(depth - 0.5 * DEPTH_M) < 1e-3) & moving_in
    later = np.arange(len(depth)) > dragged[-1]

    def half_way(rows: np.ndarray) -> float:
        order = np.argsort(depth[rows])  # between ticks: some may have been missed
        near = np.abs(depth[rows] - 0.5 * DEPTH_M).min(initial=np.inf) < 1e-4
        return float(np.interp(0.5 * DEPTH_M, depth[rows][order], push[rows][order])) if near else np.nan

    out = on_top & (depth > -1e-3) & (depth < DEPTH_M) & ~moving_in
    into = radius - (position - edge) @ m
    pressed = np.linalg.norm(position - edge, axis=1) < 2 * radius
    return {
        "reached": float(push[first_hold[:15]].mean()),
        "held": float(push[first_hold[-150:-50]].mean()),
        "first": half_way(down & ~later),
        "second": half_way(down & later),
        "sideways": float(np.median(shear / normal)),
        "pull": float(-push[out].min()),
        "side": float((force @ m)[pressed & (into > DEPTH_M - 2e-5)].mean()),
    }
