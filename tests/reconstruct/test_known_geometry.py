"""Crashes that others' recordings met, and known geometry through the door: rasters, slabs, one line each."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh

import palpate as pp
from palpate import cli
from palpate.mechanics.compliance.sites import SURFACE_EDGE_M
from palpate.mechanics.errors import ContactError, OptionError, SurfaceError
from palpate.mechanics.presses.repeats import sites_of
from palpate.mechanics.shape.refine import refined_near_surface, typical_edge
from palpate.operations._shared import given_model
from palpate.reconstruction.geometry.known_shape import OPEN, place
from palpate.reconstruction.geometry.slab import flat_mesh
from palpate.reconstruction.geometry.stated import GeometryOptions, nowhere, stated_geometry
from palpate.reconstruction.shapes.fit import Evidence, ShapeEvidence
from palpate.reconstruction.shapes.implicit import implicit_held_out
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.reconstruction.steps.s3_contacts.left_out import without_slides
from palpate.scenes.scene import Scene

from .flat_contact import points
from .flat_ground import MODULUS_PA, TIP_M, raster


@pytest.mark.parametrize(("pitch_m", "count"), [(0.005, 5), (0.003, 15), (0.002, 9)])
def test_a_raster_is_many_places(pitch_m, count):
    grid = np.arange(count) * pitch_m
    points = np.array([[x, y, 0.0] for x in grid for y in grid])
    points += 2e-4 * np.random.default_rng(0).standard_normal(points.shape)
    assert len(set(sites_of(points, np.tile([0, 0, 1.0], (len(points), 1))))) == count**2


@pytest.fixture(scope="module")
def ground():
    recording = raster()
    return recording, without_slides(explore(recording, boundary=nowhere(recording)), 4)


def test_presses_are_found_without_tracing_in_any_frame(ground):
    recording, found = ground
    assert len(found.presses) == 25 and found.presses.sites == 25


def test_a_slabs_top_goes_through_the_first_touches(ground):
    recording, found = ground
    put = place(found, GeometryOptions(slab_m=0.02), mesh_size_m=0.01, spacing_m=0.003)
    up = put.base.support_normal
    truth = found.presses.contact_normal.mean(axis=0)
    assert up @ truth / np.linalg.norm(truth) > np.cos(np.radians(1.0))
    height = (found.presses.centre - put.base.support_point) @ up
    assert np.allclose(height, 0.02 + TIP_M, atol=2e-4)
    assert put.about["kind"] == "slab" and put.about["residual_rms_m"] < 1e-4
    assert put.mesh is not None and put.mesh.volumes.sum() == pytest.approx(put.surface.volume_m3)


@pytest.mark.parametrize(("slab_m", "words"), [(1e-9, "deep into a slab of 1e-06 mm"), (1e-3, "deep into")])
def test_a_slab_thinner_than_its_presses_are_deep_is_refused(ground, slab_m, words):
    recording, found = ground
    with pytest.raises(SurfaceError, match=words):
        place(found, GeometryOptions(slab_m=slab_m), mesh_size_m=0.01, spacing_m=0.003)


def test_touches_at_one_place_leave_nothing_out_and_crash_nothing():
    centres = np.array([[0, 0, 0.05], [1e-4, 0, 0.05], [0, 1e-4, 0.05], [1e-4, 1e-4, 0.05]])
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    rim = 0.03 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(40)])
    evidence = Evidence(
        support_point=np.zeros(3),
        support_normal=np.array([0, 0, 1.0]),
        outline=rim,
        outline_centres=rim * (0.034 / 0.03) + [0, 0, TIP_M],
        centres=centres,
        normals=np.tile([0, 0, 1.0], (4, 1)),
        centre_error_m=np.full(4, 1e-4),
        tip_radius_m=TIP_M,
        site=np.zeros(4, dtype=int),
    )
    assert implicit_held_out(evidence, ShapeEvidence.of(evidence)) == np.inf


def test_one_line_for_units_open_meshes_unregistered_shapes_and_points(tmp_path, ground, capsys):
    recording, _ = ground
    far = trimesh.creation.box(extents=(60, 50, 40))
    far.apply_translation([500, 0, 0])
    far.export(tmp_path / "far.stl")
    ball = trimesh.creation.icosphere(subdivisions=3, radius=30)
    ball.update_faces((ball.triangles_center[:, :2] < 8).any(axis=1))
    ball.export(tmp_path / "open.stl")
    for options, error, words in (
        ({"shape": str(tmp_path / "far.stl")}, SurfaceError, "--unit mm"),
        ({"shape": str(tmp_path / "open.stl"), "unit": "mm"}, SurfaceError, "is open: a hole"),
        ({"shape": str(tmp_path / "far.stl"), "unit": "mm", "pose": "given"}, SurfaceError, "--pose auto"),
        ({"shape": "gone.stl"}, SurfaceError, "does not exist"),
        ({"slab_m": 0.02, "half_space": True}, OptionError, "exclude one another"),
        ({"slab_m": -1.0}, OptionError, "slab_m is -1"),
    ):
        with pytest.raises(error, match=words) as refused:
            pp.reconstruct(recording, progress=False, **options)
        assert len(str(refused.value).splitlines()) == 1
    with pytest.raises(ContactError, match="4800 spots, more than 4000.*--rate HZ"):
        pp.reconstruct(points((80, 60), rows=2), half_space=True, progress=False)
    capsys.readouterr()
    assert (
        cli.main(["press", "block", "--unit", "mm", *"--at 0,0,1 --direction 0,0,-1 --depth 0.001".split()])
        == 2
    )
    assert "--unit is for the file of a surface" in capsys.readouterr().err


def test_the_parts_of_a_known_shape_are_said_with_the_one_modulus(tmp_path, ground):
    whole, lump = trimesh.creation.box(extents=(120, 120, 30)), trimesh.creation.box(extents=(10, 10, 10))
    trimesh.util.concatenate([whole, lump]).export(tmp_path / "organ.stl")
    options = GeometryOptions(shape=str(tmp_path / "organ.stl"), unit="mm")
    put = place(ground[1], options, mesh_size_m=0.01, spacing_m=0.003)
    said = [note for note in put.notes if "432 cm³" in note and "1 cm³" in note]
    assert len(said) == 1 and "--modulus" in said[0]


def test_a_recording_states_its_geometry_itself():
    recording = raster((2, 2))
    object.__setattr__(recording, "description", {"object": {"slab_m": 0.03, "shape_pose": "given"}})
    assert stated_geometry(recording, GeometryOptions()) == GeometryOptions(slab_m=0.03, pose="given")
    asked = GeometryOptions(half_space=True)
    assert stated_geometry(recording, asked) is asked


@pytest.mark.slow
def test_a_mesh_is_a_model_in_its_own_frame(tmp_path):
    block = trimesh.creation.box(extents=(60, 50, 40))
    block.apply_translation([200, -100, 70])
    block.export(tmp_path / "part.ply")
    model = pp.model_of(tmp_path / "part.ply", 12e3, unit="mm", save=tmp_path / "MODEL", progress=False)
    assert model.material.young_modulus_pa == 12e3
    assert model.support.point == pytest.approx([0.2, -0.1, 0.05], abs=1e-6)
    assert model.mesh.volumes.sum() == pytest.approx(1.2e-4, rel=0.01)
    curve = pp.press(tmp_path / "MODEL", (0.2, -0.1, 0.09), (0, 0, -1), 0.002, progress=False)
    hertz = 4 / 3 * 12e3 / (1 - 0.49**2) * np.sqrt(model.tool.tip_radius_m) * 0.002**1.5
    # free sides make a block of this size some per cent softer than a half-space, its base stiffer
    assert 0.9 * hertz < curve.peak_force_n < 1.3 * hertz


@pytest.mark.slow
def test_the_modulus_of_a_half_space_needs_no_tracing():
    made = pp.reconstruct(raster(), half_space=True, progress=False)
    low, high = made.young_modulus_ci95_pa
    assert made.young_modulus_pa == pytest.approx(MODULUS_PA, rel=0.06) and low < high


@pytest.fixture(scope="module")
def dome(tmp_path_factory, shared_recordings):
    """The half-sphere's recording, and options with its shape as a file."""
    recording = pp.read_recording(shared_recordings / "silicone-3-halfsphere.csv.gz")
    angle = np.linspace(np.arcsin(5 / 60), np.pi / 2, 60)  # the truth's: radius 60, cut to a height of 55
    arc = np.column_stack([60 * np.cos(angle), 60 * np.sin(angle) - 5])
    file = tmp_path_factory.mktemp("dome") / "dome.stl"
    trimesh.creation.revolve([[0, 0], *arc[:-1], [0, 55]]).export(file)
    return recording, GeometryOptions(shape=str(file), unit="mm")


