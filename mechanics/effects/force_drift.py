"""Force drift: the zero of the sensor wanders with the recording's clock; where that begins it reads zero."""

import dataclasses

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Role, Scope
from palpate.mechanics.effects.settings import SHIFTED
from palpate.mechanics.recording.recording import Recording


def drifted(t: np.ndarray, rate_n_per_s: np.ndarray) -> np.ndarray:
    """(n, 3) N that the sensor reads too much at times t (n,) s of the recording's clock."""
    return t[:, None] * np.asarray(rate_n_per_s, dtype=float)


def _correct(recording: Recording, keys: Keys) -> Recording:
    force = recording.force_on_tool - drifted(recording.t, keys["rate_n_per_s"])
    return dataclasses.replace(recording, force_on_tool=force)


EFFECT = Effect(
    name="force_drift",
    domain="instrument",
    scope=Scope.READING,
    words="the zero of the force sensor drifts",
    parameters=tuple(Parameter(f"rate_{a}_n_per_s", "N/s", -0.02, 0.02, 0.0, (0.0,), 1e-4) for a in "xyz"),
    keys={"rate_n_per_s": FileKey(low=-1e3, high=1e3, size=3, unit="N/s", required=True)},
    report=lambda values, scene, modulus_pa: {"rate_n_per_s": [float(v) for v in values]},
    role=Role.FREE_AIR,
    change=lambda settings, values, scene: settings.read(
        SHIFTED, lambda force: force + drifted(scene.t, values)
    ),
    correct=_correct,
    read_as=SHIFTED,
)
