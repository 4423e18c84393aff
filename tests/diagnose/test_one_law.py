"""What is fitted is what is rendered: the force that the diagnosis predicts along a path is the renderer's.

One place on a flat block, its far field the same for both: all that an effect does to a tip that is pressed,
held, dragged, lifted and set down again.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import palpate.mechanics.compliance.fine_corners as made
from palpate.diagnosis.apply import with_effects
from palpate.diagnosis.forward.prediction import Forward
from palpate.mechanics.compliance.far_field import energy_fields, far_with_weights
from palpate.mechanics.compliance.near_field import BallLaw, surface_softness
from palpate.mechanics.compliance.pressed_places import solve_places
from palpate.mechanics.compliance.sites import touch_solver
from palpate.mechanics.compliance.stored_compliance import load_or_condense
from palpate.mechanics.effects.registry import effect, effects
from palpate.mechanics.frames import tangents
from palpate.mechanics.presses.making import of_paths
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions

COARSE_M = 0.05
POINT, UP = np.array([0.012, 0.006, 0.04]), np.array([0.0, 0.0, 1.0])
STEP_S = 1e-3
VALUES = {
    "finite_strain": (),
    "strain_stiffening": (0.8,),
    "viscoelasticity": (0.3, np.log(0.08), 0.2, np.log(0.9)),
    "power_law_relaxation": (0.3, 0.3),
    "poroelasticity": (0.4, np.log(2.0)),
    "mullins_softening": (0.25, 0.4),
    "poisson_ratio": (0.4,),
    "inclusion": (0.0, 0.0, 0.02, 0.009, np.log(4.0)),
    "modulus_gradient": (-0.8,),
    "skin_layer": (2e-3, np.log(2.5)),
    "stiffness_field": (1.0, -0.7, *[0.0] * 8),
    "unbonded_base": (0.4, 0.3, 0.9),
    "compliant_base": (np.log(0.3), np.log(0.5)),
    "tip_radius": (1.3,),
    "friction_slip": (0.15,),
    "adhesion": (0.1, 3e-3, 0.4),
    "jkr_adhesion": (0.02, 0.3, 1e-3),
}
SINGLE = tuple((name,) for name in VALUES)
PAIRS = tuple(itertools.combinations(VALUES, 2))


def _path(seed: int) -> np.ndarray:
    """(n, 3) m: into the object, and sideways twice; presses, drags, holds, and touches done again."""
    rng = np.random.default_rng(seed)
    knots = [(-4e-3, 0.0, 0.0)]
    side = np.zeros(2)
    for _ in range(4):
        deep = rng.uniform(1.5e-3, 4.5e-3)
        knots.append((deep, *side))
        knots.append((deep * rng.uniform(0.8, 1.1), *side))
        side = side + rng.uniform(-6e-4, 6e-4, 2)
        knots.append((deep * rng.uniform(0.6, 0.9), *side))
        knots.append((deep * rng.uniform(0.9, 1.0), *side))
        # off the surface by less than adhesion reaches, and by more
        knots.append((rng.choice([-1e-3, -5e-3]), *side))
    steps = rng.integers(40, 400, len(knots) - 1)
    at = np.concatenate([[0], np.cumsum(steps)])
    return np.stack([np.interp(np.arange(at[-1] + 1), at, k) for k in np.transpose(knots)], axis=1)


@pytest.fixture(scope="module")
def model(bench):
    return bench.record()[1]


@pytest.fixture(scope="module")
def compliance(model):
    """Of the block's own mesh: only its form is used."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(made, "surface_edge", lambda _: COARSE_M)
        patch.setattr(made, "ball_law", lambda solver, points, *rest: BallLaw.none(len(points)))
        patch.setattr(made, "touch_solver", partial(touch_solver, surface_edge_m=COARSE_M))
        return load_or_condense(model)


@pytest.fixture(scope="module")
def places(model):
    frame = np.stack([UP, *tangents(UP)])
    return solve_places(model, POINT[None], UP[None], frame[None])


