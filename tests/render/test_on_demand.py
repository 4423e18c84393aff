"""Places solved where a tip comes: the very forces of the condensed object, and nothing unsolved is felt."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.compliance.on_demand import OnDemandCompliance
from palpate.mechanics.compliance.stored_compliance import load_or_condense, load_or_solve
from palpate.mechanics.disk.store import read_arrays
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.material import Ball
from palpate.mechanics.model.model import Model
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import force_errors
from palpate.render.options import RenderOptions
from palpate.render.press import Stroke, press
from palpate.render.registry import create
from palpate.render.surface.felt_surface import with_own_stiffness

from . import shapes

BALL = Ball((0.004, 0.0, 0.012), 0.005, 4.0)


def _model(folder, cells=(3, 3, 2), **material) -> Model:
    made = shapes.model(shapes.block((0.05, 0.05, 0.025), cells))
    made = made.with_material(**material) if material else made
    return read_model(write_model(folder, made))


def _slide(radius: float) -> np.ndarray:
    """(n, 1, 3) m: down onto the top, 15 mm along it, and off again."""
    z = 0.025 + radius + np.concatenate([np.linspace(1e-3, -1.5e-3, 60), np.full(200, -1.5e-3)])
    x = np.concatenate([np.full(60, -8e-3), np.linspace(-8e-3, 7e-3, 200)])
    down = np.column_stack([x, np.full(260, 1e-3), z])
    return np.vstack([down, down[-1] + np.linspace(0, 6e-3, 40)[:, None] * [0, 0, 1]])[:, None]


def _both(model: Model, friction: float) -> tuple[FemRenderer, FemRenderer]:
    """One that solves on demand, and one condensed."""
    options = RenderOptions(friction=friction)
    lazy = create("fem", model, options, on_demand=True)
    assert isinstance(lazy.compliance, OnDemandCompliance)
    return lazy, FemRenderer(model, options, compliance=load_or_condense(model.replaced(path=None)))


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.3, np.inf])
@pytest.mark.parametrize("tip_m", [0.005, 0.002])
def test_a_slide_feels_to_the_bit_as_on_the_condensed_object(tmp_path, friction, tip_m):
    lazy, whole = _both(_model(tmp_path / "block"), friction)
    path, steps = _slide(tip_m), np.full(300, 1e-3)
    state = lazy.start([tip_m])
    felt = lazy.follow(state, path, steps)
    assert np.array_equal(felt, whole.follow(whole.start([tip_m]), path, steps))
    assert np.abs(felt).max() > 0.05
    # far from all is solved, and what is not is marked so
    solved = ~np.isnan(lazy.parameters.far[:, 0, 0])
    assert 0 < (~solved).sum()
    assert np.array_equal(lazy.parameters.far[solved], whole.parameters.far[solved])
    # tick by tick, and again from the file
    again = create("fem", read_model(lazy.model.path), lazy.options, on_demand=True)
    state = again.start([tip_m])
    ticks = [again.step(state, tip)[1].copy() for tip in path]
    assert np.array_equal(ticks, felt)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["ball", "gradient", "springs", "fine"])
def test_a_press_is_the_same_before_and_after_condensing(tmp_path, case):
    material = {}
    if case == "ball":
        material = {"inclusions": {"ball": BALL}}
    model = _model(tmp_path / "block", (9, 9, 5) if case == "fine" else (3, 3, 2), **material)
    if case == "gradient":
        height = model.mesh.points[model.mesh.tetrahedra[:, :4]].mean(axis=1)[:, 2]
        model = model.with_material(field=1 + 20 * height)
    if case == "springs":
        springs = {"k_normal_pa_per_m": 2e6, "k_tangential_pa_per_m": 1e6}
        model = model.replaced(effects={"compliant_base": springs})
    lazy, whole = _both(model, 0.5)
    aims = [
        ([0.0, 0.0, 0.025], [0, 0, -1]),
        ([0.01, -0.02, 0.025], [0.2, 0.1, -1]),
        ([0, 0, 0.012], [-1, 0, 0]),
    ]
    for at, way in aims:
        one, other = (press(r, at, way, Stroke(2e-3, 0.05)) for r in (lazy, whole))
        assert one.peak_force_n > 0.01
        assert np.array_equal(one.force, other.force)
        assert one.error_figures == other.error_figures


@pytest.fixture
def lazy(tmp_path) -> FemRenderer:
    """Nothing of it is solved yet."""
    return create("fem", _model(tmp_path / "block"), RenderOptions(), on_demand=True)


def test_a_place_that_is_not_solved_is_never_felt(lazy, monkeypatch):
    """The kernel by itself says where it would have read what nobody solved."""
    path, steps = _slide(0.005), np.full(300, 1e-3)
    state = lazy.start()
    for tip in path[:100]:
        lazy.kernel(lazy.parameters, state, np.ascontiguousarray(tip))
    assert state.unsolved.any()
    assert np.isnan(lazy.parameters.far[state.unsolved > 0, 0, 0]).all()
    state = lazy.start()
    lazy.follow(state, path, steps)
    assert not state.unsolved.any()


def test_what_is_solved_is_kept_and_added_to(lazy):
    """Another place adds to the file; a third process solves nothing."""
    model = lazy.model
    press(lazy, [0, 0, 0.025], [0, 0, -1], Stroke(1e-3, 0.05))
    (file,) = model.path.glob("places-*.bin")
    key = lazy.compliance._key

    def solved() -> int:
        return int(np.isfinite(read_arrays(file, key)["own"][:, 0, 0]).sum())

    first = solved()
    other = create("fem", read_model(model.path), on_demand=True)
    press(other, [0.015, 0.015, 0.025], [0, 0, -1], Stroke(1e-3, 0.05))
    both = solved()
    assert first < both < len(lazy.compliance.own)
    third = create("fem", read_model(model.path), on_demand=True)
    third.compliance._make_fine = None  # it would be called
    from palpate.mechanics.compliance import on_demand

    on_demand._last.clear()
    for x in (0.0, 0.015):
        press(third, [x, x, 0.025], [0, 0, -1], Stroke(1e-3, 0.05))
    file.write_bytes(b"damaged")
    damaged = create("fem", read_model(model.path), on_demand=True)
    assert np.isnan(damaged.compliance.own).all()


def test_several_tips_and_a_free_hand_have_the_whole_object(lazy):
    assert with_own_stiffness(lazy).stiffness_from == ""
    assert not list(lazy.model.path.glob("compliance-*"))
    state = lazy.start([0.005, 0.005])
    assert not isinstance(lazy.compliance, OnDemandCompliance)
    tips = np.array([[-0.01, 0.0, 0.032], [0.01, 0.0, 0.032]])
    whole = FemRenderer(lazy.model, lazy.options)
    other = whole.start([0.005, 0.005])
    for _ in range(40):
        tips[:, 2] -= 1e-4
        assert np.array_equal(lazy.step(state, tips)[1], whole.step(other, tips)[1])
    assert np.abs(state.forces).max() > 0.01
    # where all is condensed, it is read
    assert not isinstance(load_or_solve(lazy.model), OnDemandCompliance)


def test_its_errors_are_those_of_solved_places(lazy):
    """Also where the tip's centre is nearest to a vertex that no tick has read."""
    position = np.array([[0.012, 0.004, 0.029], [-0.03, 0.0, 0.012]])
    force = np.array([[0, 0, 0.2], [-0.1, 0, 0.0]])
    errors = force_errors(lazy, position, force, 0.005)
    assert np.isfinite(errors.law_n).all() and (errors.law_n > 0).all()


def test_the_drawn_displacement_is_that_of_the_condensed_object(lazy):
    """Far from the tip; the table between places has single precision."""
    curve = press(lazy, [0.003, 0.002, 0.025], [0, 0, -1], Stroke(1e-3, 0.05))
    whole = FemRenderer(lazy.model, lazy.options)
    i = curve.deepest
    given = (curve.position[i : i + 1] - [[0, 0, 0.005]], curve.force[i : i + 1])
    one, other = (r._smooth_displacement(*given) for r in (lazy, whole))
    assert np.abs(other).max() > 1e-5
    assert np.allclose(one, other, atol=1e-4 * np.abs(other).max())
