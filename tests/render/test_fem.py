"""The finite-element renderer against physics: Hertz, symmetry, energy, friction, sliding, pinching."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import touch_sites
from palpate.mechanics.contact.touch import touch_force
from palpate.mechanics.elastic.solver import Solver
from palpate.render.fem.renderer import FemRenderer

TIP = 0.005


def run(renderer, path, radii=(TIP,), dt=1e-3):
    """Forces (n, m, 3) along a path (n, 3) or (n, m, 3), and the last state."""
    path = np.ascontiguousarray(path if np.ndim(path) == 3 else np.asarray(path)[:, None])
    state = renderer.start(radii, dt)
    return renderer.follow(state, path, np.full(len(path), dt)), state


def down(at, depth, steps=200, normal=(0.0, 0.0, 1.0), lift=5e-4):
    """Path of the tip's centre from `lift` above touch to `depth` below, at the surface point `at`."""
    n = np.asarray(normal)
    return np.asarray(at) + (TIP - np.linspace(-lift, depth, steps))[:, None] * n


def test_a_shallow_press_follows_hertz(block_renderer):
    depths = np.array([5e-5, 1e-4, 2e-4])
    path = np.concatenate([[[0, 0, 0.08 + TIP + 1e-3]], [[0, 0, 0.08 + TIP - d] for d in depths]])
    force = run(block_renderer, path)[0][1:, 0, 2]
    hertz = 4 / 3 * 30e3 / (1 - 0.49**2) * np.sqrt(TIP) * depths**1.5
    assert force == pytest.approx(hertz, rel=0.04)
    assert np.diff(np.log(force)) / np.diff(np.log(depths)) == pytest.approx(1.5, abs=0.03)


def test_it_renders_the_law_that_reconstruction_fits(cylinder_renderer):
    model = cylinder_renderer.model
    oblique = down((0.01, 0.005, 0.08), 6e-3) + np.linspace(0, 1, 200)[:, None] * [1e-3, -5e-4, 0]
    force, state = run(cylinder_renderer, oblique)
    first = int(np.argmax(np.abs(force[:, 0]).max(axis=1) > 0))
    solver = Solver(model.mesh, 0.49)
    site = touch_sites(model.mesh, state.points, state.normals, 0.49, solver=solver)
    start = state.points[0] + TIP * state.normals[0]
    expected = touch_force(
        oblique[first:] - start, site.normals[0], site.far[0], young_modulus_pa=29e3, poisson_ratio=0.49,
        tip_radius_m=TIP, curvature=site.curvature[0], law="linear",
    )  # fmt: skip
    assert np.abs(force[first:, 0] - expected).max() < 0.02 * np.abs(expected).max()


def test_mirrored_presses_give_mirrored_forces(block_renderer):
    # the mesh's diagonals are not symmetric, so the mirror image agrees to the mesh's error
    a = run(block_renderer, down((0.02, 0.01, 0.08), 4e-3))[0][-1, 0]
    b = run(block_renderer, down((-0.02, 0.01, 0.08), 4e-3))[0][-1, 0]
    assert b == pytest.approx(a * [-1, 1, 1], abs=0.02 * a[2])


def test_force_is_zero_in_free_air_and_after_leaving(cylinder_renderer):
    out = np.linspace(0.0, 2 * np.pi, 300)
    circle = np.stack([0.046 * np.cos(out), 0.046 * np.sin(out), np.full(300, 0.04)], axis=1)
    assert not run(cylinder_renderer, circle)[0].any()
    press = down((0, 0, 0.08), 3e-3)
    force, state = run(cylinder_renderer, np.concatenate([press, press[::-1]]))
    assert force[150, 0, 2] > 0.1
    assert not force[-20:].any() and not state.touching.any() and state.stiffness[0] == 0


@pytest.mark.parametrize("direction", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0.6, -0.8, 0), (0, 0, 1)])
def test_the_object_is_felt_from_every_side_and_again(cylinder_renderer, direction):
    n = np.asarray(direction, dtype=float)
    surface = np.array([0, 0, 0.04]) + 0.04 * n
    once = np.concatenate([down(surface, 2e-3, normal=n), down(surface, 2e-3, normal=n)[::-1]])
    force = run(cylinder_renderer, np.concatenate([once, once]))[0][:, 0] @ n
    assert force[199] > 0.2 and force[400] == 0
    assert force[599] == pytest.approx(force[199], rel=1e-3)


