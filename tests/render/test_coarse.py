"""A table of which some places are solved: near the whole one, the very same where all is solved, never a
jump."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.compliance import stored_compliance
from palpate.mechanics.compliance.coarse_table import CoarseCompliance, first_places
from palpate.mechanics.compliance.on_demand import OnDemandCompliance
from palpate.mechanics.compliance.stored_compliance import (
    kept_places,
    load_coarse,
    load_or_condense,
    load_or_solve,
)
from palpate.mechanics.errors import MeshError
from palpate.mechanics.law_errors import Bound
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.shape.refine import typical_edge
from palpate.render.fem.held_tips import BLEND_S
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import coarse_error
from palpate.render.options import RenderOptions
from palpate.render.press import Stroke, press
from palpate.render.registry import create

from . import shapes

SIZE = (0.05, 0.05, 0.025)
OPTIONS = RenderOptions(friction=0.5)


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> Model:
    made = shapes.model(shapes.block(SIZE, (3, 3, 2)))
    return read_model(write_model(tmp_path_factory.mktemp("coarse") / "block", made))


@pytest.fixture(scope="module")
def coarse(model) -> FemRenderer:
    """Only the first places are solved."""
    solved = load_or_solve(model)
    assert isinstance(solved, OnDemandCompliance)
    assert load_coarse(model) is None
    with pytest.raises(MeshError):
        CoarseCompliance(solved)
    solved.solve(first_places(solved.own_points))
    made = create("fem", read_model(model.path), OPTIONS, coarse=True)
    assert made.coarse and made.compliance.solved_share < 0.4
    return made


@pytest.fixture(scope="module")
def whole(model) -> FemRenderer:
    return FemRenderer(model, OPTIONS, compliance=load_or_condense(model.replaced(path=None)))


def test_its_force_is_within_what_it_states(coarse, whole):
    error, depth = coarse_error(coarse.model, coarse.compliance, OPTIONS)
    random = np.random.default_rng(3)
    missed, felt = [], []
    for x, y in random.uniform(-0.022, 0.022, (24, 2)):
        one, other = (press(r, [x, y, SIZE[2]], [0, 0, -1], Stroke(depth, 0.05)) for r in (coarse, whole))
        missed.append(np.linalg.norm(one.force - other.force, axis=1).max())
        felt.append(other.peak_force_n)
    # the narrower the patch of a place, the faster its own compliance falls off towards a rim
    assert np.quantile(missed, 0.9) < error < 0.25 * np.median(felt)
    assert error > 1e-5


def test_a_table_by_elements_that_are_not_halved_serves_until_there_is_one_by_halved_ones(
    model, whole, monkeypatch
):
    """What was begun with the one goes on with the other."""
    monkeypatch.setattr(stored_compliance, "LARGE", 0)
    monkeypatch.setattr(stored_compliance, "surface_edge", lambda mesh: 0.9 * typical_edge(mesh))
    alone = read_model(write_model(model.path.parent / "alone", model))
    assert stored_compliance.own_places(alone, kept=True) is None and load_coarse(alone) is None
    own = stored_compliance.own_places(alone)
    own.solve(first_places(own.own_points))
    rough = create("fem", alone, OPTIONS, coarse=True)
    assert rough.coarse and rough.compliance.rough == Bound.rough.value
    stated = coarse_error(alone, rough.compliance, OPTIONS)[0]
    own.rough = 0.0
    assert stated > coarse_error(alone, CoarseCompliance(own), OPTIONS)[0]
    far = rough.field_of(whole.compliance)[0]
    assert np.array_equal(far, whole.parameters.far)
    halved = load_or_solve(alone)
    halved.solve(first_places(halved.own_points))
    assert create("fem", alone, OPTIONS, coarse=True).compliance.rough == 0.0


@pytest.mark.slow
def test_elements_that_are_not_halved_tell_of_narrow_patches(tmp_path, monkeypatch):
    """Two wide patches, drawn out to the usual one, give halved elements' far field to 5 % of a force."""
    monkeypatch.setattr(stored_compliance, "LARGE", 0)
    size = (0.05, 0.05, 0.025)
    model = read_model(write_model(tmp_path / "block", shapes.model(shapes.block(size, (8, 8, 4)))))
    own, halved = stored_compliance.own_places(model), load_or_solve(model)
    at = np.array([[x, y, size[2]] for x in (0.0, 0.008, 0.016) for y in (0.0, 0.013)])
    up = np.tile([0.0, 0.0, 1.0], (len(at), 1))
    told, solved = (each.far_at(at, up)[:, 2, 2] for each in (own, halved))
    dent = model.tool.tip_radius_m**-1 / (2 * np.sqrt(0.6)) * (1 - model.material.poisson_ratio**2)
    assert np.abs(told - solved).max() < 0.05 * (1.5 * dent + solved.min())


