"""Strain stiffening: beyond neo-Hookean, the material stiffens with strain (Yeoh's second coefficient)."""

from diagnose.effects.base import Effect, Parameter

FORCE_PER_C20 = 0.55
"""Share by which the dent's force grows a unit of c20 / c10 at an indentation of one tip radius."""


def factor(dents, c20_over_c10):  # type: ignore[no-untyped-def]
    """Factor on the dent's force law at indentations in tip radii: strain under a sphere goes with
    sqrt(depth)."""
    return 1 + FORCE_PER_C20 * c20_over_c10 * dents


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    own = factor(forward.dents, values[0])
    settings.table_factor = own if settings.table_factor is None else settings.table_factor * own


EFFECT = Effect(
    name="strain_stiffening",
    domain="object",
    words="the material stiffens as it is strained",
    parameters=(Parameter("c20_over_c10", "1", 0.0, 4.0, 0.0, (0.2,), 0.02),),
    change=_change,
    report=lambda values, forward: {"c20_over_c10": float(values[0])},
    signature="force grows faster with depth than the ideal law, at any rate",
)
