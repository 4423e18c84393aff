"""The paper's estimate: equations (8), (9), (12), (13) to the letter."""

import numpy as np
import pytest

from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import ContactError
from palpate.mechanics.presses.making import of_paths
from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.steps.s7_modulus.modulus_paper import (
    PaperOptions,
    base_reactions,
    fit_paper_modulus,
    least_squares_modulus,
)

from .boxes import box

E, NU = 16e3, 0.49
MESH = box((0.06, 0.06, 0.04), (5, 5, 4))


def pressed(deep: float = 0.011) -> Presses:
    """Presses whose force is that of the point-loaded mesh itself, straight down to `deep`."""
    solver = Solver(MESH, NU)
    nodes = np.flatnonzero(MESH.touchable & np.isclose(MESH.points[:, 2], 0.04))[::7]
    positions, forces = [], []
    travel = np.linspace(0, deep, 200)
    centres = MESH.points[nodes] + [0.0005, 0, 0.005]
    for node, start in zip(nodes, centres, strict=True):
        load = np.zeros((len(MESH.points), 3))
        load[node, 2] = -1.0
        compliance = -solver.solve(load)[node, 2]
        positions.append(start - travel[:, None] * np.array([0, 0, 1.0]))
        forces.append(np.outer(travel * E / compliance, [0, 0, 1.0]))
    up = np.tile([0.0, 0.0, 1.0], (len(nodes), 1))
    return of_paths(
        200 * np.arange(len(nodes) + 1), np.vstack(positions), np.vstack(forces), centres, up,
        tip_radius_m=0.005, sample_rate_hz=1000.0,
    )  # fmt: skip


def test_the_global_and_every_single_modulus_are_recovered():
    fit = fit_paper_modulus(pressed(), MESH, NU)
    # a load along the normal moves the node sideways as well, which (13) does not see in straight paths
    assert fit.modulus_pa == pytest.approx(E, rel=1e-6)
    assert fit.press_modulus_pa == pytest.approx(np.full(len(fit.node), E), rel=1e-6)
    assert MESH.touchable[fit.node].all()


def test_base_reactions_balance_the_load():
    fit = fit_paper_modulus(pressed(), MESH, NU)
    assert fit.reaction_error < 1e-8
    load = np.zeros((len(MESH.points), 3, 1))
    load[np.flatnonzero(MESH.touchable)[0], :, 0] = [0.3, -0.2, 0.9]
    reactions = base_reactions(MESH, NU, Solver(MESH, NU).solve(load))
    assert reactions.sum(axis=0)[:, 0] == pytest.approx([-0.3, 0.2, -0.9], abs=1e-9)


def test_equation_thirteen_is_flattened():
    predicted, measured = np.array([[2.0, 0, 0], [0, 9, 0]]), np.array([[1.0, 0, 0], [0, 3, 0]])
    assert least_squares_modulus(predicted, measured) == pytest.approx((2 + 27) / (1 + 9))


def test_presses_that_stay_shallower_than_the_indentation_are_named():
    with pytest.raises(ContactError, match="0 of .* reach the indentation of 20 mm .* --indentation"):
        fit_paper_modulus(pressed(), MESH, NU, PaperOptions(indentation_m=0.020))
