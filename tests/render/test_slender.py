"""Soft slender bodies, which bend away: against beam theory, without a jump, and said where a force did not
settle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.render.press import Stroke, press
from palpate.render.replay import replay
from palpate.render.scene import in_the_air
from palpate.render.surface.bvh import STACK, closest_triangle
from palpate.render.surface.walking import foot
from palpate.show.curve import KEYS, story
from palpate.show.story import figures_of, lines_of

from . import shapes

TIP, MODULUS, POISSON = 0.005, 5e3, 0.49
WIDTH, HEIGHT = 0.010, 0.050


@pytest.fixture(scope="module")
def beam():
    """10 x 10 x 50 mm, 5 kPa, its foot held."""
    return shapes.fem(shapes.model(shapes.block((WIDTH, WIDTH, HEIGHT), (2, 2, 10)), modulus=MODULUS))


@pytest.fixture(scope="module")
def tentacle():
    """195 mm high, 20 mm wide at its foot and 10 mm at its tip, 5 kPa."""
    straight = shapes.cylinder(0.010, 0.195, (4, 26), order=1)
    points = straight.points.copy()
    points[:, :2] *= 1 - 0.5 * points[:, 2:] / 0.195
    mesh = TetMesh(points, straight.tetrahedra, straight.fixed, straight.touchable).quadratic()
    return shapes.fem(shapes.model(mesh, modulus=MODULUS))


def bent_n(height_m: float, depth_m: float, mu: float) -> tuple[float, float]:
    """(push, drag), N, of a tip that presses a cantilever's side by depth_m at height_m and goes straight in.

    Timoshenko's beam, whose pressed face goes down as it turns, with Hertz's dent and Mindlin's stick in
    series, whose rings hold two thirds of it since they touch one after the other; the tip sticks, or slides
    with Coulomb's drag.
    """
    second, area = WIDTH**4 / 12, WIDTH**2
    shear = MODULUS / 2 / (1 + POISSON)
    cnn = height_m**3 / 3 / MODULUS / second + height_m / (5 / 6 * shear * area)
    cnz = height_m**2 / 2 / MODULUS / second * WIDTH / 2
    czz = (WIDTH / 2) ** 2 * height_m / MODULUS / second + height_m / MODULUS / area
    push, drag = depth_m / cnn, 0.0
    for _ in range(50):
        dent = (3 * push * (1 - POISSON**2) / 4 / MODULUS / np.sqrt(TIP)) ** (2 / 3)
        stick = 2 / 3 * 4 * MODULUS / (1 + POISSON) / (2 - POISSON) * np.sqrt(TIP * dent)
        push, drag = np.linalg.solve([[cnn, -cnz], [-cnz, czz + 1 / stick]], [depth_m - dent, 0.0])
        if drag > mu * push:
            push = (depth_m - dent) / (cnn - mu * cnz)
            drag = mu * push
    return push, drag


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3, 1.0, np.inf])
def test_a_beam_pressed_on_its_side_bends_as_a_beam(beam, mu):
    renderer = in_the_air(beam.with_friction(mu))
    for height in (0.035, 0.040):
        curve = press(renderer, np.array([0.0, 0.0, height]), np.array([-1.0, 0.0, 0.0]), Stroke(2e-3, 0.02))
        push, drag = bent_n(height, 2e-3, mu)
        felt = curve.force[curve.deepest]
        assert felt[0] == pytest.approx(push, rel=0.12)
        assert felt[2] == pytest.approx(drag, abs=0.12 * np.hypot(push, drag))
        assert curve.unsettled == 0


def drawn(renderer, seed: int, ticks: int) -> np.ndarray:
    """(n, 3) m, a hand's path: in along the normal of a place drawn on the surface, then some way about."""
    rng, arrays = np.random.default_rng(seed), renderer.contact.arrays
    touchable = np.flatnonzero(arrays.free)
    corners = arrays.triangles[rng.choice(touchable)]
    point, normal = arrays.vertices[corners].mean(axis=0), arrays.normals[corners].mean(axis=0)
    normal /= np.linalg.norm(normal)
    width = 80
    bell = np.exp(-(np.arange(-3 * width, 3 * width + 1) ** 2) / 2 / width**2)
    bell *= 1.5e-3 / np.sqrt((bell**2).sum())
    about = np.stack([np.convolve(rng.normal(size=ticks + 6 * width), bell, "valid") for _ in range(3)], 1)
    into = np.linspace(TIP + 1e-3, TIP - rng.uniform(0.5e-3, 2e-3), 150)
    path = np.vstack([point + into[:, None] * normal, point + into[-1] * normal + about - about[0]])
    path[:, 2] = np.maximum(path[:, 2], TIP)  # the support is in the way
    return path


