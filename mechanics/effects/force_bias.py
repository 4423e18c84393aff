"""Force bias: a constant vector on every reading, seen best in free air."""

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Parameter, Role, Scope
from palpate.mechanics.effects.settings import SHIFTED
from palpate.mechanics.recording.calibration import Calibration

EFFECT = Effect(
    name="force_bias",
    domain="instrument",
    scope=Scope.READING,
    words="the force sensor does not read zero in free air",
    parameters=tuple(Parameter(f"bias_{a}_n", "N", -2.0, 2.0, 0.0, (0.0,), 0.005) for a in "xyz"),
    keys={"bias_n": FileKey(low=-1e3, high=1e3, size=3, unit="N", required=True)},
    report=lambda values, scene, modulus_pa: {"bias_n": [float(v) for v in values]},
    role=Role.FREE_AIR,
    change=lambda settings, values, scene: settings.read(SHIFTED, lambda force: force + values),
    correct=lambda recording, keys: recording.corrected(
        Calibration(bias_n=np.asarray(keys["bias_n"], dtype=float))
    ),
    read_as=SHIFTED,
)
