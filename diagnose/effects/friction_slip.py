"""Friction: the tip slips once the tangential force reaches mu times the normal one."""

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.mu = values[0]


EFFECT = Effect(
    name="friction_slip",
    domain="contact",
    words="the tip slides instead of sticking",
    parameters=(Parameter("mu", "1", 0.005, 1.5, 1.5, (0.05, 0.15, 0.4), 0.01),),
    change=_change,
    report=lambda values, forward: {"mu": float(values[0])},
    signature="tangential force capped in proportion to the normal one",
)
