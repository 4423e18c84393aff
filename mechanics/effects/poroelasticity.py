"""Poroelasticity: fluid drains from under the tip, so a contact twice as wide relaxes four times as slowly.

f = F + share integral of m(clock(t) - clock(s)) dF(s), F the drained force, with a clock that runs as D / a^2
for a contact of radius a, a^2 = R times the depth. m is the master curve of a sphere held at a depth, 0.491
exp(-0.908 sqrt x) + 0.509 exp(-1.679 x) (Hu, Zhao, Vlassak & Suo 2010), as four exponentials, within 0.5 %.
At once the fluid bears `share` of the drained force beside it: 1 - 2 nu of the drained solid. That the clock
runs by the contact as it is, on the way in and out too, is an approximation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, check, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.law import PathLaw
from palpate.mechanics.effects.settings import TouchedScene, TouchTerms
from palpate.mechanics.effects.viscoelasticity import changed, let_go, recall
from palpate.mechanics.kernels import kernel
from palpate.mechanics.model.model import Model

WEIGHTS = (0.1802, 0.7058, 0.0876, 0.0264)
RATES = (0.1943, 1.5966, 15.9847, 567.6116)
"""Of the master curve: 1 / (D t / a^2)."""
_TERMS = len(WEIGHTS)
_DRAINED = 1e3  # time constants that are more than any memory lasts


@kernel
def poroelastic_step(numbers, memory, depth, deepest, load, most, dt, normal, force):
    """Add what the fluid bears. numbers: share, D / R, m/s; memory: as of `prony_step`."""
    changed(memory, force)
    change = memory[3:6]
    run = numbers[1] * dt / depth if depth > 0.0 else _DRAINED
    for k in range(_TERMS):
        recall(numbers[0] * WEIGHTS[k], min(RATES[k] * run, _DRAINED), k, memory, change, force)
    let_go(normal, force)


LAW = PathLaw(poroelastic_step, order=1, memory=lambda numbers: 6 + 3 * _TERMS)


def _touch(touch: TouchTerms, keys: Keys, model: Model) -> None:
    share, diffusivity = float(keys["share"]), float(keys["diffusivity_m2_per_s"])
    check(
        share >= 0 and diffusivity > 0,
        "poroelasticity",
        "share at least 0, diffusivity_m2_per_s greater than 0",
    )
    touch.numbers[LAW] = np.array([share, diffusivity / model.tool.tip_radius_m])


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    # the rate of a contact as wide as the tip is what a fit gives, at any scale
    diffusivity = float(np.exp(values[1])) * scene.tip_radius**2
    return {"share": float(values[0]), "diffusivity_m2_per_s": diffusivity}


def _in_words(keys: Keys) -> str:
    return (
        f"the fluid first adds {100 * keys['share']:.0f} % to the solid's force, and drains at "
        f"{1e6 * keys['diffusivity_m2_per_s']:.3g} mm²/s"
    )


EFFECT = Effect(
    name="poroelasticity",
    domain="object",
    scope=Scope.TIME,
    words="fluid drains from under the tip: a wider contact relaxes more slowly",
    parameters=(
        Parameter("share", "1", 0.0, 1.5, 0.0, (0.2, 0.3, 0.3, 0.2), 0.01),
        Parameter(
            "log_rate",
            "ln 1/s",
            np.log(1e-3),
            np.log(100.0),
            np.log(0.5),
            tuple(np.log((0.1, 0.5, 2.0, 8.0))),
            0.05,
            2.0,
        ),
    ),
    keys={
        "share": FileKey(low=0.0, high=10.0, required=True),
        "diffusivity_m2_per_s": FileKey(low=1e-16, high=1.0, unit="m^2/s", required=True),
    },
    report=_report,
    keys_in_words=_in_words,
    touch=_touch,
    law=LAW,
    apply=unchanged,
    hints=SearchHints(
        systematic=(0.02, 0.1),
    ),
)
