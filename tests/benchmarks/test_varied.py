"""Drawn explorations: wide where they may be, and true to what they were drawn from."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.varied.draws import ORIENTATIONS, RATES_HZ, TRACINGS, draw
from benchmarks.varied.instrument import logged, sampling_times, weighed
from benchmarks.varied.objects import DEEPEST_MM, POOL, Thing, thickness, thing
from benchmarks.varied.recorded import frame, hand, record, touches
from benchmarks.varied.shapes import CONCAVE, FAMILIES, SLENDER, shape
from benchmarks.varied.writing import write
from benchmarks.variety import REMEDIES
from palpate import reconstruction
from palpate.mechanics.recording.recording import read_recording
from palpate.scenes.laboratory.effects import SensedSamples
from palpate.scenes.laboratory.frame import axes_of


@pytest.fixture(scope="module")
def draws():
    return [draw(seed) for seed in range(400)]


def test_draws_span_what_they_state(draws):
    """Ranges are used up to a tenth of their ends, every choice is made, and a seed repeats itself."""
    for name, low, high in (
        ("young_modulus_pa", 5e3, 150e3), ("noise_n", 0.005, 0.04), ("presses", 12, 60),
        ("tilt_rad", 0, np.radians(30)),
        ("tool_mass_kg", 0, 0.1), ("pace", 0.5, 2.0),
    ):  # fmt: skip
        values = np.array([getattr(d, name) for d in draws])
        assert low - 1e-12 <= values.min() < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < values.max() <= high + 1e-12
    assert {d.rate_hz for d in draws} == set(RATES_HZ)
    assert {d.orientation for d in draws} == set(ORIENTATIONS)
    assert {d.tracing for d in draws} == set(TRACINGS)
    assert {d.number for d in draws} == set(range(POOL))
    assert all(1.5e-3 <= d.least_depth_m <= d.most_depth_m <= 10e-3 for d in draws)
    assert draw(7) == draw(7) != draw(8)


def test_every_family_is_closed_and_stands_on_its_base():
    """All shapes are watertight, outward, on z = 0; concave and slender ones are among them."""
    import trimesh

    for number in range(len(FAMILIES)):
        phantom = shape(number)
        solid = trimesh.Trimesh(phantom.vertices, phantom.faces)
        assert solid.is_watertight
        assert solid.volume > 0
        assert abs(phantom.vertices[:, 2].min()) < 1e-12
        if phantom.name.rsplit("-", 1)[0] in CONCAVE:
            assert solid.volume < 0.985 * solid.convex_hull.volume
        if phantom.name.rsplit("-", 1)[0] in SLENDER:
            spans = np.sort(np.ptp(phantom.vertices, axis=0))
            assert spans[2] > 1.9 * spans[0]


def test_presses_stay_within_the_object():
    """No press is deeper than a share of the material under it, and the order keeps count of repeats."""
    it = thing(0)
    point, normal = it.places[0][0].point, it.places[0][0].normal
    assert it.places[0][0].reach <= 0.22 * thickness(it.phantom, point[None], normal[None])[0]
    for seed in range(6):
        drawn = replace(draw(seed), number=0)
        made = touches(it, drawn)
        assert len(made) == drawn.presses
        assert all(0 < t.depth <= min(t.reach or t.depth, DEEPEST_MM) for t in made)
        for site in {t.site for t in made}:
            assert [t.repeat for t in made if t.site == site] == list(
                range(sum(t.site == site for t in made))
            )


def test_clustered_presses_lie_closer_together_than_even_ones():
    """Heaps leave more of the surface untouched."""
    it = thing(3)

    def spread(clusters):
        made = touches(it, replace(draw(5), number=3, presses=14, repeat_share=0.4, clusters=clusters))
        return np.linalg.norm(np.ptp([t.point for t in made], axis=0))

    assert spread(1) < 0.9 * spread(0)


def test_the_clock_loses_what_it_says_and_never_goes_back():
    """Jitter and loss are as drawn, time increases, at every rate."""
    rng = np.random.default_rng(0)
    for rate in RATES_HZ:
        drawn = replace(draw(0), rate_hz=rate, jitter=0.15, lost_share=0.02)
        t = sampling_times(0.0, 60.0, drawn, rng)
        assert np.all(np.diff(t) > 0)
        assert 1 - len(t) / (60 * rate) == pytest.approx(0.02, abs=0.008)


def _swung(seconds=3.0):
    """A tool that swings by 30 mm a second in free air, held upright."""
    t = np.arange(int(1000 * seconds)) / 1000
    position = np.column_stack([0.03 * np.sin(2 * np.pi * t), 0 * t, 0.1 + 0 * t])
    axes = axes_of(np.repeat([[0.0, 0.0, 1.0]], len(t), axis=0))
    return SensedSamples(t, position, np.zeros((len(t), 3)), axes, np.ones(len(t), dtype=bool))


def test_weight_and_inertia_are_the_tools():
    """50 g: untared half a newton down, tared none, and mass times acceleration along the swing."""
    drawn = replace(draw(0), tool_mass_kg=0.05, tared=False, orientation="given")
    force = weighed(_swung(), drawn).force
    assert force[:, 2].mean() == pytest.approx(-0.05 * 9.81, rel=1e-6)
    assert np.abs(force[100:-100, 0]).max() == pytest.approx(0.05 * 0.03 * (2 * np.pi) ** 2, rel=0.01)
    assert np.abs(weighed(_swung(), replace(drawn, tared=True)).force[100:-100, 2]).max() < 1e-9


def test_written_and_read_the_same_whoever_wrote_it(tmp_path):
    """Force on the object, foreign names, further columns: the recording read is the recording made."""
    for script in range(13):
        drawn = replace(
            draw(1), script=script, force_on_object=script % 2 == 0, tool_mass_stated=script % 3 == 1
        )
        made = logged(
            _swung(), drawn, within_s=(0.0, 3.0), phase_s=(0.2, 1.0), rng=np.random.default_rng(0),
            tip_radius_m=0.004,
        )  # fmt: skip
        read = read_recording(write(tmp_path / f"{script}.csv.gz", made, drawn))
        assert np.abs(read.force_on_tool - made.force_on_tool).max() < 1e-6
        assert np.abs(read.position - made.position).max() < 1e-8
        assert read.boundary_phase == made.boundary_phase
        assert read.sample_rate_hz == drawn.rate_hz


def test_noise_is_as_loud_as_drawn():
    """Per axis, white and slow together, at every rate."""
    for rate in RATES_HZ:
        drawn = replace(draw(2), rate_hz=rate, noise_n=0.03, slow_share=0.3, jitter=0.0, lost_share=0.0)
        made = logged(
            _swung(30.0), drawn, within_s=(0.0, 30.0), phase_s=(0.2, 1.0), rng=np.random.default_rng(1),
            tip_radius_m=0.004,
        )  # fmt: skip
        assert made.force_on_tool.std() == pytest.approx(0.03, rel=0.03)


def test_frames_are_rotations_tilted_as_drawn():
    """The support's normal leans by the drawn angle."""
    for seed in range(5):
        drawn = draw(seed)
        turn, shift = frame(drawn)
        assert np.allclose(turn @ turn.T, np.eye(3))
        assert np.linalg.det(turn) == pytest.approx(1.0)
        assert np.arccos(turn[2, 2]) == pytest.approx(drawn.tilt_rad)
        assert np.abs(shift).max() <= 0.5


