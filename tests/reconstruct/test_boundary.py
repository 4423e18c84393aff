"""Phase I gives the support plane and the base, in any frame, stated or detected."""

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.errors import ContactError, NoBaseError
from palpate.reconstruction.checks.registry import check
from palpate.reconstruction.shapes.outline import farthest_points, fit_plane, in_its_plane
from palpate.reconstruction.steps.s2_base import BoundaryOptions, find_boundary, find_interval, refuse_no_foot
from palpate.reconstruction.steps.s3_contacts.contacts import explore

from .exploration_of_cylinder import RADIUS, TILTED, explore_cylinder


@pytest.mark.parametrize("clockwise", [False, True])
def test_support_and_outline_in_a_tilted_frame(clockwise):
    recording, _ = explore_cylinder(clockwise=clockwise)
    boundary = explore(recording).boundary
    assert boundary.support_normal @ TILTED.rotation[:, 2] > np.cos(np.radians(0.1))
    rim = TILTED.object(boundary.outline)
    assert np.abs(rim[:, 2]).max() < 2e-5
    assert np.abs(np.hypot(rim[:, 0], rim[:, 1]) - RADIUS).max() < 2e-4
    traced = TILTED.object(boundary.centres)
    assert (np.hypot(traced[:, 0], traced[:, 1]) > np.hypot(rim[:, 0], rim[:, 1])).all()


def test_a_phase_that_is_not_stated_is_detected():
    stated, _ = explore_cylinder()
    silent = dataclasses.replace(stated, boundary_phase=None)
    a, b = explore(stated).boundary, explore(silent).boundary
    assert a.interval == pytest.approx(b.interval, abs=5)
    assert a.support_normal == pytest.approx(b.support_normal, abs=1e-4)


def test_a_trace_with_a_lift_in_it_is_detected_whole():
    recording, _ = explore_cylinder(lift=True, state_phase=False)
    whole, _ = explore_cylinder()
    first, last = explore(whole).boundary.interval
    found = explore(recording).boundary.interval
    assert abs(found[0] - first) < 5 and abs(found[1] - last) < 5


def test_a_lift_along_the_objects_wall_parts_no_tracing_and_presses_end_it():
    """A round of a foot, the tip for a moment at the wall above it; then presses on the wall."""
    rows = []  # (angle, height, touching)
    rows += [(a, 0.005, True) for a in np.linspace(0, 2, 2000)] + [(2, 0.0051, False)] * 10
    rows += [(2, h, True) for h in np.linspace(0.0052, 0.0065, 200)] + [(2, 0.0051, False)] * 10
    rows += [(a, 0.005, True) for a in np.linspace(2, 2 * np.pi, 4000)]
    for k in range(3):
        rows += [(k, 0.02, False)] * 500 + [(k, 0.02 + 0.00001 * i, True) for i in range(400)]
    angle, height, touching = np.array(rows).T
    path = np.column_stack([0.045 * np.cos(angle), 0.045 * np.sin(angle), height])
    t = np.arange(len(path)) / 1000
    assert find_interval(t, path, touching > 0, None, 0.005) == (0, 6220)


def test_a_swing_while_the_tracing_is_broken_off_ends_it_as_little():
    """A heavy tool that is lifted far off reads a touch; what is traced soon after is the same base."""
    half = [(a, 0.005, True) for a in np.linspace(0, np.pi, 3000)]
    swing = [(np.pi, 0.02, False)] * 300 + [(np.pi, 0.02, True)] * 90 + [(np.pi, 0.02, False)] * 300
    rest = [(a, 0.005, True) for a in np.linspace(np.pi, 2 * np.pi, 3000)]
    rows = [*half, *swing, *rest]
    for k in range(3):
        rows += [(k, 0.02, False)] * 500 + [(k, 0.02 + 0.00001 * i, True) for i in range(400)]
    angle, height, touching = np.array(rows).T
    path = np.column_stack([0.045 * np.cos(angle), 0.045 * np.sin(angle), height])
    t = np.arange(len(path)) / 1000
    assert find_interval(t, path, touching > 0, None, 0.005) == (0, 6690)


