"""Recordings that the laboratory writes: effects act as they say, seeds repeat, seals hold."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from palpate.cli import main
from palpate.mechanics.errors import OptionError, RecordingError
from palpate.mechanics.recording.recording import read_recording
from palpate.operations.simulate import effects_from
from palpate.scenes.laboratory.effects import REGISTRY
from palpate.scenes.laboratory.effects.contact import UNNAMED, relaxed
from palpate.scenes.laboratory.sealing import opened
from palpate.scenes.laboratory.session import Staging
from palpate.scenes.laboratory.simulate import SimulateOptions, simulate, size_of
from palpate.scenes.phantoms import phantom

CONTRACT = set(
    "finite_strain strain_stiffening viscoelasticity power_law_relaxation poroelasticity "
    "mullins_softening poisson_ratio inclusion jkr_adhesion "
    "modulus_gradient skin_layer surface_shape unbonded_base compliant_base surface_offset tip_radius "
    "friction_slip adhesion tool_compliance force_bias force_drift force_gain tool_gravity_inertia "
    "time_delay backlash".split()
)


def _made(effects: dict[str, float] | None = None, seed: int = 3, **options):
    return simulate(phantom("cylinder"), effects, SimulateOptions(protocol="sparse", **options), seed=seed)


@cache
def _kept(effects: tuple[tuple[str, float], ...], seed: int, options: tuple[tuple[str, object], ...]):
    return _made(dict(effects), seed, **dict(options))


def _run(effects: dict[str, float] | None = None, seed: int = 3, **options):
    """What `_made` returns, made once for all tests of this file: all of them have the fixture `springs`."""
    return _kept(tuple((effects or {}).items()), seed, tuple(options.items()))


def test_every_effect_of_the_contract_is_there_and_some_beyond() -> None:
    assert CONTRACT <= set(REGISTRY)
    assert len(UNNAMED) >= 2 and not {effect.name for effect in UNNAMED} & CONTRACT


def test_same_seed_same_recording_and_another_seed_another_hand(springs) -> None:
    first, again, other = _run(), _made(), _run(seed=4)
    assert np.array_equal(first.recording.force_on_tool, again.recording.force_on_tool)
    assert len(first.recording.t) != len(other.recording.t)
    assert first.truth["effects"] == []


def test_noise_and_steps_are_those_stated(springs) -> None:
    result = _run()
    noise = result.recording.force_on_tool - result.clean_n
    assert noise.std(axis=0) == pytest.approx(0.012, rel=0.03)
    assert np.abs(result.recording.position / 3e-5 - np.round(result.recording.position / 3e-5)).max() < 1e-6
    free = np.linalg.norm(result.clean_n, axis=1) == 0
    assert 0.3 < free.mean() < 0.95


def test_the_hand_makes_no_jumps_where_a_drag_begins_and_ends(springs) -> None:
    for seed in range(2):
        motion = _run(seed=seed).motion
        turns = np.flatnonzero((np.diff(motion.leg) != 0) & (np.diff(motion.touch) == 0))
        assert len(turns)
        step = np.linalg.norm(np.diff(motion.position, axis=0), axis=1)
        assert step[turns].max() < 0.02


def test_delay_shifts_the_force_and_nothing_else(springs) -> None:
    plain, late = _run(), _run({"time_delay": 1})
    assert np.array_equal(plain.recording.position, late.recording.position)
    assert late.clean_n[20:] == pytest.approx(plain.clean_n[:-20], abs=1e-9)
    assert late.truth["effects"] == ["time_delay"]
    assert late.truth["sizes"]["time_delay"]["rms_n"] > 0.02


def test_bias_drift_and_gain_read_as_their_parameters_say(springs) -> None:
    plain = _run()
    result = _run({"force_gain": 1, "force_bias": 2, "force_drift": 1})
    p = result.truth["parameters"]
    assert np.linalg.norm(p["force_bias"]["bias_n"]) == pytest.approx(0.1, rel=1e-3)
    expected = plain.clean_n @ np.array(p["force_gain"]["matrix"]).T + p["force_bias"]["bias_n"]
    expected = expected + np.outer(plain.recording.t, p["force_drift"]["rate_n_per_s"])
    assert result.clean_n == pytest.approx(expected, abs=1e-9)


def test_soft_tool_reads_deeper_than_the_tip_goes(springs) -> None:
    plain, soft = _run(), _run({"tool_compliance": 1})
    moved = soft.recording.position - plain.recording.position
    assert moved == pytest.approx(-plain.clean_n / 1200, abs=3.1e-5)
    assert soft.truth["sizes"]["tool_compliance"]["rms_n"] > 0.02


def test_backlash_loses_its_width_at_every_turn(springs) -> None:
    plain, loose = _run(), _run({"backlash": 1})
    lost = np.abs(plain.recording.position - loose.recording.position).max(axis=0)
    assert lost == pytest.approx(0.125e-3, abs=4e-5)


def test_weight_shows_when_the_tool_leans(springs) -> None:
    plain, heavy = _run(), _run({"tool_gravity_inertia": 1})
    extra = heavy.clean_n - plain.clean_n
    assert np.linalg.norm(extra[0]) < 0.02
    assert 0.05 < np.linalg.norm(extra, axis=1).max() < 1.5


def test_adhesion_pulls_at_release_only(springs) -> None:
    result = _run({"adhesion": 1})
    plain = _run()
    change = np.linalg.norm(result.clean_n - plain.clean_n, axis=1)
    assert change.max() == pytest.approx(0.1, rel=0.05)
    assert (change > 1e-9).mean() < 0.2


def test_relaxation_decays_to_the_elastic_force() -> None:
    force = np.zeros((4000, 3))
    force[100:, 2] = 1.0
    answer = relaxed(force, [0.3], [0.3])[:, 2]
    assert answer[100] == pytest.approx(1.3, rel=0.005)
    assert answer[400] == pytest.approx(1 + 0.3 * np.exp(-1), rel=0.005)
    assert answer[-1] == pytest.approx(1.0, abs=1e-4)


def test_size_of_an_effect_splits_off_what_the_modulus_absorbs() -> None:
    force = np.random.default_rng(0).normal(size=(500, 3))
    size = size_of(1.2 * force, force, force)
    assert size["best_scale"] == pytest.approx(1.2)
    assert size["rms_after_best_scale_n"] < 1e-12
    assert size["rms_n"] == pytest.approx(0.2 * np.sqrt((force**2).sum(axis=1).mean()))


def test_size_of_an_effect_is_the_same_beside_a_bias(springs) -> None:
    # a modulus cannot scale what is read in free air: a skin of 10 mN was told as 70 beside a tool of 85 g
    alone, biased = _run({"tip_radius": 1}), _run({"tip_radius": 1, "force_bias": 10})
    one, two = (result.truth["sizes"]["tip_radius"] for result in (alone, biased))
    assert two == pytest.approx(one, rel=1e-6)
    assert one["rms_after_best_scale_n"] < 0.5 * one["rms_n"]


def test_frame_turns_everything_together(springs) -> None:
    plain, turned = _run(), _run(frame=True)
    rotation = np.array(turned.truth["device_from_object_rotation"])
    shift = 1e-3 * np.array(turned.truth["device_from_object_shift_mm"])
    back = (turned.recording.position - shift) @ rotation
    assert back == pytest.approx(plain.recording.position, abs=6e-5)
    assert turned.clean_n @ rotation == pytest.approx(plain.clean_n, abs=1e-9)


def test_sealed_recording_withholds_the_truth_and_the_seal_finds_changes(
    springs, tmp_path: Path, capsys
) -> None:
    record, truth = tmp_path / "case.csv.gz", tmp_path / "vault" / "case.json"
    arguments = [
        "simulate",
        "cylinder",
        "-o",
        str(record),
        "--effect",
        "time_delay=1",
        "--protocol",
        "sparse",
    ]
    assert main([*arguments, "--seal", "--truth", str(truth)]) == 0
    said = capsys.readouterr().out
    assert f"palpate reconstruct {record} -o MODEL" in said
    recording = read_recording(record)
    assert recording.truth is None and "delay" not in (tmp_path / "case.toml").read_text()
    seal = tmp_path / "case.sealed"
    # 'written to case.csv.gz' was all that was said of a seal
    assert str(seal) in said and str(truth) in said
    judge = f"diagnose {record} --truth {truth}"
    assert f"palpate {judge}" in said
    assert opened(seal, truth)["effects"] == ["time_delay"]
    kept = json.loads(truth.read_text())
    kept["truth"]["effects"] = ["backlash"]
    truth.write_text(json.dumps(kept))
    with pytest.raises(RecordingError, match="not what"):
        opened(seal, truth)
    assert main(judge.split()) == 2, "before any work"
    assert "the truth or the salt was changed" in capsys.readouterr().err


def test_bad_requests_say_what_is_allowed(springs, tmp_path: Path, capsys) -> None:
    with pytest.raises(OptionError, match="time_delay"):
        effects_from(["gremlins=1"])
    with pytest.raises(OptionError, match="no number"):
        effects_from(["time_delay=much"])
    assert main(["simulate", "teapot", "-o", str(tmp_path / "a.csv.gz")]) == 2
    assert main(["simulate", "cylinder", "-o", str(tmp_path / "a.csv.gz"), "--seal"]) == 2
    assert "--truth" in capsys.readouterr().err
    with pytest.raises(OptionError, match="strength"):
        _run({"time_delay": -1})


def test_a_complete_exploration_ends_with_what_tells_the_instrument(springs) -> None:
    """Up to the last touch it is the same; then rigid, free and a second round are stated where they are."""
    plain = simulate(phantom("cylinder"), {"tool_compliance": 1}, SimulateOptions(protocol="sparse"), seed=3)
    staging = Staging(complete=True)
    made = simulate(
        phantom("cylinder"), {"tool_compliance": 1}, SimulateOptions(protocol="sparse"), seed=3,
        staging=staging,
    )  # fmt: skip
    n = len(plain.recording.t)
    assert np.array_equal(made.clean_n[:n], plain.clean_n)
    assert [s.kind for s in made.recording.segments] == ["rigid", "free", "retrace"]
    rows = {
        s.kind: (made.recording.t >= s.start_s) & (made.recording.t <= s.end_s)
        for s in made.recording.segments
    }
    force, height = np.linalg.norm(made.clean_n, axis=1), made.readings.position[:, 2]
    assert force[rows["rigid"]].max() == pytest.approx(4.0, rel=0.01)
    # 1200 N/m give by 3.3 mm under 4 N: the reading lies below the support
    assert height[rows["rigid"]].min() == pytest.approx(0.005 - 4.0 / 1200, abs=1e-4)
    assert force[rows["free"]].max() == 0
    foot = made.readings.position[rows["retrace"] & (force > 0.2)]
    turn = np.unique(np.floor(18 * (np.arctan2(foot[:, 1], foot[:, 0]) / np.pi)))
    assert len(turn) >= 36


def test_where_the_true_gap_is_follows_what_acts(springs) -> None:
    """Adhesion pulls while the tip leaves; a factor on every axis is the modulus's; a bias is everywhere."""
    where = _run({"adhesion": 1}).truth["where"]
    loading, _, unloading = where["phase_n"]
    assert loading < 0.1 * unloading
    same = {"matrix": (1.3 * np.eye(3)).tolist()}
    with pytest.MonkeyPatch.context() as patch:
        gain = replace(REGISTRY["force_gain"], parameters=lambda strength, bench: same)
        patch.setitem(REGISTRY, "force_gain", gain)
        factor = _made({"force_gain": 1}).truth
    assert factor["sizes"]["force_gain"]["rms_n"] > 0.1
    assert max(factor["where"]["press_n"]) < 1e-6
    assert max(_run({"force_bias": 2}).truth["where"]["press_n"]) < 1e-6
    assert "where" not in _run().truth


def test_where_the_true_gap_is_knows_each_touch_by_its_time(springs) -> None:
    result = _run({"time_delay": 1})
    where, way = result.truth["where"], result.motion
    assert len(where["press_s"]) == len(where["press_n"]) == len(result.touches)
    for number, (start, end) in enumerate(where["press_s"]):
        inside = way.t[(way.touch == number) & (way.s > 0)]
        assert start < inside[0] and inside[-1] < end
    # a late force is off where the tip moves, not where it is held
    assert where["phase_n"][1] < min(where["phase_n"][0], where["phase_n"][2])
