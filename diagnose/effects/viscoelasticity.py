"""Viscoelasticity: fading memory of the elastic force, a Prony series (shares of the equilibrium force)."""

import numpy as np

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.g = values[[0, 2]]
    settings.tau = np.exp(values[[1, 3]])


def _report(values, forward):  # type: ignore[no-untyped-def]
    pairs = sorted((float(np.exp(values[i + 1])), float(values[i])) for i in (0, 2) if values[i] > 0.005)
    return {"g": [g for _, g in pairs], "tau_s": [tau for tau, _ in pairs]}


def _starts(forward):  # type: ignore[no-untyped-def]
    return [
        np.array([fast, np.log(tau_fast), slow, np.log(tau_slow)])
        for fast, tau_fast, slow, tau_slow in (
            (0.1, 0.1, 0.05, 1.0),
            (0.3, 0.1, 0.15, 1.0),
            (0.3, 0.04, 0.2, 0.4),
            (0.05, 0.1, 0.3, 0.5),
            (0.05, 0.15, 0.2, 3.0),
            (0.0, 0.1, 0.05, 10.0),
        )
    ]


EFFECT = Effect(
    name="viscoelasticity",
    domain="object",
    words="the material creeps and relaxes: force depends on how fast and how long",
    parameters=(
        Parameter("g_fast", "1", 0.0, 3.0, 0.0, (0.1, 0.0), 0.01, 1.0),
        Parameter("log_tau_fast", "ln s", np.log(0.02), np.log(0.3), np.log(0.1), (np.log(0.1),), 0.05, 1.0),
        Parameter("g_slow", "1", 0.0, 3.0, 0.0, (0.1, 0.2), 0.01, 1.0),
        Parameter("log_tau_slow", "ln s", np.log(0.2), np.log(20.0), np.log(0.7), (np.log(0.7),), 0.05, 1.0),
    ),
    change=_change,
    report=_report,
    candidates=_starts,
    signature="stiffer when fast, decays in holds, loop",
    # a contact that shrinks is slower than the elastic force, and two terms stand for what may be more
    extra={"systematic": (0.015, 0.06, 0.015, 0.3)},
)
