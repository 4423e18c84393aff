"""Time delay: the force reads late (or early). A loop whose width grows with the rate of force; same in any
place."""

import dataclasses

import numpy as np

from mechanics.effects.base import Effect, Keys, Parameter, Scope
from mechanics.effects.settings import LATE, Scene, Settings
from mechanics.recording import Recording


def delayed(start: np.ndarray, t: np.ndarray, force: np.ndarray, delay_s: float) -> np.ndarray:
    """(n, 3) N, the force (n, 3) as it reads `delay_s` late; start: (p + 1,) rows of presses, whose ends are
    held."""
    if delay_s == 0:
        return force
    out = np.empty_like(force)
    for a, b in zip(start[:-1], start[1:], strict=True):
        for axis in range(3):
            out[a:b, axis] = np.interp(t[a:b] - delay_s, t[a:b], force[a:b, axis])
    return out


def _change(settings: Settings, values: np.ndarray, scene: Scene) -> None:
    settings.read(LATE, lambda force: delayed(scene.start, scene.t, force, values[0]))


def _correct(recording: Recording, keys: Keys) -> Recording:
    whole = np.array([0, len(recording.t)])
    force = delayed(whole, recording.t, recording.force_on_tool, -float(keys["delay_s"]))
    return dataclasses.replace(recording, force_on_tool=force)


EFFECT = Effect(
    name="time_delay",
    domain="instrument",
    scope=Scope.TIME,
    words="the force is read later than the position",
    parameters=(Parameter("delay_s", "s", -0.08, 0.08, 0.0, (0.01, -0.01), 0.002),),
    report=lambda values, scene, modulus_pa: {"delay_s": float(values[0])},
    change=_change,
    correct=_correct,
    read_as=LATE,
    systematic=(2e-4,),
)
