"""Numerical drift: the simulated body wanders, so its surface is met earlier or later as time goes on."""

import numpy as np

from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Parameter, Scope
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    begun = scene.t[scene.start[:-1]]
    towards = scene.places.frame[:, 0] @ values
    settings.onset = settings.onset + (begun - begun.min()) * towards


EFFECT = NumericalEffect(
    name="numerical_drift",
    scope=Scope.PRESS,
    words="the simulated body wanders with time",
    plain_words="the simulated object creeps away from where it stands",
    parameters=tuple(
        Parameter(f"velocity_{a}_m_per_s", "m/s", -1e-3, 1e-3, 0.0, (0.0,), 1e-7) for a in "xyz"
    ),
    keys={"velocity_m_per_s": FileKey(low=-1.0, high=1.0, size=3, unit="m/s", required=True)},
    report=lambda values, scene, modulus_pa: {"velocity_m_per_s": [float(v) for v in values]},
    change=_change,
    advice="fix the base's nodes outright (no soft constraint), let the body come to rest before each press",
)
