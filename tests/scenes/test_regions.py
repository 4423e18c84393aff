"""A mesh of several parts: each is listed, asked for, and becomes a region of its own modulus."""

from __future__ import annotations

import re

import numpy as np
import pytest
import pyvista
import trimesh

import palpate as pp
from palpate.mechanics.disk.surface_files import read_surface
from palpate.scenes.regions import REST, LimitedModulus, left_in, moduli_of

LIVER_PA, TUMOUR_PA = 5e3, 40e3


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A block of 60 x 60 x 30 mm with a ball of 8 mm radius under the middle of its top, as an OBJ file."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=8)
    ball.apply_translation([0, 0, 19])
    block = trimesh.creation.box(extents=(60, 60, 30))
    block.apply_translation([0, 0, 15])
    lines, before = [], 1
    for name, body in (("liver", block), ("tumour", ball)):
        lines.append(f"o {name}")
        lines += ["v {} {} {}".format(*v) for v in body.vertices]
        lines += ["f {} {} {}".format(*(f + before)) for f in body.faces]
        before += len(body.vertices)
    path = tmp_path_factory.mktemp("parts") / "organ.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_file_of_parts_asks_for_the_modulus_of_each(file):
    with pytest.raises(pp.PalpateError, match="liver 108 cm³, tumour 2.0.* --modulus tumour=PA"):
        pp.model_of(file, unit="mm", progress=False)
    with pytest.raises(pp.PalpateError, match="liver=PA"):
        pp.model_of(file, {"tumour": TUMOUR_PA}, unit="mm", progress=False)
    with pytest.raises(pp.PalpateError, match="liver, tumour"):
        pp.model_of(file, {"tumor": TUMOUR_PA, "liver": LIVER_PA}, unit="mm", progress=False)


def test_a_harder_part_than_a_model_holds_is_said(file):
    parts = read_surface(file, "mm").parts
    with pytest.warns(LimitedModulus, match="250000 Pa is taken"):
        assert moduli_of(parts, {REST: LIVER_PA, "tumour": 1e9}, "organ.obj")["tumour"] == 50 * LIVER_PA


def hanging(tmp_path, *others):
    """A block of 60 x 60 x 30 mm on the support, and cubes of 20 mm with their middles at `others`, mm."""
    bodies = [
        trimesh.creation.box(extents=(60, 60, 30)),
        *(trimesh.creation.box(extents=(20,) * 3) for _ in others),
    ]
    for body, at in zip(bodies, [(0, 0, 15), *others], strict=True):
        body.apply_translation(at)
    path = tmp_path / "hanging.stl"
    trimesh.util.concatenate(bodies).export(path)
    return path


@pytest.mark.parametrize("given", [None, 5e3, {REST: 5e3}], ids=["no modulus", "one", "one of the rest"])
def test_a_body_that_hangs_in_the_air_is_left_out_by_the_words_of_the_refusal(tmp_path, given):
    path = hanging(tmp_path, (60, 0, 60))
    with pytest.raises(pp.PalpateError, match="leave out what hangs, --modulus '(body .)=0'$") as refused:
        pp.model_of(path, given, unit="mm", progress=False)
    name = re.findall("'(body .)=0'", str(refused.value))[0]
    stated = {**(given if isinstance(given, dict) else {} if given is None else {REST: given}), name: 0.0}
    made = pp.model_of(path, stated, unit="mm", mesh_size_m=0.015, progress=False)
    assert made.mesh.volumes.sum() == pytest.approx(60 * 60 * 30e-9, rel=1e-3)
    assert made.material.young_modulus_pa == (5e3 if given else 20e3)
    assert f"{name} left out" in made.provenance["mended"]


def test_of_more_bodies_those_that_stand_keep_their_moduli(tmp_path):
    surface = read_surface(hanging(tmp_path, (60, 0, 60), (45, 0, 10)), "mm")
    gone = next(part.name for part in surface.parts if part.vertices[:, 2].min() > 0.04)
    left, stated = left_in(surface, {REST: 2e3, gone: 0.0})
    assert len(left.parts) == 2 and gone not in [part.name for part in left.parts] and stated == {REST: 2e3}
    with pytest.raises(pp.PalpateError, match="no part is left"):
        left_in(surface, {part.name: 0.0 for part in surface.parts})
    with pytest.raises(pp.PalpateError, match="body 1, body 2, body 3"):
        left_in(surface, {"body 7": 0.0})


