"""Improved models: what was found is written, read back and rendered; instruments stay out of it."""

from __future__ import annotations

import json
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

import palpate.mechanics.compliance.fine_corners as made
from palpate.diagnosis.apply import improved, improvement, with_effects, with_replayed_modulus
from palpate.diagnosis.options import DiagnoseOptions
from palpate.diagnosis.pipeline import diagnose
from palpate.mechanics.compliance.near_field import BallLaw, ball_law, contact_width, surface_softness
from palpate.mechanics.compliance.patch import half_space_compliance
from palpate.mechanics.compliance.pressed_places import solve_places
from palpate.mechanics.compliance.sites import surface_edge, touch_solver
from palpate.mechanics.compliance.surface_compliance import surface_compliance
from palpate.mechanics.effects.inclusion import ball_of, first_order, solved_change
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.frames import tangents
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.material import Ball
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions

UP = np.array([0.0, 0.0, 1.0])
DEPTH = 0.004
COARSE_M = 0.05
TOP = np.array([0.0, 0.0, 0.04])


@pytest.fixture(scope="module", autouse=True)
def coarse():
    """Compliances on the block's own mesh: what is asked here needs no finer one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(made, "surface_edge", lambda _: COARSE_M)
        patch.setattr(made, "ball_law", lambda solver, points, *rest: BallLaw.none(len(points)))
        patch.setattr(made, "touch_solver", partial(touch_solver, surface_edge_m=COARSE_M))
        yield


@pytest.fixture(scope="module")
def model(bench):
    """The block's model, as the ideal: linear dent, nothing left out."""
    return bench.record()[1]


@pytest.fixture(scope="module")
def folder(model, tmp_path_factory):
    """Written once: compliances of every variant are kept in it."""
    return write_model(tmp_path_factory.mktemp("models") / "block", model)


def made_once(model, folder, effects, known={}):  # noqa: B006
    """A renderer of the model with effects, its compliance kept in the folder."""
    key = json.dumps(effects, sort_keys=True)
    if key not in known:
        quick = RenderOptions(surface_edge_m=0.01, snap_to_touches=False)
        known[key] = FemRenderer(with_effects(model, effects).replaced(path=folder), quick)
    return known[key]


def felt(model, folder, effects, points=((0.0, 0.0, 0.04),), normal=UP, drag=0.0):
    """(k, n, 3) N on the tool: pressed, held for 0.5 s, dragged, let go, at points of the surface."""
    renderer = made_once(model, folder, effects)
    down, up = np.linspace(-1e-3, DEPTH, 200), np.linspace(DEPTH, -2e-3, 240)
    into = np.concatenate([down, np.full(500, DEPTH), up])
    aside = np.concatenate([np.zeros(200), np.linspace(0, drag, 500), np.zeros(240)])
    forces = []
    for point in points:
        centre = np.array(point) + model.tool.tip_radius_m * normal
        path = centre - into[:, None] * normal + aside[:, None] * np.array([0.0, 1.0, 0.0])
        forces.append(renderer.follow(renderer.start(), path[:, None], np.full(len(path), 1e-3))[:, 0])
    return np.array(forces)


def test_a_lump_is_drawn_once_and_its_key_makes_the_compliance_anew(model, folder):
    lump = {"centre_m": [0.0, 0.0, 0.022], "radius_m": 0.014, "modulus_ratio": 6.0}
    better = with_effects(model, {"inclusion": lump})
    assert better.material.inclusions == {"diagnosed-1": Ball(**lump)}
    assert better.element_ratio.max() > 1.5
    places = [(0.0, 0.0, 0.04), (0.03, 0.03, 0.04)]
    plain, hard = felt(model, folder, {}, places), felt(model, folder, {"inclusion": lump}, places)
    over, aside = (hard[:, 650, 2] / plain[:, 650, 2]) - 1
    assert over > 0.01 and over > 2 * abs(aside)


def test_the_modulus_is_the_one_that_the_renderer_needs(bench, folder):
    """Whatever modulus a fit leaves, the replay finds the same, and it is that of the object (20 kPa)."""
    recording, model = bench.record()
    model = model.replaced(path=folder)
    found = [
        with_replayed_modulus(model.with_modulus(e), recording).material.young_modulus_pa
        for e in (0.8 * model.material.young_modulus_pa, 1.3 * model.material.young_modulus_pa)
    ]
    assert found[0] == pytest.approx(found[1], rel=0.01)
    assert found[0] == pytest.approx(20e3, rel=0.08)


