"""What a nodule close below the surface adds under a contact narrower than the load patch."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.mechanics.compliance.near_field import ball_law, contact_width
from palpate.mechanics.compliance.sites import load_width, patch_width, touch_solver
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import Ball, balls_ratio, inclusion_ratio, mixed_ratio
from palpate.mechanics.shape.refine import refined_around, refined_near_surface

NU = 0.49
TOP = np.array([[0.0, 0.0, 0.04], [0.035, 0.035, 0.04]])
UP = np.array([[0.0, 0.0, 1.0]] * 2)
BALL = Ball((0.0, 0.0, 0.026), 0.009, 6.0)


@pytest.fixture(scope="module")
def mesh(box):
    return box((8, 8, 4), (0.08, 0.08, 0.04)).quadratic()


def stiff(mesh, times=1.0):
    return times * balls_ratio(mesh, [BALL])


def test_a_load_is_never_narrower_than_a_contact(box):
    """On elements of 2.5 mm a nodule was felt a third too much, under a load of half the contact's width."""
    mesh = box((30, 30, 4), (0.075, 0.075, 0.01)).quadratic()
    solver = SimpleNamespace(mesh=mesh, uniform=False)  # nothing is solved
    assert load_width(solver, 0.005) == pytest.approx(contact_width(0.005))
    assert load_width(solver, 0.001) < contact_width(0.005), "what the elements bear"
    assert load_width(solver, 1.0) == pytest.approx(patch_width(mesh))


def test_a_bent_dent_has_the_forces_of_both_depths(mesh):
    """The contact widens: over a stiff ball deep touches gain less than a far field alone makes them gain."""
    law = ball_law(Solver(mesh, NU, stiff(mesh)), TOP, UP, patch_width(mesh))
    assert law.bracing[1] == 0 and (law.far[1] == 0).all(), "too far to matter"
    assert law.far[0, 2, 2] < 0 and law.bracing[0] < 0
    soft = ball_law(Solver(mesh, NU, balls_ratio(mesh, [replace(BALL, modulus_ratio=0.3)])), TOP, UP, 0.004)
    assert soft.far[0, 2, 2] > 0 and soft.bracing[0] > 0
    twice = ball_law(Solver(mesh, NU, stiff(mesh, 2.0)), TOP, UP, patch_width(mesh))
    assert twice.far[0, 2, 2] == pytest.approx(law.far[0, 2, 2] / 2, rel=1e-4)
    assert twice.bracing[0] == pytest.approx(law.bracing[0], rel=1e-3), "it has no unit of force"


def test_a_cut_element_keeps_the_far_effect_of_its_share():
    def effect(ratio):  # Eshelby's factor of a ball in an incompressible solid
        return 5 * (ratio - 1) / (2 * ratio + 3)

    share = np.linspace(0, 1, 11)
    for stiffness in (0.3, 6.0, 50.0):
        assert np.allclose(effect(mixed_ratio(share, stiffness)), share * effect(stiffness))


def test_a_ball_is_drawn_anew_on_finer_elements(mesh):
    linear, centre = mesh.linear(), np.array(BALL.centre_m)
    fine, parent = refined_around(mesh, centre, BALL.radius_m, 0.006)
    assert len(fine.tetrahedra) > 1.2 * len(mesh.tetrahedra)
    assert np.allclose(np.bincount(parent, fine.volumes), linear.volumes)
    area = [np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum() / 2
            for p in (m.points[m.surface] for m in (fine, linear))]  # fmt: skip
    assert area[0] == pytest.approx(area[1]), "a face that only one side halved would count twice"
    base = np.random.default_rng(0).uniform(0.5, 2.0, len(mesh.tetrahedra))
    solver = touch_solver(mesh, NU, base, balls=[BALL], surface_edge_m=0.006)
    fine, parent = refined_near_surface(mesh, 0.006)
    fine, step = refined_around(fine, centre, BALL.radius_m, 0.006)
    parent = parent[step]
    want = base[parent] * inclusion_ratio(fine, centre, BALL.radius_m, BALL.modulus_ratio)
    assert np.allclose(solver.modulus_ratio, want)
