"""Compliant base: the support gives, springs under the whole base."""

from typing import Any

import numpy as np

from palpate.mechanics.compliance.support_motion import far_on_springs
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene

_FELT = 1.5e-3  # share of the object's height that counts as no compliance


def _springs(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> tuple[float, float]:
    """(normal, tangential) stiffness a unit of area, Pa/m."""
    compliance, ratio = np.exp(values)
    normal = modulus_pa / (compliance * float(scene.places.height.max()))
    return float(normal), float(normal * ratio)


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    if np.exp(values[0]) < _FELT:
        return
    springs = [k / settings.modulus for k in _springs(values, scene, settings.modulus)]
    settings.far = settings.far - scene.places.far + far_on_springs(scene.places, *springs)


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    normal, tangential = _springs(values, scene, modulus_pa)
    return {"k_normal_pa_per_m": normal, "k_tangential_pa_per_m": tangential}


def _hold(keys: Keys, young_modulus_pa: float) -> dict[str, Any]:
    stated = (keys["k_normal_pa_per_m"], keys["k_tangential_pa_per_m"])
    return {"springs": tuple(float(k) / young_modulus_pa for k in stated)}


EFFECT = Effect(
    name="compliant_base",
    domain="boundary",
    scope=Scope.PLACES,
    words="the support under the object gives",
    parameters=(
        Parameter("log_compliance_of_height", "ln 1", np.log(1e-3), 2.5, np.log(1e-3), (-1.5, 0.0), 0.05),
        Parameter("log_tangential", "ln 1", -2.5, 1.0, -0.5, (-0.5, -0.5), 0.05, 0.7),
    ),
    keys={
        "k_normal_pa_per_m": FileKey(low=1.0, high=1e15, unit="Pa/m", required=True),
        "k_tangential_pa_per_m": FileKey(low=1.0, high=1e15, unit="Pa/m", required=True),
    },
    report=_report,
    change=_change,
    apply=unchanged,
    hold=_hold,
    hints=SearchHints(
        by_base=True,
        hides_strain=True,
        expensive=True,
    ),
)
