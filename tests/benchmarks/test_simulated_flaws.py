"""Flaws that are planted in a simulation's forces."""

from benchmarks._simulated_flaws import FLAWS, MODULUS_PA, RADIUS_M, Block, simulated


def test_two_wrong_parameters_are_both_given():
    flaws = {flaw.name: flaw for flaw in FLAWS}
    planted = [(flaws["stated_modulus"], 1.5), (flaws["stated_tip_radius"], 1.2)]
    _, given = simulated(Block(), planted, 0)
    assert given.modulus_pa == 1.5 * MODULUS_PA and given.radius_m == 1.2 * RADIUS_M
