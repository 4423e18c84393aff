"""Force law: the force goes with another power of the depth than a tip's on an elastic solid.

A bed of springs and a pressure field (hydroelastic contact) push with the square of a sphere's depth, a
penalty with the depth itself. A solid's own force goes with the power 1.5, so such a force is a power of it,
|F| (|F| / F0)^(p / 1.5 - 1); its level, at the force F0 of a median press, is a modulus of another name.
"""

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import LATE, ForwardSettings, TouchedScene
from palpate.mechanics.quantities import number_words

HERTZ = 1.5
"""Power of the depth with which a sphere's force goes."""
_BENT = 0.01
"""Standard deviation of the power of a right force, as our own law bends: what is no more is a factor."""
_LEAST = 1e-3
"""Of the median press's force: below it a power says nothing."""


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    assert isinstance(scene, Forward), "numerical effects act on the presses of a diagnosis"
    t, power = scene.touches, values[0] / HERTZ - 1

    def other_power(force: np.ndarray) -> np.ndarray:
        size = np.linalg.norm(force, axis=1)
        great = np.zeros(len(t))
        np.maximum.at(great, t.press, size)
        usual = float(np.median(great))
        if not usual > 0:
            return force
        share = np.maximum(size / usual, _LEAST)
        return force * (np.exp(values[1]) * share**power)[:, None]

    settings.read(LATE - 1, other_power)


EFFECT = NumericalEffect(
    name="force_law",
    scope=Scope.EVERYWHERE,
    words="the force goes with another power of the depth than a solid's 1.5",
    plain_words="the simulated force grows with depth in another way than that of a solid, as pressure "
    "fields and beds of springs do",
    parameters=(
        Parameter("power", "1", 0.7, 3.5, HERTZ, (2.0, 1.1, 2.6), 0.01),
        Parameter("log_ratio", "1", -2.5, 2.5, 0.0, (0.0, 0.0, 0.0), 0.01, 0.5),
    ),
    keys={"power": FileKey(low=0.1, high=10.0, required=True), "ratio": FileKey(low=1e-3, high=1e3)},
    report=lambda values, scene, modulus_pa: {
        "power": float(values[0]),
        "ratio": float(np.exp(values[1])),
    },
    keys_in_words=lambda keys: f"power {number_words(keys['power'])} of the depth instead of {HERTZ}",
    change=_change,
    advice="take a contact that solves the solid (finite elements under the tip) instead of a pressure field "
    "or springs a node; a contact modulus fits one depth alone",
    built_in=True,
    hints=SearchHints(hides_strain=True, stands_for_strain=True, any_form=True, untold=(_BENT, np.inf)),
)
