"""Time delay: the force reads late (or early). A loop whose width grows with the rate of force; same in any
place."""

import dataclasses

import numpy as np
from numba import njit

from mechanics.effects.base import Effect, Keys, Parameter, Scope
from mechanics.effects.settings import LATE, Scene, Settings
from mechanics.recording import Recording


@njit(cache=True)
def late(start, t, force, delay, out):
    """Write the force (n, 3) of `delay` s before; start (p + 1,) rows of presses, whose ends are held."""
    for p in range(start.shape[0] - 1):
        a, b = start[p], start[p + 1]
        j = a
        for i in range(a, b):
            wanted = t[i] - delay
            if wanted <= t[a]:
                out[i] = force[a]
                continue
            if wanted >= t[b - 1]:
                out[i] = force[b - 1]
                continue
            while j > a and t[j] > wanted:
                j -= 1
            while t[j + 1] < wanted:
                j += 1
            w = (wanted - t[j]) / (t[j + 1] - t[j])
            out[i] = (1 - w) * force[j] + w * force[j + 1]


def delayed(start: np.ndarray, t: np.ndarray, force: np.ndarray, delay_s: float) -> np.ndarray:
    """(n, 3) N, the force as it reads `delay_s` late."""
    if delay_s == 0:
        return force
    out = np.empty_like(force)
    late(start, t, np.ascontiguousarray(force), delay_s, out)
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
