"""What touches the support after the tracing is told from palpations, and what it is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh

from palpate.mechanics.errors import ContactError
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import TimeSegment
from palpate.reconstruction.checks.support import support
from palpate.reconstruction.geometry.stated import GeometryOptions, nowhere
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct_fully
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.reconstruction.steps.s3_contacts.left_out import on_base

from .exploration_of_cylinder import HEIGHT, RADIUS


def _with_more(recording: Recording, position: np.ndarray, force: np.ndarray) -> Recording:
    """The recording, half a second of way through the air, and more samples."""
    rate = recording.sample_rate_hz
    count = round(0.5 * rate)
    share = np.arange(1, count + 1)[:, None] / (count + 1)
    start, end = recording.position[-1], position[0]
    air = start + share * (end - start)
    noise = np.random.default_rng(0).normal(0, 0.01, (count, 3))
    position = np.vstack([recording.position, air, position])
    t = recording.t[0] + np.arange(len(position)) / rate
    return dataclasses.replace(
        recording, t=t, position=position, force_on_tool=np.vstack([recording.force_on_tool, noise, force]),
        quaternion=None,
    )  # fmt: skip


def _retraced(recording: Recording, share: float, shift: np.ndarray) -> tuple[Recording, float]:
    """The recording with a share of its tracing once more, shifted; and when that begins."""
    found = explore(recording)
    a, b = found.boundary.interval
    before = round(0.3 * recording.sample_rate_hz)
    rows = slice(max(a - before, 0), a + round(share * (b - a)) + (before if share == 1 else 0))
    again = recording.position[rows] + shift
    up = again[-1] + np.linspace(0, 0.03, before)[:, None] * found.boundary.support_normal
    force = np.vstack([recording.force_on_tool[rows], np.zeros((before, 3))])
    more = _with_more(recording, np.vstack([again, up]), force)
    return more, float(recording.t[-1])


def test_a_base_traced_once_more_is_recognised_wherever_it_has_gone(cylinder):
    """No palpation of it is made, and what lies below the first tracing is no fault of the device."""
    recording, _ = cylinder
    plain = explore(recording).presses
    for down in (0.0, -1.2e-3, 1.5e-3):
        again, begins = _retraced(recording, 1.0, np.array([1e-3, -0.5e-3, down]))
        found = explore(again)
        assert len(found.presses) == len(plain)
        slid = [s for s in found.presses.segments if s.kind == "retrace"]
        assert slid and min(s.start_s for s in slid) > begins
        assert not [f for f in support(found) if f.name == "below the support"]


def test_half_a_round_is_no_tracing(cylinder):
    """It slides near the support, but goes round nothing; below it, it is a fault."""
    recording, _ = cylinder
    again, _ = _retraced(recording, 0.4, np.array([0.0, 0.0, -1.2e-3]))
    found = explore(again)
    assert not [s for s in found.presses.segments if s.kind == "retrace"]
    assert [f for f in support(found) if f.name == "below the support"]


def _with_rigid(recording: Recording, plain: Measured, yields_m: float = 0.0) -> Recording:
    """The recording with three presses on the bare support, 30 mm beside the base, into which a tool that
    yields goes so deep."""
    base, normal = plain.boundary, plain.boundary.support_normal
    middle = base.centres.mean(axis=0)
    out = base.centres[0] - middle
    place = base.centres[0] + 0.03 * out / np.linalg.norm(out)
    rate = recording.sample_rate_hz
    reach, held = round(0.4 * rate), round(0.8 * rate)
    deep = -yields_m * np.hanning(held) ** (2 / 3)
    height = np.concatenate([np.linspace(0.03, 0, reach), deep, np.linspace(0, 0.03, reach)])
    push = np.concatenate([np.zeros(reach), 4 * np.hanning(held), np.zeros(reach)])
    position = place + np.tile(height, 3)[:, None] * normal
    return _with_more(recording, position, np.tile(push, 3)[:, None] * normal)


def test_presses_on_the_bare_support_are_recognised_as_rigid(cylinder):
    recording, _ = cylinder
    plain = explore(recording)
    again = _with_rigid(recording, plain)
    found = explore(again)
    assert len(found.presses) == len(plain.presses)
    assert [s.kind for s in found.presses.segments].count("rigid") == 3
    stated = TimeSegment("rigid", float(recording.t[-1]), float(again.t[-1]))
    told = explore(dataclasses.replace(again, segments=(stated,))).presses.segments
    assert [s for s in told if s.kind == "rigid"] == [stated]


def test_a_base_that_the_touches_placed_leaves_out_those_on_its_support(cylinder):
    """As a search over that base would; the others stay as they were found."""
    recording, _ = cylinder
    plain = explore(recording)
    again = _with_rigid(recording, plain, yields_m=1e-3)
    first = explore(again, boundary=nowhere(again), unbroken=True)
    base = dataclasses.replace(plain.boundary, interval=(0, 0))
    kept, anew = on_base(first, base, 4), explore(again, boundary=base, unbroken=True)
    assert len(first.presses) >= len(kept.presses) + 3
    assert kept.boundary is base
    assert np.array_equal(kept.presses.onset_s, anew.presses.onset_s)
    assert np.allclose(kept.presses.centre, anew.presses.centre, atol=1e-12)
    assert sum("on the support" in why for _, why in kept.rejected) >= 3
    with pytest.raises(ContactError, match="on the support of the known geometry"):
        on_base(first, base, len(kept.presses) + 1)


@pytest.mark.slow
def test_touches_on_the_support_do_not_place_a_known_shape(cylinder, tmp_path):
    """One such touch, 4.9 mm off the surface, was in what its first touches lay off it, 1.25 mm rms."""
    recording, _ = cylinder
    again = _with_rigid(recording, explore(recording), yields_m=1e-3)
    path = tmp_path / "cylinder.stl"
    trimesh.creation.cylinder(RADIUS, HEIGHT, sections=90).export(path)
    geometry = GeometryOptions(shape=str(path))
    made = reconstruct_fully(again, ReconstructOptions(geometry=geometry))
    assert any("on the support" in reason for _, reason in made.exploration.rejected)
    assert len(made.placed.residual_m) == len(made.exploration.presses)
    assert np.abs(made.placed.residual_m).max() < 1e-3
