"""Contact stiffness: the tip sinks into the surface on a spring that the object does not have (penalty)."""

import numpy as np

from diagnose.numerics.base import DOMAIN, NumericalEffect
from mechanics.disk.schema import Key
from mechanics.effects.base import Parameter, Scope
from mechanics.effects.hints import SearchHints
from mechanics.effects.settings import Scene, Settings


def _change(settings: Settings, values: np.ndarray, scene: Scene) -> None:
    settings.tool_compliance += values[0]


EFFECT = NumericalEffect(
    name="contact_stiffness",
    domain=DOMAIN,
    scope=Scope.EVERYWHERE,
    words="the contact gives: a spring in series that the object does not have",
    plain_words="the simulated tip sinks into the surface before it is pushed back, as if on a spring",
    parameters=(Parameter("compliance_m_per_n", "m/N", 0.0, 0.05, 0.0, (2e-4, 1e-3), 2e-5),),
    keys={"stiffness_n_per_m": Key(low=1.0, high=1e12, unit="N/m", required=True)},
    report=lambda values, scene, modulus_pa: {"stiffness_n_per_m": float(1 / np.maximum(values[0], 1e-9))},
    change=_change,
    advice="raise the contact stiffness (a penalty of ten times the object's own stiffness under the tip "
    "leaves a tenth), or lower the time constant of the contact",
    hints=SearchHints(hides_strain=True, stands_for_strain=True),
)
