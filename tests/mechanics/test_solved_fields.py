"""The far field in a field of the modulus, taken beside one that was solved, against solving it anew."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.compliance import field_response as solved_fields
from palpate.mechanics.compliance.field_response import APART, far_in_field, solve_field
from palpate.mechanics.compliance.patch import half_space_compliance
from palpate.mechanics.compliance.pressed_places import Places
from palpate.mechanics.compliance.sites import LoadPatch, touch_sites, touch_solver
from palpate.mechanics.frames import local_frames
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import box_mesh

UP, NU = np.array([0.0, 0.0, 1.0]), 0.49
AT_M = (0.018, 0.024, 0.033, 0.042)


def _places(edge_cells: int) -> Places:
    """Sixteen places on a slab of 60 mm and 20 mm thick."""
    mesh = box_mesh((edge_cells, edge_cells, 3), (0.06, 0.06, 0.02))
    model = Model(mesh.quadratic(), ObjectMaterial(1e4, NU), Support(np.zeros(3), UP), Tool(0.005), 0.01)
    centre = mesh.points[:, :2].mean(axis=0) - 0.03
    point = np.array([[x + centre[0], y + centre[1], 0.02] for x in AT_M for y in AT_M])
    normal = np.tile(UP, (len(point), 1))
    nothing = np.zeros((len(point), 3, 3))
    return Places(
        model, point, normal, local_frames(normal), nothing, *np.zeros((3, len(point))), np.ones(len(point))
    )


def _field(places: Places, log_sd: float, seed: int) -> np.ndarray:
    """Waves 25 mm long over the elements."""
    random = np.random.default_rng(seed)
    mesh = places.model.mesh
    centre = mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)
    waves, phases = random.normal(0, 250, (20, 3)), random.uniform(0, 2 * np.pi, 20)
    return log_sd * np.sqrt(2 / 20) * np.cos(centre @ waves.T + phases).sum(axis=1)


def _along(places: Places, tensor: np.ndarray) -> np.ndarray:
    normal = places.normal[places.first]
    return np.einsum("qi,qij,qj->q", normal, tensor, normal)


@pytest.fixture
def factorised(monkeypatch) -> list[int]:
    """A number for every factorisation."""
    count: list[int] = []

    class Counted(solved_fields.Solver):
        def __init__(self, *given, **named):
            count.append(len(count))
            super().__init__(*given, **named)

    monkeypatch.setattr(solved_fields, "Solver", Counted)
    return count


@pytest.mark.parametrize(
    "cells", [6, pytest.param(12, marks=pytest.mark.slow)]
)  # of 10 mm, which touches halve, and of 5 mm, which they do not
def test_a_solved_field_is_that_of_touch_sites(cells):
    places = _places(cells)
    log = _field(places, 0.3, 0)
    solver, blunt = touch_solver(places.model.mesh, NU, np.exp(log)), LoadPatch(tip_radius_m=1.0)
    points, normals = places.point[places.first], places.normal[places.first]
    expected = touch_sites(places.model.mesh, points, normals, NU, solver=solver, curvature=0.0, patch=blunt)
    far, half, width = far_in_field(places, log)
    np.testing.assert_allclose(far, expected.far, atol=2e-5 * np.abs(far + half).max())
    assert width == pytest.approx(expected.patch_width_m)
    np.testing.assert_allclose(half[0], half_space_compliance(UP, NU, width))


@pytest.mark.slow
def test_the_bounds_hold_the_compliance_of_another_field():
    places = _places(12)
    log = _field(places, 0.3, 0)
    near, other = solve_field(places, log), log + _field(places, 0.25, 1)
    least, most = near.bounds(other)
    exact = solve_field(places, other).energy.sum(axis=1, dtype=float)
    slack = 2e-5 * np.abs(exact).max()
    assert np.linalg.eigvalsh(exact - least).min() > -slack
    assert np.linalg.eigvalsh(most - exact).min() > -slack
    apart = _along(places, most - least) / _along(places, exact)
    assert apart.max() > 3e-3
    # half way is far nearer than the bounds tell
    missed = np.abs(_along(places, 0.5 * (least + most)) / _along(places, exact) - 1)
    assert missed.max() < 0.35 * apart.max()


@pytest.mark.slow
def test_fields_that_differ_little_share_a_factorisation(factorised):
    places = _places(12)
    log = _field(places, 0.3, 0)
    far_in_field(places, log)
    shared = []
    for seed in (1, 2):
        other = log + _field(places, 0.1, seed)
        shared.append((other, far_in_field(places, other)))
    assert len(factorised) == 1
    for other, (far, half, _) in shared:
        alone = solve_field(_places(12), other)
        exact = alone.energy.sum(axis=1, dtype=float)
        error = _along(places, far + half - exact) / _along(places, exact)
        assert np.abs(error).max() < 0.5 * APART
        assert np.abs(error).max() < 2e-3


@pytest.mark.slow
def test_a_field_far_from_all_is_solved_anew(factorised):
    places = _places(12)
    far_in_field(places, _field(places, 0.3, 0))
    other = _field(places, 0.6, 1)
    far, half, _ = far_in_field(places, other)
    assert len(factorised) == 2
    exact = solve_field(_places(12), other).energy.sum(axis=1, dtype=float)
    np.testing.assert_allclose(far + half, exact, rtol=0, atol=1e-6 * np.abs(exact).max())
