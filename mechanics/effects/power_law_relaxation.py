"""Power-law relaxation: a springpot beside the elastic solid (fractional viscoelasticity; Koeller 1984).

f(t) = F(t) + share integral of ((t - s) / 1 s)^-exponent dF(s), F the quasi-static force: two numbers where
a Prony series needs four to six. It is rendered as a Prony series, the memory of viscoelasticity: time
constants one after another in a fixed ratio, their weights the best for the exponent. From 5 ms to 100 s it
is within 1 % of the power up to an exponent of 0.45 and within 3.5 % up to 0.9; a press that is
faster feels no more than 5 ms do, one that lasts longer relaxes no further.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, check, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import TouchTerms
from palpate.mechanics.effects.viscoelasticity import add_terms
from palpate.mechanics.model.model import Model

SHORTEST_S, LONGEST_S = 0.005, 100.0
TAU_S = np.append(np.geomspace(0.5 * SHORTEST_S, LONGEST_S, 7), 1e3 * LONGEST_S)
"""The last does not fade: what of the power is left at the end."""
_AT_S = np.geomspace(SHORTEST_S, LONGEST_S, 60)


@lru_cache(maxsize=4096)
def _weights(exponent: float) -> tuple[float, ...]:
    from scipy.optimize import nnls  # here: it is half a second

    series = np.exp(-_AT_S[:, None] / TAU_S) * _AT_S[:, None] ** exponent
    return tuple(nnls(series, np.ones(len(_AT_S)))[0])


def prony_terms(share: float, exponent: float) -> tuple[np.ndarray, np.ndarray]:
    """(g, tau_s), (8,) each, whose sum of g exp(-t / tau) is share (t / 1 s)^-exponent."""
    return share * np.array(_weights(float(exponent))), TAU_S


def _touch(touch: TouchTerms, keys: Keys, model: Model) -> None:
    share, exponent = float(keys["share"]), float(keys["exponent"])
    check(
        share >= 0 and 0 < exponent < 1,
        "power_law_relaxation",
        "share at least 0, exponent between 0 and 1",
    )
    add_terms(touch, *prony_terms(share, exponent))


def _in_words(keys: Keys) -> str:
    share, exponent = keys["share"], keys["exponent"]
    later = share * 10**-exponent
    return f"extra force after a fast press: {100 * share:.0f} % after 1 s, {100 * later:.0f} % after 10 s"


EFFECT = Effect(
    name="power_law_relaxation",
    domain="object",
    scope=Scope.TIME,
    words="the material creeps and relaxes by a power of time, without an end in sight",
    parameters=(
        Parameter("share", "1", 0.0, 50.0, 0.0, (0.1, 0.4, 2.0, 8.0), 0.01),
        Parameter("exponent", "1", 0.02, 0.9, 0.25, (0.2, 0.3, 0.35, 0.35), 0.01, 0.3),
    ),
    keys={
        "share": FileKey(low=0.0, high=1e3, required=True),
        "exponent": FileKey(low=1e-3, high=0.999, required=True),
    },
    report=lambda values, scene, modulus_pa: {"share": float(values[0]), "exponent": float(values[1])},
    keys_in_words=_in_words,
    touch=_touch,
    apply=unchanged,
    hints=SearchHints(
        phenomenon="relaxation",
        # holds of half a second tell share and lasting modulus apart to a tenth of the share
        systematic=(0.015, 0.02),
        systematic_share=(0.12, 0.0),
    ),
)