def test_a_press_and_its_return_conserve_energy(cylinder_renderer):
    oblique = down((0.01, 0, 0.08), 5e-3, 400) + np.linspace(0, 1, 400)[:, None] * [1e-3, 0, 0]
    path = np.concatenate([oblique, oblique[::-1]])
    force = run(cylinder_renderer, path)[0][:, 0]
    work = ((force[1:] + force[:-1]) / 2 * np.diff(path, axis=0)).sum(axis=1)
    assert abs(work.sum()) < 0.01 * np.abs(work).sum() / 2


def loop(rng) -> np.ndarray:
    """(n, 3) m, a drawn path of the tip's centre over the cylinder's top, back to its start in the air."""
    corners = np.array([0.005, 0.0, 0.08 + TIP]) + rng.uniform(-1, 1, (4, 3)) * [2e-3, 2e-3, 4e-3]
    corners = np.vstack([[0.005, 0.0, 0.0865], corners, [0.005, 0.0, 0.0865]])
    legs = zip(corners[:-1], corners[1:], strict=True)
    return np.concatenate([np.linspace(a, b, 300) for a, b in legs])


def test_no_closed_loop_gives_energy_to_the_hand(cylinder_renderer):
    rng = np.random.default_rng(3)
    for mu in (np.inf, 0.4):
        renderer = cylinder_renderer.with_friction(mu)
        for _ in range(4):
            path = loop(rng)
            force = run(renderer, path)[0][:, 0]
            given = ((force[1:] + force[:-1]) / 2 * np.diff(path, axis=0)).sum()
            assert given < 2e-6


def test_a_frictionless_loop_on_a_flat_face_gives_what_the_compliance_changes_by(cylinder_renderer):
    """The force is normal: it lacks F^2 grad C / 2 along the surface, so a loop gives -1/2 the integral of
    F^2 dC, some microjoules, and nothing besides."""
    rng, renderer = np.random.default_rng(3), cylinder_renderer.with_friction(0.0)
    p, triangles = renderer.parameters, renderer.contact.arrays.triangles
    all_given, all_told = [], []
    for _ in range(6):
        path = loop(rng)
        state, force = renderer.start(), np.zeros((len(path), 3))
        gives = np.full(len(path), np.nan)
        for k, tip in enumerate(path):
            force[k] = renderer.step(state, tip[None].copy())[1][0]
            if state.touching[0]:
                corners, n = triangles[state.grip.triangle[0]], state.normals[0]
                far = np.einsum("c,cab->ab", state.grip.weights[0], p.far[corners])
                gives[k] = n @ far @ n / p.young_modulus_pa[0]
        squared = (force**2).sum(axis=1)
        all_given.append(((force[1:] + force[:-1]) / 2 * np.diff(path, axis=0)).sum())
        all_told.append(-np.nansum((squared[1:] + squared[:-1]) / 4 * np.diff(gives)))
    np.testing.assert_allclose(all_given, all_told, atol=1e-7)
    assert 1e-7 < np.abs(all_given).max() < 2e-5


def test_forces_stay_in_the_friction_cone_and_oppose_the_slip(cylinder_renderer):
    renderer = cylinder_renderer.with_friction(0.3)
    drag = np.linspace([-0.01, 0.0, 0.082], [0.012, 0.004, 0.082], 400)
    path = np.concatenate([np.linspace([-0.01, 0.0, 0.0855], [-0.01, 0.0, 0.082], 100), drag])
    state = renderer.start([TIP])
    for tip in path:
        _, force = renderer.step(state, np.ascontiguousarray(tip[None]))
        normal = state.normals[0]
        push = float(force[0] @ normal)
        pull = float(np.linalg.norm(force[0] - push * normal))
        assert pull <= 0.3 * push * (1 + 1e-5) + 1e-12
    assert pull == pytest.approx(0.3 * push, rel=1e-3)
    assert force[0] @ [0.022, 0.004, 0] < 0
    assert np.linalg.norm(state.points[0] - [0.012, 0.004, 0.08]) < 2.5e-3  # the anchor came along


def test_without_friction_the_force_is_normal(cylinder_renderer):
    renderer = cylinder_renderer.with_friction(0.0)
    path = np.linspace([0.045, 0.0, 0.03], [0.043, 0.0, 0.05], 300)
    path = np.concatenate([np.linspace([0.046, 0, 0.03], [0.043, 0, 0.03], 50), path[50:]])
    force, state = run(renderer, path)
    normal = state.normals[0]
    assert np.linalg.norm(force[-1, 0] - (force[-1, 0] @ normal) * normal) < 1e-8


