"""Touched places solved beside a law: factors along the depth, once a place, kept where a law finds none."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.contact.depth_factors import DepthFactors
from palpate.mechanics.contact.touch import TouchedPlaces, touch_forces
from palpate.mechanics.errors import OptionError
from palpate.mechanics.law_errors import Stiffness
from palpate.mechanics.press_solver import solved_places
from palpate.mechanics.press_solver.solved_places import (
    PlacesToSolve,
    felt_of,
    said_beforehand,
    solve_touched,
)
from palpate.mechanics.shape.tetmesh import box_mesh

E, NU, TIP = 20e3, 0.49, 0.005
UP = np.array([0.0, 0.0, 1.0])


def law_along(depths: np.ndarray, law: str) -> np.ndarray:
    """The law's normal force of a half-space, N over Pa."""
    way = np.concatenate([[0.0], depths])
    places = TouchedPlaces(UP[None], np.zeros((1, 3, 3)))
    return touch_forces(
        -way[:, None] * UP, np.array([0, len(way)]), places, young_modulus_pa=1.0, poisson_ratio=NU,
        tip_radius_m=TIP, law=law,
    )[1:, 2]  # fmt: skip


def solved_block(monkeypatch, normal_force, laws=("linear", "neo-hookean")):
    """Four presses at two places of a block, solved by `normal_force(law, point, depths)`."""
    asked = []

    def answer(self, point, normal, depths):
        asked.append((self.solver.options.law, float(depths[-1])))
        return normal_force(self.solver.options.law, point, depths)

    monkeypatch.setattr(solved_places.SolvedPresses, "normal_force", answer)
    mesh = box_mesh((4, 4, 2), (0.08, 0.08, 0.04)).quadratic()
    points = np.array([[-0.01, 0, 0.04], [0.01, 0, 0.04], [-0.01, 0, 0.04], [0.01, 0, 0.04]])
    known = TouchedPlaces(np.tile(UP, (4, 1)), np.zeros((4, 3, 3)))
    touched = PlacesToSolve(points, np.array([0, 1, 0, 1]), np.array([2e-3, 4e-3, 3e-3, 1e-3]), known)
    exact = solve_touched(
        mesh, touched, laws, ratio=np.ones(len(mesh.tetrahedra)), poisson_ratio=NU, young_modulus_pa=E,
        tip_radius_m=TIP,
    )  # fmt: skip
    return exact, asked


def test_repeats_take_the_factor_of_their_places_deepest_press(monkeypatch):
    def stiffer_where_deep(law, point, depths):
        return law_along(depths, law) * (1.1 if law == "linear" else 1 + 20 * depths)

    exact, asked = solved_block(monkeypatch, stiffer_where_deep)
    assert asked == [(law, deep) for law in ("linear", "neo-hookean") for deep in (4e-3, 3e-3)] or asked == [
        (law, deep) for law in ("linear", "neo-hookean") for deep in (3e-3, 4e-3)
    ]
    press, depth = np.array([0, 1, 2, 3]), np.array([1e-3, 2e-3, 1e-3, 9e-3])
    np.testing.assert_allclose(exact.factors["linear"].at(press, depth), 1.1, rtol=1e-9)
    expected = 1 + 20 * np.array([1e-3, 2e-3, 1e-3, 4e-3])  # held beyond the deepest
    np.testing.assert_allclose(exact.factors["neo-hookean"].at(press, depth), expected, rtol=1e-6)
    assert exact.unsolved == 0 and exact.solved.all() and len(exact.places) == 4
    first = exact.places[0]
    np.testing.assert_allclose(first.solved_n, 1.1 * first.law_n)
    np.testing.assert_allclose(first.law_n, E * law_along(first.depth_m, "linear"), rtol=1e-6)
    plain = exact.as_json()
    assert plain["unsolved_places"] == 0 and {one["dent_law"] for one in plain["places"]} == set(
        exact.factors
    )