def jumps(renderer, path: np.ndarray) -> tuple[np.ndarray, int]:
    """(n,) N/m, what the force changes by for each metre that the tip goes; steps that did not settle."""
    state = renderer.start([TIP])
    force = renderer.follow(state, path[:, None].copy(), np.full(len(path), 1e-3))[:, 0]
    way = np.linalg.norm(np.diff(path, axis=0), axis=1)
    change = np.linalg.norm(np.diff(force, axis=0), axis=1)
    # what may be left of the tangential force, and lacks of the friction
    change -= 2e-3 * np.linalg.norm(force[1:], axis=1)
    return np.maximum(change, 0.0) / np.maximum(way, 1e-9), int(state.unsettled[0])


@pytest.mark.parametrize(
    ("mu", "paths"),
    [
        (0.0, range(4)),
        (0.3, range(4)),
        (1.0, range(4)),
        (1.0, (146, 588, 918)),  # the body bends after the tip, past the plane of its place and off its rest
        *(pytest.param(mu, range(150), marks=pytest.mark.release) for mu in (0, 0.3, 1)),
    ],
)
def test_the_force_on_a_slender_body_never_jumps(tentacle, mu, paths):
    renderer = tentacle.with_friction(mu)
    stiffest = (
        4 * MODULUS / (1 - POISSON**2) * TIP
    )  # twice the dent's, 2 E* a, with a contact as wide as the tip
    unsettled = 0
    for seed in paths:
        changes, missed = jumps(renderer, drawn(renderer, seed, 1000))
        assert changes.max() < stiffest
        unsettled += missed
    assert unsettled < 3e-3 * len(paths) * 1000


def test_the_foot_of_a_tip_is_found_over_a_sharp_rim(tentacle):
    arrays, rng, left = tentacle.contact.arrays, np.random.default_rng(0), []
    corners = arrays.triangles[rng.choice(np.flatnonzero(arrays.free), 4000)]
    inside = rng.dirichlet(np.ones(3), len(corners))[:, :, None]
    tips = (inside * (arrays.vertices[corners] + TIP * arrays.normals[corners])).sum(axis=1)
    for tip in tips + rng.normal(scale=TIP / 10, size=tips.shape):
        weights, (point, normal, move) = np.zeros(3), np.zeros((3, 3))
        stack = np.zeros(STACK, dtype=np.int64)
        near, _ = closest_triangle(arrays.bvh, arrays.vertices, arrays.triangles, tip, np.inf, weights, stack)
        _, height = foot(arrays, near, weights, tip, point, normal, move)
        left.append(np.linalg.norm(tip - point - height * normal))
    assert (np.array(left) < 1e-6).mean() > 0.995


def test_a_force_that_does_not_settle_is_the_last_one_and_is_counted_and_told(beam):
    # no body gives way like that: by another law at each corner, and against the force
    rough = np.random.default_rng(1).normal(size=beam.parameters.far.shape)
    renderer = beam.with_friction(0.3).with_field(1e4 * (rough + rough.transpose(0, 2, 1)))
    path = drawn(renderer, 1, 1500)
    state, held = renderer.start([TIP]), 0
    for tip in path:
        last, before = state.forces[0].copy(), int(state.unsettled[0])
        renderer.step(state, tip[None].copy())
        if state.unsettled[0] > before:
            held += 1
            assert np.array_equal(state.forces[0], last)
    assert held == state.unsettled[0] > 0
    t = 1e-3 * np.arange(len(path))
    counted: list[int] = []
    replay(in_the_air(renderer), t, path, unsettled=counted.append)
    assert counted == [held]
    curve = press(in_the_air(beam), np.array([0, 0, 0.04]), np.array([-1.0, 0, 0]), Stroke(1e-3, 0.02))
    assert len(lines_of(story(replace(curve, unsettled=3)))) == len(lines_of(story(curve))) + 1
    assert figures_of(replace(curve, unsettled=3), KEYS)["unsettled_samples"] == 3
