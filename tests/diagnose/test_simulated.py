"""Another simulator's forces: what is unclear is refused, flaws are named, and the parts add up."""

from __future__ import annotations

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.diagnosis.numerics.base import Signal, signal_of
from palpate.diagnosis.numerics.contact_stiffness import layer_factors
from palpate.diagnosis.numerics.lost_contact import lost
from palpate.diagnosis.numerics.registry import NAMES, numerical, numericals
from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions
from palpate.diagnosis.other_simulator import against_law
from palpate.diagnosis.other_simulator.against_law import seen_in_samples
from palpate.diagnosis.other_simulator.declared_parameters import StatedForward, stated_of
from palpate.diagnosis.other_simulator.forces import (
    Forces,
    ForcesOptions,
    aligned,
    reading_error_n,
    sorted_forces,
    spread_out,
)
from palpate.diagnosis.other_simulator.gap_decomposition import PARAMETER_OF, StatedParameter
from palpate.diagnosis.other_simulator.pipeline import Asked, _Weighed, diagnose_simulated
from palpate.diagnosis.other_simulator.result import PARTS, GapPart, Mended, parameter_words
from palpate.diagnosis.pipeline import diagnose
from palpate.diagnosis.search.own_size import without_wider
from palpate.diagnosis.verdict.result import EffectEntry
from palpate.importing.simulated_forces import read_forces
from palpate.mechanics.contact.dent import FINITE, grid
from palpate.mechanics.effects.registry import NAMES as PHYSICAL
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.errors import OptionError, RecordingError
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.presses.table import LEAD_S
from palpate.mechanics.progress import silent
from palpate.mechanics.quantities import parse_unit
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.render.registry import create
from palpate.render.replay import replay
from palpate.show.other_simulator import keys_in_words, lead, part_words, story, verdict
from palpate.show.story import PAGE, Sentence

FAST = DiagnoseOptions(fast=True, bootstrap=50)
OWN_CLOCK = ForcesOptions(clock_offset_s=0.0)


@pytest.fixture(scope="module")
def world(bench):
    """(recording, model, its diagnosis, the law's own force without noise, answers that were given)."""
    recording, model = bench.record(law="linear")
    exact = {}
    bench.record(lambda t, x, f: exact.update(force=f.copy()) or (x, f), law="linear")
    return recording, model, diagnose(recording, model, FAST), exact["force"], {}


def judged(world, force, **stated):
    """The answer to a force; tests that ask the same share it."""
    recording, model, reality, _, answers = world
    key = force.tobytes(), *stated.items()
    if key not in answers:
        asked = Asked(Forces(recording.t, force, "a simulator"), stated_of(stated, model), OWN_CLOCK)
        answers[key] = diagnose_simulated(recording, model, asked, FAST, reality=reality)
    return answers[key]


def shares(result):
    return sum(result.parts[name].share for name in PARTS) + result.unexplained


def test_a_simulation_by_our_own_law_has_no_flaw(world):
    result = judged(world, world[3])
    assert result.effects == () and result.kind == "none"
    assert shares(result) == pytest.approx(1.0)
    assert result.gap_before_n < 1.3 * result.noise_n
    # a diagnosis lets the tip stick, a renderer lets it slide at 1
    assert any("--stated friction=1" in note for note in result.notes)
    assert not any("friction" in note for note in judged(world, world[3], friction=0.5).notes)


def test_a_stiffer_mesh_is_numerics_and_a_stated_modulus_a_parameter(world):
    force, modulus = 1.5 * world[3], world[1].material.young_modulus_pa
    mesh, given = judged(world, force), judged(world, force, modulus=1.5 * modulus)
    assert mesh.effects[0] == "mesh_stiffness" and mesh.parts["numerics"].share > 0.9
    assert "stated_modulus" in mesh.candidates  # nobody stated it
    ratio = next(e for e in mesh.entries if e.name == "mesh_stiffness").parameters["ratio"]
    assert ratio == pytest.approx(1.5, rel=0.1)
    assert given.effects == ("stated_modulus",) and given.parts["parameters"].share > 0.9
    assert given.gap_after_n < 0.3 * given.gap_before_n
    for result in (mesh, given):
        assert shares(result) == pytest.approx(1.0)


def test_a_modulus_that_nobody_stated_and_a_mesh_are_said_as_one_thing(world):
    """A mesh was named, and the modulus only not ruled out: forces alone do not part them."""
    result = judged(world, 1.5 * world[3])
    assert result.body_alone
    assert verdict(result).startswith("above all the body is 1.5 times as stiff: its modulus")
    assert "mesh stiffness" not in verdict(result) and "stated modulus" not in verdict(result)
    assert result.advice[0].startswith("stated modulus")
    softer = [
        dataclasses.replace(e, parameters={**e.parameters, "ratio": 0.7}) if e.name == "mesh_stiffness" else e
        for e in result.entries
    ]
    assert "a softer contact is ruled out" in lead(dataclasses.replace(result, entries=tuple(softer)))
    known = judged(world, 1.5 * world[3], modulus=world[1].material.young_modulus_pa)
    assert not known.body_alone and "mesh stiffness" in verdict(known)


def test_what_a_diagnosis_leaves_open_is_not_named_of_a_simulator(world):
    """The terminal named an effect whose odds on the page were 39 %."""
    recording, model, reality, _, _ = world
    slips = dataclasses.replace(reality.entries[0], name="friction_slip", probability=0.39)
    reality = dataclasses.replace(
        reality, effects=("friction_slip",), entries=(slips,), kind="ambiguous", candidates=("backlash",)
    )
    weighed = SimpleNamespace(reality=reality, real=SimpleNamespace(names=("friction_slip",)))
    assert _Weighed.open_names.fget(weighed) == ("friction_slip",)
    weighed.open_names = ("friction_slip",)
    assert _Weighed.real_names.fget(weighed) == ()


