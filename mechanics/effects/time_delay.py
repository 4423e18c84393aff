"""Time delay: the force reads late (or early). A loop whose width grows with the rate of force; same in any
place."""

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import LATE, ForwardSettings, TouchedScene
from palpate.mechanics.recording.calibration import Calibration
from palpate.mechanics.recording.segments import delayed


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    parts = [slice(a, b) for a, b in zip(scene.start[:-1], scene.start[1:], strict=True)]
    settings.read(LATE, lambda force: delayed(parts, scene.t, force, values[0]))


EFFECT = Effect(
    name="time_delay",
    domain="instrument",
    scope=Scope.TIME,
    words="the force is read later than the position",
    parameters=(Parameter("delay_s", "s", -0.08, 0.08, 0.0, (0.01, -0.01), 0.002),),
    keys={"delay_s": FileKey(low=-10.0, high=10.0, unit="s", required=True)},
    report=lambda values, scene, modulus_pa: {"delay_s": float(values[0])},
    change=_change,
    correct=lambda recording, keys: recording.corrected(Calibration(delay_s=float(keys["delay_s"]))),
    read_as=LATE,
    hints=SearchHints(
        systematic=(2e-4,),
        # thirteen sound objects read up to 0.3 ms late or early; 1.1 ms are named
        untold=(2e-4,),
    ),
)
