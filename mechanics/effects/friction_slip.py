"""Friction: the tip slips once the tangential force reaches mu times the normal one.

The anchor of the stick walks after the tip until the force is on Coulomb's cone. `slip_length` is one walk of
it, a secant step on what is too much; renderer and prediction take the same walks.
"""

from __future__ import annotations

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, check, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import TouchTerms
from palpate.mechanics.kernels import kernel
from palpate.mechanics.model.model import Model

SLIPS = 12
CAUTION, SECANT_CAUTION = 0.9, 0.98
LEAST_N, SLIPPED = 1e-9, 1e-4


@kernel
def slip_excess(slip, pull, push, mu):
    """(what the tangential force `pull` has too much, N; the share of it that is to be kept) after `slip`
    walks; nothing too much where it is within a hair of the cone, or after the last walk."""
    excess = pull - mu * push
    if not excess > 0.0 or push <= 0.0:
        return 0.0, 1.0
    if slip == SLIPS - 1 or excess <= LEAST_N + SLIPPED * mu * push:
        return 0.0, mu * push / pull
    return excess, 1.0


@kernel
def slip_length(slip, excess, before, length, compliance, lever):
    """How far the anchor walks, m, for an excess, N; before: that of the last walk of `length`.

    compliance: m/N, of dent and object together. lever: by how much the centre moves over a surface that is
    bent, 1 on a plane. A little less than what the excess stretches, so that the force comes down onto the
    cone and is never left inside it.
    """
    if slip > 0 and excess < 0.5 * before:
        return length * SECANT_CAUTION * excess / (before - excess)
    return CAUTION * compliance * excess / lever


def _touch(touch: TouchTerms, keys: Keys, model: Model) -> None:
    mu = float(keys["mu"])
    check(mu >= 0, "friction_slip", "mu at least 0")
    touch.friction = mu


EFFECT = Effect(
    name="friction_slip",
    domain="contact",
    scope=Scope.PRESS,
    words="the tip slides instead of sticking",
    parameters=(Parameter("mu", "1", 0.005, 1.5, 1.5, (0.05, 0.15, 0.4), 0.01),),
    keys={"mu": FileKey(low=0.0, high=100.0, required=True)},
    report=lambda values, scene, modulus_pa: {"mu": float(values[0])},
    touch=_touch,
    apply=unchanged,
    hints=SearchHints(
        slips=True,
    ),
)
