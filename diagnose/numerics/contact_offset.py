"""Contact offset: the surface is met before or after it is there (margins, skins, radii of particles)."""

import numpy as np

from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    settings.onset = settings.onset + values[0]


EFFECT = NumericalEffect(
    name="contact_offset",
    scope=Scope.PRESS,
    words="the surface stands off (a margin, a skin, a particle's radius), or is met late",
    plain_words="the simulated surface is met before, or after, it is there",
    parameters=(Parameter("offset_m", "m", -2e-3, 2e-3, 0.0, (2e-4, -2e-4, 8e-4, -8e-4), 2e-5),),
    keys={"offset_m": FileKey(low=-0.1, high=0.1, unit="m", required=True)},
    report=lambda values, scene, modulus_pa: {"offset_m": float(values[0])},
    change=_change,
    advice="set contact margin, rest offset or the particles' radius to 0, or move the tip back by it",
    hints=SearchHints(hides_strain=True),
)
