"""Strain stiffening: beyond neo-Hookean, the material stiffens with strain (Yeoh's second coefficient)."""

from diagnose.effects.base import Effect, Parameter
from mechanics.effects.strain_stiffening import (
    FORCE_PER_C20,
    FORCE_POWER,
    SIDEWAYS_PER_C20,
    SIDEWAYS_POWER,
)


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    x = forward.dents
    settings.scale_table(
        1 + FORCE_PER_C20 * values[0] * x**FORCE_POWER, 1 + SIDEWAYS_PER_C20 * values[0] * x**SIDEWAYS_POWER
    )


EFFECT = Effect(
    name="strain_stiffening",
    domain="object",
    words="the material stiffens as it is strained",
    parameters=(Parameter("c20_over_c10", "1", 0.0, 4.0, 0.0, (0.3,), 0.02),),
    change=_change,
    report=lambda values, forward: {"c20_over_c10": float(values[0])},
    signature="force grows faster with depth than the ideal law, at any rate",
)