@pytest.mark.parametrize("mu", [np.inf, 0.25, 0.0])
def test_sliding_over_triangles_and_over_the_rim_never_steps(cylinder_renderer, mu):
    """From 0.3 on a tip snaps over the rim: what held it back lets go within micrometres."""
    renderer = cylinder_renderer.with_friction(mu)
    step = 1e-6
    inwards = np.linspace([0.030, 0.003, 0.0855], [0.030, 0.003, 0.0825], 200)
    if mu == np.inf:
        along = inwards[-1] + np.arange(0, 2000)[:, None] * [step, 0, 0]
    else:  # across the rim of the top, down its side
        angle = np.arange(0, np.pi / 2, step / 0.0095)
        over = np.stack(
            [0.033 + 0.0095 * np.sin(angle), 0 * angle + 0.003, 0.073 + 0.0095 * np.cos(angle)], axis=1
        )
        along = np.vstack([inwards[-1] + np.arange(0, 3000)[:, None] * [step, 0, 0], over])
    force, state = run(renderer, np.vstack([inwards, along]))
    force = force[200:, 0]
    size = np.linalg.norm(force, axis=1)
    assert size.min() > 0.02
    jump = np.linalg.norm(np.diff(force, axis=0), axis=1) / size[:-1]
    assert jump.max() < 0.005


def test_a_tip_that_is_dragged_off_a_rim_is_held_by_what_it_still_overlaps_at_once(cylinder_renderer):
    renderer = cylinder_renderer.with_friction(1.0)
    inwards = np.linspace([0.038, 0.0, 0.088], [0.038, 0.0, 0.079], 60)
    off = inwards[-1] + np.arange(1, 500)[:, None] * [2e-5, 0, 0]
    force, _ = run(renderer, np.vstack([inwards, off]))
    size = np.linalg.norm(force[:, 0], axis=1)
    assert size[60:300].min() > 0.1
    lost = (size[1:-1] == 0) & (size[:-2] > 1e-3) & (size[2:] > 1e-3)
    assert not lost.any()


def test_a_snap_over_a_rim_is_rendered_within_some_milliseconds(cylinder_renderer):
    """From one tick to the next the force changed by three quarters of its greatest."""
    renderer = cylinder_renderer.with_friction(1.0)
    inwards = np.linspace([0.038, 0.0, 0.088], [0.038, 0.0, 0.079], 100)
    off = inwards[-1] + np.arange(1, 500)[:, None] * [2e-5, 0, 0]
    state, force, settled = renderer.start([0.005]), [], []
    for tip in np.vstack([inwards, off]):
        force.append(renderer.step(state, tip[None].copy())[1][0].copy())
        settled.append(state.elastic[0].copy())
    most = np.linalg.norm(force, axis=1).max()
    change, snap = (np.linalg.norm(np.diff(each, axis=0), axis=1) / most for each in (force, settled))
    assert snap.max() > 0.5 and change.max() < 0.07
    behind = np.linalg.norm(np.subtract(force, settled), axis=1) / most
    assert 5 < (behind > 0).sum() < 60 and (behind[:300] == 0).all()
    for _ in range(60):
        renderer.step(state, off[-1][None].copy())
    assert np.array_equal(state.forces, state.elastic)


def test_a_thin_wall_is_not_popped_through(thin_renderer):
    deep = np.linspace([0, 0.012, 0.025], [0, -0.02, 0.025], 400)
    force, state = run(thin_renderer, deep)
    assert force[-1, 0, 1] > 0 and state.points[0, 1] == pytest.approx(0.003, abs=1e-4)
    # a jump through the wall within one tick is caught on the side that it came from
    force, state = run(thin_renderer, [[0, 0.012, 0.025], [0, 0.011, 0.025], [0, -0.02, 0.025]])
    assert force[-1, 0, 1] > 0 and state.points[0, 1] == pytest.approx(0.003, abs=1e-4)


def test_two_fingers_that_pinch_balance_and_stiffen_a_wall(thin_renderer):
    depth = 1.5e-3
    side = down((0, 0.003, 0.03), depth, normal=(0, 1, 0))
    other = side * [1, -1, 1]
    alone = run(thin_renderer, side)[0][-1, 0]
    pinched = run(thin_renderer, np.stack([side, other], axis=1), radii=(TIP, TIP))[0][-1]
    assert pinched[0, 1] > 2 * alone[1]  # one finger bends the wall, two squeeze it
    assert pinched[0, 1] == pytest.approx(-pinched[1, 1], rel=0.03)
    assert np.abs(pinched.sum(axis=0)).max() < 0.05 * pinched[0, 1]


