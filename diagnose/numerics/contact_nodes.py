"""Contact on few nodes: the contact is never smaller than the patch that one node stands for.

A node with its elements gives as a flat punch of radius a0 does, F = 2 a0 E* d, until Hertz's contact,
a = sqrt(R d), is the larger: linear in depth where a sphere's dent goes with the power 1.5. A tip that is met
by nodes alone is met late, between them, by a share of a0^2 / R.
"""

import numpy as np

from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.contact.dent import grid
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene

_JOIN = 3.0
"""How sharply punch and sphere meet."""


def punch_factors(radius_ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """Factors on a dent's normal force and stick at mechanics.contact.dent.grid(): a patch of at least that
    radius, over the tip's."""
    x = grid()
    wider = radius_ratio / np.sqrt(np.maximum(x, 0.5 * x[1]))
    return (1 + (1.5 * wider) ** _JOIN) ** (1 / _JOIN), (1 + wider**_JOIN) ** (1 / _JOIN)


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    if values[0] > 0:
        settings.touch.factors.append(lambda poisson_ratio: punch_factors(values[0]))
        settings.onset = settings.onset - values[1] * values[0] ** 2 * scene.tip_radius


EFFECT = NumericalEffect(
    name="contact_nodes",
    scope=Scope.EVERYWHERE,
    words="the tip rests on few nodes: a patch that does not shrink as the press gets lighter",
    plain_words="the mesh is too coarse under the tip: it is pressed by single corner points",
    parameters=(
        Parameter("radius_ratio", "1", 0.0, 4.0, 0.0, (0.3, 0.8, 0.8, 1.5), 0.02),
        Parameter("late_share", "1", 0.0, 1.0, 0.0, (0.0, 0.0, 0.5, 0.0), 0.02, 0.5),
    ),
    keys={"effective_radius_m": FileKey(low=0.0, high=1.0, unit="m", required=True)},
    report=lambda values, scene, modulus_pa: {
        "effective_radius_m": float(values[0] * scene.tip_radius),
        "late_m": float(values[1] * values[0] ** 2 * scene.tip_radius),
    },
    change=_change,
    advice="refine the mesh under the tip: edges of a third of the tip's radius or less, quadratic if the "
    "simulator has them, or contact on faces instead of nodes",
    hints=SearchHints(hides_strain=True, stands_for_strain=True, own_touches=True),
)
