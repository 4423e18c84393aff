"""Closed forms against each other and against an independent library."""

from __future__ import annotations

import numpy as np
import pytest

from . import closed_forms as reference

E, NU = 30e3, 0.45


def test_hertz_agrees_with_an_independent_library():
    """What ContactMechanics 1.8.3 answers for this depth, radius and modulus (`ReferenceSolutions.Hertz`)."""
    depth, radius = 1.2e-3, 5e-3
    assert reference.hertz_force(depth, radius, E, NU) == pytest.approx(0.1474301036408684, rel=1e-10)
    assert reference.hertz_contact_radius(depth, radius) == pytest.approx(0.002449489742783178, rel=1e-10)


def test_sphere_becomes_hertz_when_shallow_and_softer_when_deep():
    for a, least, most in ((1e-5, 0.9999, 1.0001), (4.5e-3, 0.7, 0.97)):
        force, depth = reference.sphere_force(a, 5e-3, E, NU)
        assert least < force / reference.hertz_force(depth, 5e-3, E, NU) < most


def test_boussinesq_integrated_over_a_punch_is_the_flat_punch():
    """The pressure F / (2 pi a sqrt(a^2 - r^2)) sinks every point under it alike, by F / (2 E* a)."""
    a, force = 4e-3, 0.7
    t = (np.arange(4000) + 0.5) / 4000  # r = a sqrt(1 - t^2): equal loads a step
    r = a * np.sqrt(1 - t**2)
    angle = 2 * np.pi * (np.arange(400) + 0.5) / 400
    source = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle)), np.zeros((4000, 400))], -1)
    for x in (0.0, 2e-3):
        at = np.array([x, 0.0, 0.0]) - source.reshape(-1, 3)
        sunk = -reference.boussinesq_displacement(at, force, E, NU)[:, 2].mean()
        assert reference.flat_punch_force(sunk, a, E, NU) == pytest.approx(force, rel=0.01)


@pytest.mark.parametrize("solution", [reference.boussinesq_displacement, reference.cerruti_displacement])
def test_half_space_solutions_are_in_equilibrium(solution):
    """Navier's equation by central differences inside, no traction on the free surface."""
    h = 1e-5
    point = np.array([3e-3, -2e-3, -4e-3])

    def u(p):
        return solution(np.atleast_2d(p), 1.0, 1.0, NU)[0]

    def first(f, p, axis):
        step = h * np.eye(3)[axis]
        return (f(p + step) - f(p - step)) / (2 * h)

    def divergence(p):
        return sum(first(u, p, k)[k] for k in range(3))

    laplace = sum((u(point + h * e) - 2 * u(point) + u(point - h * e)) / h**2 for e in np.eye(3))
    gradient = np.array([first(divergence, point, k) for k in range(3)])
    navier = laplace + gradient / (1 - 2 * NU)
    assert np.abs(navier).max() < 1e-3 * np.abs(laplace).max()


def test_surface_traction_vanishes_beside_the_load():
    h, p = 1e-6, np.array([[4e-3, 3e-3, 0.0]])
    for solution in (reference.boussinesq_displacement, reference.cerruti_displacement):

        def u(q, solution=solution):
            return solution(q, 1.0, 1.0, NU)[0]

        down = (u(p) - u(p - [0, 0, h])) / h
        along = [(u(p + h * e) - u(p - h * e)) / (2 * h) for e in np.eye(3)[:2]]
        shear_x, shear_y = down[0] + along[0][2], down[1] + along[1][2]
        normal = (1 - NU) * down[2] + NU * (along[0][0] + along[1][1])
        size = np.abs(down).max() + np.abs(along).max()
        assert max(abs(shear_x), abs(shear_y), abs(normal)) < 2e-3 * size


def test_sideways_punch_is_softer_than_downwards():
    down = reference.flat_punch_force(1.0, 1.0, E, NU)
    side = reference.bonded_punch_sideways_force(1.0, 1.0, E, NU)
    assert side / down == pytest.approx(2 * (1 - NU) / (2 - NU))
