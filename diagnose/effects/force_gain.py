"""Force gain: readings are a matrix times the truth. A common factor is the modulus's and cannot be told."""

import numpy as np

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.gain = values.reshape(3, 3)


EFFECT = Effect(
    name="force_gain",
    domain="instrument",
    words="the force sensor's axes have wrong gains or talk to each other",
    parameters=tuple(
        Parameter(
            f"g{a}{b}", "1", -0.5 + (a == b), 0.5 + (a == b), float(a == b), (float(a == b),), 0.01, 0.08
        )
        for a in "xyz"
        for b in "xyz"
    ),
    change=_change,
    report=lambda values, forward: {"matrix": np.asarray(values).reshape(3, 3).tolist()},
    # the modulus takes up any factor common to all axes: how far a sensor may be off on the whole is a guess
    extra={"common_factor": 0.12},
    signature="proportional to the force, fixed in the device frame, the same at every depth and rate",
)
