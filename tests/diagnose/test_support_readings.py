"""What yields on a rigid support is the instrument."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.instrument.instrument_effects import (
    find_instrument_offsets,
    read_sideways,
    ruled_out,
    seen_play,
)
from palpate.diagnosis.instrument.support_readings import Rigid, rigid_of
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.attribution import attribute
from palpate.diagnosis.search.evidence import Search
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.frames import tangents
from palpate.mechanics.recording.recording import Recording

NORMAL = np.array([0.1, -0.2, 0.97]) / np.linalg.norm([0.1, -0.2, 0.97])


def followed(tip: np.ndarray, width: float) -> np.ndarray:
    """What a reading shows that is dragged once the tip is half the play ahead, axis by axis."""
    read = tip.copy()
    for i in range(1, len(tip)):
        read[i] = np.clip(read[i - 1], tip[i] - width / 2, tip[i] + width / 2)
    return read


def traced(
    compliance: float, *, lift: bool = False, gain: np.ndarray | None = None, play: float = 0.0
) -> tuple[Recording, SimpleNamespace]:
    """A tip that is led around on a leaning plane, pressed with 1 to 3 N, read through a spring; friction
    drags at it, and what it is led around pushes it outwards."""
    rng = np.random.default_rng(1)
    t = np.arange(0, 12, 1e-3)
    across = np.cross(NORMAL, [1.0, 0, 0])
    along = np.cross(NORMAL, across)
    place = 0.05 * (np.cos(t)[:, None] * across + np.sin(t)[:, None] * along)
    push = 2 + np.sin(0.7 * t) + 0.3 * np.sin(3.1 * t)
    way = np.gradient(place, t, axis=0) / 0.05
    force = push[:, None] * (NORMAL - 0.2 * way + 0.1 * place / 0.05)
    tip = place
    if lift:
        up = np.clip(np.sin(1.3 * t) - 0.8, 0, None)
        tip = tip + 0.02 * up[:, None] * NORMAL
        force = np.where(up[:, None] > 0, 0.0, force)
    read = tip - compliance * force
    if play:
        read = followed(read, play)
    read = np.round(read / 3e-5) * 3e-5
    seen = force if gain is None else force @ gain.T
    recording = Recording(
        t=t, position=read, force_on_tool=seen + rng.normal(0, 0.012, force.shape), sample_rate_hz=1e3,
        tip_radius_m=0.005,
    )  # fmt: skip
    table = SimpleNamespace(
        within=lambda kind, at: np.full(len(at), kind == "trace"), noise=SimpleNamespace(raw_n=0.012)
    )
    return recording, table


@pytest.mark.parametrize("lift", [False, True])
@pytest.mark.parametrize("stiffness", [1200.0, 20e3])
def test_a_spring_in_the_tool_is_read_off_the_support(stiffness, lift):
    found = rigid_of(*traced(1 / stiffness, lift=lift), NORMAL)
    assert found.error < 0.02 / 1200
    assert abs(found.compliance - 1 / stiffness) < 4 * found.error + 1e-6


def test_a_support_that_leans_otherwise_than_the_model_says_is_no_gain():
    about = NORMAL + np.array([0.03, 0.0, -0.02])
    found = rigid_of(*traced(1e-3), about / np.linalg.norm(about))
    assert abs(found.compliance - 1e-3) < 5e-6 and not read_sideways(found)


def test_a_stiff_tool_reads_none():
    found = rigid_of(*traced(0.0), NORMAL)
    assert abs(found.compliance) < 4 * found.error + 2e-7


@pytest.mark.parametrize("compliance", [0.0, 1e-3])
def test_a_play_is_read_off_the_support_beside_a_spring(compliance):
    found = rigid_of(*traced(compliance, play=0.3e-3), NORMAL)
    assert found.play == pytest.approx(-0.3e-3, rel=0.05) and found.play < -20 * found.play_error
    assert abs(found.compliance - compliance) < 2e-5


def test_a_spring_alone_is_no_play():
    found = rigid_of(*traced(1e-3), NORMAL)
    assert abs(found.play) < 0.01e-3


def test_a_support_along_the_axes_tells_of_no_play():
    recording, table = traced(0.0)
    flat = np.column_stack([recording.position[:, :2], np.zeros(len(recording.t))])
    flat = dataclasses.replace(recording, position=flat)
    assert not np.isfinite(rigid_of(flat, table, np.array([0.0, 0.0, 1.0])).play_error)


def test_what_the_support_shows_of_a_play_settles_it(bench):
    recording, model = bench.record()
    forward = build_forward(touches_of(bench.table(recording)), model)
    wide = Rigid(0.0, 1e-6, 1e-6, 10.0, play=-0.3e-3, play_error=1e-6)
    none = Rigid(0.0, 1e-6, 1e-6, 10.0, play=1e-6, play_error=1e-6)
    known = seen_play(wide, set())
    assert known.parameters[0].low < -0.3e-3 < known.parameters[0].high < -0.28e-3
    assert "backlash" not in ruled_out(forward, wide, None)
    assert seen_play(none, set()) is None and "backlash" in ruled_out(forward, none, None)
    assert seen_play(wide, {"backlash"}) is None
    # a play that presses hardly feel is there all the same
    narrow = Rigid(0.0, 1e-6, 1e-6, 10.0, play=-0.06e-3, play_error=1e-6)
    assert seen_play(narrow, set()) and "backlash" not in ruled_out(forward, narrow, None)


def test_no_contact_with_the_support_tells_nothing():
    recording, table = traced(1e-3)
    table.within = lambda kind, at: np.zeros(len(at), dtype=bool)
    assert rigid_of(recording, table, NORMAL) is None


def test_what_the_support_tells_is_taken_off_the_presses(bench):
    stiffness = 900.0
    altered, model = bench.record(lambda t, x, f: (x - f / stiffness, f))
    forward = build_forward(touches_of(bench.table(altered)), model)
    read = forward.touches.travel.copy()
    found = find_instrument_offsets(forward, None, Rigid(1 / stiffness, 1e-6, 1e-6, 10.0), set())
    assert found.names == ("tool_compliance",)
    assert found.parameters["tool_compliance"]["stiffness_n_per_m"] == pytest.approx(stiffness)
    plain, _ = bench.record()
    true = touches_of(bench.table(plain)).travel
    counted = forward.touches.counted
    assert np.abs(forward.touches.travel - true)[counted].max() < 0.05e-3 < np.abs(read - true)[counted].max()
    # the spring makes the force smaller: what the ideal model says too much is put back for the plain gap
    assert found.residual[counted, 0].mean() < 0


def test_a_spring_that_changes_no_force_is_not_named(bench):
    altered, model = bench.record()
    forward = build_forward(touches_of(bench.table(altered)), model)
    before = forward.touches
    assert find_instrument_offsets(forward, None, Rigid(1e-6, 1e-8, 1e-6, 10.0), set()).names == ()
    assert forward.touches is before


def test_a_force_that_is_read_into_other_axes_shows_on_the_support():
    gain = np.array([[1.1, 0.05, -0.05], [0.05, 1.1, 0.05], [-0.05, 0.05, 1.1]])
    found = rigid_of(*traced(0.0, gain=gain), NORMAL)
    across, along = tangents(NORMAL)
    read = gain @ NORMAL
    expected = np.array([across @ read, along @ read]) / (NORMAL @ read)
    # friction that gains as well turns a little into it
    assert np.abs(np.array(found.sideways) - expected).max() < 0.006
    assert read_sideways(found) == {"force_gain"}


def test_friction_and_a_push_across_the_way_are_no_gain():
    recording, table = traced(1e-3, lift=True)
    found = rigid_of(recording, table, NORMAL)
    assert np.abs(found.sideways).max() < 0.005 and not read_sideways(found)


def test_what_the_support_shows_is_named_before_what_presses_show(bench):
    """Cross-talk too weak for the presses alone."""
    gain = np.eye(3) + 0.02 * (1 - np.eye(3))
    altered, model = bench.record(lambda t, x, f: (x, f @ gain.T))
    forward = build_forward(touches_of(bench.table(altered)), model)
    search = Search(
        forward, 20e3, nuisance=NuisanceOptions(), options=AttributionOptions(), site_sd=None,
        finite_strain=effect("finite_strain"),
    )  # fmt: skip
    tried = [effect("force_gain")]
    alone = attribute(search, tried)
    seen = attribute(search, tried, seen=frozenset({"force_gain"}))
    assert alone.chosen == () and seen.chosen == ("force_gain",)
    assert [e.effects for e in seen.explanations] == [("force_gain",)]
