"""Viscoelasticity: a Prony series on the elastic force, shares of the equilibrium force.

f(t) = F(t) + sum over k of g_k integral of exp(-(t - s) / tau_k) dF(s), F the quasi-static force. One step is
exact where F runs straight between samples (the recursion of Taylor, Pister & Goudreau 1970). A surface that
comes back more slowly than the tip leaves lets go of it: it cannot pull.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.law import PathLaw
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene, TouchTerms
from palpate.mechanics.errors import ModelError
from palpate.mechanics.kernels import kernel
from palpate.mechanics.model.model import Model
from palpate.mechanics.quantities import quantity_words


@kernel
def recall(weight, spans, k, memory, change, force):
    """Let branch k of a memory fade over `spans` of its time constants and follow a change (3,) of the
    quasi-static force that ran straight meanwhile; add it to the force."""
    decay = np.exp(-spans)
    gain = (1.0 - decay) / spans if spans > 0.0 else 1.0
    for axis in range(3):
        branch = 6 + 3 * k + axis
        memory[branch] = decay * memory[branch] + gain * change[axis]
        force[axis] += weight * memory[branch]


@kernel
def changed(memory, force):
    """Put into memory[3:6] how the quasi-static force changed since the last step, and that into memory[:3].

    Nothing is returned: a renderer's kernels count no references (mechanics.kernels), so they return no view.
    """
    for axis in range(3):
        memory[3 + axis] = force[axis] - memory[axis]
        memory[axis] = force[axis]


@kernel
def let_go(normal, force):
    """No force where it would pull: the tip has left the slower surface."""
    if not force[0] * normal[0] + force[1] * normal[1] + force[2] * normal[2] > 0.0:
        force[0] = force[1] = force[2] = 0.0


@kernel
def prony_step(numbers, memory, depth, deepest, load, most, dt, normal, force):
    """Add the memory of the force. numbers: (2 k,) pairs of g and tau, s; memory: (6 + 3 k,) the last force,
    its change, then each branch."""
    changed(memory, force)
    change = memory[3:6]
    for k in range(numbers.shape[0] // 2):
        if numbers[2 * k] != 0.0:
            recall(numbers[2 * k], dt / numbers[2 * k + 1], k, memory, change, force)
    let_go(normal, force)


LAW = PathLaw(prony_step, order=1, memory=lambda numbers: 6 + 3 * (len(numbers) // 2))


def add_terms(touch: TouchTerms, g: np.ndarray, tau_s: np.ndarray) -> None:
    """Let a touch remember by further terms g, tau_s (k,), beside those that it has."""
    there = touch.numbers.get(LAW, np.zeros(0))
    touch.numbers[LAW] = np.concatenate([there, np.column_stack([g, tau_s]).ravel()])


def _touch(touch: TouchTerms, keys: Keys, model: Model) -> None:
    g = np.atleast_1d(np.asarray(keys["g"], dtype=float))
    tau = np.atleast_1d(np.asarray(keys["tau_s"], dtype=float))
    if g.shape != tau.shape or not (tau > 0).all() or not (g >= 0).all():
        raise ModelError(
            f"viscoelasticity has g = {g.tolist()} and tau_s = {tau.tolist()}: as many of each, g at least "
            "0, tau_s greater than 0 s"
        )
    add_terms(touch, g, tau)


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    # a term too weak to be told is not reported, but a fit must see it grow
    _touch(settings.touch, {"g": values[[0, 2]], "tau_s": np.exp(values[[1, 3]])}, scene.places.model)


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    pairs = sorted((float(np.exp(values[i + 1])), float(values[i])) for i in (0, 2) if values[i] > 0.005)
    return {"g": [g for _, g in pairs], "tau_s": [tau for tau, _ in pairs]}


def _in_words(keys: Keys) -> str:
    pairs = zip(keys["g"], keys["tau_s"], strict=True)
    terms = [f"{100 * g:.0f} % that fades within {quantity_words('tau_s', tau)}" for g, tau in pairs]
    return f"extra force right after a fast press: {' and '.join(terms)}"


def _starts() -> list[np.ndarray]:
    return [
        np.array([fast, np.log(tau_fast), slow, np.log(tau_slow)])
        for fast, tau_fast, slow, tau_slow in (
            (0.1, 0.1, 0.05, 1.0),
            (0.3, 0.1, 0.15, 1.0),
            (0.3, 0.04, 0.2, 0.4),
            (0.05, 0.1, 0.3, 0.5),
            (0.05, 0.15, 0.2, 3.0),
            (0.0, 0.1, 0.05, 10.0),
            (2.0, 0.4, 1.0, 4.0),  # tissue
        )
    ]


EFFECT = Effect(
    name="viscoelasticity",
    domain="object",
    scope=Scope.TIME,
    words="the material creeps and relaxes: force depends on how fast and how long",
    parameters=(
        Parameter("g_fast", "1", 0.0, 20.0, 0.0, (0.1, 0.0), 0.01, 1.0),
        Parameter("log_tau_fast", "ln s", np.log(0.005), np.log(2.0), np.log(0.1), (np.log(0.1),), 0.05, 1.0),
        Parameter("g_slow", "1", 0.0, 20.0, 0.0, (0.1, 0.2), 0.01, 1.0),
        Parameter(
            "log_tau_slow", "ln s", np.log(0.05), np.log(100.0), np.log(0.7), (np.log(0.7),), 0.05, 1.0
        ),
    ),
    keys={
        "g": FileKey(low=0.0, high=100.0, size=0, required=True),
        "tau_s": FileKey(low=1e-6, high=1e5, size=0, unit="s", required=True),
    },
    report=_report,
    keys_in_words=_in_words,
    touch=_touch,
    change=_change,
    law=LAW,
    apply=unchanged,
    hints=SearchHints(
        phenomenon="relaxation",
        candidates=_starts,
        # a contact that shrinks is slower than the elastic force, and two terms stand for what may be more
        systematic=(0.015, 0.06, 0.015, 0.3),
    ),
)