def test_contact_that_outlasts_the_stated_phase_belongs_to_it():
    recording, _ = explore_cylinder()
    start, end = recording.boundary_phase
    early = dataclasses.replace(recording, boundary_phase=(start, end - 0.1))
    assert explore(early).boundary.interval == pytest.approx(explore(recording).boundary.interval, abs=5)


@pytest.mark.parametrize("ways", [(1, 1), (1, -1)])
def test_a_base_may_be_traced_in_strokes_that_come_up_to_it_from_beside(ways):
    """As a mouse does, side by side: strokes overlap, some go back, each begins beside the object."""
    pieces, part = [], 2 * np.pi / 8
    for k in range(8):
        angle = np.linspace(k * part, (k + 1.25) * part, 2000)[:: ways[k % 2]]
        up, away = np.linspace(0.052, 0.045, 100), np.linspace(0.045, 0.05, 100)
        beside = np.concatenate([up, np.full(1800, 0.045), away])
        pieces.append(beside[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))
    path = np.column_stack([np.concatenate(pieces), np.full(16000, 0.005)])
    force, touching = np.tile([0.0, 0.0, 0.5], (len(path), 1)), np.ones(len(path), dtype=bool)
    found = find_boundary(path, force, touching, (0, len(path)), 0.005, BoundaryOptions())
    radius = np.hypot(*found.outline[:, :2].T)
    assert np.quantile(np.abs(radius - 0.04), 0.9) < 2e-4 and np.abs(radius - 0.04).max() < 1.5e-3


def test_a_round_that_a_lift_leaves_open_is_not_taken_for_the_little_loop_that_it_closes():
    angle = np.linspace(0.0, 2.1 * np.pi, 12_000)
    lifted = (angle > 2.0) & (angle < 2.0 + 0.004 / 0.045)  # 4 mm of the way, more than what counts as closed
    path = np.column_stack([0.045 * np.cos(angle), 0.045 * np.sin(angle), np.full(len(angle), 0.005)])
    turn = np.linspace(0, 2 * np.pi, 150)
    path[6_600:6_750, :2] = path[6_600, :2] + 0.0025 * np.column_stack([1 - np.cos(turn), np.sin(turn)])
    touching = ~lifted
    force = np.tile([0.0, 0.0, 0.5], (len(path), 1))
    found = find_boundary(path, force, touching, (0, len(path)), 0.0047, BoundaryOptions())
    distance = np.hypot(found.outline[:, 0], found.outline[:, 1])
    assert 0.038 < np.median(distance) < 0.0425 and np.ptp(found.outline[:, 0]) > 0.075


def test_no_phase_is_an_error_that_names_the_remedies():
    recording, _ = explore_cylinder(without_phase=True)
    with pytest.raises(ContactError, match="trace .*base.*model = PATH"):
        explore(recording)


def test_half_a_turn_is_an_error():
    recording, _ = explore_cylinder(turn=0.5)
    with pytest.raises(ContactError, match="the base goes .* degrees round the object; at least 288"):
        explore(recording)


def test_the_sample_of_the_base_leaves_no_gap_above_the_threshold(cylinder):
    boundary = explore(cylinder[0], boundary_options=BoundaryOptions(base_spacing_m=0.008)).boundary
    gap = np.linalg.norm(boundary.outline[:, None] - boundary.points[None], axis=2).min(axis=1)
    assert gap.max() <= 0.008
    spacing = np.linalg.norm(boundary.points[:, None] - boundary.points[None], axis=2)
    assert spacing[~np.eye(len(spacing), dtype=bool)].min() > 0.004


def test_farthest_points_stops_at_the_threshold():
    line = np.column_stack([np.linspace(0, 1, 101), np.zeros(101), np.zeros(101)])
    assert len(farthest_points(line, 0.24)) == 5