def test_a_low_rank_factor_serves_as_the_dense_table(thin_renderer):
    compliance = thin_renderer.compliance
    t = len(compliance.nodes)
    dense = compliance.blocks.transpose(0, 2, 1, 3).reshape(3 * t, 3 * t).astype(float)
    size, modes = np.linalg.eigh((dense + dense.T) / 2)
    factor = (modes * np.sqrt(np.maximum(size, 0))).reshape(t, 3, -1).astype(np.float32)
    less = dataclasses.replace(compliance, factor=factor, blocks=np.zeros((0, 0, 3, 3), dtype=np.float32))
    compressed = FemRenderer(thin_renderer.model, thin_renderer.options, compliance=less)
    side = down((0, 0.003, 0.03), 1.5e-3, normal=(0, 1, 0))
    both = np.stack([side, side * [1, -1, 1], side + [0.012, 0, -0.01]], axis=1)
    forces, moved = [], []
    for renderer in (thin_renderer, compressed):
        force, state = run(renderer, both, radii=(TIP,) * 3)
        forces.append(force)
        moved.append(
            renderer.displacement_of(state.points, state.normals, force[-1], state.radii_m, state.depths)
        )
    assert forces[0][-1, 0, 1] > 0.05
    assert np.abs(forces[0] - forces[1]).max() < 1e-4 * np.abs(forces[0]).max()
    assert np.abs(moved[0] - moved[1]).max() < 1e-4 * np.abs(moved[0]).max()


def test_sixteen_frictional_contacts_converge_whatever_their_order(cylinder_renderer):
    renderer = cylinder_renderer.with_friction(0.5)
    angle = np.arange(16) * 2 * np.pi / 16
    height = 0.02 + 0.045 * ((np.arange(16) * 7) % 16) / 16

    def path(order):
        radius = np.linspace(0.046, 0.042, 60)[:, None]
        turned = angle + 10 * (0.046 - radius)
        p = np.stack([radius * np.cos(turned), radius * np.sin(turned), height + 0 * turned], axis=-1)
        return p[:, order]

    forward = run(renderer, path(np.arange(16)), radii=[0.004] * 16)[0][-1]
    backward = run(renderer, path(np.arange(16)[::-1]), radii=[0.004] * 16)[0][-1][::-1]
    assert (np.linalg.norm(forward, axis=1) > 0.1).all()
    assert np.abs(forward - backward).max() < 1e-3 * np.abs(forward).max()


def test_the_modulus_scales_the_force_without_precomputation(cylinder_renderer):
    path = down((0, 0.01, 0.08), 4e-3)
    soft, hard = (run(r, path)[0] for r in (cylinder_renderer, cylinder_renderer.with_modulus(58e3)))
    assert np.abs(hard - 2 * soft).max() < 1e-9


def test_a_series_compliance_is_felt_as_a_spring(cylinder_renderer):
    compliance = 1e-3
    path = down((0, 0, 0.08), 4e-3, 2000)
    plain = run(cylinder_renderer, path)[0][:, 0, 2]
    soft = run(cylinder_renderer.with_series_compliance(compliance), path)[0][-1, 0, 2]
    depth = np.linspace(-5e-4, 4e-3, 2000)
    assert soft == pytest.approx(np.interp(4e-3 - compliance * soft, depth, plain), rel=2e-3)


def test_replaying_a_path_is_bit_identical(cylinder_renderer):
    rng = np.random.default_rng(0)
    path = np.array([0.005, 0, 0.085]) + np.cumsum(rng.normal(0, 2e-4, (500, 3)), axis=0)
    first, second = (run(cylinder_renderer.with_friction(0.4), path)[0] for _ in range(2))
    assert first.tobytes() == second.tobytes()


def test_a_reading_that_is_no_number_gets_no_force(cylinder_renderer):
    path = down((0, 0, 0.08), 3e-3)
    path[150] = np.nan
    force = run(cylinder_renderer, path)[0]
    assert force[149, 0, 2] > 0 and not force[150:].any()  # inside now: no support until it has come out


def test_a_tip_that_starts_inside_is_left_alone_until_it_is_out(cylinder_renderer):
    path = np.vstack([down((0, 0, 0.08), 6e-3)[::-1], down((0, 0, 0.08), 2e-3)])
    force = run(cylinder_renderer, path)[0][:, 0, 2]
    assert not force[:200].any() and force[-1] > 0.05


