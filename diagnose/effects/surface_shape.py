"""Surface shape: the reconstructed surface is wrong where nobody touched, so places are too stiff or too
soft.

No few numbers describe it: one factor a site, pulled to 1. It predicts nothing at a site that was held out;
it is
named where sites differ by more than their shape's uncertainty and nothing else explains how.
"""

import numpy as np

from diagnose.effects.base import Effect


def site_factors(values: np.ndarray, forward) -> np.ndarray:  # type: ignore[no-untyped-def]
    """(p,) stiffness factor of each press from one log factor a site."""
    return np.exp(values)[forward.touches.site]


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    if len(values):
        settings.stiffness = settings.stiffness * site_factors(values, forward)


EFFECT = Effect(
    name="surface_shape",
    domain="boundary",
    words="the reconstructed shape is wrong where nobody touched",
    parameters=(),
    change=_change,
    report=lambda values, forward: {},
    signature="sites differ in stiffness without pattern, repeats agree",
)
