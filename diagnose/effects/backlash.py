"""Backlash: the tip follows the handle only once the play is taken up. A loop of constant width, whatever the
rate."""

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.backlash = values[0]


EFFECT = Effect(
    name="backlash",
    domain="instrument",
    words="the tip lags the handle by a constant play",
    parameters=(Parameter("width_m", "m", 0.0, 2e-3, 0.0, (1e-4, 4e-4), 2e-5),),
    change=_change,
    report=lambda values, forward: {"width_m": float(values[0])},
    signature="loop of constant width between loading and unloading",
)