@pytest.mark.release
def test_nuisances_leave_the_truth_as_it_is(tmp_path):
    """The same exploration by another instrument: only the weight is added to the force of the contact."""
    full = thing(0)
    it = Thing(0, full.phantom, full.tip_radius_m, full.places[:1])
    base = replace(draw(3), number=0, presses=12, tool_mass_kg=0.0)
    heavy = replace(base, tool_mass_kg=0.09, tared=False, rate_hz=300.0, noise_n=0.04, tilt_rad=0.5)
    light, burdened = (record(d, tmp_path, it=it).simulation for d in (base, heavy))
    turned = [s.clean_n @ np.array(s.truth["device_from_object_rotation"]) for s in (light, burdened)]
    pressed = light.motion.touch >= 0
    weight = burdened.readings.force - burdened.clean_n
    assert np.abs(weight).max() < 1e-12
    still = pressed & (light.motion.s > 0)
    difference = np.linalg.norm(turned[1] - turned[0], axis=1)[still]
    assert np.median(difference) == pytest.approx(0.09 * 9.81, rel=0.1)
    assert light.truth["effects"] == burdened.truth["effects"] == []
    assert hand(base) == hand(heavy)


def test_a_remedy_changes_how_an_object_is_explored_and_nothing_of_the_object(draws):
    """Modulus, object, frame and hand stay; and the refusals of reconstruct do speak of every remedy."""
    texts = [p.read_text(encoding="utf-8") for p in Path(reconstruction.__path__[0]).rglob("*.py")]
    told = re.sub(r'"\s*f?"', "", "".join(texts))
    for words, mended in REMEDIES.items():
        assert words in told
        for before in draws[:40]:
            after = mended(before)
            assert (after.number, after.young_modulus_pa, after.person) == (
                before.number, before.young_modulus_pa, before.person
            )  # fmt: skip
            assert np.allclose(frame(after)[0], frame(before)[0])
