"""An answer that does not predict, or stands on another object's shape, is called not reliable."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
import trimesh

import palpate as pp
from palpate import cli
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.model.files import read_model
from palpate.mechanics.recording.recording import write_recording
from palpate.reconstruction.checks.registry import looked_at
from palpate.reconstruction.geometry.known_shape import place
from palpate.reconstruction.geometry.stated import GeometryOptions, nowhere
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.reconstruction.steps.s7_modulus.held_out import held_out, modulus_by_others
from palpate.reconstruction.steps.s7_modulus.modulus import fit_modulus

from .exploration_of_cylinder import HEIGHT, RADIUS, explore_cylinder
from .flat_ground import NOISE_N, raster

SOLIDS = {
    "right": lambda: trimesh.creation.cylinder(RADIUS, HEIGHT, sections=90),
    "two per cent too large": lambda: trimesh.creation.cylinder(1.02 * RADIUS, 1.02 * HEIGHT, sections=90),
    "block": lambda: trimesh.creation.box((0.12, 0.05, 0.03)),
    "cone": lambda: trimesh.creation.cone(0.05, 0.10, sections=90),
    "wider cylinder": lambda: trimesh.creation.cylinder(1.25 * RADIUS, HEIGHT, sections=90),
}


def stl(folder, name: str) -> str:
    """The file of a solid, in metres."""
    path = folder / f"{name.replace(' ', '_')}.stl"
    SOLIDS[name]().export(path)
    return str(path)


@pytest.fixture(scope="module")
def touches():
    recording, _ = explore_cylinder(without_phase=True)
    return recording, explore(recording, boundary=nowhere(recording))


@pytest.mark.parametrize("name", [name for name in SOLIDS if name != "right"])
def test_first_touches_tell_another_objects_shape(touches, tmp_path, name):
    recording, found = touches
    options = GeometryOptions(shape=stl(tmp_path, name), unit="m")
    put = place(found, options, mesh_size_m=0.01, spacing_m=0.003)
    if name in ("right", "two per cent too large"):
        assert put.doubt == ""
    else:
        assert "another object's shape" in put.doubt and len(put.doubt.splitlines()) == 1


def test_first_touches_tell_that_the_tips_diameter_was_given_for_its_radius(touches, tmp_path):
    recording, found = touches
    options = GeometryOptions(shape=stl(tmp_path, "right"), unit="m")

    def put(factor: float):
        presses = dataclasses.replace(found.presses, tip_radius_m=factor * found.presses.tip_radius_m)
        by = dataclasses.replace(found, presses=presses)
        return place(by, options, mesh_size_m=0.01, spacing_m=0.003)

    stated = recording.tip_radius_m
    assert put(1.0).doubt == "" and put(1.0).open_radii == ()
    for factor in (2.0, 0.5):
        other = put(factor)
        assert other.likelier_radius_m == pytest.approx(stated)
        assert f"under one of {1e3 * stated:.3g} mm" in other.doubt


def test_first_touches_tell_that_an_object_is_not_flat(touches):
    _, found = touches
    recording = raster()
    flat = explore(recording, boundary=nowhere(recording))
    for options in (GeometryOptions(half_space=True), GeometryOptions(slab_m=0.3)):
        round_it = place(found, options, mesh_size_m=0.01, spacing_m=0.003)
        assert options.kind in round_it.doubt and len(round_it.doubt.splitlines()) == 1
        assert place(flat, options, mesh_size_m=0.01, spacing_m=0.003).doubt == ""


def test_a_dome_that_is_called_flat_is_refused_before_anything_is_computed_on_it(touches, monkeypatch):
    """Two minutes went into a modulus that the first touches ruled out in two seconds."""

    def computed(*_, **__):
        raise AssertionError("it was laid on a plane and computed")

    monkeypatch.setattr("palpate.reconstruction.pipeline.place", computed)
    recording, _ = touches
    for said in ({"half_space": True}, {"slab_m": 0.3}):
        with pytest.raises(RecordingError, match="--shape"):
            pp.reconstruct(recording, progress=False, **said)
        (finding,) = looked_at(recording, GeometryOptions(**said))[0]
        assert finding.grave and finding.ways
        assert not looked_at(raster(), GeometryOptions(**said))[0]


@pytest.mark.parametrize("depth_matters", [True, False])
def test_a_modulus_is_weighed_against_a_constant_push(depth_matters):
    recording = raster(tilt=False)
    found = explore(recording, boundary=nowhere(recording)).presses
    if not depth_matters:
        # full force at once, and less as the tip goes in
        push = np.where(found.depth > 1e-4, 0.5 - 60 * found.depth, 0.0)
        found = dataclasses.replace(found, force=push[:, None] * found.normal[found.press])
    sites = _half_space(found)
    fit = fit_modulus(found, sites, NOISE_N)
    told = held_out(found, sites, fit, modulus_by_others(fit))
    assert told is not None
    assert (told.doubt == "") == depth_matters
    if depth_matters:
        assert told.model_n < 0.2 * told.constant_n


def _half_space(presses):
    from palpate.mechanics.compliance.sites import TouchSites

    none = np.zeros(len(presses))
    return TouchSites(presses.point, presses.normal, none, np.zeros((len(presses), 3, 3)), 0.005, 0.49)


def test_the_command_ends_with_one_and_writes_everything(tmp_path, capsys):
    samples = write_recording(tmp_path / "cylinder.csv", explore_cylinder(without_phase=True)[0])
    model, figures = tmp_path / "MODEL", tmp_path / "figures.json"
    words = ["reconstruct", str(samples), "-o", str(model), "--json", str(figures), "--unit", "m"]
    assert cli.main([*words, "--shape", stl(tmp_path, "block")]) == 1
    said = capsys.readouterr().out
    assert said.startswith("not reliable")
    (line,) = [line for line in said.splitlines() if line.startswith("not reliable")]
    assert "another object's shape" in line
    # and nothing beside it is said with certainty, or to be kept
    assert "sure" not in said and "press there" not in said and "palpate touch" not in said
    assert read_model(model).material.young_modulus_pa > 0
    assert json.loads(figures.read_text())["doubt"] in line
