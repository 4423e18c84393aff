"""Force drift: the zero of the sensor wanders with the clock."""

import numpy as np

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.drift = values.copy()
    # drift is counted from the start of the recording's touches; its mean is a bias that it carries along
    settings.bias = (np.zeros(3) if settings.bias is None else settings.bias) + forward.stages.get(
        "drift_start", 0.0
    ) * values


EFFECT = Effect(
    name="force_drift",
    domain="instrument",
    words="the zero of the force sensor drifts",
    parameters=tuple(Parameter(f"rate_{a}_n_per_s", "N/s", -0.02, 0.02, 0.0, (0.0,), 1e-4) for a in "xyz"),
    change=_change,
    report=lambda values, forward: {"rate_n_per_s": [float(v) for v in values]},
    signature="free-air reading grows with the clock",
)
