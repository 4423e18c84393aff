"""The 1D renderers: equations (1), (2), (5), (6) along the normal, parameters spread over the surface."""

from __future__ import annotations

import numpy as np
import pytest

from palpate import render
from palpate.mechanics.errors import ModelError, OptionError
from palpate.mechanics.model.one_d_laws import OneDLaws, spread_law
from palpate.mechanics.presses.making import no_presses

TIP = 0.005


def press(renderer, x, y, depth, steps=100, dt=1e-3):
    path = np.array([x, y, 0.05]) + (TIP - np.linspace(-2e-4, depth, steps))[:, None] * [0, 0, 1.0]
    state = renderer.start()
    forces = renderer.follow(state, np.ascontiguousarray(path[:, None]), np.full(steps, dt))
    return forces[:, 0], state


def test_kelvin_voigt_is_a_spring_at_rest_and_resists_speed(one_d_model):
    renderer = render.create("kelvin-voigt", one_d_model)
    slow, _ = press(renderer, -0.03, -0.03, 3e-3, dt=1.0)
    assert slow[-1] == pytest.approx([0, 0, 200.0 * 3e-3], rel=1e-2, abs=1e-6)
    fast, _ = press(renderer, -0.03, -0.03, 3e-3, steps=300, dt=1e-3)
    rate = 3.2e-3 / 0.3
    assert fast[-1, 2] - slow[-1, 2] == pytest.approx(5.0 * rate, rel=0.1)


@pytest.mark.parametrize("name", ["hunt-crossley", "hunt-crossley-undamped", "hunt-crossley-kh"])
def test_hunt_crossley_is_a_power_law_along_the_normal(one_d_model, name):
    renderer = render.create(name, one_d_model)
    force, state = press(renderer, 0.03, 0.03, 4e-3, dt=1.0)
    assert force[-1] == pytest.approx([0, 0, 4000 * 4e-3**1.4], rel=1e-2, abs=1e-6)
    assert state.stiffness[0] == pytest.approx(1.4 * 4000 * 4e-3**0.4, rel=1e-2)
    assert state.depths[0] == pytest.approx(4e-3)


def test_parameters_are_interpolated_between_the_touches(one_d_model):
    smooth = render.create("kelvin-voigt", one_d_model)
    middle = press(smooth, 0.0, 0.0, 3e-3, dt=1.0)[0][-1, 2]
    assert middle == pytest.approx(300 * 3e-3, rel=0.02)
    plain = render.create("kelvin-voigt", one_d_model, render.RenderOptions(interpolation="nearest"))
    near = press(plain, 0.01, 0.0, 3e-3, dt=1.0)[0][-1, 2]
    assert near == pytest.approx(400 * 3e-3, rel=0.02)


def test_a_1d_model_pushes_along_the_normal_alone_and_never_pulls(one_d_model):
    renderer = render.create("hunt-crossley", one_d_model)
    path = np.array([[0.02, 0.0, 0.06], [0.02, 0.0, 0.0525], [0.0, 0.0, 0.0525], [-0.02, 0.0, 0.056]])
    path = np.concatenate([np.linspace(a, b, 100) for a, b in zip(path[:-1], path[1:], strict=True)])
    forces = renderer.follow(renderer.start(), np.ascontiguousarray(path[:, None]), np.full(300, 1e-3))[:, 0]
    assert (forces[:, 2] >= 0).all() and forces[150, 2] > 0.3
    assert np.abs(forces[:, :2]).max() < 1e-9


def test_a_1d_model_without_parameters_says_so(one_d_model):
    with pytest.raises(ModelError, match="reconstruct"):
        render.create("kelvin-voigt", one_d_model.replaced(presses=no_presses(0.005)))
    with pytest.raises(OptionError, match="hunt-crossley"):
        render.create("spring", one_d_model)


def test_spreading_averages_repeats_and_stays_in_range():
    points = np.array([[0.0, 0, 0], [0.0005, 0, 0], [0.05, 0, 0], [0.1, 0, 0]])
    law = OneDLaws(np.array([100.0, 300.0, 400.0, np.nan]), np.zeros(4), np.ones(4), np.zeros(4))
    at = spread_law(
        points, np.array([0, 0, 1, 2]), law, np.array([[0.00025, 0, 0], [0.05, 0, 0], [1.0, 0, 0]])
    )
    assert at.k[:2] == pytest.approx([200, 400], rel=1e-6)
    assert at.k[2] <= 400
