"""Viscoelasticity: a Prony series on the elastic force, shares of the equilibrium force.

f(t) = F(t) + sum over k of g_k integral of exp(-(t - s) / tau_k) dF(s), F the quasi-static force. One step is
exact where F runs straight between samples (the recursion of Taylor, Pister & Goudreau 1970).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numba import njit

from mechanics.errors import ModelError


def prony_series(keys: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """(g, tau_s), (k,) each, of an effect's keys `g` (1) and `tau_s` (s); raises ModelError where they
    disagree."""
    g = np.atleast_1d(np.asarray(keys["g"], dtype=float))
    tau = np.atleast_1d(np.asarray(keys["tau_s"], dtype=float))
    if g.shape != tau.shape or not (tau > 0).all() or not (g >= 0).all():
        raise ModelError(
            f"viscoelasticity has g = {g.tolist()} and tau_s = {tau.tolist()}: as many of each, g at least "
            "0, tau_s greater than 0 s"
        )
    return g, tau


@njit(cache=True, error_model="numpy")
def prony_step(memory, change, dt, g, tau, axis):  # type: ignore[no-untyped-def]
    """Advance one component: memory (k, 3), its `axis` changed in place; change of the force, N, over dt, s.

    Returns what the memory adds to the force, N.
    """
    total = 0.0
    for k in range(g.shape[0]):
        decay = np.exp(-dt / tau[k])
        gain = tau[k] / dt * (1.0 - decay) if dt > 0.0 else 1.0
        memory[k, axis] = decay * memory[k, axis] + gain * change
        total += g[k] * memory[k, axis]
    return total
