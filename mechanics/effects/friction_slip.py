"""Friction: the tip slips once the tangential force reaches mu times the normal one.

The anchor of the stick walks after the tip until the force is on Coulomb's cone. `slip_length` is one walk of
it, a secant step on what is too much; renderer and prediction take the same walks.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, check, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import TouchTerms
from palpate.mechanics.kernels import kernel
from palpate.mechanics.model.model import Model

SLIPS = 12
CAUTION, SECANT_CAUTION = 0.9, 0.98
LEAST_N, SLIPPED = 1e-9, 1e-4
_STIFFEST = 0.2  # of the stick's own compliance, the least that coupling leaves
_AIMS, _AIMED = 24, 1e-6


@kernel
def slip_excess(pull, push, mu):
    """(what the tangential force `pull` has too much, N; the share of it that the cone leaves); nothing too
    much where it is within a hair of the cone."""
    excess = pull - mu * push
    if not excess > 0.0 or push <= 0.0:
        return 0.0, 1.0
    if excess <= LEAST_N + SLIPPED * mu * push:
        return 0.0, mu * push / pull
    return excess, mu * push / pull


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


@kernel
def slip_compliance(tangent, held, cnu, cnv, cuu, cuv, cvv):
    """(uu, uv, vv), m/N: how far the tip moves sideways for a tangential force where it is kept at its
    height.

    tangent: N/m, slope of the normal force. held: N/m, stiffness of the stick. c: m/N, of the object. A
    slender body that bends gives far less than the mean of its own tangential compliances: most of its
    motion along itself is coupled to that across.
    """
    suu = 1.0 / held + cuu - cnu * cnu * tangent
    svv = 1.0 / held + cvv - cnv * cnv * tangent
    suv = cuv - cnu * cnv * tangent
    least = 0.5 * (suu + svv) - np.sqrt(0.25 * (suu - svv) ** 2 + suv * suv)
    lack = max(_STIFFEST / held - least, 0.0)
    return suu + lack, suv, svv + lack


@kernel
def slip_onto_cone(fu, fv, fn, mu, gu, gv, suu, suv, svu, svv):
    """(yu, yv) m: the slip after which the linear law has the force on the cone, against the slip.

    The force on the tool (fn, fu, fv) N becomes f - u with S u = y, S the compliance of the slip, and its
    normal part fn + g . u. Wanted is f - u = mu fn' y / |y|, which is one equation for z in 0..1, where 1
    leaves no tangential force: y = z w, f - u = (1 - z) / s w, w = (z + (1 - z) S / s)^-1 S f, s the mean of
    S.
    """
    s = 0.5 * (suu + svv)
    au, av = suu * fu + suv * fv, svu * fu + svv * fv
    low, high, z = 0.0, 1.0, 1.0
    below, above = mu * fn - np.sqrt(fu * fu + fv * fv), 0.0
    yu = yv = 0.0
    for _ in range(_AIMS):
        rest = (1.0 - z) / s
        muu, muv, mvu, mvv = z + rest * suu, rest * suv, rest * svu, z + rest * svv
        det = muu * mvv - muv * mvu
        yu, yv = (mvv * au - muv * av) / det, (muu * av - mvu * au) / det
        left_u, left_v = rest * yu, rest * yv
        push = max(fn + gu * (fu - left_u) + gv * (fv - left_v), 0.0)
        gap = mu * push - np.sqrt(left_u * left_u + left_v * left_v)
        yu, yv = z * yu, z * yv
        if abs(gap) <= _AIMED * mu * fn:
            break
        if gap > 0.0:
            high, above = z, gap
        else:
            low, below = z, gap
        z = low - below * (high - low) / (above - below)
        z = min(max(z, low + 0.05 * (high - low)), high - 0.05 * (high - low))
    return yu, yv


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
