"""The gap that an answer states, sample by sample: what its names do to the force, or what is left over."""

from __future__ import annotations

import numpy as np

from diagnose.search.fit import settings_of
from diagnose.verdict.answer import Answer, Evidence
from mechanics.effects.base import Role
from mechanics.effects.registry import effect


def stated_gap(evidence: Evidence, answer: Answer) -> np.ndarray:
    """(n,) N^2, the squared length of the stated gap's 3-vector, at the touches' rows.

    Where effects are named and nothing is left over: their force in the final fit, beyond the law without
    them at the same first touches and its best factor (what another modulus takes up is no gap). Where
    something unknown remains: what the ideal model misses, less what noise and the shape's uncertainty are
    expected to add (so it may be negative). Of 'none': 0. What is read in free air too acts on every sample,
    and is left out.
    """
    found, t = evidence.found, evidence.forward.touches
    strain = evidence.search.finite_strain.name
    if answer.remainder or answer.nameless_shape or any(effect(n).role is Role.REST for n in answer.names):
        missed = found.ideal.residual
        by_shape = evidence.site_sd[t.press] ** 2 * ((t.local_force - missed) ** 2).sum(axis=1)
        return (missed**2).sum(axis=1) - 3 * t.noise_n**2 - by_shape
    if not {*found.chosen, strain} & set(answer.names):
        return np.zeros(len(t.t))
    final = found.final
    law = (found.ideal if strain in answer.names else found.base).found
    settings = settings_of(evidence.forward, law.effects, law.values, final.found.likeliest)
    without = np.nan_to_num(evidence.forward.predict(settings))
    gap = t.local_force - final.residual - without
    plain = without[t.counted]
    gap -= (gap[t.counted] * plain).sum() / max((plain**2).sum(), 1e-300) * without
    return (gap**2).sum(axis=1)
