"""What a press says of its own error: its parts, its size, where nothing is said."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from palpate import render
from palpate.mechanics.compliance.sites import uneven_curvature
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import error_figures, force_errors, law_share, place_numbers
from palpate.render.press import Stroke, press
from palpate.render.scene import in_the_air

from . import shapes

KEYS = ("force_error_n", "modulus_error_n", "shape_error_n", "first_touch_error_n")


def test_the_law_is_surer_on_flat_ground_than_deep_on_a_bump_or_beside_a_rim():
    flat, bump, *edges = (float(law_share(1.0, *at)) for at in (np.zeros(8), *(0.3 * np.eye(8))))
    assert 0 < flat < bump and flat < min(edges)
    assert float(law_share(1.5, 0.3, 0, 0, 0)) > bump


def test_the_law_is_less_sure_of_a_compressible_solid_and_of_a_deep_slippery_tip():
    flat, squeezed = (float(law_share(1.0, 0, 0, 0, 0, poisson_ratio=nu)) for nu in (0.49, 0.35))
    assert squeezed > 1.4 * flat
    shallow, deep, slippery = (
        float(law_share(x, 0, 0, 0, 0, friction=mu)) for x, mu in ((0.2, 1.0), (2.0, 1.0), (2.0, 0.05))
    )
    assert deep > 1.5 * shallow and slippery > 1.1 * deep


def test_a_force_on_a_body_that_bends_is_as_sure_as_its_bending_and_not_as_its_dent():
    """1.8 times the force was stated for the side of a slender body, whose bending its elements solve."""
    width, height, at, radius = 0.010, 0.050, 0.040, 0.005
    beam = shapes.fem(shapes.model(shapes.block((width, width, height), (2, 2, 10)), modulus=5e3))
    curve = press(in_the_air(beam), np.array([0, 0, at]), np.array([-1.0, 0, 0]), Stroke(2e-3, 0.02))
    place = int(np.argmin(np.linalg.norm(beam.contact.arrays.vertices - [width / 2, 0, at], axis=1)))
    bent, aside, *_ = place_numbers(beam, radius, np.array([place]))[:, 0]
    assert aside == pytest.approx(3 * width / (4 * at), rel=0.3)  # a cantilever's, which has no shear or dent
    stated = curve.error_figures["force_error_n"] / np.linalg.norm(curve.force, axis=1).max()
    assert 0.01 < stated < 0.2


def test_a_force_in_a_groove_as_narrow_as_the_tip_is_as_unsure_as_solved_presses_found():
    """A press in a groove of 4 mm radius was 24 % off its solution where 2.2 % were stated."""
    tip, groove = 0.004, 0.0045

    def stated(height):
        plate = grid_plate(height)
        uneven = uneven_curvature(plate, np.array([[0, 0, height(0.0)]]), np.array([[0, 0, 1.0]]), tip)
        return float(law_share(0.07, 0.1, 0, 0, 0, tip * uneven[0]))

    def grooved(x):
        return -np.sqrt(np.maximum(groove**2 - x**2, 0.0)) if abs(x) < groove / 2 else -groove * np.sqrt(0.75)

    assert stated(grooved) > 0.16
    assert stated(lambda x: x**2 / (2 * 0.012)) < 0.03  # a wide one


def test_a_force_beside_a_rim_on_elements_too_coarse_for_it_is_less_sure():
    """6 mm from two rims of a block of 500 mm the law was 11 to 23 % too hard where 2.5 % were stated."""
    size = np.array([0.2, 0.2, 0.2])
    box = trimesh.creation.box(size)
    box.apply_translation([0, 0, 0.1])
    mesh = replace(shapes.block(size, (4, 4, 4)), shape=TrueShape(box.vertices, box.faces))
    renderer = shapes.fem(shapes.model(mesh))
    surface = renderer.contact.arrays

    def stated(at):
        off = np.linalg.norm(surface.vertices - at, axis=1) + (surface.normals[:, 1] > -0.9)
        return float(law_share(0.4, *place_numbers(renderer, 0.005, np.array([int(off.argmin())]))[:, 0]))

    assert stated([-0.094, -0.1, 0.194]) > 0.15
    assert stated([0.0, -0.1, 0.1]) < 0.05


def test_a_force_on_a_flank_close_above_the_base_is_less_sure_where_the_patch_is_wide_for_the_tip():
    """A beam pressed 2.4 mm above its base by a tip of 1.2 mm was 4 % too soft where 2.5 % were stated."""
    size = np.array([0.01, 0.01, 0.05])
    box = trimesh.creation.box(size)
    box.apply_translation([0, 0, size[2] / 2])
    mesh = replace(shapes.block(size, (4, 4, 20)), shape=TrueShape(box.vertices, box.faces))
    renderer = shapes.fem(shapes.model(mesh))
    surface = renderer.contact.arrays

    def stated(height, tip):
        off = np.linalg.norm(surface.vertices - [size[0] / 2, 0, height], axis=1)
        numbers = place_numbers(renderer, tip, np.array([int(off.argmin())]))[:, 0]
        return float(np.sqrt(law_share(0.4, *numbers) ** 2 - law_share(0.4, *numbers[:7]) ** 2))

    assert 0.02 < stated(2.4e-3, 1.2e-3) < 0.05
    assert stated(2.4e-3, 0.3e-3) < 0.01
    assert stated(8e-3, 1.2e-3) < 1e-4


def test_a_force_on_a_wall_with_air_behind_is_less_sure_and_on_a_plate_that_lies_is_not():
    """A shell of 4 mm was rendered 33 % too hard where 2.4 % were stated."""

    def number_and_share(size, at, normal):
        box = trimesh.creation.box(size)
        box.apply_translation([0, 0, size[2] / 2])
        mesh = replace(shapes.block(size, (2, 4, 2)), shape=TrueShape(box.vertices, box.faces))
        renderer = shapes.fem(shapes.model(mesh))
        surface = renderer.contact.arrays
        off = np.linalg.norm(surface.vertices - at, axis=1) + (surface.normals @ normal < 0.9)
        numbers = place_numbers(renderer, 0.005, np.array([int(off.argmin())]))[:, 0]
        return numbers[5], float(law_share(0.1, *numbers))

    wall, share = number_and_share((0.004, 0.06, 0.06), [0.002, 0, 0.03], np.array([1.0, 0, 0]))
    assert wall == pytest.approx((0.44 * 5 / 4) ** 2, rel=0.01) and share > 0.33
    assert number_and_share((0.06, 0.06, 0.004), [0, 0, 0.004], np.array([0, 0, 1.0]))[0] == 0
    assert number_and_share((0.06, 0.06, 0.06), [0.03, 0, 0.03], np.array([1.0, 0, 0]))[0] < 0.002


def test_a_tip_at_a_sharp_rim_is_as_unsure_as_it_is_felt_late():
    """1 mm beyond a block's rim nothing was felt, nor doubted, of a tip that overlapped by 0.29 mm; a sixth
    of a millimetre deep the law was 59 % too soft where 20 % were stated, between the faces 44 % too hard."""
    size, radius = np.array([0.06, 0.06, 0.04]), 0.005
    box = trimesh.creation.box(size)
    box.apply_translation([0, 0, size[2] / 2])
    mesh = replace(shapes.block(size, (6, 6, 4)), shape=TrueShape(box.vertices, box.faces))
    renderer = shapes.fem(shapes.model(mesh))
    rim, material = np.array([size[0] / 2, 0, size[2]]), renderer.model.material
    hertz = 4 / 3 * material.young_modulus_pa / (1 - material.poisson_ratio**2) * np.sqrt(radius)

    def felt(away, overlap_m):
        """(force N, what it may be off by N), of a tip that comes from `away`, (2,) x and z."""
        along = np.array([away[0], 0, away[1]]) / np.hypot(*away)
        path = rim + np.outer(radius + np.linspace(1e-3, -overlap_m, 40), along)
        force = renderer.follow(renderer.start([radius]), path[:, None], np.full(40, 10.0))[-1:, 0]
        errors = force_errors(renderer, path[-1:], force, radius)
        return float(np.linalg.norm(force)), float(errors.law_n[0])

    for overlap in (0.2e-3, 0.4e-3):  # solved, a right-angled rim is about half as stiff as plane ground
        force, off = felt((1.0, 4.9), overlap)
        wedge = hertz * overlap**1.5 / 2
        assert force < 0.6 * wedge and force + off > wedge
    force, off = felt((1.0, 1.0), 0.33e-3)
    assert off > 0.306 * force


def test_a_tip_felt_late_at_the_rim_of_a_wall_misses_no_more_than_the_wall_gives():
    """8 times the force was stated at this edge, 15 at that of a web of the zoo: a half-space does not
    bend."""
    size, radius = np.array([0.008, 0.06, 0.06]), 0.005
    box = trimesh.creation.box(size)
    box.apply_translation([0, 0, size[2] / 2])
    mesh = replace(shapes.block(size, (2, 6, 6)), shape=TrueShape(box.vertices, box.faces))
    renderer = shapes.fem(shapes.model(mesh))
    rim = np.array([size[0] / 2, 0.0, size[2]])
    stated = []
    for away in ([1.0, 0.0, 0.2], [0.2, 0.0, 1.0]):
        along = np.array(away) / np.linalg.norm(away)
        path = rim + np.outer(radius + np.linspace(1e-3, -1e-3, 40), along)
        force = renderer.follow(renderer.start([radius]), path[:, None], np.full(40, 10.0))[-1:, 0]
        stated.append(
            float(force_errors(renderer, path[-1:], force, radius).law_n[0] / np.linalg.norm(force))
        )
    assert stated[0] < 1.5  # pushed to bend
    assert stated[1] > 0.1  # pushed along the web


def grid_plate(height):
    """A mesh of no tetrahedra whose shape is a plate of 40 x 40 mm, its top at height(x)."""
    at = np.linspace(-0.02, 0.02, 81)
    x, y = np.meshgrid(at, at[::4], indexing="ij")
    top = np.stack([x, y, np.vectorize(height)(x)], axis=-1)
    low = top.copy()
    low[..., 2] = -0.03
    rows, columns = x.shape
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    lid = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    around = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    nxt, below = np.roll(around, -1), rows * columns
    wall = np.vstack(
        [np.column_stack([around, around + below, nxt + below]), np.column_stack([around, nxt + below, nxt])]
    )
    points = np.vstack([top.reshape(-1, 3), low.reshape(-1, 3)])
    shape = TrueShape(points, np.vstack([lid, lid[:, ::-1] + below, wall]))
    return SimpleNamespace(shape=shape)


def test_error_grows_with_the_force_and_is_told_in_its_parts(block_renderer):
    top, radius = np.array([0.0, 0.0, 0.08]), 0.005
    centre = np.array([top + [0, 0, radius - 0.001], top + [0, 0, radius - 0.004]])
    force = np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.8]])
    errors = force_errors(block_renderer, centre, force, radius)
    assert 0.005 < errors.law_n[0] / 0.1 < 0.1
    assert errors.law_n[1] == pytest.approx(8 * errors.law_n[0], rel=0.3)
    figures = error_figures(errors)
    assert tuple(figures) == KEYS
    assert all(np.isfinite(value) and value >= 0 for value in figures.values())


def test_a_shape_that_is_given_is_not_doubted(block_renderer):
    """An exact file was said to be off by a millimetre, which is half of the force of a shallow press."""
    model = block_renderer.model
    box = trimesh.creation.box((0.1, 0.1, 0.08))
    box.apply_translation([0.0, 0.0, 0.04])
    shape = TrueShape(np.asarray(box.vertices), np.asarray(box.faces))
    given = model.replaced(mesh=replace(model.mesh, shape=shape), shape_uncertainty_m=None)
    centre, force = np.array([[0.0, 0.0, 0.083]]), np.array([[0.0, 0.0, 0.3]])
    by_shape = []
    for each in (model, given):
        errors = force_errors(FemRenderer(each, compliance=block_renderer.compliance), centre, force, 0.005)
        by_shape.append(float(errors.shape_n[0]))
    assert by_shape[0] > 0.1 and by_shape[1] == 0.0


def test_in_air_there_is_nothing_to_be_off_by(block_renderer):
    errors = force_errors(block_renderer, np.array([[0.0, 0.0, 0.2]]), np.zeros((1, 3)), 0.005)
    assert error_figures(errors) == dict.fromkeys(KEYS, 0)


def test_a_one_d_renderer_says_nothing_of_its_own_error(one_d_model):
    renderer = render.create("kelvin-voigt", one_d_model)
    assert error_figures(force_errors(renderer, np.zeros((1, 3)), np.ones((1, 3)), 0.005)) == {}
