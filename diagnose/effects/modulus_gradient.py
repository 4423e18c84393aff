"""Modulus gradient: stiffness runs linearly from the base to the top, along the support's normal."""

import numpy as np

from diagnose.effects.base import Effect, Parameter
from diagnose.fields import energy_fields, far_with_weights


def ratios(log_ratio: float) -> tuple[float, float]:
    """(ratio_base, ratio_top) whose mean is 1: the mean belongs to the modulus."""
    base = 2 / (1 + np.exp(-log_ratio))
    return float(base), float(2 - base)


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    fields = energy_fields(forward)
    base, top = ratios(values[0])
    height = fields.height.max() * 1.02
    modulus = base + (top - base) * fields.height / height
    settings.far = settings.far - forward.far + far_with_weights(forward, 1 / modulus)
    at = forward.model.support.height(forward.touches.point)
    local = np.clip(base + (top - base) * at / height, 0.05, None)
    half = fields.half_space[fields.place]
    settings.far = settings.far - (1 / local - 1)[:, None, None] * half
    settings.dent_ratio = settings.dent_ratio * local


def _report(values, forward):  # type: ignore[no-untyped-def]
    base, top = ratios(values[0])
    return {"ratio_base": base, "ratio_top": top}


EFFECT = Effect(
    name="modulus_gradient",
    domain="object",
    words="the object is stiffer at one end than at the other",
    parameters=(Parameter("log_ratio", "1", -3.0, 3.0, 0.0, (0.3, -0.3), 0.05),),
    change=_change,
    report=_report,
    needs=("fields",),
    signature="stiffness of places runs with their height",
)
