"""Every law of tissue through the servo at 1 kHz: its own force along the hand's way, and no energy given.

Along the way that the hand took, the elastic force is the same renderer's without the law; what the law makes
of it is the laboratory's, which is written apart from the compiled step and its few exponentials.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks._closed_loop import ClosedLoopResult, Loop, closed_loop
from palpate.devices.impedance import HandImpedance
from palpate.devices.virtual_hand import SPEC
from palpate.mechanics.contact.dent import dent_force, dent_law, grid
from palpate.mechanics.effects.strain_stiffening import stiffening
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.scenes.laboratory.effects import effect
from palpate.scenes.laboratory.hand_path import Motion
from palpate.scenes.laboratory.paths import WAY_IN, WAY_OUT

from ...render import shapes

TIP, TOP, DEPTH, DT = 0.005, 0.05, 4e-3, 1e-3
E_STAR = 30e3 / (1 - 0.49**2)
STICKY = {"work_j_per_m2": 0.02 * E_STAR * TIP, "healed": 0.3}
UP = np.array([0.0, 0.0, 1.0])

LAWS: dict[str, tuple[str, dict[str, Any], float]] = {
    "Prony as large as tissue's": ("viscoelasticity", {"g": [3.4, 1.1], "tau_s": [0.02, 0.4]}, 0.02),
    "springpot": ("power_law_relaxation", {"share": 0.3, "exponent": 0.3}, 0.03),
    "drainage": ("poroelasticity", {"share": 0.5, "diffusivity_m2_per_s": 3e-5}, 0.03),
    "JKR": ("jkr_adhesion", {**STICKY, "range_m": 1e-6}, 0.03),
    "towards DMT": ("jkr_adhesion", {**STICKY, "range_m": 0.4 * TIP}, 0.03),
    "exponential stiffening": ("strain_stiffening", {"c20_over_c10": 1.5}, 0.01),
    "softening": ("strain_stiffening", {"c20_over_c10": -0.1}, 0.01),
}
"""Effect, its keys, and the greatest error of the force that is allowed, of its peak."""


@pytest.fixture(scope="module")
def block():
    """A block of 80 x 80 x 50 mm and its compliance."""
    made = shapes.model(shapes.block((0.08, 0.08, TOP), (4, 4, 3)))
    return made, shapes.quick_compliance(made)


def rendered(block, **effects) -> FemRenderer:
    made, compliance = block
    return FemRenderer(
        made.replaced(effects=effects), RenderOptions(dent_law="linear"), compliance=compliance
    )


def pressed(
    renderer: FemRenderer, hand: HandImpedance, delay_s: float = 0.0, coupling: bool = True
) -> ClosedLoopResult:
    """Two presses at up to 0.2 m/s, each held for 0.4 s; 0.55 s of ramp before them."""
    low, high = -DEPTH, 0.006
    s = np.arange(1, 81) / 80
    smooth = s * s * (3 - 2 * s)
    into, out = high - (high - low) * smooth, low + (high - low) * smooth
    once = np.concatenate([into, np.full(400, low), out, np.full(200, high)])
    z = np.concatenate([np.full(550, high), once, once])
    path = (TOP + TIP + z)[:, None] * UP
    return closed_loop(renderer, SPEC, hand, path, loop=Loop(1000.0, 5e-5, delay_s, coupling=coupling))


def followed(renderer: FemRenderer, position: np.ndarray) -> np.ndarray:
    """(n,) N along a way (n, 3) m at 1 kHz."""
    return renderer.follow(renderer.start(), position[:, None, :], np.full(len(position), DT))[:, 0, 2]


def told(name: str, keys: dict[str, Any], position: np.ndarray, elastic: np.ndarray) -> np.ndarray:
    """(n,) N, what the law itself makes of the elastic force (n,) along the way, touch by touch: what has let
    go is forgotten."""
    depth = TOP + TIP - position[:, 2]
    if name == "strain_stiffening":
        return stiffened(keys["c20_over_c10"], depth, elastic)
    parameters = {**keys, "tip_radius_m": TIP, "plane_strain_modulus_pa": E_STAR}
    law, out = effect(name).on_force, np.zeros(len(depth))
    assert law is not None
    for begun in np.flatnonzero(np.diff((depth > 0).astype(int)) > 0) + 1:
        gone = begun + int(np.argmax(depth[begun:] < -0.5 * TIP))
        rows = np.arange(begun - 1, gone)
        leg = np.where(np.arange(len(rows)) > np.argmax(depth[rows]), WAY_OUT, WAY_IN)
        none, up = np.zeros((len(rows), 3)), np.tile(UP, (len(rows), 1))
        motion = Motion(none, up, np.zeros(len(rows), int), leg, 1e3 * depth[rows], none, none, (0.0, 0.0))
        out[rows] = law(elastic[rows, None] * UP, motion, up, parameters)[:, 2]
    return out


def stiffened(ratio: float, depth: np.ndarray, elastic: np.ndarray) -> np.ndarray:
    """The dent's force times the family's factor, in series with the same object."""
    dents = TIP * grid()[grid() <= 1.5]
    law = dent_law("linear").table
    plain = np.array([dent_force(law, d, TIP, 0.0, E_STAR)[0] for d in dents])
    hard = plain * stiffening(ratio)[0][: len(dents)]
    out = np.zeros(len(depth))
    for i in np.flatnonzero((depth > 0) & (elastic > 0)):
        give = (depth[i] - np.interp(elastic[i], plain, dents)) / elastic[i]
        out[i] = np.interp(depth[i], dents + give * hard, hard)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("words", LAWS)
def test_a_law_is_felt_as_it_is_and_feeds_no_hand(block, words):
    name, keys, error = LAWS[words]
    renderer = rendered(block, **{name: keys})
    # no spring before an object whose stiffest place the device could not render: the law itself is asked for
    firm = pressed(renderer, HandImpedance(0.2, 12.0, 600.0), coupling=False)
    read = 5e-5 * np.floor(firm.position / 5e-5 + 0.5)
    felt = firm.rendered[:, 2]
    # the servo's step is the renderer's
    assert felt == pytest.approx(followed(renderer, read), abs=1e-6)
    own = told(name, keys, read, followed(rendered(block), read))
    assert np.abs(felt - own).max() < error * own.max()
    for hand, delay_s in ((HandImpedance(0.05, 2.0, 200.0), 0.0), (HandImpedance(0.05, 2.0, 200.0), 0.002)):
        assert pressed(renderer, hand, delay_s).given_back_j < 1e-3
