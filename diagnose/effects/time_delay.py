"""Time delay: the force reads late (or early). A loop whose width grows with the rate of force; same in any
place."""

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.delay = values[0]


EFFECT = Effect(
    name="time_delay",
    domain="instrument",
    words="the force is read later than the position",
    parameters=(Parameter("delay_s", "s", -0.08, 0.08, 0.0, (0.01, -0.01), 0.002),),
    change=_change,
    report=lambda values, forward: {"delay_s": float(values[0])},
    extra={"systematic": (2e-4,)},
    signature="loop proportional to the rate of force, none in a hold",
)
