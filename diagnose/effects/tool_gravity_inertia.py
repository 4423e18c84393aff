"""Tool gravity and inertia: mass beyond the sensor reads as weight and as mass times acceleration."""

import numpy as np

from diagnose.effects.base import Effect, Parameter

GRAVITY = 9.81


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.inertia = -values[0]
    settings.gravity = forward.weight(values[0], values[1])


def _report(values, forward):  # type: ignore[no-untyped-def]
    return {"mass_kg": float(values[0]), "tared": bool(values[1] < 0.5)}


def _starts(forward):  # type: ignore[no-untyped-def]
    return [np.array([0.02, 0.0]), np.array([0.02, 1.0])]


EFFECT = Effect(
    name="tool_gravity_inertia",
    domain="instrument",
    words="the tool's own mass is read as force",
    parameters=(
        Parameter("mass_kg", "kg", 0.0, 1.0, 0.0, (0.02,), 0.002),
        Parameter("weight_share", "1", 0.0, 1.0, 0.0, (0.0, 1.0), 0.05),
    ),
    change=_change,
    report=_report,
    candidates=_starts,
    signature="force with acceleration, in free air too; weight that turns with the tool",
)