def placed(recording, options):
    pressed = without_slides(explore(recording, boundary=nowhere(recording), unbroken=True), 4)
    return place(pressed, options, mesh_size_m=0.01, spacing_m=0.003)


def test_a_traced_table_tells_how_a_round_shape_stands(dome):
    """A stretch of the tracing was taken for a press in unbroken contact, so the tracing was ignored: the
    dome lay 12 degrees off, and its foot 11 mm."""
    put = placed(*dome)
    truth = np.array(dome[0].truth["device_from_object_rotation"])[:, 2]
    assert put.base.support_normal @ truth > np.cos(np.radians(1.0))
    assert not any("open by" in note for note in put.notes)


def test_what_is_said_to_stand_open_is_what_a_diagnosis_takes_for_open(dome):
    """Each had a size of its own: of a dome 13 degrees off, said to be open, a loose base was named."""
    recording, options = dome
    later = recording.t > 13.6  # what comes before is the tracing
    arrays = {name: getattr(recording, name)[later] for name in ("t", "position", "force_on_tool")}
    put = placed(dataclasses.replace(recording, **arrays, boundary_phase=None), options)
    assert any("open by" in note for note in put.notes)
    assert put.about["surface_sd_p95_m"] > OPEN * np.linalg.norm(np.ptp(put.surface.vertices, axis=0))


def test_a_surfaces_file_is_the_model_of_a_recording(tmp_path):
    """Of compare --model and of diagnose: owners of a CAD model were refused."""
    trimesh.creation.box(extents=(80, 80, 40)).export(tmp_path / "part.stl")
    given = {"young_modulus_pa": 9e3, "unit": "mm"}
    scene = given_model(str(tmp_path / "part.stl"), given)
    assert isinstance(scene, Scene) and scene.kind == "mesh"
    assert (scene.young_modulus_pa, scene.unit) == (9e3, "mm")
    with pytest.raises(OptionError, match="needs --model FILE"):
        given_model(None, given)


def test_a_deep_blocks_surface_is_just_fine_enough():
    """Under touches 60 mm apart: cells of 7.2 mm were halved to 3.6, 141,000 nodes and ten gigabytes."""
    block = flat_mesh(np.array([0.144, 0.144, 0.12]), 0.010, 20)
    fine, _ = refined_near_surface(block, SURFACE_EDGE_M)
    assert 0.8 * SURFACE_EDGE_M < typical_edge(fine) <= SURFACE_EDGE_M
    assert len(fine.quadratic().points) < 60_000
