"""Tool compliance: a spring between the position sensor and the tip. Felt more where the object is stiff."""

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene
from palpate.mechanics.recording.calibration import Calibration


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    settings.tool_compliance = values[0]


EFFECT = Effect(
    name="tool_compliance",
    domain="instrument",
    scope=Scope.EVERYWHERE,
    words="the tool bends: the tip is not where the position sensor says",
    parameters=(Parameter("compliance_m_per_n", "m/N", 0.0, 0.01, 0.0, (5e-4,), 5e-5),),
    keys={"stiffness_n_per_m": FileKey(low=1.0, high=1e12, unit="N/m", required=True)},
    report=lambda values, scene, modulus_pa: {"stiffness_n_per_m": float(1 / np.maximum(values[0], 1e-9))},
    change=_change,
    correct=lambda recording, keys: recording.corrected(
        Calibration(stiffness_n_per_m=keys["stiffness_n_per_m"])
    ),
    read_as=-1,
    hints=SearchHints(
        hides_strain=True,
        # what a turning tool's weight adds to the force on the support
        systematic_share=(0.005,),
        stands_for_strain=True,
    ),
)
