"""Compliant base: the support gives, springs under the whole base."""

from diagnose.effects.base import Effect, Parameter
from diagnose.fields import far_on_springs


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    if values[0] > 0:
        settings.far = settings.far - forward.far + far_on_springs(forward, values[0])


def _report(values, forward):  # type: ignore[no-untyped-def]
    height = forward.height
    k = forward.stages.get("modulus", 1.0) / (max(float(values[0]), 1e-9) * height)
    return {"k_normal_pa_per_m": k, "k_tangential_pa_per_m": k}


EFFECT = Effect(
    name="compliant_base",
    domain="boundary",
    words="the support under the object gives",
    parameters=(Parameter("give_of_height", "1", 0.0, 5.0, 0.0, (0.1,), 0.01),),
    change=_change,
    report=_report,
    needs=("springs",),
    signature="places near the base and far from its middle too stiff in the ideal model",
)