@pytest.mark.slow
def test_what_changes_the_force_most_is_named_first_whatever_part_it_is_in(world):
    """Both pull one way here, and a third of the force outweighs 20 ms."""
    t, force, modulus = world[0].t, world[3], world[1].material.young_modulus_pa
    late = np.column_stack([np.interp(t - 0.02, t, f) for f in 1.5 * force.T])
    result = judged(world, late, modulus=1.5 * modulus)
    assert set(result.effects) == {"time_step", "stated_modulus"}
    sizes = {e.name: e.gap_after_n for e in result.entries}
    assert sizes[result.effects[0]] < sizes[result.effects[1]]


def test_a_tip_held_by_a_spring_is_contact_stiffness_with_that_springs(world):
    """Springs side by side are looked for too, and take nothing of it."""
    real = world[2].forward
    forward = StatedForward(real.touches, real.places, stated_of({}, world[1]))
    settings = forward.ideal(1.0)
    settings.tool_compliance += 1e-3
    local, frame = forward.predict(settings), real.places.frame[real.touches.press]
    force = Forces(real.touches.t, np.einsum("nij,ni->nj", frame, local), "a simulator")
    asked = Asked(force, stated_of({}, world[1]), OWN_CLOCK)
    result = diagnose_simulated(*world[:2], asked, FAST, reality=world[2])
    assert result.effects == ("contact_stiffness",)
    found = next(e for e in result.entries if e.name == "contact_stiffness")
    assert found.parameters["stiffness_n_per_m"] == pytest.approx(1000.0, rel=0.06)


def _half_too_stiff(world, *, ratio=1.5, compliance=0.0, dent_law="linear", **given):
    """Forces of a simulator whose mesh is half too stiff, its tip on a spring of so many m/N; what it was
    given."""
    real, stated = world[2].forward, stated_of(given, world[1])
    stiff = stated.but("young_modulus_pa", ratio * stated.young_modulus_pa)
    forward = StatedForward(real.touches, real.places, stiff)
    settings = forward.ideal(1.0)
    settings.tool_compliance += compliance
    settings.touch.dent_law = dent_law
    local, frame = np.nan_to_num(forward.predict(settings)), real.places.frame[real.touches.press]
    return Forces(real.touches.t, np.einsum("nij,ni->nj", frame, local), "a simulator"), stated


def _judged(world, run, base=None):
    asked = Asked(*run, OWN_CLOCK, base=base)
    return diagnose_simulated(*world[:2], asked, FAST, reality=world[2])


@pytest.mark.slow
def test_a_soft_body_is_named_beside_the_soft_contact_that_could_stand_for_it(world):
    """Forces x 0.7 over a contact of 1 N/mm were 98 % a contact of 0.34 N/mm: once that has bent, the body's
    0.7 moves the prediction by little, though its own force is a third of all."""
    result = _judged(world, _half_too_stiff(world, ratio=0.7, compliance=1 / 700, dent_law=FINITE))
    assert {*result.effects} == {"mesh_stiffness", "contact_stiffness"}
    found = {e.name: e.parameters for e in result.entries if e.name in result.effects}
    assert found["mesh_stiffness"]["ratio"] == pytest.approx(0.7, rel=0.07)
    assert found["contact_stiffness"]["stiffness_n_per_m"] == pytest.approx(700, rel=0.15)
    alone = _judged(world, _half_too_stiff(world, ratio=0.7, dent_law=FINITE))
    assert alone.effects == ("mesh_stiffness",)


@pytest.mark.slow
def test_a_simulator_that_is_off_already_is_judged_against_its_best(world):
    """Its mesh is half too stiff at its best, and a contact that is then made soft takes some of that off."""
    base, soft = _half_too_stiff(world), _half_too_stiff(world, compliance=1e-3)
    alone, result = _judged(world, soft), _judged(world, soft, base[0])
    assert alone.effects != ("contact_stiffness",)  # what is asked for is what was changed
    # the power of the depth is how its contact is made: no setting changes it
    weighed = [{e.name for e in each.entries} for each in (alone, result)]
    assert "force_law" in weighed[0] - weighed[1]
    assert result.effects == ("contact_stiffness",) and result.own.effects == ("mesh_stiffness",)
    assert shares(result) == pytest.approx(1.0)
    (pair,) = result.made_up
    assert set(pair.effects) == {"contact_stiffness", "its own"} and pair.together_n < max(pair.alone_n)
    assert "make up for each other" in "\n".join(result.lines())
    unchanged = _judged(world, base, base[0])
    assert unchanged.effects == () and unchanged.made_up == ()


@pytest.mark.slow
def test_a_contact_that_flickers_at_its_best_too_is_its_own(world):
    """Drake's own contact loses a sample in six: whatever was changed, that came first."""

    def flickering(run, seed):
        force, stated = run
        gone = np.random.default_rng(seed).random(len(force.t)) < 1 / 6
        return dataclasses.replace(force, force=np.where(gone[:, None], 0.0, force.force)), stated

    told = []
    for draw in range(3):
        base = flickering(_half_too_stiff(world, ratio=1.0), 2 * draw)
        soft = flickering(_half_too_stiff(world, ratio=1.0, compliance=1e-3), 2 * draw + 1)
        assert draw or _judged(world, soft).effects[0] == "lost_contact"
        result = _judged(world, soft, base[0])
        told.append("contact_stiffness" in (*result.effects, *result.candidates))
        assert "lost_contact" not in (*result.effects, *result.candidates)
        assert "lost_contact" in result.own.effects
    # a sixth of the samples hides what was changed in some draws of what is lost
    assert any(told), told


