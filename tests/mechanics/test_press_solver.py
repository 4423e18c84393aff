"""The solver of a press: elements, meshes and contact against closed forms, tables and energy."""

import numpy as np
import pytest

from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.errors import OptionError
from palpate.mechanics.press_solver import equilibrium as settling
from palpate.mechanics.press_solver.graded_mesh import CurvedSurface, drawn_to, graded_mesh
from palpate.mechanics.press_solver.press import PressOptions, PressSolver
from palpate.mechanics.press_solver.solid import SolidElements
from palpate.mechanics.shape.tetmesh import box_mesh

RADIUS_M, HEIGHT_M = 5e-3, 0.3
TOP, UP = np.array([0.0, 0.0, HEIGHT_M]), np.array([0.0, 0.0, 1.0])


def half_space(poisson_ratio: float = 0.49, **options) -> PressSolver:
    """A block of unit modulus, 60 tip radii high and 120 wide."""
    return PressSolver(
        box_mesh((4, 4, 2), (2 * HEIGHT_M, 2 * HEIGHT_M, HEIGHT_M)),
        None,
        young_modulus_pa=1.0,
        poisson_ratio=poisson_ratio,
        tip_radius_m=RADIUS_M,
        options=PressOptions(**options),
    )


def graded_box():
    """A block, fine at the middle of its top."""
    mesh = box_mesh((2, 2, 2), (0.04, 0.04, 0.03))
    top = np.array([0.0, 0.0, 0.03])
    return graded_mesh(mesh, None, lambda at: np.maximum(4e-3, np.linalg.norm(at - top, axis=1)))


def test_a_uniform_deformation_leaves_inner_nodes_in_balance():
    mesh = graded_box()
    solid = SolidElements(mesh.points, mesh.cells, 0.49, 0.3)
    stretch = np.array([[0.12, 0.05, -0.03], [0.02, -0.06, 0.04], [0.01, 0.03, -0.04]])
    force = solid.respond(mesh.points @ stretch.T).forces
    total = np.zeros_like(mesh.points)
    np.add.at(total, mesh.cells.ravel(), force.reshape(-1, 3))
    inner = np.ones(len(total), dtype=bool)
    inner[mesh.faces.ravel()] = inner[mesh.fixed] = False
    assert inner.sum() > 50
    assert np.abs(total[inner]).max() < 1e-11 * np.abs(force).max()


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("stiffening, local", [(0.0, 0.0), (0.6, 0.0), (-0.3, 5.0)])
def test_force_is_the_slope_of_energy_and_tangent_that_of_force(stiffening, local, coupled):
    mesh, rng = graded_box(), np.random.default_rng(0)
    solid = SolidElements(mesh.points, mesh.cells, 0.49, stiffening, coupled=coupled, local_bulk=local)
    u = mesh.points @ (0.08 * rng.normal(size=(3, 3))) + 2e-5 * np.sin(300 * mesh.points)
    d = mesh.points @ rng.normal(size=(3, 3)) + 1e-4 * rng.normal(size=u.shape)
    here, step = solid.respond(u, tangent=True), 1e-5
    ahead, behind = solid.respond(u + step * d), solid.respond(u - step * d)
    local = d[mesh.cells].reshape(-1, 30)
    assert (ahead.energy - behind.energy) / (2 * step) == pytest.approx((here.forces * local).sum(), rel=1e-6)
    change = np.einsum("exy,ey->ex", here.stiffness, local)
    assert np.abs((ahead.forces - behind.forces) / (2 * step) - change).max() < 1e-6 * np.abs(change).max()


def test_a_graded_mesh_fills_the_block_and_is_fine_where_it_is_asked():
    mesh = graded_box()
    solid = SolidElements(mesh.points, mesh.cells, 0.3)
    assert solid.weights.sum() == pytest.approx(0.04 * 0.04 * 0.03, rel=1e-12)
    assert solid.weights.min() > 0
    corner = mesh.points[mesh.cells[:, :4]]
    edge = np.linalg.norm(corner[:, [0, 0, 0, 1, 1, 2]] - corner[:, [1, 2, 3, 2, 3, 3]], axis=2).max(axis=1)
    away = np.linalg.norm(corner.mean(axis=1) - [0, 0, 0.03], axis=1)
    assert (edge <= np.maximum(4e-3, away) * (1 + 1e-9)).all()