@pytest.mark.parametrize("below", [0.0, 1e-6])
def test_a_tip_that_starts_at_first_touch_gets_no_sudden_force(block_renderer, below):
    first = np.array([0.0, 0.0, 0.08 + TIP - below])
    down_from_there = first - np.linspace(0, 3e-3, 100)[:, None] * [0, 0, 1.0]
    out_and_in = first + np.concatenate([np.linspace(0, 1e-4, 5), np.linspace(1e-4, -3e-3, 100)])[:, None] * [
        0,
        0,
        1,
    ]
    inside = run(block_renderer, down_from_there)[0][:, 0, 2]
    assert not inside.any()  # it was never seen outside
    assert run(block_renderer, np.vstack([down_from_there, out_and_in]))[0][-1, 0, 2] > 0.1


def test_a_tip_that_let_go_remembers_nothing(cylinder_renderer):
    sideways = np.linspace(0, 1e-3, 100)[:, None] * [1, 0, 0]
    press = down((0.005, 0, 0.08), 3e-3)
    stuck = press[-1] + sideways
    leave = np.linspace(stuck[-1], stuck[-1] + [0, 0, 6e-3], 200)
    force, state = run(cylinder_renderer, np.vstack([press, stuck, leave, leave[-1] + 0 * press[:2]]))
    assert abs(force[299, 0, 0]) > 0.05  # it was held back while it stuck
    assert not force[-1].any() and state.touching[0] == 0 and state.grip.triangle[0] == -1
    again = np.vstack([press, stuck, leave, press[:1] + [0, 0, 4e-3], press])
    assert run(cylinder_renderer, again)[0][-1, 0] == pytest.approx(
        run(cylinder_renderer, press)[0][-1, 0], rel=1e-6
    )


def test_a_tip_that_lifts_off_while_dragged_sideways_feels_nothing_above_the_surface(cylinder_renderer):
    renderer = cylinder_renderer.with_friction(0.5)
    press = down((0.0, 0, 0.08), 2e-3)
    lift = press[-1] + np.linspace(0, 1, 400)[:, None] * [8e-3, 0, 4e-3]
    state = renderer.start([TIP])
    for tip in np.vstack([press, lift]):
        _, force = renderer.step(state, np.ascontiguousarray(tip[None]))
        if tip[2] > 0.08 + TIP + 1e-5:
            assert not force.any() and state.depths[0] == 0 and state.stiffness[0] == 0
    assert state.grip.triangle[0] == -1


def test_contacts_that_stay_feel_a_changed_table(thin_renderer):
    side = down((0, 0.003, 0.03), 1.5e-3, normal=(0, 1, 0))
    tips = np.ascontiguousarray(np.stack([side[-1], side[-1] * [1, -1, 1]]))
    renderer = thin_renderer
    state = renderer.start([TIP, TIP])
    for pair in np.stack([side, side * [1, -1, 1]], axis=1):
        renderer.step(state, np.ascontiguousarray(pair))
    before = state.forces.copy()
    changed = renderer.with_field(renderer.parameters.far, 0.0 * renderer.parameters.blocks)
    for _ in range(100):  # tips at rest: what changes without them comes within some milliseconds
        _, alone = changed.step(state, tips)
    fresh = changed.start([TIP, TIP])
    for pair in np.stack([side, side * [1, -1, 1]], axis=1):
        changed.step(fresh, np.ascontiguousarray(pair))
    assert np.abs(alone - before).max() > 0.05 * np.abs(before).max()
    assert alone == pytest.approx(fresh.forces, abs=0.02 * np.abs(before).max())


def test_the_drawn_surface_follows_the_tip_and_the_base_stays(cylinder_renderer):
    _, state = run(cylinder_renderer, down((0, 0, 0.08), 4e-3))
    points, _ = cylinder_renderer.surface
    moved = cylinder_renderer.displacement(state)
    top = int(np.linalg.norm(points - [0, 0, 0.08], axis=1).argmin())
    assert moved[top, 2] == pytest.approx(-4e-3, rel=0.05)
    assert np.abs(moved[points[:, 2] < 1e-9]).max() < 1e-4
    tip = np.array([0, 0, 0.08 + TIP - 4e-3])
    assert np.linalg.norm(points + moved - tip, axis=1).min() > 0.98 * TIP


def test_dragging_near_the_clamped_base_never_jams(cylinder_renderer):
    renderer = cylinder_renderer.with_friction(1.0)
    for height in (0.004, 0.008, 0.015):
        angle = np.linspace(0, 1.5, 1500)
        ring = np.stack([0.0435 * np.cos(angle), 0.0435 * np.sin(angle), height + 0 * angle], axis=1)
        force = run(renderer, np.vstack([np.linspace([0.046, 0, height], ring[0], 50), ring]))[0][:, 0]
        size = np.linalg.norm(force, axis=1)
        assert size[60:].max() < 3 * size[50]
