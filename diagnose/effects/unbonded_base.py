"""Unbonded base: part of the base is free to lift and slip."""

import numpy as np

from diagnose.effects.base import Effect, Parameter
from diagnose.fields import far_partly_bonded, support_axes


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.far = settings.far - forward.far + far_partly_bonded(forward, 1 - values[0], values[1])


def _report(values, forward):  # type: ignore[no-untyped-def]
    across, along = support_axes(forward.model)
    direction = np.cos(values[1]) * across + np.sin(values[1]) * along
    return {"bonded_fraction": float(1 - values[0]), "direction": [float(v) for v in direction]}


def _starts(forward):  # type: ignore[no-untyped-def]
    return [np.array([0.3, angle]) for angle in np.arange(8) * np.pi / 4]


EFFECT = Effect(
    name="unbonded_base",
    domain="boundary",
    words="part of the object's base is loose",
    parameters=(
        Parameter("free_fraction", "1", 0.0, 0.8, 0.0, (0.3,), 0.02),
        Parameter("angle", "rad", -7.0, 14.0, 0.0, (0.0,), 0.1),
    ),
    change=_change,
    report=_report,
    needs=("unbonded",),
    candidates=_starts,
    signature="one side too stiff in the ideal model",
)
