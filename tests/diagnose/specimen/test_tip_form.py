"""A tip is a form: its law is known, a curve speaks for its power of the depth, no machine stands for it."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.specimen.baseline import form_scores
from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.material import material_of
from palpate.diagnosis.specimen.result import MachineTests
from palpate.mechanics.contact.tip import Tip
from palpate.mechanics.errors import ContactError, OptionError
from palpate.show.material import lead

RADIUS, MODULUS, NU = 0.005, 2e4, 0.49
TIPS = {
    "sphere": Tip("sphere", RADIUS),
    "punch": Tip("punch", RADIUS),
    "cone": Tip("cone", None, 35.0),
    "pyramid": Tip("pyramid", None, 35.0),
}


def curves(tip: Tip, count: int = 1, noise: float = 0.002, stiffness: float = np.inf) -> list[MachineCycle]:
    """In and out, 60 rows a way, after half a millimetre of air; 0.2 % of noise."""
    rng, found = np.random.default_rng(4), []
    for k in range(count):
        dent = np.concatenate([np.linspace(-0.5e-3, 2.5e-3, 60), np.linspace(2.5e-3, -0.5e-3, 60)])
        force = tip.force(tip.laws[0], dent, MODULUS, NU)
        travel = dent + force / stiffness + 1e-4 * k
        read = force + noise * force.max() * rng.standard_normal(len(force))
        found.append(MachineCycle(np.arange(len(dent)) / 20, travel, read, f"curve {k}"))
    return found


def material(tip: Tip, given: list[MachineCycle], **said):
    return material_of(
        MachineTests("indentation", curves=tuple(given), tip=tip), ["a"] * len(given), fast=True, **said
    )


def test_the_closed_forms_are_sneddons():
    depth, plane_strain = np.array([1e-3]), MODULUS / (1 - NU**2)
    assert TIPS["punch"].force("punch", depth, MODULUS, NU) == pytest.approx(
        2 * RADIUS * plane_strain * depth
    )
    cone = 2 / np.pi * np.tan(np.radians(35)) * plane_strain * depth**2
    assert TIPS["cone"].force("cone", depth, MODULUS, NU) == pytest.approx(cone)
    assert (TIPS["punch"].force("punch", -depth, MODULUS, NU) == 0).all()


@pytest.mark.parametrize(("form", "count"), [("punch", 1), ("punch", 6), ("cone", 1), ("pyramid", 2)])
def test_a_stated_form_gives_its_own_modulus(form, count):
    made = material(TIPS[form], curves(TIPS[form], count))
    low, high = made.young_modulus_ci95_pa
    assert low < MODULUS < high and made.young_modulus_pa == pytest.approx(MODULUS, rel=0.02)
    assert made.law == form and made.predicts and not made.effects


@pytest.mark.parametrize("form", ["punch", "cone"])
def test_curves_speak_against_a_sphere_and_for_one(form):
    scores = form_scores(curves(TIPS[form]), RADIUS, NU)
    assert scores["sphere"] < scores[form] + np.log(9)
    assert max(scores, key=lambda name: scores[name] if name != "sphere" else -np.inf) == form
    for stiffness in (np.inf, 200.0):  # as stiff as the contact
        scores = form_scores(curves(TIPS["sphere"], stiffness=stiffness), RADIUS, NU)
        assert scores["sphere"] > max(scores["punch"], scores["cone"]) + np.log(9)


@pytest.mark.parametrize("count", [1, pytest.param(6, marks=pytest.mark.slow)])
def test_a_straight_line_said_to_be_a_spheres_is_no_answer(count):
    made = material(TIPS["sphere"], curves(TIPS["punch"], count, noise=1e-4))
    assert not made.predicts and made.at_bound


def test_no_interval_is_narrower_than_readings_are_true():
    made = material(TIPS["sphere"], curves(TIPS["sphere"], noise=1e-9))
    low, high = made.young_modulus_ci95_pa
    assert high / low > 1.02 and low < MODULUS < high


def test_what_an_angle_or_a_layer_cannot_be_is_refused():
    for given in (("cone", None, None), ("cone", None, 95.0), ("punch", None, None), ("star", 0.001)):
        with pytest.raises(OptionError, match="--tip"):
            Tip(*given)
    with pytest.raises(OptionError, match="--layer"):
        material(TIPS["punch"], curves(TIPS["punch"]), layer_m=0.02)


def test_three_readings_in_contact_are_too_few_and_what_to_do_is_said():
    (curve,) = curves(TIPS["cone"])
    few = MachineCycle(curve.t[::16], curve.travel[::16], curve.force[::16], "few")
    with pytest.raises(ContactError, match="press slower"):
        material(TIPS["cone"], [few])


@pytest.mark.parametrize("form", ["punch", "cone"])
def test_ways_in_of_two_or_three_readings_share_their_modulus(form):
    """Each press is read in steps of 0.9 mm of its 2.5, which begin anywhere."""
    tip, rng, few = TIPS[form], np.random.default_rng(5), []
    for k in range(6):
        dent = 2.5e-3 - 0.9e-3 * np.abs(np.arange(-12, 13) + k / 6 - 0.4)
        force = tip.force(tip.laws[0], dent, MODULUS, NU)
        read = force + 0.002 * force.max() * rng.standard_normal(len(force))
        few.append(MachineCycle(np.arange(len(dent)) / 10, dent, read))
    made = material(tip, few)
    low, high = made.young_modulus_ci95_pa
    assert made.predicts and made.curves == 6 and low <= MODULUS <= high < 1.5 * low


def test_poissons_ratio_is_the_files_where_nobody_states_another():
    given = tuple(curves(TIPS["sphere"]))
    tests = MachineTests("indentation", curves=given, tip=TIPS["sphere"], poisson_ratio=0.3)
    of_file, stated, assumed = (
        material_of(tests, ["a"]),
        material_of(tests, ["a"], poisson_ratio=0.4),
        material(TIPS["sphere"], list(given)),
    )
    assert [m.poisson_from for m in (of_file, stated, assumed)] == ["file", "stated", "assumed"]
    assert of_file.young_modulus_pa == pytest.approx(
        assumed.young_modulus_pa * (1 - 0.09) / (1 - NU**2), rel=0.02
    )
    assert "0.49" in lead(assumed) and "0.3 " in lead(of_file)