def test_new_nodes_lie_on_the_felt_surface():
    import pyvista

    ball = pyvista.Sphere(radius=0.02, theta_resolution=40, phi_resolution=40)
    surface = CurvedSurface(np.asarray(ball.points, dtype=float), ball.regular_faces)
    points = np.random.default_rng(1).normal(size=(50, 3))
    points *= 0.0198 / np.linalg.norm(points, axis=1, keepdims=True)
    # curved by its normals, it is a tenth as far from the ball as its facets are
    assert np.abs(np.linalg.norm(surface.nearest(points), axis=1) - 0.02).max() < 1e-5
    cube = box_mesh((2, 2, 2), (0.021, 0.021, 0.021))
    low = cube.points - [0, 0, 0.0105]
    mesh = drawn_to(type(cube)(low, cube.tetrahedra, cube.fixed, cube.touchable), surface)
    fine = graded_mesh(mesh, surface, lambda at: np.full(len(at), 0.008))
    shell = np.unique(fine.faces)
    shell = shell[fine.points[shell, 2] > 0.005]
    off = np.linalg.norm(surface.nearest(fine.points[shell]) - fine.points[shell], axis=1)
    assert np.median(off) < 2e-6


def test_a_coarse_files_plane_faces_and_rims_stay_where_they_are():
    import trimesh

    size = np.array([0.08, 0.08, 0.04])
    shell = trimesh.creation.box(size)  # 12 triangles
    solver = PressSolver(
        box_mesh((4, 4, 2), tuple(size)),
        (shell.vertices + [0, 0, size[2] / 2], shell.faces),
        young_modulus_pa=1.0,
        poisson_ratio=0.49,
        tip_radius_m=RADIUS_M,
    )
    points = solver.mesh.points[np.unique(solver.mesh.touchable_surface)]
    assert np.abs(off_box(points - [0, 0, size[2] / 2], size / 2)).max() < 2e-5


def test_a_coarse_cylinders_felt_surface_is_round_up_to_its_rim():
    import trimesh

    radius, half = 0.04, 0.04
    shell = trimesh.creation.cylinder(radius, 2 * half, sections=64)  # walls of one strip, 0.05 mm inside
    turn, z = np.meshgrid(np.linspace(0, 2 * np.pi, 101), half - 1e-3 * np.array([0.5, 1.5, 4, 30]))
    wall = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=-1).reshape(-1, 3)
    cap = wall * [0.97, 0.97, 0] + [0, 0, half]
    felt = CurvedSurface(shell.vertices, shell.faces)
    assert np.linalg.norm(felt.nearest(np.vstack([wall, cap])) - np.vstack([wall, cap]), axis=1).max() < 2e-5


def test_a_coarse_balls_felt_surface_is_round_between_its_corners():
    """Drawn in triangles of at most 3 mm it lay 5 µm off, and of other files 20 µm."""
    import trimesh

    shell = trimesh.creation.icosphere(subdivisions=3, radius=0.03)  # edges of 4.7 mm, 0.09 mm inside
    points = trimesh.creation.icosphere(subdivisions=5, radius=0.03).vertices
    felt = CurvedSurface(shell.vertices, shell.faces)
    assert np.abs(np.linalg.norm(felt.nearest(0.999 * points), axis=1) - 0.03).max() < 3e-6


def off_box(points: np.ndarray, half: np.ndarray) -> np.ndarray:
    """(k,) m, signed distance of points (k, 3) from a box of half sizes (3,) m about the origin."""
    out = np.abs(points) - half
    return np.linalg.norm(np.maximum(out, 0), axis=1) + np.minimum(out.max(axis=1), 0)


def test_a_shallow_press_without_friction_is_hertz():
    depth = np.array([2e-5])
    pressed = half_space(0.3, law="linear", friction=0.0).press(TOP, UP, depth)
    hertz = dent_law("hertz").force(depth, 1.0, 0.3, RADIUS_M)
    assert pressed.force[0, 2] == pytest.approx(hertz[0], rel=0.015)
    assert np.abs(pressed.force[0, :2]).max() < 1e-3 * hertz[0]
    assert pressed.contact_radius[0] == pytest.approx(np.sqrt(RADIUS_M * depth[0]), rel=0.12)


