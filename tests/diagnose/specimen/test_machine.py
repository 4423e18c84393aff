"""A few curves tell the machine beside the material: a modulus with and without, a stiffness where it
matters, and no number outside its own interval."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.elastic_fit import NAMED, elastic_of
from palpate.diagnosis.specimen.machine_compliance import ThinnedWay
from palpate.diagnosis.specimen.material import material_of
from palpate.diagnosis.specimen.result import MachineTests, Material
from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.contact.tip import Tip
from palpate.show.material import in_words

RADIUS = 0.005
TIP = Tip("sphere", RADIUS)


def curves(modulus: float, stiffness: float, count: int = 3, slope: float = 0.0) -> list[MachineCycle]:
    """In and out of a sphere on a deep sample by a machine of that stiffness (N/m), 0.3 % of noise."""
    rng, found = np.random.default_rng(1), []
    for k in range(count):
        deepest = RADIUS * rng.uniform(0.2, 0.35)
        way = np.concatenate([np.linspace(-0.4e-3, 0, 80)[:-1], np.linspace(0, deepest, 400)])
        dent = np.concatenate([way, way[::-1]])
        force = np.asarray(dent_law("sphere").force(np.maximum(dent, 0), modulus, 0.49, RADIUS))
        travel = dent + force / stiffness + 1e-3 * k
        read = force + slope * (travel - travel[0]) + 0.003 * force.max() * rng.standard_normal(len(force))
        found.append(MachineCycle(np.arange(len(dent)) / 100, travel, read + 0.1, f"curve {k}"))
    return found


def stiffness_for(modulus: float, share: float) -> float:
    """N/m that adds that share of a dent of 1.5 mm."""
    deep = 0.3 * RADIUS
    return 16 / 9 * modulus * np.sqrt(RADIUS) * deep**1.5 / (share * deep)


def material(given: list[MachineCycle]):
    tests = MachineTests("indentation", curves=tuple(given), tip=TIP)
    return material_of(tests, [c.name for c in given], fast=True)


@pytest.mark.parametrize(("modulus", "share"), [(1e6, 0.2), pytest.param(2e4, 0.5, marks=pytest.mark.slow)])
def test_a_machine_that_yields_is_told_with_its_stiffness(modulus, share):
    made = material(curves(modulus, stiffness_for(modulus, share)))
    assert made.effects == ("tool_compliance",)
    found = made.parameters["tool_compliance"]["stiffness_n_per_m"]
    assert found == pytest.approx(stiffness_for(modulus, share), rel=0.2)
    assert made.young_modulus_pa == pytest.approx(modulus, rel=0.07)
    low, high = made.young_modulus_ci95_pa
    assert low <= made.young_modulus_pa <= high
    assert "{" not in "\n".join(made.lines()) and "N/mm" in "\n".join(made.lines())


@pytest.mark.parametrize("law", ["sphere", "neo-hookean", "linear"])
def test_a_rigid_machine_is_not_named_whatever_the_law(law):
    rng, given = np.random.default_rng(3), []
    for _ in range(3):
        dent = np.concatenate([np.linspace(-0.4e-3, 0, 80)[:-1], np.linspace(0, 0.3 * RADIUS, 400)])
        force = np.asarray(dent_law(law).force(np.maximum(dent, 0), 5e4, 0.49, RADIUS))
        force += 0.003 * force.max() * rng.standard_normal(len(dent))
        given.append(MachineCycle(np.arange(len(dent)) / 100, dent, force))
    found = elastic_of(given, TIP, 0.49)
    assert not found.machine and found.yields < NAMED
    assert found.interval_pa[0] < 5e4 < found.interval_pa[1]


@pytest.mark.parametrize("law", ["hertz", "neo-hookean"])
@pytest.mark.parametrize("slope", [-0.15, 0.0, 0.1])
def test_noise_and_a_slope_hide_no_machine_and_the_interval_holds_the_modulus(law, slope):
    """One curve of 0.8 % noise by a machine three times as stiff as the contact: a rigid one is 20 % off."""
    rng, modulus = np.random.default_rng(0), 1e5
    dent = np.linspace(-0.1 * RADIUS, 0.25 * RADIUS, 500)
    force = np.asarray(dent_law(law).force(np.maximum(dent, 0), modulus, 0.49, RADIUS))
    travel = dent + force / (3 * 1.5 * force[-1] / dent[-1])
    read = force + slope * force[-1] * travel / dent[-1] + 0.008 * force[-1] * rng.standard_normal(500)
    found = elastic_of([MachineCycle(np.arange(500) / 100, travel, read)], TIP, 0.49)
    assert found.machine and found.interval_pa[0] < modulus < found.interval_pa[1] < 1.4 * modulus
    assert abs(np.log(found.rigid_pa / modulus)) > 0.1


def test_a_slope_of_free_air_is_taken_off_and_said():
    made = material(curves(2e4, 1e9, slope=60.0))
    assert made.effects == ()
    assert "free air slopes by" in str(made.lines())


@pytest.mark.slow
def test_the_modulus_of_many_curves_lies_inside_its_interval():
    stiffness = stiffness_for(1e6, 0.3)
    made = material(curves(1e6, stiffness, count=8))
    low, high = made.young_modulus_ci95_pa
    assert low <= made.young_modulus_pa <= high
    assert made.young_modulus_pa == pytest.approx(1e6, rel=0.1)
    assert made.effects == ("tool_compliance",)
    assert made.parameters["tool_compliance"]["stiffness_n_per_m"] == pytest.approx(stiffness, rel=0.2)


def test_an_answer_that_misses_more_than_a_constant_says_so_first():
    rng = np.random.default_rng(0)
    travel = 1e-3 * np.linspace(-0.15, 1, 400)
    swings = (travel > 0) * (1 + 0.5 * np.sin(1.3e4 * travel) + 0.01 * rng.standard_normal(400))
    swings[-1] = 1.7
    made = material([MachineCycle(np.arange(400) / 100, travel, swings, name) for name in "ab"])
    assert made.missed > made.error["constant"] and not made.predicts
    assert "NO ANSWER" in made.lines()[0] and made.as_json()["predicts"] is False


def test_what_was_named_in_vain_is_in_the_first_line():
    error = {"ideal": 0.39, "verdict": 0.41, "constant": 0.56, "kelvin-voigt": 0.5, "hunt-crossley": 0.5}
    said = "tip radius explains the gap"
    made = Material("indentation", ("a",), 6, "curves", 4e4, (3e4, 5e4), "linear", error, said)
    assert "the ideal model predicts held-out data better than with what was found" in made.lines()[0]
    better = dataclasses.replace(made, error={**error, "verdict": 0.38})
    assert "the ideal model" not in better.lines()[0]


def test_a_loop_of_creep_widens_the_interval_down_to_the_lasting_modulus_and_is_said():
    way = np.concatenate([np.linspace(-0.3e-3, 0, 60)[:-1], np.linspace(0, 1e-3, 300), np.full(200, 1e-3)])
    dent = np.concatenate([way, np.linspace(1e-3, -0.3e-3, 360)])
    since = np.maximum(np.arange(len(dent)) - 359, 0) / 100
    modulus = 20e3 * (1 + np.exp(-since / 0.4))
    force = np.asarray(dent_law("sphere").force(np.maximum(dent, 0), 1.0, 0.49, RADIUS)) * modulus
    force += 0.002 * force.max() * np.random.default_rng(2).standard_normal(len(force))
    made = material([MachineCycle(np.arange(len(dent)) / 100, dent, force, "one")])
    low, high = made.young_modulus_ci95_pa
    assert low < 20e3 < high and "creep, a late force or play" in " ".join(made.lines())
    assert "pulls" not in made.verdict, "noise alone pulls by no more"
    depth, measured, predicted, *_ = made.seen
    way_in = slice(0, int(np.argmax(measured)))
    assert np.abs(predicted - measured)[way_in].max() < 0.05 * measured.max()
    assert depth.max() == pytest.approx(1e-3, rel=0.05)


def test_a_sample_that_fades_while_the_tip_rests_is_no_machine_that_yields():
    """A relaxing sphere contact of 20 kPa that ends in its hold: the ways in bend as a machine's would."""
    given = []
    for k, speed in enumerate((1e-3, 3e-3)):
        t = np.arange(0.0, 0.3 + 2e-3 / speed + 0.5, 5e-3)
        dent = speed * np.clip(t - 0.3, 0, 2e-3 / speed)
        elastic = 4 / 3 * 20e3 / (1 - 0.49**2) * np.sqrt(RADIUS) * dent**1.5
        memory, force = 0.0, elastic.copy()
        for i in range(1, len(t)):
            memory = np.exp(-5e-3 / 0.3) * memory + 0.3 * (elastic[i] - elastic[i - 1])
            force[i] += memory
        noise = np.random.default_rng(k).normal(0, 5e-5, len(t))
        given.append(MachineCycle(t, dent + speed * np.minimum(t - 0.3, 0), force + noise, f"{k}", None))
    found = material(given)
    assert found.effects == () and "yields" not in found.verdict
    assert any("may be in it" in note for note in found.notes)
    low, high = found.young_modulus_ci95_pa
    assert low < 20e3 < high


def test_parameters_are_written_as_people_write_them():
    assert in_words("tool_compliance", {"stiffness_n_per_m": 64e3}) == "stiffness 64 N/mm"
    words = in_words("viscoelasticity", {"g": [0.3, 0.2], "tau_s": [0.5, 20.0]})
    assert words == "of the lasting force 0.3 fades in 500 ms, 0.2 fades in 20 s"


@pytest.mark.parametrize("rows", [2, 3, 40])
def test_what_gives_against_the_push_is_its_slope_to_second_order(rows):
    push = np.cumsum(np.random.default_rng(0).uniform(0.1, 1.0, rows))
    way = ThinnedWay(push, push)
    assert way.against_push(3 * push + 1) == pytest.approx(3.0 if rows > 2 else 1.0)
    if rows > 2:
        assert way.against_push(push**2)[1:-1] == pytest.approx(2 * push[1:-1])
        assert way.against_push(np.sin(push)) == pytest.approx(np.gradient(np.sin(push), push))
