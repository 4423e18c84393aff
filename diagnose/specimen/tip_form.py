"""Which form of tip a machine's curves are of, where nobody said it: each form is a hypothesis.

The force of a form grows by a power of the depth of its own. Each is fitted to the ways in, with a first
touch of its own, and blocks of force are left out in turn. A sphere may be held by a machine that yields,
which makes a straight line of its curve, so it is fitted on either.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.diagnosis.specimen.baseline import without_slope
from palpate.diagnosis.specimen.bench import MachineCycle, touched
from palpate.diagnosis.specimen.machine_compliance import BLOCKS, held_out_laws, way_of
from palpate.mechanics.contact.tip import Tip

_COMES = {"sphere": 0.95, "punch": 0.025, "cone": 0.025}
"""How often a tip is of a form where only a radius is said; a pyramid's curve is a cone's."""
_LAW_MISSES = 0.01
"""Share of the force that the right law misses."""
_CURVES = 8
_ANY_ANGLE = 45.0
"""Degrees: the angle changes the modulus alone."""


def form_scores(curves: Sequence[MachineCycle], radius_m: float, poisson_ratio: float) -> dict[str, float]:
    """Form -> log likelihood (nats) of its power, with how often it comes. Raises ContactError where no curve
    has a contact."""
    some = curves[:: max(1, len(curves) // _CURVES)]
    return {
        form: float(np.log(comes)) + _score(some, Tip(form, radius_m, _ANY_ANGLE), poisson_ratio)
        for form, comes in _COMES.items()
    }


def _score(curves: Sequence[MachineCycle], tip: Tip, poisson_ratio: float) -> float:
    """Nats of the blocks of force that the form misses; a sphere's by the best of its laws, on a rigid
    machine or one that yields. Machines take any share of the travel alike: the more of it, the fewer do."""
    curves = without_slope(curves, tip, timed=False).curves
    found = touched(curves, tip)
    used = [c for c, u in zip(curves, found.used, strict=True) if u]
    ways = [way_of(c.travel, c.force, float(at)) for c, at in zip(used, found.onset, strict=True)]
    deep = max(float(w.travel[-1] - w.travel[0]) for w in ways)
    guess = tip.guess_modulus(deep, max(float(w.push.max()) for w in ways), poisson_ratio)
    laws = held_out_laws(ways, poisson_ratio, tip, guess, (False, True) if tip.form == "sphere" else (False,))
    return max(
        float(np.log(max(1 - each.share, 1e-9)) - BLOCKS * np.log(np.hypot(each.missed, _LAW_MISSES)))
        for each in laws
    )
