"""The felt surface beside the mesh: what the file holds, when it is believed, how stiff each place is."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import palpate as pp
from palpate.cli import main
from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.model.files import FELT, read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.making import no_presses, of_places
from palpate.render.options import RenderOptions
from palpate.render.press import Stroke, press
from palpate.render.surface.felt_surface import (
    OWN_DEPTH_M,
    PRESSES,
    TOUCHES,
    felt_surface,
    with_own_stiffness,
)
from palpate.render.surface.snapping import ONSET_NOISE_M, touched_surface

from . import shapes

TOUCHED = [(x, y) for x in (-0.02, 0.02) for y in (-0.02, 0.02)]
DOUBT_M = 8e-4


@pytest.fixture
def folder(tmp_path) -> Model:
    """A block, uncertain by 0.8 mm but for four touches on its top, as a MODEL folder."""
    mesh = shapes.block((0.1, 0.1, 0.05), (6, 6, 3))
    places = np.array([[x, y, 0.0502] for x, y in TOUCHED])
    rows = of_places(places, np.tile([0.0, 0.0, 1.0], (4, 1)), 0.005)
    made = shapes.model(mesh, presses=rows, shape_uncertainty_m=np.full(len(mesh.points), DOUBT_M))
    return read_model(write_model(tmp_path / "block", made))


def test_the_file_holds_what_a_renderer_touches_for_any_program(folder):
    import pyvista

    felt_surface(folder)
    shape = pyvista.read(folder.path / FELT)
    arrays = touched_surface(folder, RenderOptions()).arrays
    assert np.array_equal(shape.points, arrays.vertices)
    assert np.array_equal(shape.regular_faces, arrays.triangles)
    assert {"uncertainty_m", "own_stiffness_n_per_m", "touchable"} <= set(shape.point_data.keys())
    below = np.asarray(shape.points)[:, 2] < 1e-9
    inside = np.abs(np.asarray(shape.points)[:, :2]).max(axis=1) < 0.045
    assert not shape.point_data["touchable"][below & inside].any()
    assert shape.point_data["touchable"][~below].all()


def test_touches_pin_the_surface_and_far_from_them_the_models_doubt_is_left(folder):
    surface = felt_surface(folder)
    for x, y in TOUCHED:
        near = np.linalg.norm(surface.points - [x, y, 0.05], axis=1).argmin()
        assert surface.uncertainty_m[near] < 3 * ONSET_NOISE_M
    far = np.linalg.norm(surface.points - [0, 0.05, 0.01], axis=1).argmin()
    assert surface.uncertainty_m[far] == pytest.approx(DOUBT_M, rel=1e-3)
    assert (surface.uncertainty_m <= DOUBT_M * (1 + 1e-9)).all()
    # one touch, its own place: the product of two Gaussians
    one = folder.replaced(presses=folder.presses.of(np.arange(1)), path=None)
    at = felt_surface(one)
    near = np.linalg.norm(at.points - [*TOUCHED[0], 0.05], axis=1).argmin()
    away = np.linalg.norm(at.points[near, :2] - TOUCHED[0])
    told = np.exp(-((away / 0.012) ** 2)) * DOUBT_M**2 / (DOUBT_M**2 + ONSET_NOISE_M**2)
    assert at.uncertainty_m[near] == pytest.approx(DOUBT_M * np.sqrt(1 - told), rel=0.05)


def test_the_file_is_read_again_and_never_believed_of_another_mesh_or_touch(folder):
    first = felt_surface(folder)
    stamp = (folder.path / FELT).stat().st_mtime_ns
    again = felt_surface(read_model(folder.path))
    assert (folder.path / FELT).stat().st_mtime_ns == stamp
    assert np.array_equal(first.points, again.points) and np.array_equal(first.normals, again.normals)
    assert np.array_equal(first.uncertainty_m, again.uncertainty_m)
    other = folder.replaced(presses=no_presses(0.005))
    assert felt_surface(other).points[:, 2].max() == pytest.approx(0.05)
    assert felt_surface(folder).points[:, 2].max() == pytest.approx(0.0502, abs=5e-5)


@pytest.mark.parametrize("damage", ["cut", "nonsense", "gone"])
def test_a_file_that_is_damaged_or_not_there_is_made_anew(folder, damage):
    first = felt_surface(folder)
    path = folder.path / FELT
    if damage == "gone":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:900] if damage == "cut" else b"no surface at all")
    assert np.array_equal(felt_surface(folder).points, first.points)
    assert path.stat().st_size > 10_000


def test_a_place_is_as_stiff_as_a_press_there(folder):
    renderer = shapes.fem(folder)
    surface = with_own_stiffness(renderer)
    assert surface.stiffness_from == PRESSES
    for x, y in ((0.0, 0.0), (0.02, -0.01)):
        curve = press(renderer, [x, y, 0.05], [0, 0, -1], Stroke(2 * OWN_DEPTH_M, 0.01))
        expected = float(curve.force_at(OWN_DEPTH_M)[2]) / OWN_DEPTH_M
        near = np.linalg.norm(surface.points - [x, y, 0.05], axis=1).argmin()
        assert surface.own_stiffness_n_per_m[near] == pytest.approx(expected, rel=0.02)
    assert np.isfinite(surface.own_stiffness_n_per_m[surface.touchable]).all()
    assert np.isnan(surface.own_stiffness_n_per_m[~surface.touchable]).all()
    # it stays in the folder, whatever friction or renderer comes next, but not for another material
    kept = felt_surface(read_model(folder.path))
    assert np.array_equal(kept.own_stiffness_n_per_m, surface.own_stiffness_n_per_m, equal_nan=True)
    stiffer = felt_surface(folder.replaced(material=replace(folder.material, young_modulus_pa=60e3)))
    assert stiffer.stiffness_from == "" and np.isnan(stiffer.own_stiffness_n_per_m).all()


def test_before_that_the_touch_sites_tell_it(folder):
    renderer = shapes.fem(folder)
    points = np.array([[x, y, 0.05] for x, y in TOUCHED])
    up = np.tile([0.0, 0.0, 1.0], (4, 1))
    compliance = renderer.compliance
    sites = TouchSites(points, up, np.zeros(4), compliance.far_at(points, up), 0.005, 0.49)
    told = felt_surface(folder, sites)
    assert told.stiffness_from == TOUCHES
    pressed = with_own_stiffness(renderer)
    top = (np.abs(told.points[:, :2]).max(axis=1) < 0.03) & (told.points[:, 2] > 0.045)
    ratio = told.own_stiffness_n_per_m[top] / pressed.own_stiffness_n_per_m[top]
    assert np.abs(ratio - 1).max() < 0.1
    assert felt_surface(folder, sites).stiffness_from == PRESSES  # the better stays


@pytest.mark.slow
def test_a_renderer_for_any_hand_leaves_the_stiffness_in_the_folder_and_one_press_does_not(tmp_path):
    plain = shapes.model(shapes.block((0.05, 0.05, 0.025), (3, 3, 2)), presses=no_presses(0.005))
    path = write_model(tmp_path / "plain", plain)
    words = ["--at", "0,0,0.025", "--direction", "0,0,-1", "--depth", "0.001", "--json", str(tmp_path / "j")]
    assert main(["press", str(path), *words]) == 0
    assert json.loads((tmp_path / "j").read_text())["peak_force_n"] > 0
    assert felt_surface(read_model(path)).stiffness_from == ""
    pp.renderer(path)
    assert felt_surface(read_model(path)).stiffness_from == PRESSES


def test_the_contact_surface_is_kept_and_read_as_it_was_made(folder, monkeypatch):
    """In another process as good as never made; of other touches or a damaged file it is made anew."""
    from palpate.render.surface import snapping

    first = touched_surface(folder, RenderOptions())
    (file,) = folder.path.glob("contact-*.bin")

    def again():
        return touched_surface(read_model(folder.path), RenderOptions()).flat()

    with monkeypatch.context() as patch:
        patch.setattr(snapping, "contact_surface", None)  # it would be called
        read = again()
    assert read.keys() == first.flat().keys()
    assert all(np.array_equal(read[name], array) for name, array in first.flat().items())
    assert all(array.flags.writeable for array in read.values())  # the kernels know no others
    file.write_bytes(file.read_bytes()[:-9])
    assert np.array_equal(again()["vertices"], first.arrays.vertices)
    bare = touched_surface(folder.replaced(presses=no_presses(0.005)), RenderOptions())
    assert bare.arrays.vertices[:, 2].max() == pytest.approx(0.05)
