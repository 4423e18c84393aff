"""Effects of the object and its base, solved in the solid."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.scenes.laboratory.effects.base import EffectContext, Parameters, SimulatedEffect
from palpate.scenes.laboratory.specimen import Specimen, ball
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.phantoms import Phantom


def _inclusion(strength: float, bench: EffectContext) -> dict[str, Any]:
    """Below a touched place; moved inwards until it lies inside the object."""
    radius = bench.phantom.height_m / 5
    surface = TriangleSurface(bench.phantom.vertices * 1e3, bench.phantom.faces)
    order = bench.rng.permutation(len(bench.touches))
    best, most = np.zeros(3), -np.inf
    for k in order:
        touch = bench.touches[k]
        centre = touch.point - 2e3 * radius * touch.normal
        on, distance, face = surface.nearest(centre[None])
        inside = (centre - on[0]) @ surface.face_normals[face[0]] < 0
        room = distance[0] if inside else -distance[0]
        if room > most:
            best, most = centre, room
        if most > 1.15e3 * radius:
            break
    radius = min(radius, max(most, 4.0) / 1.15e3)
    return {
        "centre_m": [round(float(x) * 1e-3, 5) for x in best],
        "radius_m": round(radius, 5),
        "modulus_ratio": 1 + 5 * strength,
    }


def _with_ball(specimen: Specimen, p: Parameters) -> Specimen:
    added = ball(p["centre_m"], p["radius_m"], p["modulus_ratio"])
    return replace(specimen, balls=(*specimen.balls, added))


def _base_modulus(strength: float, bench: EffectContext) -> dict[str, Any]:
    if strength > 3.2:
        raise OptionError(f"modulus_gradient has strength {strength}; the top would vanish: at most 3.2")
    return {"ratio_base": 1 + 0.5 * strength, "ratio_top": 1 - 0.3 * strength}


def _unbonded(strength: float, bench: EffectContext) -> dict[str, Any]:
    if not 0 < strength <= 1.5:
        raise OptionError(
            f"unbonded_base has strength {strength}; between 0 and 1.5, so that some base holds"
        )
    angle = float(np.round(bench.rng.uniform(-np.pi, np.pi), 3))
    return {
        "bonded_fraction": 1 - 0.5 * strength,
        "direction": [float(np.cos(angle)), float(np.sin(angle)), 0.0],
    }


def _loosen(specimen: Specimen, p: Parameters) -> Specimen:
    angle = float(np.arctan2(p["direction"][1], p["direction"][0]))
    return replace(specimen, base=("unbonded", p["bonded_fraction"], round(angle, 3)))


def _springs(strength: float, bench: EffectContext) -> dict[str, Any]:
    stiffness = bench.modulus_pa / bench.phantom.height_m / strength
    return {"k_normal_pa_per_m": stiffness, "k_tangential_pa_per_m": stiffness / 3}


def scaled(name: str, parameters: Parameters, modulus_pa: float) -> dict[str, Any]:
    """The parameters in the solver's units, where stresses are in units of the modulus and lengths in mm."""
    if name != "compliant_base":
        return dict(parameters)
    return {key: round(value / modulus_pa / 1e3, 9) for key, value in parameters.items()}


def _shape(strength: float, bench: EffectContext) -> dict[str, Any]:
    """A bite out of the place that is farthest from all touches."""
    surface = TriangleSurface(bench.phantom.vertices * 1e3, bench.phantom.faces)
    points = np.array([t.point for t in bench.touches])
    free = surface.vertices[surface.vertices[:, 2] > 8.0]
    gap = np.linalg.norm(free[:, None] - points[None], axis=2).min(axis=1)
    where, width = free[gap.argmax()], 0.55 * float(gap.max())
    deep = 0.8 * strength * width
    near = np.linalg.norm(surface.corners.mean(axis=1) - where, axis=1)
    bite = deep * np.exp(-((near / width) ** 2))
    rms = float(np.sqrt(np.average(bite**2, weights=surface.areas)))
    return {
        "rms_m": 1e-3 * rms,
        "where": (1e-3 * where).round(5).tolist(),
        "depth_m": 1e-3 * deep,
        "width_m": 1e-3 * width,
    }


def _bite(phantom: Phantom, p: Parameters) -> Phantom:
    vertices = phantom.vertices.copy()
    middle = np.array([0.0, 0.0, 0.4 * phantom.height_m])
    distance = np.linalg.norm(vertices - p["where"], axis=1)
    inward = middle - np.array(p["where"])
    inward /= np.linalg.norm(inward)
    amount = p["depth_m"] * np.exp(-((distance / p["width_m"]) ** 2))
    # the foot stays where it is traced
    amount *= np.clip(vertices[:, 2] / 0.006, 0, 1)
    return replace(phantom, vertices=vertices + amount[:, None] * inward)


EFFECTS = (
    SimulatedEffect(
        "finite_strain", "object", lambda strength, bench: {}, lambda s, p: replace(s, finite=True)
    ),
    SimulatedEffect(
        "strain_stiffening",
        "object",
        lambda strength, bench: {"c20_over_c10": 0.35 * strength},
        lambda s, p: replace(s, stiffening=p["c20_over_c10"]),
        needs_finite=True,
        least_strength=-1.4,
    ),
    SimulatedEffect(
        "mullins_softening",
        "object",
        lambda strength, bench: {"r": 3.7 / strength, "m_rel": 1.0},
        lambda s, p: replace(s, mullins=(p["r"], p["m_rel"])),
        needs_finite=True,
    ),
    SimulatedEffect(
        "poisson_ratio",
        "object",
        lambda strength, bench: {"poisson_ratio": max(0.0, 0.49 - 0.14 * strength)},
        lambda s, p: replace(s, poisson_ratio=p["poisson_ratio"]),
    ),
    SimulatedEffect("inclusion", "object", _inclusion, _with_ball),
    SimulatedEffect(
        "modulus_gradient",
        "object",
        _base_modulus,
        lambda s, p: replace(s, gradient=(p["ratio_base"], p["ratio_top"])),
    ),
    SimulatedEffect(
        "skin_layer",
        "object",
        lambda strength, bench: {"thickness_m": 0.003, "modulus_ratio": 1 + 2 * strength},
        lambda s, p: replace(s, skin=(1e3 * p["thickness_m"], p["modulus_ratio"])),
    ),
    SimulatedEffect("surface_shape", "object", _shape, on_shape=_bite),
    SimulatedEffect("unbonded_base", "boundary", _unbonded, _loosen),
    SimulatedEffect(
        "compliant_base",
        "boundary",
        _springs,
        lambda s, p: replace(s, base=("springs", p["k_normal_pa_per_m"], p["k_tangential_pa_per_m"])),
    ),
)
"""Effects of the object and its boundary that change what is solved."""
