"""Known shapes: registered to first touches with outliers and noise, with an honest error; slides."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import pyvista
import trimesh
from scipy.spatial.transform import Rotation

from palpate.mechanics.compliance.sites import touch_sites, touch_solver
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.shape.tetmesh import box_mesh, vertex_normals
from palpate.reconstruction.geometry.registration import (
    PAYS,
    Registration,
    ShapeToPlace,
    TouchedPoints,
    nats_for_radii,
    register,
)
from palpate.reconstruction.steps.s3_contacts.left_out import sliding
from palpate.reconstruction.steps.s7_modulus.shape_error import PoseError, compliance_covariance

TIP_M = 0.004


def wedge() -> tuple[np.ndarray, np.ndarray]:
    """A solid without symmetry: a block with a slanted top and one long side."""
    low = np.array([[-0.05, -0.03, 0], [0.05, -0.04, 0], [0.05, 0.04, 0], [-0.05, 0.03, 0]])
    top = low + np.array([[0, 0, 0.03], [0, 0, 0.055], [0, 0, 0.05], [0, 0, 0.03]])
    hull = trimesh.Trimesh(np.vstack([low, top]), process=False).convex_hull
    return np.array(hull.vertices), np.array(hull.faces)


def touched(
    shape: tuple[np.ndarray, np.ndarray], *, seed: int, facing_up: float = -0.2, slips: int = 2
) -> tuple[TouchedPoints, Rotation, np.ndarray]:
    """First touches of a body in a random pose: 0.2 mm of noise, slips of 4 mm, directions 9 degrees off."""
    rng = np.random.default_rng(seed)
    points, face = trimesh.sample.sample_surface(trimesh.Trimesh(*shape), 2000, seed=seed)
    normals = trimesh.Trimesh(*shape).face_normals[face]
    centres = points + TIP_M * normals
    shell = pyvista.PolyData.from_regular_faces(*shape)
    _, foot = shell.find_closest_cell(centres, return_closest_point=True)
    clear = (np.linalg.norm(centres - foot, axis=1) > TIP_M - 1e-6) & (points[:, 2] > 0.008)
    chosen = np.flatnonzero(clear & (normals[:, 2] > facing_up))[:40]
    turn, shift = Rotation.random(rng=rng), rng.uniform(-0.3, 0.3, 3)
    out = turn.apply(normals[chosen])
    at = turn.apply(centres[chosen]) + shift + 2e-4 * rng.standard_normal((len(chosen), 1)) * out
    at[:slips] += 0.004 * out[:slips]
    told = out + 0.15 * rng.standard_normal(out.shape)
    told /= np.linalg.norm(told, axis=1, keepdims=True)
    error = np.full(len(chosen), 1e-4)
    return TouchedPoints(at, told, error, np.arange(len(chosen)), TIP_M), turn, shift


def surface_error(found: Registration, shape, turn: Rotation, shift: np.ndarray) -> np.ndarray:
    """(n,) m: how far the registered surface is from the true one along its normal."""
    vertices, faces = trimesh.remesh.subdivide(*shape)
    true = pyvista.PolyData.from_regular_faces(turn.apply(shape[0]) + shift, shape[1])
    here = found.to_device(vertices)
    return np.linalg.norm(here - true.find_closest_cell(here, return_closest_point=True)[1], axis=1)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_shape_is_found_in_any_pose_despite_slips(seed):
    shape = wedge()
    told, turn, shift = touched(shape, seed=seed)
    found = register(ShapeToPlace(*shape, np.zeros(3), np.array([0, 0, 1.0])), told)
    assert surface_error(found, shape, turn, shift).max() < 0.8e-3
    assert found.weight[:2].max() < 0.01 and found.rms_m < 4e-4
    corners = found.to_device(shape[0])
    sd = np.sqrt((found.modes(corners, vertex_normals(corners, shape[1])) ** 2).sum(axis=1))
    assert 0.5e-4 < np.median(sd) < 1e-3


def test_what_the_touches_leave_open_is_told():
    """A block touched on top alone may lie anywhere along it: its sides are uncertain, its top is not."""
    block = trimesh.creation.box(extents=(0.08, 0.06, 0.04))
    block.apply_translation([0, 0, 0.02])
    shape = np.array(block.vertices), np.array(block.faces)
    told, *_ = touched(shape, seed=3, facing_up=0.9)
    found = register(ShapeToPlace(*shape, np.zeros(3), np.array([0, 0, 1.0])), told)
    up = told.normals.mean(axis=0) / np.linalg.norm(told.normals.mean(axis=0))
    spot = told.centres.mean(axis=0) - TIP_M * up
    aside = np.cross(up, [1.0, 0.3, 0.2])
    aside /= np.linalg.norm(aside)
    sd = np.sqrt((found.modes(np.array([spot, spot]), np.array([up, aside])) ** 2).sum(axis=1))
    assert sd[0] < 2e-4 and sd[1] > 0.01


def test_a_round_cap_is_not_turned_where_no_touch_asks_for_it():
    """It leant by 20 degrees: a ball's cap turned about the ball's middle meets the touches all the same."""
    radius_m, height_m = 0.045, 0.025
    angle = np.linspace(0, np.arccos(1 - height_m / radius_m), 30)
    profile = np.c_[radius_m * np.sin(angle), radius_m * np.cos(angle) - (radius_m - height_m)][::-1]
    cap = trimesh.creation.revolve(np.vstack([[0, 0], profile[:-1], [0, height_m]]), sections=96)
    cap.merge_vertices()
    rng = np.random.default_rng(0)
    polar, around = np.arcsin(0.62 * np.sqrt((np.arange(30) + 0.5) / 30)), 2.4 * np.arange(30)
    out = np.c_[np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)]
    shift = np.array([0.4, -0.05, 0.1])
    middle = shift + [0, 0, height_m - radius_m]
    centres = middle + (radius_m + TIP_M + 2e-5 * rng.standard_normal((30, 1))) * out
    told = TouchedPoints(centres, out, np.full(30, 2e-5), np.arange(30), TIP_M)
    shape = np.array(cap.vertices), np.array(cap.faces)
    found = register(ShapeToPlace(*shape, np.zeros(3), np.array([0, 0, 1.0])), told)
    assert found.rotation[2, 2] > np.cos(np.radians(1))
    assert found.shift_m == pytest.approx(shift, abs=2e-4)


@pytest.mark.parametrize(("stated", "true"), [(2.0, 0.5), (0.5, 2.0)])
def test_touches_from_all_sides_tell_a_diameter_from_a_radius(stated, true):
    """The pose took a tip of twice the radius up, and the modulus was 10 kPa of 17 without a word."""
    shape = wedge()
    body = ShapeToPlace(*shape, np.zeros(3), np.array([0, 0, 1.0]))
    told, *_ = touched(shape, seed=5)
    off_m = 0.005 * 0.1
    right = nats_for_radii(body, told, register(body, told), off_m)
    assert max(right.values()) < -PAYS
    wrong = dataclasses.replace(told, tip_radius_m=stated * TIP_M)
    assert nats_for_radii(body, wrong, register(body, wrong), off_m)[true] > PAYS


def test_a_support_that_was_traced_by_another_tip_lies_elsewhere_too():
    """With the foot held where a tip of twice the radius had traced it, another object's shape was named."""
    shape = wedge()
    body = ShapeToPlace(*shape, np.zeros(3), np.array([0, 0, 1.0]))
    told, turn, shift = touched(shape, seed=5)
    up = turn.apply([0, 0, 1.0])
    right = dataclasses.replace(told, support=(shift, up))
    assert max(nats_for_radii(body, right, register(body, right), 5e-4).values()) < -PAYS
    wrong = dataclasses.replace(told, tip_radius_m=2 * TIP_M, support=(shift - TIP_M * up, up))
    assert nats_for_radii(body, wrong, register(body, wrong), 5e-4)[0.5] > PAYS
    assert wrong.under(TIP_M).support[0] == pytest.approx(shift)