def test_written_and_read_back_it_renders_the_same(model, tmp_path):
    effects = {
        "inclusion": {"centre_m": [0.01, 0.0, 0.02], "radius_m": 0.008, "modulus_ratio": 4.0},
        "viscoelasticity": {"g": [0.3], "tau_s": [0.3]},
        "adhesion": {"pull_off_n": 0.1, "range_m": 6e-4, "inside": 0.4},
    }
    better = with_effects(model, effects)
    again = read_model(write_model(tmp_path / "model", better))
    assert {k: dict(v) for k, v in again.effects.items()} == effects
    assert again.element_ratio == pytest.approx(better.element_ratio, rel=1e-12)
    assert again.material.inclusions == better.material.inclusions


def test_a_softer_top_makes_the_dent_softer_too(model, folder):
    """The modulus under the tip is the dent's: a gradient that is felt alike in far field and dent."""
    gradient = {"modulus_gradient": {"ratio_base": 0.5, "ratio_top": 0.5}}
    path = np.array([[0.0, 0.0, 0.045 + 1e-3 - d] for d in np.linspace(0, 5e-3, 50)])[:, None]
    forces = []
    for effects in (gradient, {}):
        renderer = made_once(model, folder, effects)
        forces.append(renderer.follow(renderer.start(), path, np.full(50, 1e-3))[:, 0, 2])
    soft, ideal = forces
    assert soft[1:] == pytest.approx(0.5 * ideal[1:], rel=2e-3, abs=1e-6)


def test_a_gradient_is_softer_on_top_and_stiffer_at_the_base(model, folder):
    gradient = {"modulus_gradient": {"ratio_base": 1.5, "ratio_top": 0.7}}
    plain, graded = felt(model, folder, {}), felt(model, folder, gradient)
    assert graded[0, 650, 2] < 0.9 * plain[0, 650, 2]
    low, side = [(0.04, 0.0, 0.008)], np.array([1.0, 0.0, 0.0])
    plain, graded = (felt(model, folder, e, low, side) for e in ({}, gradient))
    assert graded[0, 650, 0] > 1.1 * plain[0, 650, 0]


def test_a_skin_is_stiffer_at_first_touch_than_deep(model, folder):
    skin = {"skin_layer": {"thickness_m": 0.003, "modulus_ratio": 3.0}}
    ratio = felt(model, folder, skin)[0, :, 2] / np.maximum(felt(model, folder, {})[0, :, 2], 1e-9)
    assert ratio[60] > ratio[199] > 1.1
    ratios = with_effects(model, skin).element_ratio
    assert 1.1 < ratios.max() <= 3.0 and ratios.min() >= 1.0


def test_a_loose_base_carries_what_presses_on_it_and_lets_go_of_what_lifts(model, folder):
    loose = {"unbonded_base": {"bonded_fraction": 0.5, "direction": [1.0, 0.0, 0.0]}}
    top = [(0.02, 0.0, 0.04)]
    plain, own = felt(model, folder, {}, top), felt(model, folder, loose, top)
    # straight down over the loose half: the floor is there
    assert 0.9 < own[0, 650, 2] / plain[0, 650, 2] < 1.0
    left, side = [(-0.04, 0.0, 0.03)], np.array([-1.0, 0.0, 0.0])
    plain, own = (felt(model, folder, e, left, side) for e in ({}, loose))
    towards = own[0, 650, 0] / plain[0, 650, 0]
    right, other = [(0.04, 0.0, 0.03)], np.array([1.0, 0.0, 0.0])
    plain, own = (felt(model, folder, e, right, other) for e in ({}, loose))
    # pushed away from it the loose half lifts, pushed onto it it is carried
    assert own[0, 650, 0] / plain[0, 650, 0] < towards < 1.0 or towards < 0.995


