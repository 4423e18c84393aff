"""Time step: the force answers where the tip was, some steps ago."""

import numpy as np

from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Parameter, Scope
from palpate.mechanics.effects.settings import LATE, ForwardSettings, TouchedScene
from palpate.mechanics.recording.segments import delayed


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    parts = [slice(a, b) for a, b in zip(scene.start[:-1], scene.start[1:], strict=True)]
    settings.read(LATE, lambda force: delayed(parts, scene.t, force, values[0]))


EFFECT = NumericalEffect(
    name="time_step",
    scope=Scope.TIME,
    words="the force comes late, by the simulator's steps",
    plain_words="the simulated force answers where the tip was a moment ago",
    parameters=(Parameter("delay_s", "s", 0.0, 0.2, 0.0, (0.01, 0.04), 0.001),),
    keys={"delay_s": FileKey(low=0.0, high=10.0, unit="s", required=True)},
    report=lambda values, scene, modulus_pa: {"delay_s": float(values[0])},
    change=_change,
    advice="log each force with the position of its own step; if it is, take smaller time steps, or more "
    "iterations a step",
)