def test_a_sticking_press_at_small_strain_is_the_table_and_its_side_stiffness_is_mindlins():
    depth, across = np.array([1e-3]), 2e-5
    pressed = half_space(law="linear").press(TOP, UP, depth, slide=np.array([[across, 0, 0]]))
    law = dent_law("linear", 0.49)
    assert pressed.force[0, 2] == pytest.approx(law.force(depth, 1.0, 0.49, RADIUS_M)[0], rel=0.015)
    x = depth[0] / RADIUS_M
    stiffness = (
        4 / (1.49 * 1.51) * RADIUS_M * np.sqrt(x) * np.interp(x, np.linspace(0, 3, 601), law.table[:, 2])
    )
    # the stiffness follows the contact's edge, which elements of half its radius know to some 6 %
    assert -pressed.force[1, 0] == pytest.approx(stiffness * across, rel=0.1)


def test_energy_is_work_without_friction():
    depths = np.linspace(1.0e-3, 1.2e-3, 3)
    pressed = half_space(law="linear", friction=0.0, growth=1.2).press(TOP, UP, depths)
    work = (pressed.force[:, 2] @ [1, 4, 1]) * (depths[1] - depths[0]) / 3
    assert pressed.energy[2] - pressed.energy[0] == pytest.approx(work, rel=0.01)


def test_options_and_depths_that_make_no_sense_are_refused():
    with pytest.raises(OptionError, match="law"):
        PressOptions(law="rubber")
    with pytest.raises(OptionError, match="friction"):
        PressOptions(friction=-0.1)
    with pytest.raises(OptionError, match="increasing"):
        half_space().press(TOP, UP, np.array([2e-3, 1e-3]))


@pytest.mark.slow
def test_a_deep_press_at_finite_strain_is_the_axisymmetric_table():
    depths = np.array([0.67e-3, 2e-3, 4e-3, 6e-3, 8e-3])
    pressed = half_space(coupled=True).press(TOP, UP, depths)
    table = dent_law("neo-hookean", 0.49).force(depths, 1.0, 0.49, RADIUS_M)
    assert pressed.converged.all()
    np.testing.assert_allclose(pressed.force[:, 2], table, rtol=0.02)


@pytest.mark.slow
def test_a_tip_that_slides_drags_by_coulombs_law():
    slide = np.outer(np.arange(1, 5), [5e-4, 0, 0])
    pressed = half_space(friction=0.3, growth=1.0).press(TOP, UP, np.array([1e-3]), slide)
    assert abs(pressed.force[0, 0]) < 0.01 * pressed.force[0, 2]
    # the dent leans against the tip: a few hundredths beside friction
    assert -pressed.force[-1, 0] / pressed.force[-1, 2] == pytest.approx(0.3, abs=0.05)


@pytest.mark.release
def test_a_slippery_tip_goes_deep_with_less_force_than_one_that_sticks():
    depths = np.array([2e-3, 4e-3, 6e-3])
    forces = [
        half_space(friction=friction, finest=0.9, growth=1.3, zone=3.5).press(TOP, UP, depths).force[:, 2]
        for friction in (0.0, 0.15, None)
    ]
    assert np.isfinite(forces).all()
    assert (np.diff(forces, axis=0)[:, 1:] > 0).all()


def test_a_tangent_that_is_no_valley_costs_a_shorter_step(monkeypatch):
    """It ended a deep press of a thin plate, and the run of all others with it."""
    solver, depths = half_space(finest=0.9, growth=1.3, zone=3.5), np.array([1e-3, 2e-3])
    usual = solver.press(TOP, UP, depths).force
    condensed, calls = settling.Condensed, []

    def sometimes(dense, few):
        calls.append(len(few))
        if len(calls) == 2:
            raise np.linalg.LinAlgError("not positive definite")
        return condensed(dense, few)

    monkeypatch.setattr(settling, "Condensed", sometimes)
    assert solver.press(TOP, UP, depths).force[:, 2] == pytest.approx(usual[:, 2], rel=2e-3)
    assert len(calls) > 2