def test_springs_under_the_base_and_a_compressible_material_are_softer(model, folder):
    plain = felt(model, folder, {})[0, 650, 2]
    k = model.material.young_modulus_pa / 0.04
    springs = {"compliant_base": {"k_normal_pa_per_m": k, "k_tangential_pa_per_m": k / 3}}
    assert felt(model, folder, springs)[0, 650, 2] < 0.97 * plain
    assert felt(model, folder, {"poisson_ratio": {"poisson_ratio": 0.35}})[0, 650, 2] < 0.97 * plain
    assert felt(model, folder, {"finite_strain": {}})[0, 650, 2] < 0.99 * plain


def test_adhesion_that_holds_inside_pulls_all_the_way_out(model, folder):
    keys = {"pull_off_n": 0.1, "range_m": 6e-4}
    plain = felt(model, folder, {})[0, :, 2]
    edge = felt(model, folder, {"adhesion": keys})[0, :, 2]
    inside = felt(model, folder, {"adhesion": {**keys, "inside": 1.0}})[0, :, 2]
    half_way_out = 200 + 500 + 100
    assert edge[half_way_out] == pytest.approx(plain[half_way_out], abs=1e-9)
    assert inside[half_way_out] == pytest.approx(plain[half_way_out] - 0.1, abs=1e-3)
    assert edge.min() == pytest.approx(-0.1, abs=0.01) and inside.min() == pytest.approx(-0.1, abs=0.01)
    assert np.abs(np.diff(inside)).max() < 0.03  # nothing steps


def test_only_what_belongs_into_a_model_is_put_there(model):
    assert [
        n for n in ("force_bias", "time_delay", "surface_shape", "surface_offset") if effect(n).rendered
    ] == []
    better = with_effects(model, {"time_delay": {"delay_s": 0.02}, "friction_slip": {"mu": 0.1}})
    assert list(better.effects) == ["friction_slip"]
    assert with_effects(better, {"adhesion": {"pull_off_n": 0.1, "range_m": 1e-3}}).effects.keys() == {
        "friction_slip", "adhesion",
    }  # fmt: skip


def test_softness_of_the_surface_leaves_balls_out(model):
    lump = {"centre_m": [0.0, 0.0, 0.03], "radius_m": 0.008, "modulus_ratio": 6.0}
    better = with_effects(model, {"inclusion": lump})
    points = np.array([[0.0, 0.0, 0.04], [0.03, 0.0, 0.04]])
    assert surface_softness(better.mesh, better.surface_ratio, points, 0.005) == pytest.approx(1.0)
    assert (surface_softness(better.mesh, better.element_ratio, points, 0.005) < 1).any()
    assert surface_softness(better.mesh, np.full_like(better.element_ratio, 2.0), points, 0.005) == (
        pytest.approx(0.5)
    )


def at_top(model):
    """The places of one press in the middle of the top."""
    return solve_places(model, TOP[None], UP[None], np.stack([UP, *tangents(UP)])[None])


@pytest.mark.slow
@pytest.mark.parametrize("modulus_ratio", [0.5, 2.5])
def test_a_skin_counts_once(model, modulus_ratio):
    """The dent has it: on a wide block the rest is a small share of the dent's own compliance. It was
    felt a second time under the patch, and force by a fitted skin was 18 % more, rendered 28 %."""
    better = with_effects(model, {"skin_layer": {"thickness_m": 0.002, "modulus_ratio": modulus_ratio}})
    plain, skinned = (at_top(m).far[0, 0, 0] for m in (model, better))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(made, "surface_edge", surface_edge)
        patch.setattr(made, "ball_law", ball_law)
        patch.setattr(made, "touch_solver", touch_solver)
        renderer = FemRenderer(better, RenderOptions(snap_to_touches=False))
    near = np.linalg.norm(renderer.parameters.surface.vertices - TOP, axis=1).argmin()
    dent = half_space_compliance(UP, 0.49, contact_width(better.tool.tip_radius_m))[2, 2]
    assert skinned == pytest.approx(plain, abs=0.08 * dent)
    assert UP @ renderer.parameters.far[near] @ UP == pytest.approx(skinned, abs=0.02 * dent)


def test_a_ball_lies_inside_the_object(model):
    places = at_top(model)
    deep = np.array([0.0, 0.0, 0.03, 0.025, np.log(6.0)])
    ball = ball_of(deep, places)
    assert ball.radius_m == pytest.approx(0.01, abs=1e-6), "10 mm below the top"
    asked, held = (first_order(np.array([*deep[:3], r, deep[4]]), places) for r in (0.025, 0.01))
    assert asked.far == pytest.approx(held.far, rel=1e-6)
    assert ball_of(np.array([0.0, 0.0, 0.06, 0.01, 0.5]), places).radius_m < 0.002, "outside there is none"