@pytest.mark.slow
def test_what_a_simulator_that_is_off_is_given_wrongly_acts_on_its_own_force(world):
    """A tip a fifth too small takes its share of a force that is half too great, and is all that is named."""
    small = _half_too_stiff(world, tip_radius_m=0.8 * world[1].tool.tip_radius_m)
    assert _judged(world, small, small[0]).effects == ("stated_tip_radius",)


@pytest.mark.slow
def test_a_mesh_that_is_off_by_less_at_a_wrong_poisson_ratio_is_not_the_parameters_flaw(world):
    """It locks less the more the solid gives way in volume: half too stiff at the right one, a fifth here."""
    wrong = _half_too_stiff(world, ratio=1.2, poisson_ratio=0.3)
    result = _judged(world, wrong, wrong[0])
    assert result.effects == ("stated_poisson_ratio",) and result.own.effects == ("mesh_stiffness",)


@pytest.mark.slow
def test_what_is_named_first_does_not_depend_on_what_stands_beside_it(world):
    """A mesh too stiff by 0.7 outweighs a modulus too small by 0.55, though in a simulation that has both the
    mesh adds but 0.7 of 0.45."""
    force, modulus = 1.7 * 0.45 * world[3], world[1].material.young_modulus_pa
    result = judged(world, force, modulus=0.45 * modulus)
    assert result.effects == ("mesh_stiffness", "stated_modulus")


@pytest.mark.slow
def test_mending_one_flaw_leaves_the_others_in_place(world):
    """Of the same simulation: with the right modulus its mesh makes it too stiff by 0.7, and with the right
    mesh it is too soft by 0.55, where as it came it was too soft by 0.235."""
    force, modulus = 1.7 * 0.45 * world[3], world[1].material.young_modulus_pa
    result = judged(world, force, modulus=0.45 * modulus)
    left = {e.name: e.gap_after_n / result.gap_before_n for e in result.entries}
    assert left["stated_modulus"] == pytest.approx(0.7 / 0.235, rel=0.15)
    assert left["mesh_stiffness"] == pytest.approx(0.55 / 0.235, rel=0.15)


def test_a_poisson_ratio_is_advised_as_far_as_a_simulator_takes_it():
    wrong = StatedParameter("stated_poisson_ratio", np.zeros((1, 3)), 0.35, 0.49)
    assert {"0.49", "0.35"} == numbers(parameter_words(wrong))
    assert {"0.45", "0.49"} == numbers(parameter_words(wrong, 0.45))
    there = dataclasses.replace(wrong, stated=0.45)
    assert "0.45" in parameter_words(there, 0.45) and "give" not in parameter_words(there, 0.45)
    tip = StatedParameter("stated_tip_radius", np.zeros((1, 3)), 0.005, 0.006)
    assert {"0.006", "0.005"} == numbers(parameter_words(tip, 0.45))


def numbers(words: str) -> set[str]:
    """The numbers that a text names."""
    return set(re.findall(r"[0-9]+[.][0-9]+", words))


def test_two_flaws_are_named_by_a_quick_diagnosis_too(world):
    """What takes long in a diagnosis is the object's own effects: the simulator's are never cut short."""
    t, force = world[0].t, world[3]
    result = judged(world, np.column_stack([np.interp(t - 0.02, t, f) for f in 1.5 * force.T]))
    assert set(result.effects) == {"mesh_stiffness", "time_step"}
    delay = next(e for e in result.entries if e.name == "time_step").parameters["delay_s"]
    assert delay == pytest.approx(0.02, abs=0.004)
    assert result.unexplained < 0.1
    ratio = next(e for e in result.entries if e.name == "mesh_stiffness").parameters["ratio"]
    assert ratio == pytest.approx(1.5, rel=0.1)
    assert "young_modulus_pa=" in " ".join(result.advice)


def test_a_gap_that_nothing_explains_is_said_first(world):
    """A force that no parameter makes: it comes and goes from second to second."""
    result = judged(world, world[3] * (1 + 0.8 * np.sin(2.4 * world[0].t))[:, None])
    assert result.unexplained > 0.5
    assert " explain" in lead(result) and "Above all" not in lead(result)
    # a run with mended settings that takes most of it away says what no part does
    again = dataclasses.replace(result, mended=Mended("settings best", result.gap_before_n / 20, ()))
    assert "run again with settings best" in lead(again) and "not explained" not in lead(again)
    assert "most of the gap is numerics" in again.lines()[0]
    little = dataclasses.replace(result, mended=Mended("settings best", 0.9 * result.gap_before_n, ()))
    assert lead(little) == lead(result)
    stiff = judged(world, 1.5 * world[3])
    assert "Above all: " in lead(stiff)
    told = next(each.text for each in story(stiff) if isinstance(each, Sentence) and each.on == PAGE)
    assert re.fullmatch(r"The gap is \d+\s% of the measured force\. How sure each name is: .*\d\s%\.", told)
    assert "Nothing stands out" in lead(judged(world, world[3]))


