"""A bonded skin: under the tip beside axisymmetric solutions, over the whole object as a membrane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import palpate as pp
from palpate.diagnosis.forward.prediction import Forward
from palpate.mechanics.compliance.patch import PatchSampler, half_space_compliance
from palpate.mechanics.compliance.pressed_places import solve_places
from palpate.mechanics.contact.dent import grid
from palpate.mechanics.contact.skin import skin_factors
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.elastic.membrane import half_space_change, membrane_stiffness
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.frames import tangents
from palpate.mechanics.model.material import Skin
from palpate.mechanics.presses.making import of_paths
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.scenes.phantoms import phantom
from tools.dent_half_space import HalfSpace, graded
from tools.dent_skin import DEPTHS, ELEMENT, NU, logarithms, pressed

TIP_M = 0.005


class Cylinder(HalfSpace):
    """Of eight tip radii, twice as high, fixed below; a skin covers top and wall."""

    def __init__(self, thickness: float, ratio: float) -> None:
        along = np.append(graded(ELEMENT, 1.6, 1.15, 6.0), np.linspace(8 - thickness, 8, 4))
        below = graded(0.1, 0.2, 1.15, 13.0)
        down = np.concatenate([np.linspace(0, thickness, 11), thickness + below[1:], [16.0]])
        super().__init__(ELEMENT, NU, "linear", 1.2, along=along, down=down)
        self.fixed[:] = False
        self.fixed[self.points[:, 0] == 0, 0] = True
        self.fixed[self.points[:, 1] == -16.0] = True
        r, z = self.points[self.cells].mean(axis=1).T
        own = np.where((z > -thickness) | (r > 8 - thickness), ratio, 1.0)
        self.rules = [((b, weight * own), part) for (b, weight), part in self.rules]


@pytest.fixture(scope="module")
def covered(tmp_path_factory):
    """A cylinder of the same size, uniform."""
    shape, path = phantom("cylinder"), tmp_path_factory.mktemp("covered") / "cylinder.stl"
    trimesh.Trimesh(shape.vertices, shape.faces, process=False).export(path)
    return pp.model_of(path, unit="m", progress=False)


@pytest.mark.slow
@pytest.mark.parametrize(("thickness", "ratio"), [(0.6, 1.0), (0.6, 2.0), (0.6, 5.0), (0.3, 5.0)])
def test_a_press_on_a_covered_cylinder_is_the_axisymmetric_one(covered, thickness, ratio):
    """As a model and as a fitted effect. Before, at a ratio of 5: 10 % too hard at 6 mm, 2 % at 0.5."""
    depth, force, _ = pressed(Cylinder(thickness, ratio))[1::2].T
    asked = np.array([0.1, 0.2, 0.4, 0.7, 1.0])
    known = np.exp(np.interp(np.log(asked), np.log(depth), np.log(force))) * TIP_M**2
    skin, top, up = Skin(thickness * TIP_M, ratio), np.array([0.0, 0.0, 0.08]), np.array([0.0, 0.0, 1.0])
    travel = np.append(0.0, asked * TIP_M)[:, None] * [1.0, 0.0, 0.0]
    frame, centre = np.stack([up, *tangents(up)]), top + TIP_M * up
    presses = of_paths(
        np.array([0, len(travel)]), centre - travel @ frame, np.zeros_like(travel), centre[None], up[None],
        tip_radius_m=TIP_M, sample_rate_hz=1000.0,
    )  # fmt: skip
    presses = replace(presses, columns={"lead": np.zeros_like(travel)})
    stated = covered.with_modulus(1.0).with_material(dent_law="linear")
    for by_effect in (False, True):
        model = stated if by_effect else stated.with_material(skin=skin)
        forward = Forward(presses, solve_places(model, top[None], up[None], frame[None]))
        settings = forward.ideal(1.0)
        if by_effect:
            effect("skin_layer").act(settings, np.array([skin.thickness_m, np.log(ratio)]), forward)
        assert np.abs(forward.predict(settings)[1:, 0]) == pytest.approx(known, rel=0.015)


@pytest.mark.parametrize("modulus_ratio", [0.3, 4.0])
def test_a_small_contact_feels_the_skin_and_a_wide_one_what_lies_within(modulus_ratio):
    thick, usual, thin = (skin_factors(Skin(t, modulus_ratio), TIP_M)[0] for t in (0.05, 2e-3, 5e-5))
    assert np.log(thick[60]) == pytest.approx(np.log(modulus_ratio), rel=0.08)
    assert np.log(thin[60]) == pytest.approx(0, abs=0.02 * abs(np.log(modulus_ratio)))
    felt = np.log(usual) / np.log(modulus_ratio)
    assert (np.diff(felt[:120]) <= 1e-9).all() and felt[0] == pytest.approx(1) and felt[120] > 0.05


def test_a_skin_weighs_more_under_a_blunter_contact():
    """On a bump the effective radius is smaller: the same skin is thicker beside it."""
    force, _, bent = skin_factors(Skin(3e-3, 3.0), TIP_M)
    sharper = skin_factors(Skin(3e-3, 3.0), TIP_M / 1.1)[0]
    assert force * (1 + 0.1 * bent) == pytest.approx(sharper, rel=0.004)


@pytest.mark.slow
@pytest.mark.parametrize(("thickness", "ratio"), [(0.6, 5.0), (0.35, 2.0), (1.3, 0.5)])
def test_between_the_solved_skins_a_dent_is_what_is_solved(thickness, ratio):
    force, sideways, _ = (
        np.interp(DEPTHS[:9], grid(), each) for each in skin_factors(Skin(thickness * TIP_M, ratio), TIP_M)
    )
    solved = np.exp(np.log(ratio) * logarithms(thickness, float(np.log(ratio)))[:9])
    assert force == pytest.approx(solved[:, 0], rel=0.01)
    assert sideways == pytest.approx(solved[:, 1], rel=0.015)


def test_a_stretched_membrane_holds_the_energy_of_plane_stress():
    mesh = box_mesh((2, 2, 2), (0.04, 0.04, 0.02)).quadratic()
    p, stretch = mesh.points, 0.003
    top = mesh.points[mesh.touchable_surface[:, :3]][..., 2].min(axis=1) > 0.0199
    matrix = membrane_stiffness(mesh, 0.4, np.where(top, stretch, 0.0))
    strained = np.stack([0.01 * p[:, 0] + 0.004 * p[:, 1], -0.002 * p[:, 1], 0.0 * p[:, 0]], axis=1).ravel()
    xx, yy, xy = 0.01, -0.002, 0.004
    density = (xx**2 + yy**2 + 2 * 0.4 * xx * yy + 0.5 * (1 - 0.4) * xy**2) / (1 - 0.4**2)
    assert strained @ (matrix @ strained) == pytest.approx(stretch * 0.04**2 * density, rel=1e-9)
    turned = np.cross([0.1, -0.2, 0.3], p).ravel() + np.tile([1.0, 2.0, 3.0], len(p))
    assert np.abs(matrix @ turned).max() < 1e-12, "moved as a whole nothing is stretched"


@pytest.mark.slow
@pytest.mark.parametrize("poisson_ratio", [0.3, 0.49])
def test_the_half_space_under_a_membrane_is_a_large_block_s(poisson_ratio):
    mesh = box_mesh((14, 14, 9), (0.28, 0.28, 0.18)).quadratic()
    width, stretch, middle = 0.016, 0.01, np.array([0.0, 0.0, 0.18])
    middle[:2] = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))[:2]
    nodes, weights = PatchSampler(mesh, width).weights(middle)
    found = []
    for s in (0.0, stretch):
        solver = Solver(mesh, poisson_ratio, stretch_m=s)
        loads = np.zeros((len(mesh.points), 3, 3))
        for axis in range(3):
            loads[nodes, axis, axis] = weights
        found.append(np.einsum("n,nab->ab", weights, solver.solve(loads)[nodes]))
    change = half_space_change(np.array([0.0, 0.0, 1.0]), poisson_ratio, width, stretch)
    plain = half_space_compliance(np.array([0.0, 0.0, 1.0]), poisson_ratio, width)
    assert np.diag(found[1] - found[0]) == pytest.approx(np.diag(change), abs=0.03 * plain[0, 0])
    assert change[0, 0] < -0.2 * plain[0, 0] and change[2, 2] == pytest.approx(0, abs=0.04 * plain[2, 2])
