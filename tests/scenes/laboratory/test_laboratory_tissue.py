"""The laboratory's laws of tissue, made for themselves, beside those that are diagnosed and rendered."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.effects.jkr_adhesion import LAW as STICKY
from palpate.mechanics.effects.jkr_adhesion import _set as set_adhesion
from palpate.mechanics.effects.jkr_adhesion import edge_share
from palpate.mechanics.effects.poroelasticity import LAW as POROUS
from palpate.mechanics.effects.power_law_relaxation import prony_terms
from palpate.mechanics.effects.settings import TouchTerms
from palpate.mechanics.effects.viscoelasticity import LAW as PRONY
from palpate.scenes.laboratory.effects import effect
from palpate.scenes.laboratory.hand_path import Motion
from palpate.scenes.laboratory.paths import SIDEWAYS, WAY_IN, WAY_OUT
from palpate.scenes.laboratory.tracing import RATE_HZ

RADIUS, E_STAR, DEPTH_MM = 5e-3, 25e3, 3.0
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def touch() -> tuple[Motion, np.ndarray]:
    """(motion, (n, 3) N): in within 0.3 s, held for 1 s, out to 2 mm above; a half-space by Hertz."""
    into = np.linspace(-0.5, DEPTH_MM, int(0.35 * RATE_HZ))
    out = np.linspace(DEPTH_MM, -2.0, int(0.5 * RATE_HZ))
    s = np.concatenate([into, np.zeros(int(RATE_HZ)), out])
    leg = np.repeat([WAY_IN, SIDEWAYS, WAY_OUT], [len(into), int(RATE_HZ), len(out)])
    n = len(s)
    depth = np.where(leg == SIDEWAYS, DEPTH_MM, s)
    force = 4 / 3 * E_STAR * np.sqrt(RADIUS) * (1e-3 * np.maximum(depth, 0)) ** 1.5
    motion = Motion(
        np.zeros((n, 3)), np.tile(UP, (n, 1)), np.zeros(n, dtype=int), leg, s, np.zeros((n, 3)),
        np.zeros((n, 3)), (0.0, 0.0),
    )  # fmt: skip
    return motion, force[:, None] * UP


def rendered(law, numbers: np.ndarray, motion: Motion, force: np.ndarray) -> np.ndarray:
    """(n,) N by the law that is stepped at 1 kHz."""
    depth = 1e-3 * np.where(motion.leg == SIDEWAYS, DEPTH_MM, motion.s)
    memory, deepest, out = np.zeros(law.memory(numbers)), 0.0, np.empty(len(depth))
    for i, d in enumerate(depth):
        three = force[i].copy()
        deepest = max(deepest, d)
        law.step(numbers, memory, d, deepest, 0.0, 0.0, 1 / RATE_HZ, UP, three)
        out[i] = three[2]
    return out


def made(name: str, parameters: dict, touch: tuple[Motion, np.ndarray]) -> np.ndarray:
    motion, force = touch
    normals = np.tile(UP, (len(force), 1))
    return effect(name).on_force(force, motion, normals, parameters)[:, 2]


def test_a_power_of_time(touch) -> None:
    found = made("power_law_relaxation", {"share": 0.3, "exponent": 0.3}, touch)
    numbers = np.column_stack(prony_terms(0.3, 0.3)).ravel()
    assert found == pytest.approx(rendered(PRONY, numbers, *touch), abs=0.02 * found.max())


def test_drainage(touch) -> None:
    keys = {"share": 0.4, "diffusivity_m2_per_s": 3e-5, "tip_radius_m": RADIUS}
    found = made("poroelasticity", keys, touch)
    numbers = np.array([0.4, 3e-5 / RADIUS])
    assert found == pytest.approx(rendered(POROUS, numbers, *touch), abs=0.015 * found.max())
    held = found[touch[0].leg == SIDEWAYS]
    assert 1.15 < held[0] / held[-1] < 1.4


@pytest.mark.parametrize("reach", [1e-6, 0.1, 0.4])
def test_a_contact_that_sticks(touch, reach) -> None:
    """From the limit of Johnson, Kendall & Roberts, 3/2 pi w R, towards that of Derjaguin, Muller & Toporov,
    2 pi w R."""
    work = 0.01 * E_STAR * RADIUS
    keys = {
        "work_j_per_m2": work, "healed": 0.2, "range_m": reach * RADIUS, "tip_radius_m": RADIUS,
        "plane_strain_modulus_pa": E_STAR,
    }  # fmt: skip
    found = made("jkr_adhesion", keys, touch)
    sticky = TouchTerms()
    set_adhesion(sticky, keys, E_STAR, 0.0, RADIUS)
    assert found == pytest.approx(rendered(STICKY, sticky.numbers[STICKY], *touch), abs=0.01 * -found.min())
    pulls = 2 - 0.5 * edge_share(work, reach * RADIUS, E_STAR, RADIUS)
    assert found.min() == pytest.approx(-pulls * np.pi * work * RADIUS, rel=0.02)
