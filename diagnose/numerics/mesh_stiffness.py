"""Mesh stiffness: elements that are too coarse, or lock near Poisson's ratio 0.5, resist too much.

A factor on the force of a place, whatever depth and rate; more where the object is stiff (thin, near its
base) than where it is soft: ln ratio is a straight line in the logarithm of the place's own compliance.
"""

from typing import Any

import numpy as np

from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Keys, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene
from palpate.mechanics.quantities import number_words


def _stiffer(scene: TouchedScene) -> np.ndarray:
    """(p,) how stiff a place is against the others: mean 0, standard deviation 1."""
    # what a place gives beside its dent, and the dent of a quarter of the tip's radius
    soft = np.log(np.maximum(scene.places.far[:, 0, 0] + 1 / scene.tip_radius, 1e-3))
    spread = soft.std()
    return (soft.mean() - soft) / spread if spread > 1e-6 else np.zeros(len(soft))


def _ratio(values: np.ndarray, scene: TouchedScene) -> np.ndarray:
    return np.exp(values[0] + values[1] * _stiffer(scene))


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    settings.stiffness = settings.stiffness * _ratio(values, scene)


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    ratio = _ratio(values, scene)
    return {
        "ratio": float(np.exp(values[0])),
        "ratio_softest_place": float(ratio[np.argmin(_stiffer(scene))]),
        "ratio_stiffest_place": float(ratio[np.argmax(_stiffer(scene))]),
    }


def _words(keys: Keys) -> str:
    low, high = sorted((keys["ratio_softest_place"], keys["ratio_stiffest_place"]))
    few, many = number_words(low), number_words(high)
    places = "" if few == many else f", {few} to {many} from place to place"
    return f"{number_words(keys['ratio'])} times as stiff as it should be{places}"


def _how_much(keys: Keys) -> str:
    return f"enough when the force is {number_words(1 / keys['ratio'])} times what it is"


def _too_soft(keys: Keys) -> str:
    if keys["ratio"] >= 1:
        return ""
    return (
        "it is too soft: check that the modulus is the one stated, and the force's unit; "
        f"{number_words(1 / keys['ratio'])} times the modulus makes up for it"
    )


EFFECT = NumericalEffect(
    name="mesh_stiffness",
    scope=Scope.EVERYWHERE,
    words="the mesh is too stiff (coarse or locking elements), whatever depth and rate",
    plain_words="the simulated object itself is too stiff or too soft, as coarse or locking meshes are",
    parameters=(
        Parameter("log_ratio", "1", -2.5, 2.5, 0.0, (0.2, -0.2), 0.01),
        Parameter("log_ratio_a_spread", "1", -0.6, 0.6, 0.0, (0.0, 0.0), 0.01, 0.1),
    ),
    keys={"ratio": FileKey(low=1e-3, high=1e3, required=True)},
    report=_report,
    keys_in_words=_words,
    change=_change,
    advice="check that the modulus is the one stated, and the force's unit; refine the mesh, use quadratic "
    "elements, or lower a Poisson's ratio above 0.45 by steps",
    how_much=_how_much,
    opposite=_too_soft,
    hints=SearchHints(),
)