def test_a_label_beside_another_is_left_out_and_closed_there(tmp_path):
    grid = pyvista.ImageData(dimensions=(5, 5, 4), spacing=(10, 10, 10)).cast_to_unstructured_grid()
    grid.cell_data["label"] = np.where(grid.cell_centers().points[:, 0] > 20, 2, 1)
    grid.save(tmp_path / "halves.vtu")
    left, stated = left_in(read_surface(tmp_path / "halves.vtu", "mm"), {"label 2": 0.0, "label 1": 3e3})
    half = trimesh.Trimesh(left.vertices, left.triangles, process=False)
    assert half.is_watertight and half.volume == pytest.approx(20 * 40 * 30e-9) and stated == 3e3
    assert half.bounds[1, 0] == pytest.approx(0.02)


@pytest.mark.slow
def test_parts_are_regions_of_their_own_modulus(file, tmp_path):
    moduli = {"liver": LIVER_PA, "tumour": TUMOUR_PA}
    made = pp.model_of(file, moduli, unit="mm", save=tmp_path / "MODEL", progress=False)
    cells = pyvista.read(tmp_path / "MODEL" / "mesh.vtu")
    centres, young = cells.cell_centers().points, np.asarray(cells.cell_data["young_modulus_pa"])
    away = np.linalg.norm(centres - [0, 0, 0.019], axis=1)
    assert young[away > 0.015] == pytest.approx(LIVER_PA, rel=1e-6)
    assert young[away < 0.003] == pytest.approx(TUMOUR_PA, rel=0.3)
    # what of the ball's volume is harder, whatever the mesh
    harder = float(made.mesh.volumes @ (young > 2 * LIVER_PA))
    assert harder == pytest.approx(4 / 3 * np.pi * 0.008**3, rel=0.5)
    plain = pp.model_of(file, LIVER_PA, unit="mm", progress=False)
    at = {"direction": (0, 0, -1), "depth_m": 0.003, "speed_m_per_s": 0.01, "progress": False}
    over, beside = (
        pp.press(tmp_path / "MODEL", at=(x, 0, 0.03), **at).peak_force_n
        / pp.press(plain, at=(x, 0, 0.03), **at).peak_force_n
        for x in (0.0, 0.02)
    )
    assert 1.15 < over < 3 and 0.95 < beside < 1.2


@pytest.mark.slow
def test_labels_are_regions_up_to_the_surface(tmp_path):
    """Two halves side by side: a press of each, and what 1D models read of it, is of its own modulus."""
    grid = pyvista.ImageData(dimensions=(7, 5, 4), spacing=(10, 10, 10)).cast_to_unstructured_grid()
    grid.cell_data["label"] = np.where(grid.cell_centers().points[:, 0] > 30, 2, 1)
    grid.save(tmp_path / "halves.vtu")
    moduli = {"label 2": TUMOUR_PA, REST: LIVER_PA}
    made = pp.model_of(tmp_path / "halves.vtu", moduli, unit="mm", progress=False)
    at = {"direction": (0, 0, -1), "depth_m": 0.001, "speed_m_per_s": 0.01, "progress": False}
    soft, hard = (pp.press(made, at=(x, 0.02, 0.03), **at).peak_force_n for x in (0.01, 0.05))
    assert hard / soft == pytest.approx(TUMOUR_PA / LIVER_PA, rel=0.15)
    inside = np.abs(made.presses.point[:, 0] - 0.03) > 0.012
    hand = made.presses.point[:, 0] > 0.03
    stiff = made.presses.fits["k_v"]
    assert np.median(stiff[hand & inside]) / np.median(stiff[~hand & inside]) > 4
    assert made.presses.fits["e_pa"][hand & inside] == pytest.approx(TUMOUR_PA, rel=0.05)