def test_json_has_the_keys_of_the_contract(world):
    result = judged(world, 1.5 * world[3])
    figures = result.as_json()
    assert figures["mended"] is None and figures["gap_without_numerics_n"] < 0.5 * result.gap_before_n
    again = dataclasses.replace(result, mended=Mended("settings best", 0.0123, ()))
    assert again.as_json()["gap_after_measured_n"] == 0.0123
    assert set(figures["parts"]) == {"reality", "parameters", "numerics"}
    assert all({"gap_n", "share"} <= set(part) for part in figures["parts"].values())
    assert {"name", "version", "stated"} <= set(figures["simulator"])
    assert figures["simulator"]["stated"]["friction"] is None  # it sticks
    assert {"gap_before_n", "verdict", "where", "effects", "next_touch", "unexplained"} <= set(figures)
    assert {e["domain"] for e in figures["effects"]} <= {
        "object", "contact", "boundary", "instrument", "parameters", "numerics",
    }  # fmt: skip


def test_numerical_effects_have_names_of_their_own_and_do_nothing_at_their_ideal(world):
    assert not set(NAMES) & set(PHYSICAL)
    real = world[2].forward
    forward = StatedForward(real.touches, real.places, stated_of({}, world[1]))
    plain = forward.predict(forward.ideal(1.0))
    for effect in numericals():
        settings = forward.ideal(1.0)
        effect.act(settings, effect.ideal, forward)
        assert forward.predict(settings) == pytest.approx(plain, abs=1e-12), effect.name
        assert effect.advice


@pytest.mark.parametrize(
    ("factor", "said", "unsaid"), [(1.5, "0.67 times", "soft"), (0.7, "1.43 times", "refine")]
)
def test_the_advice_says_how_much_and_which_way(world, factor, said, unsaid):
    """Forces of 0.7 times the measured ones were told to refine the mesh, if it was too stiff."""
    (advice,) = (words for words in judged(world, factor * world[3]).advice if "mesh stiffness:" in words)
    assert said in advice and unsaid not in advice


def test_a_contact_that_gives_is_told_how_hard_it_is_and_should_be():
    advice = numerical("contact_stiffness").advised({"stiffness_n_per_m": 280.0})
    assert "2.8 N/mm in place of 0.28 N/mm leave a tenth" in advice


def test_a_layer_of_springs_takes_its_share_of_the_depth_and_most_of_a_light_press():
    x, share = grid(), 0.1
    factor, stick = layer_factors(share)
    dent = x[1:] * factor[1:] ** (2 / 3)  # the force goes with the dent's power 1.5
    np.testing.assert_allclose(dent + share * np.sqrt(dent), x[1:], rtol=1e-9)
    assert (np.diff(factor[1:]) > 0).all() and (stick > factor)[1:].all()
    assert layer_factors(0.0)[0] == pytest.approx(1.0)


def test_flicker_and_falling_through_show_in_the_samples(world):
    presses, force = world[1].presses, world[3]
    at = np.column_stack([np.interp(presses.t, world[0].t, f) for f in force.T])
    flickering = at.copy()
    flickering[np.random.default_rng(0).random(len(at)) < 0.2] = 0.0
    signal, seen = seen_in_samples(signal_of(presses, flickering))
    assert seen["lost_contact"][1]["share"] == pytest.approx(0.2, abs=0.08)
    assert np.abs(signal.force - at).max() < 0.2 * np.abs(at).max()
    through = at.copy()
    part = presses.parts[3]
    deep = presses.travel[part, 0]
    through[part][np.argmax(deep > 0.7 * deep.max()) :] = 0.0
    _, seen = seen_in_samples(signal_of(presses, through))
    assert seen["tunnelling"][1]["share"] == pytest.approx(1 / len(presses))
    assert not seen_in_samples(signal_of(presses, at))[1]


def test_a_short_press_whose_force_begins_late_has_lost_no_contact():
    t = np.arange(0.0, 0.1, 0.002)
    depth = 0.002 * np.clip(np.minimum(t, t[-1] - t) / 0.03, 0.0, 1.0)
    push = 1e3 * np.maximum(depth - 0.001, 0.0) ** 1.5  # of a tip that is met a millimetre late
    force = push[:, None] * [0.0, 0.0, 1.0]
    signal = Signal(t, force, depth, np.tile([0.0, 0.0, 1.0], (len(t), 1)), (slice(0, len(t)),), t < 0)
    assert not lost(signal)[0].any()
    force[20:24] = 0.0
    assert lost(signal)[0].nonzero()[0].tolist() == [20, 21, 22, 23]


def passed_through(presses, force, which, *, turns):
    """(n, 3) N: from 0.6 of the depth on these presses push less the deeper the tip is, or pull it in."""
    out = force.copy()
    for k in which:
        part = presses.parts[k]
        deep = presses.travel[part, 0] / presses.travel[part, 0].max()
        out[part] *= (1 - np.clip((deep - 0.6) / 0.2, 0, 1.3 if turns else 0.85))[:, None]
    return out


@pytest.mark.parametrize("turns", [True, False])
def test_a_push_that_falls_while_the_tip_goes_deeper_shows_in_the_samples(world, turns):
    presses, force = world[1].presses, world[3]
    at = np.column_stack([np.interp(presses.t, world[0].t, f) for f in force.T])
    signal, seen = seen_in_samples(signal_of(presses, passed_through(presses, at, (2, 5, 7), turns=turns)))
    assert seen["tunnelling"][1]["share"] == pytest.approx(3 / len(presses))
    assert seen["tunnelling"][1]["never_felt"] == 0
    assert seen["tunnelling"][1]["from_depth_m"] == pytest.approx(
        0.6 * np.median(presses.deepest[[2, 5, 7]]), rel=0.2
    )
    left = np.unique(presses.press[signal.left])
    assert list(left) == [2, 5, 7] and not signal.left[presses.travel[:, 0] < 0].all()