def _forward(places, y) -> Forward:
    tip = places.model.tool.tip_radius_m
    centre = POINT + tip * UP
    position = centre - y @ places.frame[0]
    presses = of_paths(
        np.array([0, len(y)]), position, np.zeros_like(y), centre[None], UP[None], tip_radius_m=tip,
        sample_rate_hz=1 / STEP_S,
    )  # fmt: skip
    return Forward(replace(presses, columns={"lead": np.zeros_like(y)}), places)


def predicted_and_rendered(names, model, places, compliance, seed=0):
    """(n, 3) N each, place's frame, along the same path under the same far field."""
    forward = _forward(places, _path(seed))
    settings = forward.ideal(model.material.young_modulus_pa)
    keys = {}
    for name in names:
        values = np.array(VALUES[name], dtype=float)
        keys[name] = effect(name).report(values, forward, settings.modulus)
        effect(name).act(settings, values, forward)
    predicted = forward.predict(settings)
    frame = places.frame[0]
    options = RenderOptions(
        surface_edge_m=COARSE_M, snap_to_touches=False, friction=None if "friction_slip" in names else np.inf
    )
    better = with_effects(model, keys)
    renderer = FemRenderer(better, options, compliance=compliance)
    vertices = len(renderer.parameters.far)
    # a plane without end, of one place: the coarse block's edges and corners are rounded into its middle
    flat = renderer.parameters.surface._replace(normals=np.tile(UP, (vertices, 1)))
    softness = surface_softness(better.mesh, better.surface_ratio, POINT[None], better.tool.tip_radius_m)
    renderer = renderer._with(
        surface=flat, curvature=np.zeros(vertices), softness=np.tile(softness, vertices)
    )
    far = np.tile(frame.T @ settings.far[0] @ frame, (vertices, 1, 1))
    bracing = settings.bracing[0] + settings.touch.law_of_dent(settings.nu).braced * places.braced[0]
    renderer = renderer.with_field(far, bracing=np.full(vertices, bracing))
    centre = POINT + model.tool.tip_radius_m * UP
    tips = centre - forward.touches.travel @ frame
    forces = renderer.follow(renderer.start(), tips[:, None], np.full(len(tips), STEP_S))[:, 0]
    return predicted, forces @ frame.T


def test_every_rendered_effect_is_compared():
    assert set(VALUES) == {e.name for e in effects() if e.rendered}


@pytest.mark.parametrize("names", [(), *SINGLE, *PAIRS], ids="+".join)
def test_predicted_is_rendered(names, model, places, compliance):
    predicted, rendered = predicted_and_rendered(names, model, places, compliance, seed=len(names))
    assert np.abs(rendered).max() > 0.05
    np.testing.assert_allclose(predicted, rendered, atol=1e-4, rtol=1e-3)


@pytest.mark.parametrize("name", VALUES)
def test_the_path_shows_each_effect(name, model, places, compliance):
    """A comparison in which an effect does nothing would say nothing."""
    plain, _ = predicted_and_rendered((), model, places, compliance)
    changed, _ = predicted_and_rendered((name,), model, places, compliance)
    assert np.abs(changed - plain).max() > 1e-3


def test_a_gradient_weighs_the_elements_as_the_applied_model_has_them(model, places):
    """Its height is one: the far field that is predicted is that of the elements that `apply` makes."""
    gradient, values = effect("modulus_gradient"), np.array(VALUES["modulus_gradient"])
    forward = _forward(places, _path(0))
    settings = forward.ideal(model.material.young_modulus_pa)
    gradient.act(settings, values, forward)
    ratio = with_effects(model, {gradient.name: gradient.report(values, forward, 1.0)}).element_ratio
    softness = places.under_tip[0] @ (1 / ratio[model.mesh.touchable_elements])
    given_back = (1 - softness) * energy_fields(places).half_space
    expected = far_with_weights(places, 1 / ratio)[0] + given_back
    np.testing.assert_allclose(settings.far[0], expected, rtol=1e-6, atol=1e-3)
    assert settings.dent_ratio[0] == pytest.approx(1 / softness, rel=1e-9)
