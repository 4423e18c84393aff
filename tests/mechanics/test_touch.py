"""The touch law: shared compliance, stick along a path, unilateral, no energy made."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.contact.touch import (
    STATE_SIZE,
    TouchedPlaces,
    moduli,
    touch_force,
    touch_forces,
    touch_solve,
    touch_step,
)
from palpate.mechanics.frames import local_frames, support_axes, tangents

from .closed_forms import bonded_punch_sideways_force, hertz_force

E, NU, R = 29e3, 0.49, 5e-3
UP = np.array([0.0, 0.0, 1.0])
NONE = np.zeros((3, 3))
KNOWN = {"young_modulus_pa": E, "poisson_ratio": NU, "tip_radius_m": R}


def path(*corners, steps=200):
    """Straight pieces between corners (k, 3)."""
    pieces = [np.linspace(a, b, steps, endpoint=False) for a, b in zip(corners, corners[1:], strict=False)]
    return np.vstack([*pieces, np.array(corners[-1:])])


def test_rigid_far_field_leaves_the_dent_alone():
    depth = np.linspace(0, 2e-3, 20)
    force = touch_force(-depth[:, None] * UP, UP, NONE, law="hertz", **KNOWN)
    assert force[:, 2] == pytest.approx(hertz_force(depth, R, E, NU), rel=1e-9)
    assert np.abs(force[:, :2]).max() == 0


def test_give_of_the_object_adds_to_the_dent():
    far = np.diag([40.0, 40.0, 60.0])
    depth = 3e-3
    force = touch_force(np.array([[0, 0, -depth]]), UP, far, law="sphere", **KNOWN)[0, 2]
    dent = depth - 60.0 / E * force
    assert dent_law("sphere").force(np.array([dent]), E, NU, R)[0] == pytest.approx(force, rel=1e-8)


@pytest.mark.parametrize("slope, known", [(0.1, (0.7238, 0.7421, 0.7588)), (0.35, (0.7497, 0.7632, 0.7815))])
def test_the_deeper_an_oblique_press_the_more_it_is_pushed_back_sideways(slope, known):
    """Sideways over normal force and slope at 2, 3 and 5 mm: the virtual laboratory's block, 105 mm wide and
    47 high, finest element 1.3 mm, which wavers by 3 %. Rings that hold stiffen as the dent deepens: without
    that 4 to 7 % less.
    """
    depth = np.linspace(0, 8e-3, 401)
    far = np.array([[2.52, 0.03, -0.26], [0.03, 2.52, -0.32], [-0.26, -0.32, -7.59]])
    d = np.column_stack([slope * depth, 0 * depth, -depth])
    force = touch_force(d, UP, far, law="neo-hookean", **KNOWN)[[100, 150, 250]]
    assert -force[:, 0] / force[:, 2] / slope == pytest.approx(known, rel=0.03)


def test_force_is_on_the_tool_and_turns_with_the_frame():
    rng = np.random.default_rng(0)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    far = np.array([[30.0, 2.0, 1.0], [2.0, 35.0, -3.0], [1.0, -3.0, 60.0]])
    d = path([0, 0, 0], [0.3e-3, 0, -3e-3], [1e-3, 0.5e-3, -2e-3])
    plain = touch_force(d, UP, far, **KNOWN)
    turned = touch_force(d @ turn.T, turn @ UP, turn @ far @ turn.T, **KNOWN)
    assert plain[150, 2] > 0  # pushed out
    assert turned @ turn == pytest.approx(plain, abs=1e-9)


def test_no_touch_no_force_and_no_pull():
    d = path([0, 0, 1e-3], [0, 0, -2e-3], [0, 0, 1e-3])
    force = touch_force(d, UP, np.diag([30.0, 30.0, 50.0]), **KNOWN)
    assert (force[d[:, 2] >= 0] == 0).all()
    assert (force[:, 2] >= 0).all()


def test_sideways_after_a_press_is_mindlins_stick():
    press, shift = 1e-3, 1e-5
    d = path([0, 0, 0], [0, 0, -press], [shift, 0, -press])
    force = touch_force(d, UP, NONE, law="hertz", **KNOWN)
    a = np.sqrt(R * press)
    assert force[-1, 0] == pytest.approx(-bonded_punch_sideways_force(shift, a, E, NU), rel=1e-6)
    assert force[-1, 2] == pytest.approx(force[200, 2])


def test_oblique_press_has_less_shear_than_press_then_shift():
    """Rings that touch later have been carried less: the exponent of a in the integral gives 2/3."""
    end = [1e-4, 0, -1e-3]
    oblique = touch_force(path([0, 0, 0], end, steps=4000), UP, NONE, law="hertz", **KNOWN)[-1, 0]
    after = touch_force(path([0, 0, 0], [0, 0, -1e-3], end), UP, NONE, law="hertz", **KNOWN)[-1, 0]
    assert oblique / after == pytest.approx(2 / 3, rel=0.01)


def test_path_back_brings_everything_back():
    far = np.diag([30.0, 30.0, 50.0])
    there = [[0, 0, 0], [0, 0, -2e-3], [0.4e-3, -0.2e-3, -2e-3]]
    d = path(*there, *there[-2::-1])
    force = touch_force(d, UP, far, **KNOWN)
    assert force[:401] == pytest.approx(force[::-1][:401], abs=2e-6)


def test_a_closed_loop_makes_no_energy():
    """Press, shift, lift half way, shift back: the work on the tool over a loop is not positive."""
    far = np.diag([30.0, 30.0, 50.0])
    corners = [[0, 0, 0], [0, 0, -3e-3], [1e-3, 0, -3e-3], [1e-3, 0, -1e-3], [0, 0, -1e-3], [0, 0, 0]]
    for loop in (corners, corners[::-1]):
        d = path(*loop, steps=2000)
        force = touch_force(d, UP, far, **KNOWN)
        work = (0.5 * (force[1:] + force[:-1]) * np.diff(d, axis=0)).sum()
        stored = np.abs((force[1:] * np.diff(d, axis=0)).sum(axis=1)).sum()
        assert work < 2e-3 * stored


@pytest.mark.parametrize("law", ["linear", "neo-hookean"])
@pytest.mark.parametrize("far", [NONE, np.diag([30.0, 30.0, 50.0])])
def test_a_loop_that_stretches_shallow_and_lets_go_deep_costs_as_much_as_its_way_back(law, far):
    """What is lost is what rings hold that let go, the same both ways round; rings that stiffen as the dent
    deepens give it back to the normal force."""
    shallow, deep, aside = -1e-3, -5e-3, 0.7e-3
    corners = [[0, 0, 0], [0, 0, shallow], [aside, 0, shallow], [aside, 0, deep], [0, 0, deep], [0, 0, 0]]
    works = []
    for loop in (corners, corners[::-1]):
        d = path(*loop, steps=4000)
        force = touch_force(d, UP, far, law=law, **KNOWN)
        pieces = (0.5 * (force[1:] + force[:-1]) * np.diff(d, axis=0)).sum(axis=1)
        works.append(pieces.sum())
    assert works[0] < 0
    assert works[0] == pytest.approx(works[1], abs=1e-5 * np.abs(pieces).sum())


def test_a_tip_that_holds_still_feels_one_force():
    """What its rings hold pushes it out: guessed at none, that shut out the dent at which the tip stood, and
    each step halved its way back there."""
    far = np.array([[30.0, 0.0, 5.0], [0.0, 30.0, 0.0], [5.0, 0.0, 50.0]])
    still = [1e-3, 0, -3e-3]
    d = np.vstack([path([0, 0, 0], still), np.tile(still, (50, 1))])
    held = touch_force(d, UP, far, law="neo-hookean", **KNOWN)[-51:]
    assert np.abs(held - held[0]).max() < 1e-11 * np.abs(held).max()


def test_the_sampling_of_a_path_hardly_matters():
    far = np.diag([30.0, 30.0, 50.0])
    corners = ([0, 0, 0], [0.5e-3, 0, -4e-3], [1e-3, 0.5e-3, -2e-3])
    coarse = touch_force(path(*corners, steps=60), UP, far, **KNOWN)
    fine = touch_force(path(*corners, steps=6000), UP, far, **KNOWN)[::100]
    assert np.abs(coarse - fine).max() < 3e-3


def test_many_touches_at_once_equal_one_by_one():
    rng = np.random.default_rng(2)
    paths = [path([0, 0, 0], -1e-3 * rng.uniform(0.5, 4, 3), steps=n) for n in (30, 70, 50)]
    normals = np.array([UP, [1.0, 0, 0], [0, 0.6, 0.8]])
    fars = np.array([np.eye(3) * k for k in (20.0, 50.0, -8.0)])
    starts = np.concatenate([[0], np.cumsum([len(p) for p in paths])])
    bent = np.array([0.0, 20.0, 10.0])
    together = touch_forces(np.vstack(paths), starts, TouchedPlaces(normals, fars, bent), **KNOWN)
    for k, p in enumerate(paths):
        alone = touch_force(p, normals[k], fars[k], curvature=bent[k], **KNOWN)
        assert np.array_equal(together[starts[k] : starts[k + 1]], alone)


@pytest.mark.parametrize("radius", [2e-3, 5e-3, 20e-3])
def test_any_displacement_gives_a_finite_force(radius):
    rng = np.random.default_rng(4)
    table = dent_law("neo-hookean").table
    plane_strain, stick = moduli(E, NU)
    state = np.zeros(STATE_SIZE)
    far = np.diag([-20.0, -25.0, -25.0]) / E  # a rigid support close below
    for _ in range(3000):
        d = rng.normal(scale=6e-3, size=3)
        force = np.array(touch_step(state, d, far, table, radius, 0.1, plane_strain, stick))
        assert np.isfinite(force).all()
        assert np.linalg.norm(force) < 1e3
        assert force[0] >= 0


def test_local_frame_is_right_handed_and_its_normal_first():
    normal = np.array([0.0, 0.6, 0.8])
    frame, axes = local_frames(normal)[0], support_axes(3 * normal)
    for rows in (frame, axes):
        assert rows @ rows.T == pytest.approx(np.eye(3), abs=1e-15)
        assert np.linalg.det(rows) == pytest.approx(1.0)
    assert np.array_equal(frame[0], normal) and axes[2] == pytest.approx(normal, abs=1e-15)
    assert np.array_equal(frame[1:], tangents(normal))
    assert axes[:2] == pytest.approx(frame[1:], abs=1e-15)


@pytest.mark.parametrize("bend", [0.3, 0.95, 0.999])
def test_a_body_that_gives_along_itself_as_it_bends_has_one_force_whatever_was_tried_before(bend):
    # of the tip of a tentacle: most of what it gives along its axis is coupled to what it gives across
    cnn, czz = 100.0, 20.0
    far = np.array([[cnn, 0.0, bend * np.sqrt(cnn * czz)], [0, cnn, 0], [bend * np.sqrt(cnn * czz), 0, czz]])
    turned = np.array([[1.0, 0, 0], [0, np.sqrt(0.5), -np.sqrt(0.5)], [0, np.sqrt(0.5), np.sqrt(0.5)]])
    table, moduli_pa = dent_law("linear", 0.49).table, moduli(5e3, 0.49)
    d = np.array([-2e-3, 0.0, 1e-4])
    forces = []
    for frame in (np.eye(3), turned):
        for tried in (0.0, 1e-6, 1e-4, 2e-3):
            state = np.zeros(STATE_SIZE)
            state[1] = tried
            fn, fu, fv = touch_solve(state, frame @ d, frame @ far @ frame.T, table, 0.005, 0.0, *moduli_pa)[
                :3
            ]
            forces.append(frame.T @ [fn, fu, fv])
    assert np.ptp(forces, axis=0) == pytest.approx(0.0, abs=1e-6 * np.abs(forces).max())


def test_a_body_that_bends_towards_a_tip_that_sticks_holds_it_beyond_its_own_plane():
    # of a tentacle, pushed along its axis: its end has turned and stays in touch as the tip is drawn up
    far = np.array([[36.2, 0.0, -56.0], [0.0, 123.4, 0.0], [-56.0, 0.0, 87.5]])
    table, (plane_strain, stick) = dent_law("linear", 0.49).table, moduli(5e3, 0.49)
    d = path([0, 0, 0], [-1e-3, 0, 0], [-1e-3, 0, -3e-3], [3e-3, 0, -3e-3], steps=2000)
    state = np.zeros(STATE_SIZE)
    force = np.array([touch_step(state, x, far, table, R, 0.0, plane_strain, stick) for x in d])
    assert force[d[:, 0] < 0][-1, 0] > 3e-3
    assert not force[-1].any()
    way = np.linalg.norm(np.diff(d, axis=0), axis=1)
    change = np.linalg.norm(np.diff(force, axis=0), axis=1)
    assert (change < 4 * plane_strain * R * way).all()  # twice the dent's stiffness, as wide as the tip
