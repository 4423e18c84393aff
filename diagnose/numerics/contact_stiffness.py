"""Contact stiffness: the tip sinks into the surface on springs that the object does not have (penalty).

One spring in series sinks with the force. Springs side by side, one a node or an area, are the more the
larger the contact is: a layer of stiffness s an area sinks by F / (s pi R d) where a dent d gives
F = 4/3 E* sqrt(R) d^1.5, so it takes B sqrt(R d) of the depth, B = 4 E* / (3 pi s R), which is most of it
where the press is light.
"""

from typing import Any

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.contact.dent import grid
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Keys, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene
from palpate.mechanics.quantities import quantity_words


def layer_factors(share: float) -> tuple[np.ndarray, np.ndarray]:
    """Factors on a dent's normal force and stick at `mechanics.contact.dent.grid()`, where a layer of that B
    lies on the object."""
    x = np.maximum(grid(), 0.5 * grid()[1])
    left = (0.5 * (np.sqrt(share**2 + 4 * x) - share)) ** 2 / x
    return left**1.5, np.sqrt(left)


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    settings.tool_compliance += values[0]
    if values[1] > 0:
        settings.touch.factors.append(lambda poisson_ratio: layer_factors(values[1]))


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    assert isinstance(scene, Forward), "numerical effects act on the presses of a diagnosis"
    plane = modulus_pa / (1 - scene.ideal(modulus_pa).nu ** 2)
    # springs side by side are told as one by what they give where presses are deepest: 1 / (s pi R d)
    layer = 0.75 * values[1] / (plane * float(np.median(scene.touches.deepest)))
    return {"stiffness_n_per_m": float(1 / max(values[0] + layer, 1e-9))}


def _how_much(keys: Keys) -> str:
    now = keys["stiffness_n_per_m"]
    ten = quantity_words("stiffness_n_per_m", 10 * now)
    return f"{ten} in place of {quantity_words('stiffness_n_per_m', now)} leave a tenth of its error"


EFFECT = NumericalEffect(
    name="contact_stiffness",
    scope=Scope.EVERYWHERE,
    words="the contact gives: springs in series that the object does not have",
    plain_words="the simulated tip sinks into the surface before it is pushed back, as if on a spring",
    parameters=(
        Parameter("compliance_m_per_n", "m/N", 0.0, 0.05, 0.0, (2e-4, 1e-3, 0.0, 0.0), 2e-5),
        Parameter("layer", "1", 0.0, 2.0, 0.0, (0.0, 0.0, 0.05, 0.3), 0.005),
    ),
    keys={"stiffness_n_per_m": FileKey(low=1.0, high=1e12, unit="N/m", required=True)},
    report=_report,
    change=_change,
    advice="raise the contact stiffness (a penalty of ten times the object's own stiffness under the tip "
    "leaves a tenth), or lower the time constant of the contact",
    how_much=_how_much,
    hints=SearchHints(hides_strain=True, stands_for_strain=True),
)
