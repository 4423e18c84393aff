"""Adhesion: on the way out the surface pulls the tip back, most where it is level again, not beyond its
range. A share of the pull may hold deeper in the contact as well, after a fifth of the tip's
radius of the way back.

A form without a theory; where the work of adhesion is what matters, jkr_adhesion has it."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, check, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.law import PathLaw
from palpate.mechanics.effects.settings import TouchTerms
from palpate.mechanics.kernels import kernel
from palpate.mechanics.model.model import Model

_TURN = 0.25  # of the range: the way back over which the pull sets in, so that no force steps
_TURN_INSIDE = 0.2  # of the tip's radius: the same deeper in the contact


@kernel
def adhesive_pull(depth_m, deepest_m, pull_off_n, range_m, inside, turn_m):
    """Pull towards the object, N, at least 0; depth (negative: above the surface), the touch's deepest, m.

    inside: 0 to 1, the share of it that holds wherever the tip is in the object. turn_m: after so much of the
    way back.
    """
    if deepest_m <= 0.0:
        return 0.0
    returned = deepest_m - depth_m
    reach = max(1.0 - abs(depth_m) / range_m, 0.0) * min(max(returned / (_TURN * range_m), 0.0), 1.0)
    if depth_m > 0.0:
        reach = max(reach, inside * min(max(returned / turn_m, 0.0), 1.0))
    return pull_off_n * reach


@kernel
def _step(numbers, memory, depth, deepest, load, most, dt, normal, force):
    pull = adhesive_pull(depth, deepest, numbers[0], numbers[1], numbers[2], numbers[3])
    for k in range(3):
        force[k] -= pull * normal[k]


LAW = PathLaw(_step, order=2, sharp=True, reach=lambda numbers: float(numbers[1]))


def _touch(touch: TouchTerms, keys: Keys, model: Model) -> None:
    pull, reach, inside = float(keys["pull_off_n"]), float(keys["range_m"]), float(keys.get("inside", 0.0))
    check(
        pull >= 0 and reach > 0 and 0 <= inside <= 1,
        "adhesion",
        "pull_off_n at least 0, range_m above 0, inside from 0 to 1",
    )
    touch.numbers[LAW] = np.array([pull, reach, inside, _TURN_INSIDE * model.tool.tip_radius_m])


EFFECT = Effect(
    name="adhesion",
    domain="contact",
    scope=Scope.TIME,
    words="the surface is sticky: it pulls the tip as it leaves",
    parameters=(
        Parameter("pull_off_n", "N", 0.0, 1.5, 0.0, (0.05, 0.05, 0.05), 0.005),
        Parameter("range_m", "m", 1e-4, 4e-3, 1e-3, (3e-4, 1.2e-3, 6e-4), 1e-4),
        Parameter("inside", "1", 0.0, 1.0, 0.0, (0.1, 0.3, 0.9), 0.05),
    ),
    keys={
        "pull_off_n": FileKey(low=0.0, high=100.0, unit="N", required=True),
        "range_m": FileKey(low=1e-6, high=0.1, unit="m", required=True),
        "inside": FileKey(low=0.0, high=1.0),
    },
    report=lambda values, scene, modulus_pa: dict(
        zip(("pull_off_n", "range_m", "inside"), map(float, values), strict=True)
    ),
    touch=_touch,
    law=LAW,
    apply=unchanged,
    hints=SearchHints(
        phenomenon="stickiness",
        systematic_share=(0.1, 0.2, 0.0),
    ),
)
