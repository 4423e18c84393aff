"""Stiffness field: Young's modulus differs smoothly from place to place, as tissue does.

ln E is a Gaussian process of few parameters (mechanics.compliance.smooth_field). How much it varies, and over
what length, is what makes the presses' own stiffness likeliest; what a fit moves are the MODES patterns of
which these presses tell most, each of unit variance before anything is known. The far field answers to first
order, the dent through the modulus under the tip; the renderer has the field in its elements.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.mechanics.compliance.far_field import energy_fields
from palpate.mechanics.compliance.field_response import far_of, shares_in_elements, tips_of
from palpate.mechanics.compliance.pressed_places import Places
from palpate.mechanics.compliance.smooth_field import (
    Prior,
    SmoothField,
    correlation,
    estimate,
    kriging,
    lengths_of,
    places_of,
    views_of,
)
from palpate.mechanics.disk.schema import ANY, FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope
from palpate.mechanics.effects.hints import Misfit, SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene
from palpate.mechanics.model.material import LENGTH
from palpate.mechanics.model.model import Model

MODES = 10
_USUAL = Prior(0.35, 0.02, 0.03)
"""Where nothing was sought in the presses yet."""
_USUAL_ANSWER_M = 0.005
_BASIS = "stiffness_field"


@dataclass(frozen=True)
class Basis:
    """places: (c, 3) m. patterns: (MODES, c) of ln E there, those that presses tell of first, 0 for those
    that are not there. elements: (m, MODES) of ln E of the elements, by pattern."""

    prior: Prior
    places: np.ndarray
    patterns: np.ndarray
    elements: np.ndarray


def _basis(scene: TouchedScene) -> Basis:
    places = scene.places
    p = len(places.point)
    return places.stage(_BASIS, lambda: _made(places, _USUAL, np.full(p, _USUAL_ANSWER_M), np.full(p, 1e3)))


def _made(places: Places, prior: Prior, answer: np.ndarray, weight: np.ndarray) -> Basis:
    """answer: (p,) m, of ln E to compliance. weight: (p,) of each press."""
    shares, at = shares_in_elements(places, answer), _places(places)
    elements = kriging(shares.nodes, at, prior.length_m)
    own = prior.log_sd**2 * correlation(at, at, prior.length_m)
    values, vectors = np.linalg.eigh(own)
    root = vectors * np.sqrt(np.maximum(values, 0))
    seen = shares.weight @ elements @ root
    seen = np.sqrt(weight)[:, None] * (seen - (weight @ seen) / weight.sum())
    strongest = np.linalg.svd(seen, full_matrices=False)[2][:MODES]
    patterns = np.zeros((MODES, len(at)))
    patterns[: len(strongest)] = strongest @ root.T
    return Basis(prior, at, patterns, elements @ patterns.T)


def _places(places: Places) -> np.ndarray:
    return places_of(tips_of(places)[places.first], energy_fields(places).centroid)


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    places, basis = scene.places, _basis(scene)
    if not values.any():
        return
    ratio = np.exp(basis.elements @ values)
    softness = places.under_tip @ (1 / ratio[places.model.mesh.touchable_elements])
    far, dent_ratio = far_of(places, energy_fields(places), ratio, softness)
    settings.far = settings.far - places.far + far
    settings.dent_ratio = settings.dent_ratio * dent_ratio


def _seek(scene: TouchedScene, misfit: Misfit) -> list[np.ndarray]:
    """The likeliest field of what the presses' stiffness is off by; and from now on its patterns."""
    places = scene.places
    answer = np.maximum(-misfit.answer, 0.0)
    shares, at = shares_in_elements(places, answer), _places(places)
    level = np.log(np.clip(1 + misfit.level, 0.2, 5.0))
    touched = places.point[places.first]
    views = views_of(shares, at, lengths_of(touched, shares.nodes))
    found = estimate(level, 1 / np.sqrt(misfit.weight), places.place, views)
    basis = places.stages[_BASIS] = _made(places, found.prior, answer, misfit.weight)
    start = np.linalg.lstsq(basis.patterns.T, found.field.log_ratio, rcond=1e-6)[0]
    return [np.clip(start, *EFFECT.bounds)]


def field_of(keys: Keys) -> SmoothField:
    """The field that an effect's keys say."""
    return SmoothField(
        np.asarray(keys["places_m"], float).reshape(-1, 3),
        np.log(np.asarray(keys["ratio"], float)),
        float(keys["length_m"]),
    )


def keys_of(field: SmoothField) -> dict[str, Any]:
    """The keys that say a field."""
    return {
        "length_m": field.length_m,
        "places_m": field.places.tolist(),
        "ratio": np.exp(field.log_ratio).tolist(),
    }


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    basis = _basis(scene)
    return keys_of(SmoothField(basis.places, values @ basis.patterns, basis.prior.length_m))


def _words(keys: Keys) -> str:
    ratio = np.asarray(keys["ratio"], float)
    return (
        f"{ratio.min():.2f} to {ratio.max():.2f} times the object's modulus, alike over about "
        f"{1e3 * float(keys['length_m']):.0f} mm"
    )


def _apply(model: Model, keys: Keys) -> Model:
    mesh = model.mesh
    ratio = np.exp(field_of(keys).at(mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)))
    there = model.material.field
    return model.with_material(field=ratio if there is None else there * ratio)


EFFECT = Effect(
    name="stiffness_field",
    domain="object",
    scope=Scope.PLACES,
    words="its stiffness differs from place to place",
    parameters=tuple(
        Parameter(f"pattern_{k + 1}", "1", -6.0, 6.0, 0.0, (0.5 if k < 2 else 0.0,), 0.05, 1.0)
        for k in range(MODES)
    ),
    keys={
        "places_m": ANY,
        "ratio": FileKey(low=1e-3, high=1e3, size=0, required=True),
        "length_m": LENGTH,
    },
    report=_report,
    keys_in_words=_words,
    change=_change,
    apply=_apply,
    hints=SearchHints(
        seek=_seek,
        any_form=True,
        expensive=True,
        # first order in the far field: on four slabs of `benchmarks._tissue` the contrast was 0.82 to 0.99
        systematic_share=(0.13,) * MODES,
    ),
)
