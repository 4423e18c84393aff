"""Adhesion: the surface pulls the tip back as it leaves."""

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.adhesion = (values[0], values[1], values[2])


EFFECT = Effect(
    name="adhesion",
    domain="contact",
    words="the surface is sticky: it pulls the tip as it leaves",
    parameters=(
        Parameter("pull_off_n", "N", 0.0, 1.5, 0.0, (0.05, 0.05, 0.05), 0.005),
        Parameter("range_m", "m", 1e-4, 4e-3, 1e-3, (3e-4, 1.2e-3, 6e-4), 1e-4),
        Parameter("inside", "1", 0.0, 1.0, 0.0, (0.1, 0.3, 0.9), 0.05),
    ),
    change=_change,
    report=lambda values, forward: {"pull_off_n": float(values[0]), "range_m": float(values[1])},
    extra={"systematic_share": (0.1, 0.2, 0.0)},
    signature="negative force at release only",
)