def test_the_plane_ignores_samples_far_off_it():
    random = np.random.default_rng(0)
    points = random.uniform(-0.05, 0.05, (400, 3)) * [1, 1, 0] + 1e-5 * random.standard_normal((400, 3))
    points[:60, 2] += 0.01
    _, normal, rms = fit_plane(points)
    assert abs(normal[2]) > 1 - 1e-6
    assert rms < 3e-5


def test_a_trace_that_was_broken_off_for_seconds_is_detected_whole():
    """Two long gaps in the clock of contact: all contacts in the plane belong to it until one leaves it."""
    recording, _ = explore_cylinder(state_phase=False)
    first, last = explore(recording).boundary.interval
    force = recording.force_on_tool.copy()
    for share in (0.3, 0.6):
        at = int(first + share * (last - first))
        force[at : at + 60] = 0.0
    t = recording.t.copy()
    for share in (0.3, 0.6):
        t[int(first + share * (last - first)) + 30 :] += 3.0
    found = explore(dataclasses.replace(recording, t=t, force_on_tool=force)).boundary.interval
    assert abs(found[0] - first) < 100
    assert abs(found[1] - last) < 100


def test_a_stated_tracing_is_touched_where_it_lies_in_its_plane_and_lifted_strokes_are_air():
    t = np.arange(0, 20, 0.001)
    angle = 2 * np.pi * t / 20
    lifted = (t % 5) > 4.2
    path = np.column_stack([0.04 * np.cos(angle), 0.04 * np.sin(angle), np.where(lifted, 0.008, 0.0)])
    path = path @ TILTED.rotation.T + [0.1, -0.2, 0.3]
    stated = t < 19
    np.testing.assert_array_equal(in_its_plane(path, stated, 0.004), stated & ~lifted)
    nowhere = np.zeros(len(t), dtype=bool)
    assert not in_its_plane(path, nowhere, 0.004).any()


def test_deep_presses_alone_are_no_tracing():
    """They slide as far as a tracing: what is missing is a base, not presses."""
    pressed, _ = explore_cylinder(without_phase=True, depth=0.012)
    with pytest.raises(NoBaseError):
        explore(pressed)
    found = check(pressed)
    assert [f.name for f in found if f.grave] == ["no base"]
    assert {"shape", "slab_m", "half_space"} <= {name for way in found[0].ways for name in way.options}


@pytest.mark.parametrize("stated", [True, False])
def test_a_tracing_that_nothing_pushes_sideways_is_no_foot(stated):
    """A circle on the open table shows no object, however well it closes; one that leans a little does."""
    for lean_n, beside in ((0.0, True), (0.02, False)):
        recording, _ = explore_cylinder(lean_n=lean_n, noise=1e-3, state_phase=stated)
        grave = [f for f in check(recording) if f.grave]
        assert [f.name for f in grave] == ["beside the foot" if stated else "no base"] * beside
        assert all("lean" in f"{f.todo} {f.saw}" for f in grave)


@pytest.mark.parametrize("aside", [0.0, 0.2])
def test_a_foot_has_the_presses_over_it_and_room_for_an_object(aside):
    angle = np.linspace(0, 2 * np.pi, 3000)
    path = np.column_stack([0.045 * np.cos(angle), 0.045 * np.sin(angle), np.full(3000, 0.005)])
    force, touching = np.tile([0.0, 0.0, 0.5], (len(path), 1)), np.ones(len(path), dtype=bool)
    t, pressed = np.arange(3000) / 1000, np.array([[aside, 0.0, 0.05], [aside + 0.08, 0.0, 0.02]])
    base = find_boundary(path, force, touching, (0, len(path)), 0.005, BoundaryOptions())
    if aside:
        with pytest.raises(NoBaseError):
            refuse_no_foot(base, pressed, t, 0.005)
        return
    refuse_no_foot(base, pressed, t, 0.005)
    with pytest.raises(NoBaseError):
        refuse_no_foot(base, pressed, t, 0.05)
