"""Contact that never breaks, and points without a time: what is cut, and what it can and cannot tell."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import palpate as pp
from palpate.diagnosis.forward.touches import unobservable_effects
from palpate.diagnosis.pipeline import with_tip_of
from palpate.mechanics.errors import ContactError, OptionError
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.reconstruction.geometry.stated import nowhere
from palpate.reconstruction.presses_on_model import presses_on
from palpate.reconstruction.steps.s1_filter.noise import low_pass, noise_gain
from palpate.reconstruction.steps.s3_contacts.contacts import ContactOptions, explore
from palpate.reconstruction.steps.s3_contacts.cycles import free_air_seen
from palpate.reconstruction.steps.s3_contacts.quasi_static import explore_points
from palpate.render.replay import replay_error

from .flat_contact import cyclic, points, pushed, recorded
from .flat_ground import MODULUS_PA, NOISE_N, TIP_M, raster


def seen(recording):
    return free_air_seen(
        low_pass(recording.position, recording.sample_rate_hz, 25.0),
        low_pass(recording.force_on_tool, recording.sample_rate_hz, 25.0),
        recording.tip_radius_m,
        NOISE_N * noise_gain(recording.sample_rate_hz, 25.0),
    )


def test_free_air_is_where_going_in_or_out_changes_no_force():
    assert seen(raster()) and not seen(cyclic())
    # sliding at one depth changes no force either, and is no air
    way = np.linspace(0, 0.08, 2000)
    along = np.column_stack([way, 0 * way, TIP_M - 0.002 + 3e-4 * np.sin(400 * way)])
    assert not seen(recorded(along, pushed(TIP_M - along[:, 2]), 200.0, NOISE_N))


def test_cycles_are_cut_at_minima_and_say_what_they_cannot_tell():
    recording = cyclic()
    found = explore(recording, boundary=nowhere(recording), unbroken=True).presses
    assert len(found) == 32 and set(found.kinds) == {"cycle"} and found.sites == 16
    assert (found.peak_s > found.onset_s).all() and (found.end_s[:-1] <= found.onset_s[1:] + 1e-9).all()
    # first touches that were never seen, from the law of the loading
    assert np.abs(found.centre[:, 2] - TIP_M).max() < 2e-4
    assert np.median(np.abs(found.centre[:, 2] - TIP_M) / found.onset_error_m) < 2
    assert not found.within("free", recording.t).any()
    # nothing is taken off as free air
    assert not found.free_air.any()


def test_a_load_cell_of_one_axis_cuts_the_presses_that_three_axes_cut():
    """The axes that nobody reads are no silence: taken for one, 4 mN of noise were cut into contacts."""
    full = raster((3, 2), tilt=False)
    force = np.where([False, False, True], full.force_on_tool, 0.0)
    alone = dataclasses.replace(full, force_on_tool=force)
    found, whole = (explore(r, boundary=nowhere(r), unbroken=True).presses for r in (alone, full))
    assert found.kinds == whole.kinds == ("press",) * 6
    assert found.noise.raw_n == pytest.approx(NOISE_N, rel=0.15)
    assert np.abs(found.onset_s - whole.onset_s).max() < 0.02
    assert (found.contact_normal[:, 2] > 0.999).all()


def test_a_hold_that_relaxes_is_one_press():
    t = np.arange(0, 3, 0.005)
    depth = np.interp(t, [0, 0.5, 1, 2.5, 3], [-0.002, -0.002, 0.003, 0.003, -0.002])
    relaxed = pushed(depth) * (1 - 0.4 * (1 - np.exp(-np.maximum(t - 1, 0) / 0.3)))
    tiled = np.tile(np.column_stack([0 * t, 0 * t, TIP_M - depth]), (5, 1))
    tiled[:, 0] = np.repeat(np.arange(5) * 0.01, len(t))
    recording = recorded(tiled, np.tile(relaxed, 5), 200.0, NOISE_N)
    found = explore(recording, boundary=nowhere(recording), unbroken=True).presses
    assert len(found) == 5 and set(found.kinds) == {"press"}


@pytest.mark.parametrize("by_depth", [False, True])
@pytest.mark.parametrize("rows", [2, 3, 8])
def test_points_are_presses_without_a_time(by_depth, rows):
    recording = points(rows=rows, by_depth=by_depth)
    if rows == 2:
        with pytest.raises(ContactError, match="at three depths or more"):
            explore_points(recording, nowhere(recording), ContactOptions())
        return
    found = explore_points(recording, nowhere(recording), ContactOptions()).presses
    assert len(found) == found.sites == 25 and found.quasi_static
    assert not found.rate.any() and not found.speed.any()
    # the first row of each place is 0.3 mm over the ground
    away = np.linalg.norm(recording.position[:, None, :2] - found.centre[:, :2], axis=2)
    above = np.where(away < 0.002, recording.position[:, 2:], -1).max(axis=0)
    off = found.centre[:, 2] - above + 3e-4
    assert np.abs(off).max() < 3e-4 and np.median(np.abs(off) / found.onset_error_m) < 2


def test_a_raster_of_219_places_at_3_mm_is_219_places():
    recording = points((73, 3), 0.003, 5)
    found = explore_points(recording, nowhere(recording), ContactOptions()).presses
    assert len(found) == found.sites == 219


@pytest.fixture(scope="module")
def slab():
    """A slab of 30 mm under the raster, as some other recording gave it, with another tip."""
    size = (0.09, 0.09, 0.03)
    mesh = box_mesh((9, 9, 3), size)
    points = mesh.points + [-0.036, -0.036, -0.03]
    mesh = TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable)
    support = Support(np.array([0.0, 0.0, -0.03]), np.array([0.0, 0.0, 1.0]))
    return Model(mesh, ObjectMaterial(MODULUS_PA, 0.49), support, Tool(0.006), 0.01)


@pytest.mark.parametrize("made", [cyclic, points])
def test_a_model_of_another_recording_needs_no_tracing(slab, made):
    recording = made()
    found = presses_on(recording, slab)
    assert set(found.kinds) == {"cycle" if made is cyclic else "points"}
    assert np.abs(found.point[:, 2]).max() < 1e-6
    # the tip is the recording's, in places and in the law alike
    assert with_tip_of(slab, found).tool.tip_radius_m == TIP_M == found.tip_radius_m
    assert unobservable_effects(found) >= ({"time_delay", "viscoelasticity"} if made is points else set())


def test_a_replay_of_contact_that_is_never_left_counts_all_of_it(slab):
    """The quietest 30 % were taken for air."""
    recording = cyclic()
    found = presses_on(recording, slab)
    error = replay_error(recording, found, np.zeros_like(recording.force_on_tool))
    pressed = (recording.t > found.onset_s.min()) & (recording.t < found.end_s.max())
    moving = np.linalg.norm(np.gradient(recording.position, axis=0)[:, :2], axis=1) > 1e-5
    assert error.contact[pressed & ~moving].mean() > 0.98
    assert error.relative == pytest.approx(1.0)


def test_points_that_cannot_be_read_are_one_line():
    flat = points(rows=5)
    with pytest.raises(ContactError, match="--slab M") as refused:
        pp.reconstruct(flat, progress=False)
    assert len(str(refused.value).splitlines()) == 1
    outside = points(rows=5)
    object.__setattr__(outside, "force_on_tool", -outside.force_on_tool)
    with pytest.raises(ContactError, match="force_on"):
        explore_points(outside, nowhere(outside), ContactOptions())
    with pytest.raises(OptionError, match="without a time"):
        pp.replay("demo", flat, progress=False)
