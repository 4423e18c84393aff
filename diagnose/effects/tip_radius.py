"""Tip radius: the sphere is not as large as stated; the dent's force goes with its square root."""

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.tip_radius = settings.tip_radius * values[0]


EFFECT = Effect(
    name="tip_radius",
    domain="contact",
    words="the tip is larger or smaller than stated",
    parameters=(Parameter("ratio", "1", 0.4, 2.5, 1.0, (0.8, 1.25), 0.02),),
    change=_change,
    report=lambda values, forward: {"tip_radius_m": float(values[0] * forward.tip_radius)},
    # a site law that bends a little differently looks like another tip
    extra={"systematic": (0.1,)},
    signature="every dent too stiff or soft by the same factor, while the far field is not",
)