def test_a_late_force_and_one_of_the_tips_speed_are_no_tunnelling(world):
    presses, force = world[1].presses, world[3]
    t = world[0].t
    late = np.column_stack([np.interp(presses.t - 0.1, t, f) for f in force.T])
    assert "tunnelling" not in seen_in_samples(signal_of(presses, late))[1]
    at = np.column_stack([np.interp(presses.t, t, f) for f in force.T])
    touching = (presses.travel[:, 0] > 0)[:, None]
    damped = at + touching * 30.0 * presses.speed[:, None] * presses.normal[presses.press]
    assert "tunnelling" not in seen_in_samples(signal_of(presses, damped))[1]


def test_what_is_soft_is_named_beside_presses_that_the_tip_fell_through(world):
    """Until it fell through, a press says of the law what the others do; nothing is left to `unexplained`."""
    presses, soft = world[1].presses, 0.6 * world[3]
    at = np.column_stack([np.interp(presses.t, world[0].t, f) for f in soft.T])
    through = passed_through(presses, at, range(1, len(presses), 2), turns=True)
    result = judged(world, np.column_stack([np.interp(world[0].t, presses.t, f) for f in through.T]))
    assert set(result.effects) == {"tunnelling", "mesh_stiffness"}
    assert result.unexplained < 0.05 and shares(result) == pytest.approx(1.0)


def test_mujoco_as_documented_lets_a_deep_press_through(tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)  # it leaves its warnings in a file where it runs
    radius, up = 0.005, np.array([0.0, 0.0, 1.0])
    mesh = box_mesh((5, 5, 3), (0.05, 0.05, 0.03))
    block = Model(mesh, ObjectMaterial(30e3, 0.45), Support(np.zeros(3), up), Tool(radius), 0.01)
    deep = np.interp(np.arange(0, 1.3, 0.005), [0.0, 0.5, 0.8, 1.3], [-1e-3, 8e-3, 8e-3, -1e-3])
    centre = up * (0.03 + radius - deep)[:, None]
    force = replay(create("mujoco", block), np.arange(len(deep)) * 0.005, centre, progress=silent)
    normal = np.broadcast_to(up, force.shape)
    at = Signal(
        np.arange(len(deep)) * 0.005, force, deep, normal, (slice(0, len(deep)),), np.zeros(len(deep), bool)
    )
    _, seen = seen_in_samples(at)
    assert seen["tunnelling"][1]["share"] == 1 and force[:, 2].min() < 0


def test_what_is_unclear_is_refused_with_the_option_that_settles_it(world):
    recording, model, _, force, _ = world
    presses, t = model.presses, recording.t
    with pytest.raises(OptionError, match="--simulated-force-on object"):
        aligned(Forces(t, -force, "x"), presses, ForcesOptions())
    turned = aligned(Forces(t, -force, "x"), presses, ForcesOptions(simulated_force_on="object"))
    assert turned.usable.all()
    with pytest.raises(OptionError, match="else --clock-offset 1000"):
        aligned(Forces(t - 1000.0, force, "x"), presses, ForcesOptions(clock_offset_s=None))
    with pytest.raises(OptionError, match="--clock-offset"):
        aligned(Forces(t + 1.0, force, "x"), presses, ForcesOptions())
    with pytest.raises(OptionError, match="zero wherever"):
        aligned(Forces(t, 0 * force, "x"), presses, ForcesOptions())


