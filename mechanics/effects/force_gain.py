"""Force gain: readings are a matrix times the truth. A common factor is the modulus's and cannot be told."""

import numpy as np

from palpate.mechanics.disk.schema import ANY
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import MIXED
from palpate.mechanics.recording.calibration import Calibration

EFFECT = Effect(
    name="force_gain",
    domain="instrument",
    scope=Scope.EVERYWHERE,
    words="the force sensor's axes have wrong gains or talk to each other",
    parameters=tuple(
        Parameter(
            f"g{a}{b}", "1", -0.5 + (a == b), 0.5 + (a == b), float(a == b), (float(a == b),), 0.01, 0.08
        )
        for a in "xyz"
        for b in "xyz"
    ),
    keys={"matrix": ANY},
    report=lambda values, scene, modulus_pa: {"matrix": np.asarray(values).reshape(3, 3).tolist()},
    plain_words="the force sensor's axes read too much or too little, or into one another",
    change=lambda settings, values, scene: settings.read(MIXED, lambda force: force @ values.reshape(3, 3).T),
    correct=lambda recording, keys: recording.corrected(
        Calibration(matrix=np.asarray(keys["matrix"], dtype=float))
    ),
    read_as=MIXED,
    hints=SearchHints(
        hides_strain=True,
        stands_for_strain=True,
        # the modulus takes up any factor common to all axes: how far a sensor may be off as a whole is a
        # guess
        common_factor=0.12,
    ),
)
