"""Surfaces of known shapes, touched by a seeded hand: geometry is the oracle."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks._surface_truth import OWN, phantom_truth, touch
from benchmarks.surface import deviation
from palpate.mechanics.errors import SurfaceError
from palpate.reconstruction.shapes.fit import Evidence
from palpate.reconstruction.steps.s4_surface import SurfaceOptions, reconstruct_surface

from .exploration_of_cylinder import explore_cylinder

MEAN_M, P95_M, VOLUME = 0.0012, 0.003, 0.04


def reconstructed(truth, seed=0, surface="auto", change=lambda e: e, **hand):
    evidence, back = touch(truth, seed, **hand)
    found = reconstruct_surface(change(evidence), SurfaceOptions(surface=surface))
    return found, deviation(truth, back(found.vertices), found.triangles)


@cache
def known(name, surface="auto"):
    """`reconstructed` of a phantom, made once for all tests of this file."""
    return reconstructed(phantom_truth(name), surface=surface)


@pytest.mark.parametrize(
    ("name", "method"),
    [
        ("cylinder", "cylinder"),
        ("block", "block"),
        pytest.param("half-sphere", "sphere", marks=pytest.mark.release),
    ],
)
def test_the_papers_shapes_are_recognised(name, method):
    found, error = known(name)
    assert found.method.rstrip("+") == method
    assert error["mean_m"] < 0.0003
    assert abs(error["volume_error"]) < 0.01
    assert "left out" in found.reason


def test_a_sharp_shape_beats_the_hull_at_its_rims():
    _, own = known("cylinder")
    _, hull = known("cylinder", "hull")
    assert own["p95_m"] < 0.1 * hull["p95_m"]
    assert hull["volume_error"] < -0.05


@pytest.mark.slow
def test_a_bean_keeps_its_dent():
    truth = phantom_truth("bean")
    found, error = reconstructed(truth)
    assert error["mean_m"] < MEAN_M
    assert error["p95_m"] < P95_M
    hull = found.mesh.convex_hull.volume
    true_hull = deviation_of_hull(truth)
    assert found.volume_m3 / hull == pytest.approx(true_hull, abs=0.02)


def deviation_of_hull(truth):
    import trimesh

    return truth.volume_m3 / trimesh.Trimesh(truth.vertices, truth.triangles).convex_hull.volume


@pytest.mark.parametrize(
    "name",
    ["blob", *(pytest.param(name, marks=pytest.mark.release) for name in ("frustum", "ellipsoid", "gable"))],
)
def test_shapes_nobody_told_it_of(name):
    _, error = reconstructed(OWN[name]())
    assert error["mean_m"] < 1.5 * MEAN_M
    assert error["p95_m"] < 1.5 * P95_M
    assert abs(error["volume_error"]) < 1.5 * VOLUME


def test_an_outline_that_no_point_sees_whole():
    found, error = reconstructed(OWN["horseshoe"]())
    assert found.method == "implicit"
    assert error["mean_m"] < 1.5 * MEAN_M
    assert abs(error["volume_error"]) < 1.5 * VOLUME


@pytest.mark.release
def test_every_known_shape_within_the_targets():
    from benchmarks.surface import truths

    for name, make in truths().items():
        _, error = reconstructed(make(), seed=3)
        assert error["mean_m"] < 1.5 * MEAN_M, name
        assert abs(error["volume_error"]) < 1.5 * VOLUME, name


def test_bad_presses_do_not_bend_the_surface():
    def spoil(evidence: Evidence) -> Evidence:
        rng = np.random.default_rng(1)
        bad = rng.choice(len(evidence.centres), 3, replace=False)
        centres = evidence.centres.copy()
        centres[bad] -= rng.uniform(0.002, 0.006, (3, 1)) * evidence.normals[bad]
        return replace(evidence, centres=centres)

    found, error = reconstructed(phantom_truth("bean"), 1, change=spoil)
    assert error["mean_m"] < 0.0003
    assert found.held_out_m[found.method] < 0.0005


def test_the_hull_lies_inside_a_convex_object_and_the_tangent_planes_outside():
    truth = phantom_truth("block")
    found, _ = known("block")
    low, high = found.bracket_m3
    assert low < truth.volume_m3
    assert low < found.volume_m3 < 1.02 * high


def test_the_frame_of_the_device_does_not_matter():
    truth = phantom_truth("half-sphere")
    evidence, _ = touch(truth, 4)
    quarter = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    shift = np.array([0.3, -0.2, 0.1])
    turned = replace(
        evidence,
        **{
            name: getattr(evidence, name) @ quarter.T + shift
            for name in ("support_point", "outline", "outline_centres", "centres")
        },
        **{name: getattr(evidence, name) @ quarter.T for name in ("support_normal", "normals")},
    )
    one, two = reconstruct_surface(evidence), reconstruct_surface(turned)
    assert one.method == two.method
    assert two.volume_m3 == pytest.approx(one.volume_m3, rel=1e-3)


def test_the_base_lies_on_the_support():
    found, _ = known("cylinder")
    height = (found.vertices - found.support_point) @ found.support_normal
    assert height.min() == pytest.approx(0, abs=1e-9)
    assert (np.abs(height) < 1e-9).sum() > 50


def test_uncertainty_is_small_at_touches_and_large_at_rims():
    truth = phantom_truth("cylinder")
    _, back = touch(truth, 0)
    found, _ = known("cylinder")
    local = back(found.vertices)
    radius = np.linalg.norm(local[:, :2], axis=1)
    rim = (np.abs(local[:, 2] - 0.08) < 0.002) & (np.abs(radius - 0.04) < 0.002)
    wall = (np.abs(radius - 0.04) < 0.001) & (np.abs(local[:, 2] - 0.04) < 0.01)
    assert found.uncertainty_m[rim].mean() > 0.001
    assert found.uncertainty_m[wall].mean() < 0.0003
    place, sd_m = found.least_known
    height, across = back(place[None])[0, 2], np.linalg.norm(back(place[None])[0, :2])
    assert sd_m > 0.001 and abs(height - 0.08) < 0.003 and abs(across - 0.04) < 0.003


@pytest.mark.slow
def test_uncertainty_covers_the_error_of_a_free_form():
    truth = OWN["blob"]()
    evidence, back = touch(truth, 2)
    found = reconstruct_surface(evidence)
    from palpate.mechanics.shape.nearest import distance

    local = back(found.vertices)
    off = local[:, 2] > 0.012
    error = distance(truth.vertices, truth.triangles, local[off])
    assert np.mean(error < 3 * found.uncertainty_m[off] + 5e-5) > 0.85


def test_too_few_touches_are_refused():
    evidence, _ = touch(phantom_truth("block"), 0)
    with pytest.raises(SurfaceError, match="touch more places"):
        replace(evidence, centres=evidence.centres[:3], normals=evidence.normals[:3], centre_error_m=1e-4)


def test_values_that_are_not_finite_are_refused():
    evidence, _ = touch(phantom_truth("block"), 0)
    centres = evidence.centres.copy()
    centres[0, 0] = np.nan
    with pytest.raises(SurfaceError, match="not finite"):
        replace(evidence, centres=centres)


def test_touches_on_the_support_alone_are_refused():
    evidence, _ = touch(phantom_truth("block"), 0)
    height = (evidence.centres - evidence.origin) @ evidence.axes[2]
    flat = evidence.centres - (height - evidence.tip_radius_m)[:, None] * evidence.axes[2]
    with pytest.raises(SurfaceError, match="on the support"):
        reconstruct_surface(replace(evidence, centres=flat))


@pytest.mark.parametrize(
    ("stem", "name"),
    [
        pytest.param("silicone-2-block", "block", marks=pytest.mark.slow),
        pytest.param("silicone-1-cylinder", "cylinder", marks=pytest.mark.release),
        pytest.param("silicone-3-halfsphere", "half-sphere", marks=pytest.mark.release),
        pytest.param("example-time-delay", "cylinder", marks=pytest.mark.release),
    ],
)
def test_the_labelled_recordings_meet_the_targets(shared_recordings, stem, name):
    from palpate.mechanics.recording.recording import read_recording
    from palpate.reconstruction.steps.s3_contacts.contacts import explore
    from palpate.reconstruction.steps.s4_surface import evidence_of

    recording = read_recording(shared_recordings / f"{stem}.toml")
    found = reconstruct_surface(evidence_of(explore(recording)))
    truth = recording.truth
    turn = np.array(truth.get("device_from_object_rotation", np.eye(3)))
    shift = 1e-3 * np.array(truth.get("device_from_object_shift_mm", [0, 0, 0]))
    error = deviation(phantom_truth(name), (found.vertices - shift) @ turn, found.triangles)
    assert error["mean_m"] < MEAN_M
    assert error["p95_m"] < P95_M
    assert abs(error["volume_error"]) < VOLUME


def test_a_top_touched_at_one_place_does_not_take_the_slope_of_its_noise():
    from palpate.reconstruction.shapes.choice import first_guesses
    from palpate.reconstruction.shapes.fit import ShapeEvidence, fit

    evidence, _ = touch(phantom_truth("cylinder"), 2)
    up = evidence.support_normal
    top = np.flatnonzero(evidence.normals @ up > 0.7)
    along = np.cross(up, evidence.normals[np.argmin(np.abs(evidence.normals @ up))])
    # three repeats at one place, a little uphill by their noise
    steps = 0.00015 * np.array([-1.0, 0.0, 1.0])[:, None] * (along + up)
    sides = np.setdiff1d(np.arange(len(evidence.centres)), top)
    kept = [*sides, *[top[0]] * 3]
    few = replace(
        evidence,
        centres=np.vstack([evidence.centres[sides], evidence.centres[top[0]] + steps]),
        normals=evidence.normals[kept],
        centre_error_m=evidence.centre_error_m[kept],
    )
    seen = ShapeEvidence.of(few)
    sloped = [g for g in first_guesses(few, seen) if any(p.label == "slope_x" for p in g.parameters)][0]
    found, _ = fit(sloped, seen)
    slopes = [p.value for p in found.parameters if p.label.startswith("slope")]
    assert np.hypot(*slopes) < 0.25


@pytest.mark.release
def test_the_directions_of_the_first_forces_speak_against_a_top_below_touched_walls():
    from palpate.reconstruction.shapes.choice import direction_score, try_shapes
    from palpate.reconstruction.shapes.prism import Prism

    truth = phantom_truth("bowl")
    evidence, _ = touch(truth, 0)
    tried = {e.name: e for e in try_shapes(evidence)}
    dish = max((e for n, e in tried.items() if n.startswith("dish")), key=direction_score)
    cylinder = tried["cylinder"]
    assert isinstance(cylinder.shape, Prism)
    assert direction_score(dish) > direction_score(cylinder) + 2


def test_a_shape_that_runs_away_where_nothing_was_touched_is_passed_over(monkeypatch):
    """A field beside a block once ended 1.8 m below the support."""
    from palpate.reconstruction.shapes import choice as module

    evidence, _ = touch(phantom_truth("cylinder"), 0)
    honest, tried = module.draw, []

    def runs_away_first(explained, spacing_m):
        vertices, triangles, deviation = honest(explained, spacing_m)
        tried.append(explained.name)
        return (vertices * [1, 1, -30] if len(tried) == 1 else vertices), triangles, deviation

    monkeypatch.setattr(module, "draw", runs_away_first)
    found = reconstruct_surface(evidence)
    assert len(tried) > 1 and found.method == tried[1]
    height = (found.vertices - found.support_point) @ found.support_normal
    assert -1e-6 < height.min() and height.max() < 0.2


def test_an_implicit_surface_that_is_open_is_no_rival(monkeypatch):
    """It was tried where no shape explains the touches, and its fault refused the recording."""
    from palpate.reconstruction.steps import s4_surface as module

    asked = []

    def open_one(evidence, options, why):
        asked.append(why)
        raise SurfaceError("the implicit surface is open")

    monkeypatch.setattr(module, "_POOR_M", 0.0)
    monkeypatch.setattr(module, "_implicit", open_one)
    surface = reconstruct_surface(touch(phantom_truth("cylinder"), 0)[0])
    assert asked and surface.method.rstrip("+") == "cylinder"


def test_a_first_touch_known_by_far_less_well_than_the_others_places_no_surface():
    from palpate.reconstruction.steps.s3_contacts.contacts import explore
    from palpate.reconstruction.steps.s4_surface import evidence_of

    found = explore(explore_cylinder(noise=0.01)[0])
    error = found.presses.onset_error_m.copy()
    every = evidence_of(found)
    assert len(every.centres) == len(error)
    error[[2, 5]] = 0.005
    sure = evidence_of(replace(found, presses=replace(found.presses, onset_error_m=error)))
    np.testing.assert_array_equal(sure.centres, np.delete(every.centres, [2, 5], axis=0))
    np.testing.assert_array_equal(sure.site, np.delete(every.site, [2, 5]))
    # where all are known as badly, all count
    all_loose = evidence_of(replace(found, presses=replace(found.presses, onset_error_m=0 * error + 0.005)))
    assert len(all_loose.centres) == len(error)
    # and four are kept, whatever they are
    p = found.presses
    five = SimpleNamespace(
        centre=p.centre[:5],
        contact_normal=p.contact_normal[:5],
        site=p.site[:5],
        onset_error_m=np.array([1e-4, 1e-4, 0.004, 1e-4, 0.005]),
    )
    few = SimpleNamespace(boundary=found.boundary, recording=found.recording, presses=five)
    np.testing.assert_array_equal(evidence_of(few).centres, p.centre[:4])
