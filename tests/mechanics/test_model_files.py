"""MODEL folders: written whole or not at all, read back the same, contradictions named."""

from __future__ import annotations

import numpy as np
import pytest

from mechanics.errors import MeshError, ModelError
from mechanics.model import Model, read_model, write_model
from mechanics.presses import of_places
from mechanics.tetmesh import TetMesh


def cube() -> TetMesh:
    """A unit cube of six tetrahedra around one diagonal, fixed at z = 0."""
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    tets = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
    return TetMesh(points, tets, points[:, 2] == 0, points[:, 2] > 0)


def model(order: int) -> Model:
    mesh = cube() if order == 1 else cube().quadratic()
    return Model(
        mesh, 16e3, 0.49, 0.005, 0.01, np.zeros(3), np.array([0, 0, 1.0]), (15e3, 17e3),
        modulus_ratio=np.linspace(1, 2, len(mesh.tetrahedra)),
        shape_uncertainty_m=np.linspace(0, 1e-3, len(mesh.points)),
        presses=of_places([0.5, 0.5, 1.0], [0, 0, 1.0], 0.005, depth_m=0.004, fits={"e_pa": 15.5e3}),
        effects={"viscoelasticity": {"g": [0.3], "tau_s": [0.3]}},
        provenance={"method": "finite-tip"},
    )  # fmt: skip


@pytest.mark.parametrize("order", [1, 2])
def test_round_trip(tmp_path, order):
    first = model(order)
    again = read_model(write_model(tmp_path / "m", first))
    assert np.array_equal(again.mesh.points, first.mesh.points)
    assert np.array_equal(again.mesh.tetrahedra, first.mesh.tetrahedra)
    assert np.array_equal(again.mesh.touchable, first.mesh.touchable)
    assert np.allclose(again.modulus_ratio, first.modulus_ratio, rtol=1e-14)
    assert np.array_equal(again.shape_uncertainty_m, first.shape_uncertainty_m)
    assert again.young_modulus_ci95_pa == (15e3, 17e3)
    assert again.effects["viscoelasticity"]["tau_s"] == [0.3]
    assert again.presses.fits["e_pa"] == [15.5e3] and np.isnan(again.presses.fits["k_kv"][0])


def test_an_interrupted_write_leaves_the_old_model(tmp_path, monkeypatch):
    write_model(tmp_path / "m", model(1))

    def broken(*_):
        raise OSError("disk full")

    monkeypatch.setattr("mechanics.model.write_csv", broken)
    with pytest.raises(OSError, match="disk full"):
        write_model(tmp_path / "m", model(2))
    assert read_model(tmp_path / "m").mesh.order == 1
    assert [p.name for p in tmp_path.iterdir()] == ["m"]


def test_a_folder_that_is_no_model_is_not_overwritten(tmp_path):
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "thesis.txt").write_text("years of work")
    with pytest.raises(ModelError, match="no MODEL folder"):
        write_model(tmp_path / "m", model(1))
    assert (tmp_path / "m" / "thesis.txt").exists()


def test_contradicting_and_missing_files_are_named(tmp_path):
    with pytest.raises(ModelError, match="model.toml"):
        read_model(tmp_path / "none")
    path = write_model(tmp_path / "m", model(1))
    text = (path / "model.toml").read_text().replace("nodes = 8", "nodes = 9", 1)
    (path / "model.toml").write_text(text)
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