def test_a_force_in_the_place_of_the_time_is_refused_and_no_unlike_clock_suggested(world):
    """Columns in another order were answered with a clock 54 s off, at a likeness of 0.10."""
    recording, model, _, force, _ = world
    t = recording.t
    with pytest.raises(RecordingError, match=r"t does not increase \(row \d+"):
        sorted_forces(force[:, 0] + 1e-3 * np.sin(1e4 * t), force, "x")
    moved = np.concatenate([np.arange(len(t) // 2, len(t)), np.arange(len(t) // 2)])
    assert "sorted by time" in sorted_forces(t[moved], force[moved], "x").notes[0]
    unlike = np.abs(np.random.default_rng(0).normal(size=force.shape)) * force[::-1]
    aligned(Forces(t, np.abs(np.cumsum(unlike, axis=0)), "x"), model.presses, ForcesOptions())


@pytest.mark.slow
def test_an_early_force_by_a_stated_clock_is_early_and_nothing_else(world):
    """A clock that took 10 ms too much off was named numerical damping."""
    recording, model, reality, exact, _ = world
    late = ForcesOptions(clock_offset_s=-0.01)
    stated = stated_of({"modulus": model.material.young_modulus_pa}, model)
    asked = Asked(Forces(recording.t, 1.25 * exact, "a simulator"), stated, late)
    result = diagnose_simulated(recording, model, asked, FAST, reality=reality)
    assert set(result.effects) == {"mesh_stiffness", "time_step"}
    assert any("a lag of the simulator itself cannot be told from it" in note for note in result.notes)
    step = next(e for e in result.entries if e.name == "time_step")
    assert step.parameters["delay_s"] == pytest.approx(-0.01, abs=0.002)
    assert keys_in_words(step).startswith("early by")
    assert any("come early" in advice for advice in result.advice)


def test_a_gain_that_was_idle_beside_a_power_of_the_force_stands_instead_of_it(world, monkeypatch):
    """A power has a level of its own, so a plain gain was named a force law, then a contact offset."""
    searches = []
    found = against_law.attribute
    monkeypatch.setattr(against_law, "attribute", lambda s, *a, **k: searches.append(s) or found(s, *a, **k))
    recording, model, reality, exact, _ = world
    stated = stated_of({"modulus": model.material.young_modulus_pa}, model)
    asked = Asked(Forces(recording.t, 1.3 * exact, "a simulator"), stated, OWN_CLOCK)
    diagnose_simulated(recording, model, asked, FAST, reality=reality)
    gain, power = numerical("mesh_stiffness"), numerical("force_law")
    search = searches[0]
    wide, both = search.judge([power]), search.judge([gain, power])
    left, names = without_wider(search, ["force_law"], wide, both)
    assert names == ["mesh_stiffness"] and left.found.names == ("mesh_stiffness",)


def test_forces_in_another_frame_or_unit_are_taken_where_they_show_it_and_say_so(world):
    recording, model, _, force, _ = world
    presses, t = model.presses, recording.t
    plain = aligned(Forces(t, force, "x"), presses, OWN_CLOCK)
    assert (plain.frame.axes, plain.frame.unit, plain.frame.notes) == ("x,y,z", "N", ())
    y_up = force[:, [0, 2, 1]] * [1, 1, -1]
    for came, axes, unit in (
        (y_up, "x,z,-y", "N"),
        (force[:, [0, 2, 1]], "x,z,y", "N"),  # left-handed
        (1e3 * force, "x,y,z", "mN"),
        (1e-3 * y_up, "x,z,-y", "kN"),
    ):
        found = aligned(Forces(t, came, "x"), presses, OWN_CLOCK)
        assert (found.frame.axes, found.frame.unit) == (axes, unit) and found.frame.notes
        assert found.force == pytest.approx(plain.force)
    # as stated, nothing is weighed
    kept = dataclasses.replace(OWN_CLOCK, simulated_axes="x,y,z", simulated_unit="N")
    assert aligned(Forces(t, 1e3 * force, "x"), presses, kept).force == pytest.approx(1e3 * plain.force)
    with pytest.raises(OptionError, match="--simulated-axes 'x,z'"):
        aligned(Forces(t, force, "x"), presses, dataclasses.replace(kept, simulated_axes="x,z"))


@pytest.mark.parametrize("unit", ["kgf", "lbf"])
def test_a_force_that_may_be_in_another_unit_is_asked_and_the_cure_works(world, unit):
    """A simulation may be ten times too soft."""
    recording, model, _, force, _ = world
    few = Forces(recording.t, force / parse_unit(unit).scale, "x")
    with pytest.raises(OptionError, match=f"--simulated-unit {unit}"):
        aligned(few, model.presses, OWN_CLOCK)
    cured = aligned(few, model.presses, dataclasses.replace(OWN_CLOCK, simulated_unit=unit))
    assert cured.force == pytest.approx(
        aligned(Forces(recording.t, force, "x"), model.presses, OWN_CLOCK).force
    )
    # a modulus stated as so much softer accounts for it
    softer = aligned(few, model.presses, OWN_CLOCK, 1 / parse_unit(unit).scale)
    assert softer.frame.unit == "N"


def test_a_frame_that_the_presses_leave_open_is_asked_and_the_cure_works(world):
    """All presses from above: how the other two axes lie nobody can tell."""
    recording, model, _, force, _ = world
    presses = model.presses
    top = presses.of(presses.normal[:, 2] > 0.9)
    assert len(top) >= 3
    up = Forces(recording.t, np.outer(force[:, 2], [0, 1, 0]), "x")
    with pytest.raises(OptionError, match="--simulated-axes"):
        aligned(up, top, OWN_CLOCK)
    cured = aligned(up, top, dataclasses.replace(OWN_CLOCK, simulated_axes="x,z,-y"))
    assert cured.force[:, 2].max() > 0 and not cured.force[:, :2].any()


def test_newtons_that_another_unit_would_fit_better_are_kept_and_it_is_said(world):
    recording, model, _, force, _ = world
    pounds = Forces(recording.t, 1.5 * force / parse_unit("lbf").scale, "x")
    found = aligned(pounds, model.presses, OWN_CLOCK)
    assert found.frame.unit == "N" and "--simulated-unit lbf" in str(found.frame.notes)


def test_axes_as_written_are_asked_about_too_where_others_are_nearly_as_likely(world):
    recording, model, _, force, _ = world
    y_up = force[:, [0, 2, 1]] * [1, 1, -1]
    half = Forces(recording.t, 0.35 * force + 0.65 * y_up, "x")
    with pytest.raises(OptionError, match="x,y,z; x,z,-y fit alike"):
        aligned(half, model.presses, OWN_CLOCK)


@pytest.mark.parametrize("power", [2.0, pytest.param(1.0, marks=pytest.mark.slow)])
def test_a_force_of_another_power_of_the_depth_is_one_effect(world, power):
    force = world[3]
    size = np.linalg.norm(force, axis=1, keepdims=True)
    share = np.maximum(size / np.percentile(size[size > 0.05], 95), 1e-9)
    result = judged(world, force * share ** (power / 1.5 - 1))
    assert result.effects == ("force_law",)
    found = next(e for e in result.entries if e.name == "force_law")
    assert found.parameters["power"] == pytest.approx(power, rel=0.05)
    assert result.unexplained < result.noise_share + 0.05


def test_missing_rows_and_another_rate_are_told(world):
    recording, model, _, force, _ = world
    presses, t = model.presses, recording.t
    kept = ~((t > presses.onset_s[2]) & (t < presses.onset_s[2] + 0.3))
    some = aligned(Forces(t[kept][::4], force[kept][::4], "x"), presses, OWN_CLOCK)
    assert not some.usable[2] and some.usable.sum() == len(presses) - 1
    said = " ".join(some.notes)
    assert "125 Hz" in said and "1 of 24 presses were left out" in said
    bad = force.copy()
    bad[5] = np.nan
    assert "1 rows without a number" in sorted_forces(t, bad, "x").notes[0]


def test_a_simulator_that_was_run_over_some_presses_is_judged_by_those_that_have_rows(world):
    """What it was not run over is zero there, which is no contact that was lost; a press without rows is left
    out, and said."""
    recording, model, reality, force, _ = world
    presses, t = model.presses, recording.t
    chosen = spread_out(presses, 8)
    assert chosen.sum() == 8 and not (chosen & ~spread_out(presses, 12)).any()  # fewer are some of more
    assert len(np.unique(presses.site[chosen])) == 8 and spread_out(presses, None).all()
    some = np.where(presses.of(chosen).touching(t, LEAD_S)[:, None], 1.5 * force, 0.0)
    lost, *others = presses.onset_s[chosen]
    kept = ~((t > lost) & (t < lost + 0.3))
    asked = Asked(Forces(t[kept], some[kept], "x", (), chosen), stated_of({}, model), OWN_CLOCK)
    result = diagnose_simulated(recording, model, asked, FAST, reality=reality)
    assert result.effects == ("mesh_stiffness",) and shares(result) == pytest.approx(1.0)
    assert set(result.touches.onset_s) == set(others)
    assert [note.split(" were left out")[0] for note in result.notes if "left out" in note] == [
        "1 of 8 presses"
    ]


def test_files_are_read_or_refused(tmp_path):
    good = tmp_path / "good.csv"
    good.write_text("t,fx,fy,fz,note\n0,0,0,1,a\n0.1,0,0,2,b\n")
    assert read_forces(good).force[1, 2] == 2.0
    bad = tmp_path / "bad.csv"
    for rows in ("t,f\n0,1\n0.1,2\n", "fx,fy,fz\n0,0,1\n0,0,1\n"):
        bad.write_text(rows)
        with pytest.raises(RecordingError, match="are t, fx, fy, fz"):
            read_forces(bad)


@pytest.mark.parametrize(
    "text",
    [
        "time;Force X (N);Force Y (N);Force Z (N)\n0,0;0,5;0,0;1,0\n0,1;0,5;0,0;2,0\n",
        "time,Force X (N),Force Y (N),Force Z (N)\n0.0;0.5;0.0;1.0\n0.1;0.5;0.0;2.0\n",
        "0.0,0.5,0.0,1.0\n0.1,0.5,0.0,2.0\n",
        "t (ms),fx (mN),fy (mN),fz (mN)\n0,500,0,1000\n100,500,0,2000\n",
    ],
)
def test_a_file_of_forces_is_read_under_the_names_that_import_knows(text, tmp_path):
    (tmp_path / "forces.csv").write_text(text)
    read = read_forces(tmp_path / "forces.csv")
    assert read.t == pytest.approx([0.0, 0.1]) and read.notes
    assert read.force == pytest.approx(np.array([[0.5, 0, 1], [0.5, 0, 2]]))


def test_a_file_that_ends_early_is_judged_by_the_presses_that_it_covers(world):
    """Its clock is right: no offset is a cure. Another clock is told though it covers some presses."""
    recording, model, _, force, _ = world
    t, presses = recording.t, model.presses
    early = t < presses.end_s[9] + 0.01
    plain = ForcesOptions()
    found = aligned(Forces(t[early], force[early], "x"), presses, plain)
    assert found.usable.sum() == 10 and "10 of 24 presses" in " ".join(found.notes)
    late = presses.onset_s[12] - presses.onset_s[0]
    with pytest.raises(OptionError, match="--clock-offset") as refused:
        aligned(Forces(t + late, force, "x"), presses, plain)
    offset = float(re.search(r"--clock-offset (-?[\d.]+)", str(refused.value))[1])
    assert offset == pytest.approx(-late, abs=2e-4)


@pytest.mark.parametrize("late", [-1.0037, 0.5123])
def test_the_clock_that_is_suggested_lies_on_no_grid(world, late):
    """It was a multiple of 20 ms, and 10 ms too much were named numerical damping."""
    recording, model, _, force, _ = world
    noisy = 1.3 * force + np.random.default_rng(0).normal(0, 0.02, force.shape)
    with pytest.raises(OptionError, match="--clock-offset") as refused:
        aligned(Forces(recording.t + late, noisy, "x"), model.presses, ForcesOptions())
    offset, error = re.search(r"--clock-offset (-?[\d.]+) \(\+- ([\d.]+) ms", str(refused.value)).groups()
    assert float(offset) == pytest.approx(-late, abs=1e-3)
    assert abs(float(offset) + late) < 4e-3 * float(error) + 5e-5 and float(error) < 1


def test_forces_between_the_presses_deny_no_clock(world):
    """A simulation pushes hard where the foot was traced, as its object stands there: another offset was
    asked for."""
    recording, model, _, force, _ = world
    presses, t = model.presses, recording.t
    given = Forces(np.append(t, t + t[-1] + 1.0), np.vstack([force, 10 * force]), "x")
    found = aligned(given, presses, ForcesOptions())
    assert found.usable.all() and not found.notes


def test_the_answer_says_how_bad_against_the_force_and_where(world):
    """A third more force is a third of it; what is not named has no size."""
    told = str(judged(world, 1.5 * world[3]))
    gap = next(line for line in told.splitlines() if line.startswith("gap: "))
    assert float(re.search(r"([\d.]+)\s%", gap)[1]) == pytest.approx(50, abs=5)
    assert any(line.startswith("where: ") for line in told.splitlines())
    parts = [line for line in told.splitlines() if line.strip().startswith("parameters, ")]
    assert parts[0].endswith(": -")


def test_rows_too_far_apart_for_the_presses_settle_nothing(world):
    """Straight lines between them would be named as flaws of the simulator."""
    recording, model, reality, force, _ = world
    t, presses = recording.t, model.presses

    def read(step):
        return Forces(t[::step], force[::step], "x")

    fine, slow = (aligned(read(step), presses, OWN_CLOCK) for step in (2, 50))
    assert not fine.coarse and slow.coarse
    truth = np.column_stack([np.interp(presses.t, t, f) for f in force.T])
    off = np.sqrt(((slow.force - truth)[presses.counted] ** 2).sum(axis=1).mean())
    assert reading_error_n(0.1, presses) == pytest.approx(off, rel=0.25)
    asked, few = Asked(read(50), stated_of({}, model), OWN_CLOCK), AttributionOptions(most=1)
    result = diagnose_simulated(recording, model, asked, FAST, attribution=few, reality=reality)
    assert "unknown" in result.kind and verdict(result).startswith("no verdict yet")
    assert result.reasons.count(result.coarse) == 1
    enough = float(re.search(r"log at ([\d.]+) Hz", result.coarse)[1])
    assert not aligned(read(int(250 / enough)), presses, OWN_CLOCK).coarse


def test_times_in_milliseconds_are_asked_about(world):
    recording, model, _, force, _ = world
    with pytest.raises(OptionError, match=r"in ms\?.*t \(ms\)"):
        aligned(Forces(1e3 * recording.t[::8], force[::8], "x"), model.presses, ForcesOptions())


def test_what_was_stated_is_read_over_the_models_own(world):
    model = world[1]
    stated = stated_of(["modulus=30000", "nu=0.4"], model)
    assert stated.young_modulus_pa == 30000 and stated.poisson_ratio == 0.4
    assert stated.tip_radius_m == model.tool.tip_radius_m and stated.given == {
        "young_modulus_pa", "poisson_ratio",
    }  # fmt: skip
    for wrong in (["colour=3"], ["nu=0.7"], ["nu"], ["nu=soft"], ["nu=0.4", "poisson=0.3"]):
        with pytest.raises(OptionError, match="--stated"):
            stated_of(wrong, model)
    assert dataclasses.replace(stated, given=frozenset()).as_json()["friction"] is None


def key_sets(world):
    """{name of an effect: every set of keys that an answer can carry of it}; {} where nothing is fitted."""
    real, presses, force = world[2].forward, world[1].presses, world[3]
    forward = StatedForward(real.touches, real.places, stated_of({}, world[1]))
    sets = {name: [{}] for name in (*NAMES, *PHYSICAL)}
    for each in (*numericals(), *effects()):
        values = [each.ideal, *each.starts()] if each.parameters else []
        sets[each.name] += [each.report(np.asarray(v, float), forward, 20e3) for v in values]
    at = np.column_stack([np.interp(presses.t, world[0].t, f) for f in force.T])
    flickering = np.where(np.random.default_rng(0).random((len(at), 1)) < 0.2, 0.0, at)
    for seen in (flickering, passed_through(presses, at, (2, 5, 7), turns=True)):
        for name, (_, keys) in seen_in_samples(signal_of(presses, seen))[1].items():
            sets[name].append(keys)
    for name in PARAMETER_OF:
        sets[name] = [{"stated": given, "measured": said} for given in (0.3, None) for said in (0.2, None)]
    return sets


def test_every_effect_has_words_for_all_the_keys_that_an_answer_can_carry_of_it(world):
    """Names share keys: `ratio` is a number of a mesh and a list of a stiffness field."""
    sets = key_sets(world)
    assert set(sets) == {*NAMES, *PHYSICAL, *PARAMETER_OF}
    assert {"share", "never_felt", "from_depth_m"} in map(set, sets["tunnelling"])
    said = {}
    for name, keys in sets.items():
        for each in keys:
            entry = EffectEntry(name, "object", 0.9, 0.01, 0.5, (0.4, 0.6), each)
            said[name] = keys_in_words(entry)
            assert bool(said[name]) == bool(each), (name, each)
    assert said["tool_compliance"].startswith("the tool's stiffness")
    assert said["contact_stiffness"].startswith("stiffness of the contact")
    assert said["time_delay"].startswith("force reads early by") and "by 10 ms" in said["time_step"]
    assert said["mesh_stiffness"] == "0.82 times as stiff as it should be"
    assert "times the object's modulus" in said["stiffness_field"]
    assert said["stated_friction"] == "given unlimited: the tip sticks, measured unlimited: the tip sticks"


def test_a_share_below_0_is_said_in_a_sentence():
    """A numerics of "0 mN, -770 %" stood beside a contact stiffness of 117 mN."""
    plain = part_words(GapPart(0.0, -0.66)).replace("\N{NO-BREAK SPACE}", " ")
    assert "larger by 66 %" in plain and "hides another error" in plain and "mN" not in plain
    for share in (0.4, -0.004):
        assert not set("larger hides".split()) & set(part_words(GapPart(0.01, share)).split())