@pytest.mark.slow
def test_a_ball_that_is_fitted_changes_a_place_as_the_rendered_one_does(model):
    places, ball = at_top(model), Ball((0.0, 0.0, 0.024), 0.01, 6.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(made, "surface_edge", surface_edge)
        patch.setattr(made, "ball_law", ball_law)
        patch.setattr(made, "touch_solver", touch_solver)
        plain, with_ball = (
            surface_compliance(model.mesh, model.material.poisson_ratio, balls=balls)
            for balls in ((), (ball,))
        )
    rows = [np.linalg.norm(table.own_points - TOP, axis=1).argmin() for table in (plain, with_ball)]
    own = [table.own[row] for table, row in zip((plain, with_ball), rows, strict=True)]
    rendered = float(UP @ (own[1] - own[0]) @ UP)
    change, bracing = solved_change(ball, places)
    assert change[0] == pytest.approx(rendered, rel=0.1)
    assert bracing[0] == pytest.approx(with_ball.own_bracing[rows[1]], rel=0.1) and bracing[0] < -20


@pytest.mark.slow
@pytest.mark.parametrize(
    "ball",
    [(0.0, 0.0, 0.024, 0.010, 6.0), (0.0, 0.0, 0.018, 0.010, 15.0), (0.006, 0.0, 0.026, 0.007, 0.3)],
)
def test_first_order_knows_a_ball_by_how_much_it_matters_under_a_contact(model, ball):
    """By the energies of elements of 20 mm alone a ball 6 mm below a tip changed it by half as much."""
    places = at_top(model)
    first = first_order(np.array([*ball[:4], np.log(ball[4])]), places)
    change, bracing = solved_change(Ball(ball[:3], *ball[3:]), places)
    print(first.far[0, 0, 0] / change[0], first.bracing[0] / bracing[0])
    assert 0.7 < first.far[0, 0, 0] / change[0] < 1.4
    assert 0.6 < first.bracing[0] / bracing[0] < 1.6


class Named:
    """A diagnosis that asserts a ball and a tip that slips, and nothing of how they were found."""

    def __init__(self, model, ball):
        found = {"inclusion": ball, "friction_slip": {"mu": 0.2}}
        self.effects, self.attribution = tuple(found), None
        self.entries = tuple(SimpleNamespace(name=name, parameters=keys) for name, keys in found.items())
        self.young_modulus_pa = model.material.young_modulus_pa


def test_the_improved_modulus_has_an_interval_that_holds_the_truth(bench):
    recording, given = bench.record()
    better = improved(given, diagnose(recording, given, DiagnoseOptions(fast=True, bootstrap=20)))[0]
    for each in (better, with_replayed_modulus(better, recording)):
        low, high = each.material.young_modulus_ci95_pa
        assert low < each.material.young_modulus_pa < high
    low, high = better.material.young_modulus_ci95_pa
    assert low < 20e3 < high < 1.5 * low


@pytest.mark.parametrize(("gap_n", "kept"), [(0.03, True), (0.28, False)])
def test_what_makes_the_replayed_force_worse_is_left_out(bench, model, monkeypatch, gap_n, kept):
    """A ball whose rendered force is farther off than the one without it is no improvement."""
    ball = {"centre_m": [0.012, 0.0, 0.026], "radius_m": 0.011, "modulus_ratio": 6.0}
    replayed = {True: gap_n, False: 0.05}
    monkeypatch.setattr("palpate.diagnosis.apply.with_replayed_modulus", lambda model, recording: model)
    monkeypatch.setattr(
        "palpate.diagnosis.apply.replayed_gap",
        lambda model, recording: (replayed["inclusion" in model.effects], 3),
    )
    found = improvement(model, Named(model, ball), bench.record()[0])
    assert ("inclusion" in found.model.effects) == kept and "friction_slip" in found.model.effects
    assert found.left_out == (() if kept else ("inclusion",))
    assert (found.given_n, found.improved_n) == (0.05, min(gap_n, 0.05))
    assert found.unsettled == 6 and found.samples > 6
