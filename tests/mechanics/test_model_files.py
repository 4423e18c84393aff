"""MODEL folders: written whole or not at all, read back the same, contradictions named."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.errors import FileError, MeshError, ModelError
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.material import (
    MODULUS_LIMITS,
    Ball,
    Gradient,
    ObjectMaterial,
    Skin,
    inclusion_ratio,
    skin_ratio,
)
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.presses.making import of_places
from palpate.mechanics.shape.tetmesh import TetMesh


def cube() -> TetMesh:
    """A unit cube of six tetrahedra around one diagonal, fixed at z = 0."""
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    tets = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
    return TetMesh(points, tets, points[:, 2] == 0, points[:, 2] > 0)


def model(order: int) -> Model:
    mesh = cube() if order == 1 else cube().quadratic()
    material = ObjectMaterial(
        16e3, 0.49, (15e3, 17e3), "neo-hookean", {"a ball": Ball((0.5, 0.5, 0.6), 0.3, 6.0)},
        Gradient(1.5, 0.7), Skin(0.1, 3.0), np.linspace(1, 2, len(mesh.tetrahedra)),
    )  # fmt: skip
    return Model(
        mesh, material, Support(np.zeros(3), np.array([0, 0, 1.0])), Tool(0.005), 0.01,
        shape_uncertainty_m=np.linspace(0, 1e-3, len(mesh.points)),
        presses=of_places([0.5, 0.5, 1.0], [0, 0, 1.0], 0.005, depth_m=0.004, fits={"e_pa": 15.5e3}),
        effects={"viscoelasticity": {"g": [0.3], "tau_s": [0.3]}},
        provenance={"method": "finite-tip"},
        about={"shape": {"surface": "block", "held_out_m": {"block+": 1e-4}}},
    )  # fmt: skip


def edited(path, *changes):
    """The folder with texts of its model.toml replaced."""
    text = (path / "model.toml").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (path / "model.toml").write_text(text)
    return path


@pytest.mark.parametrize("order", [1, 2])
def test_round_trip(tmp_path, order):
    first = model(order)
    again = read_model(write_model(tmp_path / "m", first))
    assert np.array_equal(again.mesh.points, first.mesh.points)
    assert np.array_equal(again.mesh.tetrahedra, first.mesh.tetrahedra)
    assert np.array_equal(again.mesh.touchable, first.mesh.touchable)
    for name in ("young_modulus_pa", "young_modulus_ci95_pa", "poisson_ratio", "dent_law"):
        assert getattr(again.material, name) == getattr(first.material, name)
    for name in ("inclusions", "gradient", "skin"):
        assert getattr(again.material, name) == getattr(first.material, name)
    assert np.array_equal(again.material.field, first.material.field)
    assert np.array_equal(again.element_ratio, first.element_ratio)
    assert np.array_equal(again.support.normal, first.support.normal) and again.tool == first.tool
    assert again.about == first.about and again.provenance == first.provenance
    assert np.array_equal(again.shape_uncertainty_m, first.shape_uncertainty_m)
    assert again.effects["viscoelasticity"]["tau_s"] == [0.3]
    assert again.presses.fits["e_pa"] == [15.5e3] and np.isnan(again.presses.fits["k_kv"][0])


def test_an_interrupted_write_leaves_the_old_model(tmp_path, monkeypatch):
    write_model(tmp_path / "m", model(1))

    def broken(*_):
        raise OSError("disk full")

    monkeypatch.setattr("palpate.mechanics.model.files.write_csv", broken)
    with pytest.raises(OSError, match="disk full"):
        write_model(tmp_path / "m", model(2))
    assert read_model(tmp_path / "m").mesh.order == 1
    assert [p.name for p in tmp_path.iterdir()] == ["m"]


def test_a_folder_that_is_no_model_is_not_overwritten(tmp_path):
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "thesis.txt").write_text("years of work")
    with pytest.raises(FileError, match="no MODEL folder"):
        write_model(tmp_path / "m", model(1))
    assert (tmp_path / "m" / "thesis.txt").exists()


def test_contradicting_and_missing_files_are_named(tmp_path):
    with pytest.raises(ModelError, match="model.toml"):
        read_model(tmp_path / "none")
    path = write_model(tmp_path / "m", model(1))
    edited(path, ("nodes = 8", "nodes = 9"))
    with pytest.raises(ModelError, match="says 9 nodes, mesh.vtu holds 8"):
        read_model(path)


def test_quadratic_mesh_keeps_volume_surface_and_base():
    linear = cube()
    quadratic = linear.quadratic()
    assert np.isclose(linear.volumes.sum(), 1.0) and np.isclose(quadratic.volumes.sum(), 1.0)
    assert len(quadratic.surface) == len(linear.surface) == 12
    assert quadratic.fixed.sum() == 9  # 4 corners, 4 sides, 1 diagonal of the base
    assert not (quadratic.fixed & quadratic.touchable).any()
    p = quadratic.points
    assert np.allclose(p[quadratic.surface[:, 3]], p[quadratic.surface[:, [0, 1]]].mean(axis=1))
    corners = p[linear.surface]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", outward, corners.mean(axis=1) - 0.5) > 0).all()


def test_an_inverted_tetrahedron_is_refused():
    mesh = cube()
    with pytest.raises(MeshError, match="flat or inverted"):
        TetMesh(mesh.points, mesh.tetrahedra[:, [1, 0, 2, 3]], mesh.fixed, mesh.touchable)


def test_a_plain_object_has_one_modulus():
    plain = model(1).replaced(material=ObjectMaterial(16e3, 0.49))
    assert (plain.element_ratio == 1).all()
    assert plain.material.dent_law == "linear" and np.isnan(plain.material.young_modulus_ci95_pa).all()


def test_moduli_of_elements_are_the_product_of_the_parts(box):
    mesh = box((4, 4, 3), (0.08, 0.08, 0.06))
    ball, skin = Ball((0.01, 0.0, 0.03), 0.02, 6.0), Skin(0.008, 3.0)
    gradient, field = Gradient(1.5, 0.7), np.linspace(0.8, 1.2, len(mesh.tetrahedra))
    support = Support(np.array([0.0, 0.0, 0.01]), np.array([0.0, 0.0, 2.0]))
    material = ObjectMaterial(16e3, 0.49, inclusions={"a": ball}, gradient=gradient, skin=skin, field=field)
    made = Model(mesh, material, support, Tool(0.005), 0.02)
    # linear in height from the support, 1 cm up, to the highest node, 6 cm up
    height = (mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)[:, 2] - 0.01) / 0.05
    bulk = field * (1.5 - 0.8 * height)
    lump, hide = inclusion_ratio(mesh, np.array(ball.centre_m), 0.02, 6.0), skin_ratio(mesh, skin)
    assert lump.max() > 2 and hide.max() > 1.5 and (lump * hide).min() == 1.0
    assert made.surface_ratio == pytest.approx(bulk)
    assert made.solid_ratio == pytest.approx(bulk * lump)
    assert made.element_ratio == pytest.approx(bulk * hide * lump)
    hard = made.with_material(inclusions={"a": Ball(ball.centre_m, 0.02, 500.0)}).element_ratio
    assert hard.max() == MODULUS_LIMITS[1] and hard.min() > 0


def test_an_edited_value_in_the_text_changes_the_model(tmp_path):
    first = model(1)
    path = write_model(tmp_path / "m", first)
    edited(
        path,
        ("young_modulus_pa = 16000.0", "young_modulus_pa = 24e3"),
        ("ratio_top = 0.7", "ratio_top = 0.9"),
    )
    again = read_model(path)
    assert again.material.young_modulus_pa == 24e3
    assert np.array_equal(again.material.field, first.material.field)
    stiffer = first.with_material(gradient=Gradient(1.5, 0.9))
    assert np.array_equal(again.element_ratio, stiffer.element_ratio)
    assert not np.allclose(again.element_ratio, first.element_ratio)


def test_effects_that_are_material_do_not_count_twice(tmp_path):
    effects = {
        "inclusion": {"centre_m": [0.5, 0.5, 0.6], "radius_m": 0.3, "modulus_ratio": 6.0},
        "modulus_gradient": {"ratio_base": 1.5, "ratio_top": 0.7},
        "skin_layer": {"thickness_m": 0.1, "modulus_ratio": 3.0},
        "finite_strain": {},
    }
    first = model(1)
    again = read_model(write_model(tmp_path / "m", first.replaced(effects=effects)))
    assert again.effects == effects
    assert np.array_equal(again.element_ratio, first.element_ratio)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("format = 3", "format = 99", "has format 99; this program reads 3"),
        ("format = 3", 'format = "x"', "has format x"),
        (
            "support_normal = [0.0, 0.0, 1.0]",
            "support_normal = [0.0, 0.0, 0.0]",
            "support_normal is .0, 0, 0",
        ),
        (
            "support_normal = [0.0, 0.0, 1.0]",
            "support_normal = [nan, 0.0, 1.0]",
            "support_normal = .nan.*from -1e.06 to 1e.06",
        ),
        (
            "young_modulus_pa = 16000.0",
            "young_modulus_pa = -1",
            "young_modulus_pa = -1; it must be a number from 1 ",
        ),
        ("young_modulus_pa = 16000.0", "young_modulus_pa = 'soft'", "young_modulus_pa = 'soft'.*a number"),
        ("poisson_ratio = 0.49", "poisson_ratio = 0.5", "poisson_ratio = 0.5.*from 0 to 0.4999"),
        ("poisson_ratio = 0.49", "poison_ratio = 0.49", "poisson_ratio is missing .is 'poison_ratio' meant"),
        ("[tool]", "[tool]\ntip = 'punch'", "tip = 'punch'; it must be one of sphere"),
        ('"neo-hookean"', '"rubber"', "dent_law = 'rubber'; .* one of .*linear"),
        ("ratio_top = 0.7", "ratio_top = inf", "ratio_top = inf.*from 0.001"),
        ("thickness_m = 0.1", "thickness_m = 0", "thickness_m = 0; it must be a number from 1e-05"),
        ("radius_m = 0.3", "", "radius_m is missing"),
        ("[material.skin]", "[material.hide]", r"\[material\] hide is no key"),
        ("[15000.0, 17000.0]", "[17e3, 15e3]", "0 <= low <= high"),
    ],
)
def test_what_is_impossible_is_refused_in_one_line(tmp_path, old, new, words):
    path = edited(write_model(tmp_path / "m", model(1)), (old, new))
    with pytest.raises(ModelError, match=words) as error:
        read_model(path)
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_a_field_needs_a_value_a_tetrahedron():
    with pytest.raises(ModelError, match="field has 5 values; the mesh needs 6"):
        model(1).with_material(field=np.ones(5))
    with pytest.raises(ModelError, match="positive finite"):
        model(1).with_material(field=np.array([1, 1, 1, 1, 1, np.nan]))
