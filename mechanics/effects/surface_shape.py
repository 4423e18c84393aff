"""Surface shape: the reconstructed surface is wrong where nobody touched, so places are too stiff or too
soft.

No few numbers describe it: it predicts nothing at a place that was held out; it is named where places differ
by more than their shape's uncertainty and nothing else explains how. What the surface should be it does not
say, so it is not rendered.
"""

from palpate.mechanics.disk.schema import ANY, FileKey
from palpate.mechanics.effects.base import Effect, Role, Scope, no_keys

EFFECT = Effect(
    name="surface_shape",
    domain="boundary",
    scope=Scope.PLACES,
    words="the reconstructed shape is wrong where nobody touched",
    parameters=(),
    keys={"rms_m": FileKey(low=0.0, high=1.0, unit="m"), "where": ANY},
    report=no_keys,
    role=Role.REST,
)