def test_a_place_that_one_law_cannot_solve_keeps_every_law(monkeypatch):
    def lost_at_one(law, point, depths):
        lost = law == "neo-hookean" and point[0] > 0
        return np.full(len(depths), np.nan) if lost else 0.9 * law_along(depths, law)

    exact, _ = solved_block(monkeypatch, lost_at_one)
    assert exact.unsolved == 1 and exact.solved.tolist() == [True, False, True, False]
    for factors in exact.factors.values():
        np.testing.assert_allclose(factors.at(np.arange(4), np.full(4, 2e-3)), [0.9, 1, 0.9, 1])
        solved = Stiffness.solved.value
        np.testing.assert_allclose(factors.law_error(0.03), [solved, 0.03, solved, 0.03])
    assert exact.of(np.array([False, True, True, False])).solved.tolist() == [False, True]


def test_no_press_is_solved_under_a_law_of_small_contacts(monkeypatch):
    with pytest.raises(OptionError, match="hertz"):
        solved_block(monkeypatch, None, laws=("hertz",))


def test_a_touch_at_a_solved_place_has_the_solved_force():
    depth = np.linspace(0, 3e-3, 31)
    told = {
        0: (
            depth[10:],
            law_along(depth[10:], "linear"),
            (1 + 30 * depth[10:]) * law_along(depth[10:], "linear"),
        )
    }
    places = TouchedPlaces(np.tile(UP, (2, 1)), np.zeros((2, 3, 3)), factors=DepthFactors.fitted(2, told))
    force = touch_forces(
        -np.tile(depth, 2)[:, None] * UP, np.array([0, 31, 62]), places, young_modulus_pa=E, poisson_ratio=NU,
        tip_radius_m=TIP, law="linear",
    )[:, 2]  # fmt: skip
    np.testing.assert_allclose(force[10:31], (1 + 30 * depth[10:]) * force[41:], rtol=1e-6)
    np.testing.assert_allclose(force[1:10], (1 + 30 * depth[10]) * force[32:41], rtol=1e-6)


def test_what_is_felt_of_a_mesh_alone_is_its_boundary():
    points, triangles = felt_of(box_mesh((3, 3, 3), (0.06, 0.06, 0.06)).quadratic())
    corner = points[triangles]
    volume = np.einsum("ki,ki->k", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum() / 6
    assert volume == pytest.approx(0.06**3) and len(np.unique(triangles)) == len(points) == 56


def test_time_is_said_by_places_and_laws():
    assert "1 place " in said_beforehand(1) and "10 s" in said_beforehand(1)
    twelve = said_beforehand(12, 2)
    assert "12 places" in twelve and "2 laws" in twelve and "4 min" in twelve


@pytest.mark.slow
def test_a_solved_place_of_a_block_lies_beside_the_law(tmp_path, monkeypatch):
    from palpate.mechanics.compliance.compression import own_blocks
    from palpate.mechanics.compliance.patch import PATCH_WIDTH_M as WIDTH
    from palpate.mechanics.compliance.patch import half_space_compliance
    from palpate.mechanics.compliance.sites import SURFACE_EDGE_M
    from palpate.mechanics.elastic.solver import Solver
    from palpate.mechanics.shape.refine import refined_near_surface

    monkeypatch.setattr(solved_places, "cache_folder", lambda: tmp_path)
    mesh = box_mesh((8, 8, 4), (0.08, 0.08, 0.04))
    points, normals = np.array([[0.0, 0.0, 0.04]]), UP[None]
    fine = refined_near_surface(mesh, SURFACE_EDGE_M)[0].quadratic()
    far = own_blocks(Solver(fine, NU), points, WIDTH) - half_space_compliance(normals, NU, WIDTH)
    known = TouchedPlaces(normals, far)
    exact = solve_touched(
        mesh.quadratic(), PlacesToSolve(points, np.array([0]), np.array([4e-3]), known), ("linear",),
        ratio=np.ones(len(mesh.tetrahedra)), poisson_ratio=NU, young_modulus_pa=E, tip_radius_m=TIP,
    )  # fmt: skip
    np.testing.assert_allclose(exact.places[0].solved_n, exact.places[0].law_n, rtol=0.01)
