"""A base that is traced twice tells how far the object moved in between."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.instrument.instrument_effects import InstrumentOffsets, ruled_out, with_move
from palpate.diagnosis.instrument.support_readings import Move, Rigid, move_of
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.verdict.next_touch import next_touch
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.recording.recording import Recording

UP = np.array([0.15, -0.1, 0.98]) / np.linalg.norm([0.15, -0.1, 0.98])
CENTRE = np.array([0.3, -0.2, 0.1])


def _round(rng: np.random.Generator, lobes: float) -> np.ndarray:
    """(n, 3) m once and a tenth round a base: a circle, or one with two lobes; a hand leans in and out."""
    angle = rng.uniform(0, 2 * np.pi) + np.linspace(0, 2.2 * np.pi, 9000)
    lean = gaussian_filter1d(rng.normal(size=len(angle)), 150)
    reach = 0.04 * (1 + lobes * np.cos(2 * angle)) + 3e-4 * lean / lean.std()
    flat = Rotation.align_vectors([UP], [[0, 0, 1.0]])[0]
    return flat.apply(np.column_stack([reach * np.cos(angle), reach * np.sin(angle), 0.005 + 0 * angle]))


def _twice(seed: int, shift: np.ndarray, turn: np.ndarray, lobes: float) -> Move | None:
    """The move told by two tracings, the second moved by a shift and a turn about CENTRE."""
    rng = np.random.default_rng(seed)
    first = CENTRE + _round(rng, lobes)
    again = CENTRE + shift + Rotation.from_rotvec(turn).apply(_round(rng, lobes))
    position = np.round(np.vstack([first, again]) / 3e-5) * 3e-5
    force = rng.normal(0, 0.012, position.shape) + 0.7 * UP
    t = np.arange(len(position)) * 1e-3
    recording = Recording(t=t, position=position, force_on_tool=force, sample_rate_hz=1e3, tip_radius_m=5e-3)
    spans = {"trace": (0.0, t[len(first)]), "retrace": (t[len(first)], np.inf)}

    def within(kind: str, at: np.ndarray) -> np.ndarray:
        a, b = spans.get(kind, (np.inf, np.inf))
        return (at >= a) & (at < b)

    return move_of(recording, SimpleNamespace(within=within, noise=SimpleNamespace(raw_n=0.012)), UP, CENTRE)


def test_a_shift_and_a_turn_are_read_off_the_two_tracings():
    """Within their own errors, for small and large moves, of a base that is not round."""
    rng = np.random.default_rng(2)
    off = []
    for seed, size in enumerate([0.5e-3, 1.5e-3, 4e-3] * 2):
        shift, turn = size * rng.normal(size=3), 15 * size * rng.normal(size=3)
        found = _twice(seed, shift, turn, 0.25)
        sd = np.sqrt(np.diag(found.error))
        assert sd[:3].max() < 0.6e-3
        off += [(found.shift - shift) / sd[:3], (found.turn - turn) / sd[3:]]
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 2


def test_what_has_not_moved_is_seldom_said_to_have():
    """Of six objects, round and not, none reaches four standard errors all over."""
    rng = np.random.default_rng(3)
    normal = rng.normal(size=(20, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    for seed in range(6):
        found = _twice(100 + seed, np.zeros(3), np.zeros(3), 0.0 if seed % 2 else 0.25)
        along, error = found.along(CENTRE + 0.04 * normal, normal)
        assert (along**2).mean() < 4**2 * np.trace(error) / len(along)


def test_a_round_base_tells_its_shift_whatever_it_turned_by():
    found = _twice(5, np.array([2e-3, -1e-3, 1e-3]), np.zeros(3), 0.0)
    assert np.abs(found.shift - [2e-3, -1e-3, 1e-3]).max() < 0.3e-3
    assert np.sqrt(found.error[5, 5]) < 0.3


def test_one_tracing_tells_no_move():
    rng = np.random.default_rng(0)
    position = _round(rng, 0.1)
    recording = Recording(
        t=np.arange(len(position)) * 1e-3, position=position, force_on_tool=position * 0 + 0.7 * UP,
        sample_rate_hz=1e3, tip_radius_m=5e-3,
    )  # fmt: skip
    table = SimpleNamespace(
        within=lambda kind, at: np.full(len(at), kind == "trace"), noise=SimpleNamespace(raw_n=0.012)
    )
    assert move_of(recording, table, UP, CENTRE) is None


@pytest.mark.parametrize("shift, named", [(1.5e-3, True), (5e-6, False)])
def test_a_move_that_is_felt_is_named_with_what_it_hides(bench, shift, named):
    """The gap before is what the surface would miss by if it stood where its base was traced."""
    recording, model = bench.record()
    forward = build_forward(touches_of(bench.table(recording)), model)
    nothing = InstrumentOffsets((), {}, np.zeros_like(forward.touches.local_force), ())
    up = np.array([0.0, 0.0, shift])
    move = Move(up, np.zeros(3), np.zeros(3), np.diag([1e-9, 1e-9, 1e-14, 1e-6, 1e-6, 1e-6]))
    found = with_move(nothing, forward, move, set())
    assert found.names == (("surface_offset",) if named else ())
    assert with_move(nothing, forward, move, {"surface_offset"}).names == ()
    if named:
        # pressed on a top that has risen, the base's word has less force than is felt
        on_top = (forward.touches.normal[:, 2] > 0.9)[forward.touches.press] & forward.touches.counted
        assert found.residual[on_top, 0].mean() > 0.05
        low, high = np.array(found.intervals["surface_offset"]["shift_m"])
        assert (low <= up).all() and (up <= high).all()


def test_what_the_support_shows_not_to_be_there_is_ruled_out(bench):
    """Only where it would not matter even by several standard errors."""
    recording, model = bench.record()
    forward = build_forward(touches_of(bench.table(recording)), model)

    def rigid(error: float) -> Rigid:
        return Rigid(0.0, error, 1e-6, 10.0)

    def move(error: float) -> Move:
        return Move(np.zeros(3), np.zeros(3), np.zeros(3), error**2 * np.eye(6))

    assert ruled_out(forward, rigid(1e-7), None) == {"tool_compliance"}
    assert ruled_out(forward, rigid(1e-4), None) == set()
    assert ruled_out(forward, None, move(1e-6)) == {"surface_offset"}
    assert ruled_out(forward, None, move(1e-3)) == set()
    assert ruled_out(forward, None, None) == set()


@pytest.mark.parametrize("name, kind", [("tool_compliance", "rigid"), ("surface_offset", "retrace")])
def test_what_only_the_support_tells_is_asked_of_it(bench, name, kind):
    """A yielding tool and a moved object are parted from a tip's radius on the table, not by a press."""
    there = {
        "tool_compliance": lambda t, x, f: (x - f / 300.0, f),
        "surface_offset": lambda t, x, f: (x + [0.002, 0.0, 0.003], f),
    }
    recording, model = bench.record(there[name])
    forward = build_forward(touches_of(bench.table(recording)), model)
    search = Search(
        forward, model.material.young_modulus_pa, nuisance=NuisanceOptions(),
        options=AttributionOptions(), site_sd=None, finite_strain=effect("finite_strain"),
    )  # fmt: skip
    pair = [(n, search.judge([search.finite_strain, effect(n)])) for n in (name, "tip_radius")]
    touch = next_touch(forward, *pair, NuisanceOptions())
    assert (touch.kind, touch.separates) == (kind, (name, "tip_radius"))
    assert touch.sigmas > 2  # presses may take part of a move for their own first touch
