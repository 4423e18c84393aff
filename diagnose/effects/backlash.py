"""Backlash: a play between the tip and the position sensor. A loop of constant width, whatever the rate.

Moved by the hand at the tip, the sensor lags (negative width here: the tip is ahead of its reading); moved
from
the sensor's side, the tip lags (positive). The contract's key is the width of the play, in both.
"""

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.backlash = values[0]


EFFECT = Effect(
    name="backlash",
    domain="instrument",
    words="a constant play lies between the tip and the position sensor",
    parameters=(Parameter("width_m", "m", -2e-3, 2e-3, 0.0, (1e-4, 4e-4, -1e-4, -4e-4), 2e-5),),
    change=_change,
    report=lambda values, forward: {"width_m": abs(float(values[0]))},
    # within the play the tip's place is not known, so a fit with the right width still misses
    extra={"slack": 2.5, "systematic_share": (0.15,)},
    signature="loop of constant width between loading and unloading",
)
