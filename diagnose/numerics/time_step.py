"""Time step: the force answers where the tip was, some steps ago.

Or where it will be: a force logged with the position before, or a stated clock that takes off too much, which
damping or a gain would be named for otherwise.
"""

import numpy as np

from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Keys, Parameter, Scope
from palpate.mechanics.effects.settings import LATE, ForwardSettings, TouchedScene
from palpate.mechanics.quantities import number_words
from palpate.mechanics.recording.segments import delayed


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    parts = [slice(a, b) for a, b in zip(scene.start[:-1], scene.start[1:], strict=True)]
    settings.read(LATE, lambda force: delayed(parts, scene.t, force, values[0]))


def _late(keys: Keys) -> str:
    delay = keys["delay_s"]
    return f"{'late' if delay >= 0 else 'early'} by {number_words(abs(1e3 * delay))} ms"


def _early(keys: Keys) -> str:
    if keys["delay_s"] >= 0:
        return ""
    return "its forces come early: log each with the position of its own step, or mend --clock-offset"


EFFECT = NumericalEffect(
    name="time_step",
    scope=Scope.TIME,
    words="the force comes late, by the simulator's steps",
    plain_words="the simulated force answers where the tip was a moment ago",
    parameters=(Parameter("delay_s", "s", -0.2, 0.2, 0.0, (0.01, 0.04, -0.01), 0.001),),
    keys={"delay_s": FileKey(low=-10.0, high=10.0, unit="s", required=True)},
    report=lambda values, scene, modulus_pa: {"delay_s": float(values[0])},
    keys_in_words=_late,
    change=_change,
    opposite=_early,
    advice="log each force with the position of its own step; if it is, take smaller time steps, or more "
    "iterations a step",
)
