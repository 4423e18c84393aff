"""Numerical damping: force that goes with the tip's speed while it touches, and that no parameter states."""

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Parameter, Scope
from palpate.mechanics.effects.settings import WEIGHED, ForwardSettings, TouchedScene


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    assert isinstance(scene, Forward), "numerical effects act on the presses of a diagnosis"
    velocity = scene.touches.velocity
    normal = scene.places.frame[scene.press, 0]

    def damped(force: np.ndarray) -> np.ndarray:
        out = force - values[0] * velocity
        # the surface lets go rather than pull
        pull = np.minimum(np.einsum("ni,ni->n", out, normal), 0.0)
        touching = np.einsum("ni,ni->n", force, normal) > 0
        return np.where(touching[:, None], out - pull[:, None] * normal, force)

    settings.read(WEIGHED, damped)


EFFECT = NumericalEffect(
    name="numerical_damping",
    scope=Scope.TIME,
    words="force that grows with the tip's speed, which no parameter states",
    plain_words="the simulated object resists fast presses more than slow ones",
    parameters=(Parameter("damping_n_s_per_m", "N s/m", 0.0, 200.0, 0.0, (0.5, 3.0), 0.05),),
    keys={"damping_n_s_per_m": FileKey(low=0.0, high=1e6, unit="N s/m", required=True)},
    report=lambda values, scene, modulus_pa: {"damping_n_s_per_m": float(values[0])},
    change=_change,
    advice="lower the damping of contact and material, or take smaller time steps (implicit integrators damp "
    "by themselves)",
)