def test_touches_from_one_side_leave_the_radius_open():
    shape = wedge()
    body = ShapeToPlace(*shape, np.zeros(3), np.array([0, 0, 1.0]))
    told, *_ = touched(shape, seed=3, facing_up=0.7)
    for factor in (0.5, 1.0, 2.0):
        other = dataclasses.replace(told, tip_radius_m=factor * TIP_M)
        nats = nats_for_radii(body, other, register(body, other), 0.005 * 0.1)
        assert max(abs(n) for n in nats.values()) < PAYS


def test_as_it_stands_only_the_residuals_are_told():
    shape = wedge()
    told, turn, shift = touched(shape, seed=4, slips=0)
    home = dataclasses.replace(told, centres=turn.inv().apply(told.centres - shift) + [0, 0, 0.0015])
    home = dataclasses.replace(home, normals=turn.inv().apply(told.normals))
    found = register(ShapeToPlace(*shape, np.zeros(3), np.array([0, 0, 1.0])), home, free=False)
    assert np.array_equal(found.rotation, np.eye(3)) and not found.covariance.any()
    on_top = home.normals[:, 2] > 0.8
    assert np.median(found.residual_m[on_top]) == pytest.approx(0.0015, abs=3e-4)


@pytest.mark.slow
def test_the_poses_error_reaches_the_compliance_as_moving_the_object_does():
    """Against solving again: a place near the edge of a block, the block moved sideways under the tip."""
    mesh, step = box_mesh((10, 8, 5), (0.08, 0.06, 0.03)), 2e-3
    place = np.array([[0.028, 0.0, 0.03], [0.0, 0.0, 0.03]])
    up = np.tile([0.0, 0.0, 1.0], (2, 1))
    solver = touch_solver(mesh, 0.45)

    def compliance(points: np.ndarray) -> np.ndarray:
        far = touch_sites(solver.mesh, points, up, 0.45, solver=solver, curvature=0.0).far
        return far[:, 2, 2]

    moved = (compliance(place - [step / 2, 0, 0]) - compliance(place + [step / 2, 0, 0])) / step
    sites = touch_sites(solver.mesh, place, up, 0.45, solver=solver, curvature=0.0)
    pose = PoseError(np.diag([1e-6, 0, 0, 0, 0, 0]), place[0])
    told = compliance_covariance(solver, sites, np.zeros(len(solver.mesh.points)), pose=pose)
    assert np.sqrt(told[0, 0]) / 1e-3 == pytest.approx(abs(moved[0]), rel=0.35)
    assert np.sqrt(told[1, 1]) < 0.1 * np.sqrt(told[0, 0])
    lifted = PoseError(np.diag([0, 0, 1e-6, 0, 0, 0]), place[0])
    told = compliance_covariance(solver, sites, np.zeros(len(solver.mesh.points)), pose=lifted)
    # a touch says how high the surface is: the whole object higher is the same object
    assert np.sqrt(told.max()) < 1e-9


def test_a_contact_that_wanders_is_a_slide():
    from palpate.mechanics.presses.making import of_paths

    still = np.column_stack([np.zeros(50), np.zeros(50), 0.004 - 0.002 * np.sin(np.linspace(0, np.pi, 50))])
    wandering = still + np.column_stack([np.linspace(0, 0.05, 50), np.zeros((50, 2))])
    table: Presses = of_paths(
        np.array([0, 50, 100]),
        np.vstack([still, wandering]),
        np.ones((100, 3)),
        np.array([[0, 0, 0.004]] * 2),
        np.array([[0, 0, 1.0]] * 2),
        tip_radius_m=TIP_M,
        sample_rate_hz=100.0,
    )
    assert sliding(table).tolist() == [False, True]
