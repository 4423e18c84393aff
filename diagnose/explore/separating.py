"""How well a press would separate two causes, by the way in which it is made.

Every place that was pressed is pressed once more in thought, by each plan, under the likeliest form of the
likeliest cause and of its rivals. What is left of the difference beside noise, first touch, stiffness of the
place and the modulus is the expected gain in log evidence.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.explore.causes import Causes, likeliest
from palpate.diagnosis.explore.weighing import NUISANCE, SUPPORT_GIVES, Weighing, changed
from palpate.diagnosis.forward.planned import Plan, pressed
from palpate.diagnosis.search.whiten import Whitener
from palpate.mechanics.effects.tool_compliance import EFFECT as TOOL_COMPLIANCE

PLANS = (
    Plan(0.8, 0.02, 0.2, 0.0, 1),
    Plan(0.8, 0.08, 0.2, 0.0, 1),
    Plan(0.8, 0.005, 0.2, 0.0, 1),
    Plan(0.8, 0.06, 1.5, 0.0, 1),
    Plan(0.35, 0.02, 0.2, 0.0, 1),
)
"""Ways of pressing that are compared; depths as shares of the greatest so far, m/s, s."""
RIVALS = 2
RIGID_S = 6.0
"""What three presses on the bare support take."""
SPRING = TOOL_COMPLIANCE.name


@dataclass(frozen=True)
class Separation:
    """What a plan would show. gain: (p,) expected log evidence of the likeliest cause against its rivals, at
    each place that was pressed (point (p, 3) m, device frame), never more than is missing."""

    plan: Plan
    depth_m: float
    point: np.ndarray
    gain: np.ndarray
    first: str
    rival: str

    def near(self, point: np.ndarray) -> float:
        """The gain at the pressed place that is nearest to a point (3,) m."""
        return float(self.gain[np.argmin(((self.point - point) ** 2).sum(axis=1))])


def separations(weighing: Weighing, causes: Causes, at: float) -> list[Separation]:
    """What each plan would show of the likeliest cause against those that are not ruled out beside it."""
    first, *others = causes.not_ruled_out(at)
    rivals = others[:RIVALS]
    if not rivals:
        return []
    w, made = weighing, []
    over = w.inflation(causes.misfit)
    forms = {name: likeliest(w, name, causes.least_n) for name in (first, *rivals)}
    for plan in PLANS:
        virtual = dataclasses.replace(w.forward, touches=pressed(w.forward, plan))
        before = changed(virtual, w.found, None)
        change = {}
        for name, form in forms.items():
            change[name] = np.zeros_like(before)
            if form is not None:
                change[name] = form[1] * (changed(virtual, w.found, form[0]) - before)
        ideal = virtual.ideal(float(np.exp(w.found.values[0])))
        whitener = Whitener(virtual, ideal, NUISANCE, w.site_sd, w.whitener.onset_sd)
        gain = np.zeros(len(virtual.touches))
        for rival in rivals:
            both = np.stack([change[first] - change[rival], before], axis=2)
            gram = whitener.gram(both)
            left = gram[:, 0, 0] - gram[:, 0, 1] ** 2 / np.maximum(gram[:, 1, 1], 1e-12)
            gain += np.minimum(0.5 * left / over, causes.missing(rival, at))
        touches = w.forward.touches
        made.append(Separation(plan, plan.depth_m(touches), touches.point, gain, first, rivals[0]))
    return made


def support_gain(weighing: Weighing, causes: Causes, at: float) -> tuple[float, str, str]:
    """(expected log evidence, likeliest cause, rival) of three presses on the bare support; 0 where no
    yielding tool is in question."""
    first, *others = causes.not_ruled_out(at)
    pair = [n for n in (first, *others[:RIVALS]) if n != SPRING]
    if len(pair) > RIVALS or not pair or not others:
        return 0.0, first, first
    act, size = likeliest(weighing, SPRING, causes.least_n) or (None, 0.0)
    yields = size * weighing.springs[weighing.acts.index(act)] if act is not None else 0.0
    gain = 0.5 * (yields / SUPPORT_GIVES) ** 2
    out = min(causes.missing(name, at) for name in (pair if first == SPRING else [SPRING]))
    return float(min(gain, out)), first, others[0] if first == SPRING else SPRING
