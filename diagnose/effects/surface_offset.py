"""Surface offset: the touched surface is shifted against the traced base (phase II against phase I)."""

import numpy as np

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    t = forward.touches
    arm = t.point - forward.centre
    move = values[:3] + np.cross(values[3:], arm)
    settings.onset = settings.onset + np.einsum("pi,pi->p", t.normal, move)


EFFECT = Effect(
    name="surface_offset",
    domain="boundary",
    words="the object moved between tracing its base and pressing it",
    parameters=(
        *(Parameter(f"shift_{a}_m", "m", -8e-3, 8e-3, 0.0, (0.0,), 5e-5, 2e-3) for a in "xyz"),
        *(Parameter(f"rotation_{a}_rad", "rad", -0.15, 0.15, 0.0, (0.0,), 1e-3, 0.03) for a in "xyz"),
    ),
    change=_change,
    report=lambda values, forward: {
        "shift_m": [float(v) for v in values[:3]],
        "rotation_rad": [float(v) for v in values[3:]],
    },
    signature="first touch comes early on one side and late on the other",
)
