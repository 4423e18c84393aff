"""Finite strain: a neo-Hookean solid instead of a linear one. It has no parameter: it grows with the
depth."""

from diagnose.effects.base import Effect


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.finite_strain = 1.0


EFFECT = Effect(
    name="finite_strain",
    domain="object",
    words="the presses are so deep that small-strain elasticity no longer holds",
    parameters=(),
    change=_change,
    report=lambda values, forward: {},
    signature="grows with depth over tip radius, not with rate",
)
