"""Poisson's ratio: not what was stated. Thin places against thick ones, normal against tangential."""

from diagnose.effects.base import Effect, Parameter
from diagnose.fields import far_at_poisson


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.nu = values[0]
    settings.far = far_at_poisson(forward, values[0])


def _starts(forward):  # type: ignore[no-untyped-def]
    import numpy as np

    return [np.array([0.40])]


EFFECT = Effect(
    name="poisson_ratio",
    domain="object",
    words="the material is more compressible than stated",
    parameters=(Parameter("poisson_ratio", "1", 0.30, 0.49, 0.49, (0.40,), 0.01),),
    change=_change,
    report=lambda values, forward: {"poisson_ratio": float(values[0])},
    needs=("poisson",),
    candidates=_starts,
    signature="places near the base too stiff in the ideal model",
)
