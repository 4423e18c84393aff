"""Compliant base: the support gives, springs under the whole base."""

import numpy as np

from diagnose.effects.base import Effect, Parameter
from diagnose.support_motion import far_on_springs


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    give, ratio = np.exp(values)
    if give < 1.5e-3:
        return
    normal = 1 / (give * forward.height)
    settings.far = settings.far - forward.far + far_on_springs(forward, normal, normal * ratio)


def _report(values, forward):  # type: ignore[no-untyped-def]
    give, ratio = np.exp(values)
    normal = forward.stages.get("modulus", 1.0) / (give * forward.height)
    return {"k_normal_pa_per_m": float(normal), "k_tangential_pa_per_m": float(normal * ratio)}


EFFECT = Effect(
    name="compliant_base",
    domain="boundary",
    words="the support under the object gives",
    parameters=(
        Parameter("log_give_of_height", "ln 1", np.log(1e-3), 2.5, np.log(1e-3), (-1.5, 0.0), 0.05),
        Parameter("log_tangential", "ln 1", -2.5, 1.0, -0.5, (-0.5, -0.5), 0.05, 0.7),
    ),
    change=_change,
    report=_report,
    needs=("support",),
    signature="places near the base and far from its middle too stiff in the ideal model",
)
