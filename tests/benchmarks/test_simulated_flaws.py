"""Flaws that are planted in a simulation's forces."""

import numpy as np
import pytest

from benchmarks._adapter_flaws import CONTROLS, LAYOUT, POISSON, Parameters, drawn_plan
from benchmarks._simulated_flaws import FLAWS, MODULUS_PA, RADIUS_M, Block, Given, simulated
from benchmarks.simulated import _verdict, _world
from palpate.diagnosis.other_simulator.forces import Forces


@pytest.mark.release
def test_two_wrong_parameters_are_both_given():
    flaws = {flaw.name: flaw for flaw in FLAWS}
    planted = [(flaws["stated_modulus"], 1.5), (flaws["stated_tip_radius"], 1.2)]
    _, given = simulated(Block(), planted, 0)
    assert given.modulus_pa == 1.5 * MODULUS_PA and given.radius_m == 1.2 * RADIUS_M


@pytest.fixture(scope="module")
def parameters():
    return Parameters(Block(0, LAYOUT))


@pytest.mark.release
@pytest.mark.parametrize(("field", "side"), [("modulus_pa", 0), ("modulus_pa", 1), ("radius_m", 1)])
def test_a_wrong_parameter_changes_the_force_by_the_drawn_multiple(parameters, field, side):
    block = Block(0, LAYOUT)
    law = block.force(Given(poisson=POISSON))
    wrong = block.force(Given(**{"poisson": POISSON, field: parameters.wrong_by(field, side, 8.0)}))
    change = np.sqrt(((wrong - law)[law.any(axis=1)] ** 2).sum(axis=1).mean())
    assert change == pytest.approx(8 * parameters.visible_n, rel=0.1)


@pytest.mark.release
def test_pairs_of_a_simulators_flaws_are_two_of_its_single_ones(parameters):
    """Else what each changes alone would have to be run for them again."""
    rng = np.random.default_rng(3)
    plan = drawn_plan("drake", rng, 8, 5, parameters)
    alone = [case[0] for case in plan if len(case) == 1]
    assert len(alone) == 8 and "contact stiffness" not in {flaw.name for flaw, _ in alone}  # it has none
    for pair in (case for case in plan if len(case) == 2):
        assert all(each in alone for each in pair) and pair[0][0].name != pair[1][0].name
    changed = CONTROLS["drake"].but({"damping_s": 0.05, "cells": 5})
    assert changed.settings["damping_s"] == 0.05 and changed.cells == 5
    assert changed.settings["sphere_radii"] == CONTROLS["drake"].settings["sphere_radii"]


@pytest.mark.release
def test_a_sensor_that_reads_late_gives_no_simulation_a_wrong_modulus():
    block = Block(0, LAYOUT)
    law = Forces(block.t, block.force(Given(poisson=POISSON)), "law")
    verdict = _verdict(_world(block, True, 1), law, CONTROLS["scikit-fem"].stated)
    assert "time_delay" in verdict.effects and not verdict.parts["parameters"].names
