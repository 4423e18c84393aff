"""Rendered effects: memory, softening, adhesion, stiffening, tip radius, friction, as a model names them."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.errors import ModelError

from . import shapes

TIP = 0.005


@pytest.fixture(scope="module")
def base():
    """A small block and its compliance."""
    made = shapes.model(shapes.block((0.08, 0.08, 0.05), (4, 4, 3)))
    return made, shapes.quick_compliance(made)


def render_with(base, **effects):
    from palpate.render.fem.renderer import FemRenderer
    from palpate.render.options import RenderOptions

    made, compliance = base
    return FemRenderer(
        made.replaced(effects=effects), RenderOptions(dent_law="linear"), compliance=compliance
    )


def force(renderer, height, dt=1e-3):
    path = np.zeros((len(height), 1, 3))
    path[:, 0, 2] = 0.05 + TIP + np.asarray(height)
    return renderer.follow(renderer.start(), path, np.full(len(height), dt))[:, 0, 2]


IN = np.linspace(1e-3, -4e-3, 200)


def test_viscoelastic_force_starts_stiffer_and_relaxes_to_the_elastic_one(base):
    path = np.concatenate([IN, np.full(3000, -4e-3)])
    elastic = force(render_with(base), path)
    slow = force(render_with(base, viscoelasticity={"g": [0.3], "tau_s": [0.3]}), path)
    assert 1.15 < slow[199] / elastic[199] < 1.3
    assert slow[-1] == pytest.approx(elastic[-1], rel=1e-3)
    step = np.concatenate([[1e-3], np.full(5, -4e-3)])
    jump = force(render_with(base, viscoelasticity={"g": [0.3], "tau_s": [0.3]}), step)
    assert jump[1] == pytest.approx(1.3 * elastic[-1], rel=5e-3)


def test_mullins_softens_the_second_press_below_the_first_depth(base):
    twice = np.concatenate([IN, IN[::-1], IN])
    soft = force(render_with(base, mullins_softening={"r": 4.0, "m_rel": 0.3}), twice)
    elastic = force(render_with(base), twice)
    assert soft[:200] == pytest.approx(elastic[:200], abs=1e-12)
    assert soft[520] < 0.9 * elastic[520]
    assert soft[599] == pytest.approx(elastic[599], rel=1e-6)


def test_adhesion_pulls_at_release_only(base):
    both = np.concatenate([IN, IN[::-1]])
    sticky = force(render_with(base, adhesion={"pull_off_n": 0.1, "range_m": 5e-4}), both)
    elastic = force(render_with(base), both)
    assert sticky[:200] == pytest.approx(elastic[:200], abs=1e-12)
    assert sticky.min() == pytest.approx(-0.1, rel=0.1)
    assert sticky[-1] == 0.0
    assert np.abs(np.diff(sticky)).max() < 0.03


def test_stiffening_larger_tip_and_finite_strain_change_the_deep_force(base):
    elastic = force(render_with(base), IN)[-1]
    assert force(render_with(base, strain_stiffening={"c20_over_c10": 0.35}), IN)[-1] > 1.01 * elastic
    assert force(render_with(base, tip_radius={"tip_radius_m": 0.0065}), IN)[-1] > 1.03 * elastic


def test_an_effect_with_impossible_keys_is_refused(base):
    with pytest.raises(ModelError, match="tau_s"):
        render_with(base, viscoelasticity={"g": [0.3], "tau_s": [0.3, 1.0]})
    with pytest.raises(ModelError, match="range_m"):
        render_with(base, adhesion={"pull_off_n": 0.1})
    with pytest.raises(ModelError, match="friction_slip"):
        render_with(base, friction_slip={"mu": -1.0})


def test_instrument_effects_are_not_rendered(base):
    plain = force(render_with(base), IN)
    biased = force(render_with(base, force_bias={"bias_n": [0, 0, 1.0]}, time_delay={"delay_s": 0.02}), IN)
    assert plain.tobytes() == biased.tobytes()


def pressed(renderer, depth, seconds):
    """Force of a step to a depth, held."""
    return force(renderer, np.concatenate([[1e-3], np.full(round(seconds * 1000), -depth)]))


def test_a_springpot_relaxes_by_a_power_of_time(base):
    elastic = pressed(render_with(base), 3e-3, 0.01)[-1]
    slow = pressed(render_with(base, power_law_relaxation={"share": 0.2, "exponent": 0.3}), 3e-3, 3.0)
    over = slow / elastic - 1
    assert over[3000] / over[300] == pytest.approx(10**-0.3, rel=0.02)
    # the springpot's own kernel, share t^-exponent of the elastic force
    assert over[1000] == pytest.approx(0.2, rel=0.02)


def test_drainage_relaxes_slower_under_a_wider_contact(base):
    wet = render_with(base, poroelasticity={"share": 0.5, "diffusivity_m2_per_s": 3e-5})
    over = {}
    for depth in (1e-3, 4e-3):
        elastic = pressed(render_with(base), depth, 0.01)[-1]
        over[depth] = pressed(wet, depth, 2.0) / elastic - 1
    # the contact's radius squared goes with the depth, and so does the time
    for ms in (50, 200, 500):
        assert over[4e-3][4 * ms] == pytest.approx(over[1e-3][ms], abs=0.02)
    assert over[1e-3][1] > 0.4 > 0.1 > over[1e-3][500]


@pytest.mark.parametrize("range_m", [1e-6, 5e-4])
def test_surfaces_that_stick_pull_by_their_work_and_less_before_they_touched(base, range_m):
    """Johnson, Kendall & Roberts pull 3/2 pi w R at the most, Derjaguin's 2 pi w R; what heals pulls less."""
    work = 4.0
    sticky = render_with(base, jkr_adhesion={"work_j_per_m2": work, "healed": 0.3, "range_m": range_m})
    found = force(sticky, np.concatenate([IN[::2], IN[::-2], np.linspace(1e-3, 3e-3, 100)]))
    unit = np.pi * work * TIP
    assert 1.4 * unit < -found.min() < 2.1 * unit
    assert -found.min() > 2 * -found[:100].min()
    assert found[-1] == 0.0 and np.isfinite(found).all()


def test_exponential_stiffening_and_softening_show_where_it_is_deep(base):
    plain = force(render_with(base), IN)
    hard, soft = (force(render_with(base, strain_stiffening={"c20_over_c10": c}), IN) for c in (1.5, -0.1))
    early = 60  # 0.2 mm deep
    assert hard[early] == pytest.approx(plain[early], rel=0.08)
    assert hard[-1] > 1.1 * plain[-1] and soft[-1] < hard[-1] / 1.1
    assert np.isfinite(hard).all() and np.isfinite(soft).all()
