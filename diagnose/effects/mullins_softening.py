"""Mullins softening: below the greatest load that a place has felt, it is softer (Ogden and Roxburgh
1999)."""

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    if values[0] > 1e-4:
        settings.mullins = (1 / values[0], values[1])


EFFECT = Effect(
    name="mullins_softening",
    domain="object",
    words="the material is softer the second time it is pressed",
    parameters=(
        Parameter("inverse_r", "1", 0.0, 0.8, 0.0, (0.1, 0.1), 0.01),
        Parameter("m_rel", "1", 0.01, 2.0, 0.3, (0.1, 0.4), 0.02),
    ),
    change=_change,
    report=lambda values, forward: {"r": float(1 / max(values[0], 1e-6)), "m_rel": float(values[1])},
    signature="first touch against repeat; unloading below loading, whatever the rate",
)
