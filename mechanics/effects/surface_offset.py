"""Surface offset: the touched surface is shifted against the traced base (phase II against phase I).

The model's surface is wrong then, and this says where it was, not what it should be: it is not rendered.
"""

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    point, normal = scene.places.point, scene.places.normal
    move = values[:3] + np.cross(values[3:], point - point.mean(axis=0))
    settings.onset = settings.onset + np.einsum("pi,pi->p", normal, move)


EFFECT = Effect(
    name="surface_offset",
    domain="boundary",
    scope=Scope.PLACES,
    words="the object moved between tracing its base and pressing it",
    parameters=(
        *(Parameter(f"shift_{a}_m", "m", -8e-3, 8e-3, 0.0, (0.0,), 5e-5, 2e-3) for a in "xyz"),
        *(Parameter(f"rotation_{a}_rad", "rad", -0.15, 0.15, 0.0, (0.0,), 1e-3, 0.03) for a in "xyz"),
    ),
    keys={
        "shift_m": FileKey(low=-1.0, high=1.0, size=3, unit="m", required=True),
        "rotation_rad": FileKey(low=-4.0, high=4.0, size=3, unit="rad", required=True),
    },
    report=lambda values, scene, modulus_pa: {
        "shift_m": [float(v) for v in values[:3]],
        "rotation_rad": [float(v) for v in values[3:]],
    },
    change=_change,
    hints=SearchHints(
        # a delay or a play has already moved the first touches that the surface was fitted to
        by_first_touches=True,
    ),
)