@pytest.mark.slow
def test_its_error_shrinks_to_none_as_places_are_solved(coarse, model, whole):
    """And all of them make the condensed object's own numbers, without solving one twice."""
    solved = kept_places(model)
    errors = [coarse_error(model, coarse.compliance, OPTIONS)[0]]
    near = np.argsort(np.linalg.norm(solved.own_points - [0.0, 0.0, SIZE[2]], axis=1))
    for share in (0.7, 1.0):  # half of them, all at one place, tell the others hardly more
        solved.solve(near[: int(share * len(near))])
        table = CoarseCompliance(solved)
        errors.append(coarse_error(model, table, OPTIONS)[0])
        # where all around is solved, a place is that of the whole table already
        same = (coarse.field_of(table)[0] == whole.parameters.far).all(axis=(1, 2))
        assert 0.2 * share < same.mean() <= share + 0.1
    assert errors[0] > errors[1] > errors[2] == 0.0
    assert same.all()
    solved._make_fine = None  # it would be called
    made, other = load_or_condense(model).arrays(), load_or_condense(model.replaced(path=None)).arrays()
    assert all(np.array_equal(made[name], other[name]) for name in made)


def test_a_touch_that_goes_on_comes_to_another_table_without_a_jump(coarse, whole):
    """The tip rests; the force leaves the one table's for the other's in 50 ms, by no more a tick than a
    share of the difference."""
    half = whole.with_field(0.5 * whole.parameters.far)
    tip = np.array([[0.004, 0.003, SIZE[2] + 0.002]])
    path = np.repeat(tip[None], 60, axis=0)
    path[:30, 0, 2] = np.linspace(SIZE[2] + 0.006, tip[0, 2], 30)
    steps = np.full(len(path), 1e-3)
    state = whole.start()
    before = whole.follow(state, path, steps)[-1, 0].copy()
    ticks = int(BLEND_S / 1e-3)
    forces = np.array([half.step(state, tip)[1][0].copy() for _ in range(2 * ticks)])
    lone = half.start()
    after = half.follow(lone, path, steps)[-1, 0]
    whole_way = np.linalg.norm(after - before)
    assert whole_way > 0.02 * np.linalg.norm(before)
    each = np.linalg.norm(np.diff(np.vstack([before[None], forces]), axis=0), axis=1)
    assert each.max() < 2.5 * whole_way / ticks
    assert np.linalg.norm(forces[-1] - after) < 0.05 * whole_way  # it sticks by its own way there
    assert np.allclose(forces[ticks + 1 :], forces[-1], rtol=1e-9)
    # a state that begins with a table has left none
    assert lone.before[0] == 0.0


def test_several_tips_have_the_whole_table(coarse, whole, model):
    made = create("fem", model.replaced(path=None), OPTIONS, coarse=True)
    assert not made.coarse
    two = FemRenderer(model, OPTIONS, compliance=CoarseCompliance(kept_places(model)))
    state = two.start([0.005, 0.005])
    assert not two.coarse and np.array_equal(two.parameters.far, whole.parameters.far)
    assert len(state.forces) == 2
