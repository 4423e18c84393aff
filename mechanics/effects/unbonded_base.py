"""Unbonded base: part of the base is free to lift and slip; what presses on the support is still carried."""

from typing import Any

import numpy as np

from palpate.mechanics.compliance.support_motion import ANGLES, far_partly_bonded
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene
from palpate.mechanics.frames import tangents


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    settings.far = settings.far - scene.places.far + far_partly_bonded(scene.places, *values)


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    across, along = tangents(scene.places.model.support.normal)
    direction = np.cos(values[1]) * across + np.sin(values[1]) * along
    return {"bonded_fraction": float(1 - values[0]), "direction": [float(v) for v in direction]}


def _hold(keys: Keys, young_modulus_pa: float) -> dict[str, Any]:
    direction = np.asarray(keys["direction"], dtype=float)
    return {"bonded_fraction": float(keys["bonded_fraction"]), "direction": direction}


def _starts() -> list[np.ndarray]:
    return [np.array([0.4, k * 2 * np.pi / ANGLES, floor]) for floor in (0.95, 0.05) for k in range(ANGLES)]


EFFECT = Effect(
    name="unbonded_base",
    domain="boundary",
    scope=Scope.PLACES,
    words="part of the object's base is loose",
    parameters=(
        Parameter("free_fraction", "1", 0.0, 0.75, 0.0, (0.3,), 0.02),
        Parameter("angle", "rad", -7.0, 14.0, 0.0, (0.0,), 0.1),
        Parameter("floor", "1", 0.0, 1.0, 1.0, (1.0,), 0.05, 0.7),
    ),
    keys={
        "bonded_fraction": FileKey(low=1e-3, high=1.0, required=True),
        "direction": FileKey(low=-1e3, high=1e3, size=3, required=True),
    },
    report=_report,
    change=_change,
    apply=unchanged,
    hold=_hold,
    hints=SearchHints(
        candidates=_starts,
        by_base=True,
        expensive=True,
    ),
)
