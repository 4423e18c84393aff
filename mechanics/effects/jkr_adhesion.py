"""Adhesion by the surfaces' work: the contact snaps in at first touch and holds on above it (JKR, DMT).

The contact of radius a is a sphere's dent of that radius, drawn back as a flat punch by sqrt(2 pi a w / E*)
(Johnson, Kendall & Roberts 1971, in the form of Maugis), in series with the give of the object as a whole,
which the elastic force and the depth tell. It grows with the work w on first touch and lets go with the work
of separation; between the two its edge is pinned, which is the hysteresis of adhesion. Attraction of a range
that is not small against the neck (Tabor's parameter) pulls on the contact as a whole instead, 2 pi w R
(Derjaguin, Muller & Toporov 1975), beyond it falling off over the range; shares after Carpick, Ogletree &
Salmeron (1999). All lengths are in tip radii, the work in E* R: it holds at any scale of the tip. Before
first touch nothing pulls.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, check, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.law import PathLaw
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene, TouchTerms
from palpate.mechanics.kernels import kernel
from palpate.mechanics.model.model import Model

_HALVINGS = 60
_OBJECT_GIVES = 4.0
"""Of the pull-off's distance on a half-space: as far as an object that gives as a whole follows the tip."""


@kernel
def _travel(a, lift, pull, give):
    """Of the tip, where the contact has radius a: all in tip radii and E* R^2."""
    neck = np.sqrt(lift * a)
    return a * a - neck + give * (4.0 / 3.0 * a * a * a - 2.0 * a * neck - pull)


@kernel
def _least(lift, give):
    """The contact radius at which a tip that is drawn back lets go."""
    if lift <= 0.0:
        return 0.0
    low, high = (lift / 16.0) ** (1.0 / 3.0), (9.0 * lift / 16.0) ** (1.0 / 3.0)
    for _ in range(_HALVINGS):
        a = 0.5 * (low + high)
        if 2.0 * a - 0.5 * np.sqrt(lift / a) + give * (4.0 * a * a - 3.0 * np.sqrt(lift * a)) > 0.0:
            high = a
        else:
            low = a
        if high - low < 1e-12 * high:
            break
    return high


@kernel
def contact_radius(travel, lift, pull, give):
    """The stable contact's radius at a travel, 0 where nothing holds; all over the tip's radius and E* R^2.

    lift: 2 pi w / (E* R) of what acts at the edge. pull: on the contact as a whole. give: of the object.
    """
    low = _least(lift, give)
    if _travel(low, lift, pull, give) > travel:
        return 0.0
    high = max(2.0 * low, np.sqrt(max(travel, 0.0)) + 1e-9)
    while _travel(high, lift, pull, give) < travel:
        low, high = high, 2.0 * high
    for _ in range(_HALVINGS):
        a = 0.5 * (low + high)
        if _travel(a, lift, pull, give) < travel:
            low = a
        else:
            high = a
        if high - low < 1e-9 * high:
            break
    return 0.5 * (low + high)


@kernel
def jkr_step(numbers, memory, depth, deepest, load, most, dt, normal, force):
    """numbers: lift and pull of the work on first touch, of that of separation, the range over R, R m,
    E* R^2 N. memory: contact radius over R, the object's give as the way in told it, how
    far the pull has turned to that of separation, the last travel over R."""
    if not deepest > 0.0:
        return
    radius, unit = numbers[5], numbers[6]
    travel = depth / radius
    held = (force[0] * normal[0] + force[1] * normal[1] + force[2] * normal[2]) / unit
    if depth >= deepest and held > 0.0:
        # more force than a half-space's, as of a quick press, or of a support close below, tells of no give
        memory[1] = max((travel - (0.75 * held) ** (2.0 / 3.0)) / held, 0.0)
    give = memory[1]
    memory[2] = min(max(memory[2] - (travel - memory[3]) / numbers[4], 0.0), 1.0)
    memory[3] = travel
    pull = numbers[1] + memory[2] * (numbers[3] - numbers[1])
    a = 0.0
    if memory[0] > 0.0 or travel >= 0.0:
        a = min(memory[0], contact_radius(travel, numbers[2], pull, give))
        a = max(a, contact_radius(travel, numbers[0], pull, give))
    memory[0] = a
    if a > 0.0:
        back = (a * a + give * (4.0 / 3.0 * a * a * a - pull) - travel) / (1.0 + 2.0 * a * give)
        now = 4.0 / 3.0 * a * a * a - 2.0 * a * back - pull
    else:
        # beyond the contact the pull falls off over its range; the surface rises towards the tip meanwhile
        left = 1.0 - pull * give / numbers[4]
        now = 0.0
        if left > 0.0:
            now = -min(pull * max(1.0 + travel / numbers[4], 0.0) / left, pull)
    plain = contact_radius(travel, 0.0, 0.0, give)
    change = (now - 4.0 / 3.0 * plain * plain * plain) * unit
    for k in range(3):
        force[k] += change * normal[k]


def _reach(numbers: np.ndarray) -> float:
    """m, how far above the surface it still holds the tip."""
    neck = 3.0 * (numbers[2] / 16.0) ** (2.0 / 3.0)
    return float((_OBJECT_GIVES * neck + numbers[4]) * numbers[5])


LAW = PathLaw(jkr_step, order=2, memory=lambda numbers: 4, reach=_reach)


def edge_share(work: float, range_m: float, plane_strain_pa: float, radius_m: float) -> float:
    """Share of the work, J/m^2, that acts at the contact's edge: 1 is JKR's limit, 0 that of DMT.

    Maugis's parameter from Tabor's, and the pull-off force that goes with it.
    """
    if not work > 0:
        return 1.0
    tabor = (radius_m * work**2 / (plane_strain_pa**2 * range_m**3)) ** (1 / 3)
    with_maugis = 4.04 * (1.157 * tabor) ** 1.4
    return float(with_maugis / (1 + with_maugis))


def _set(touch: TouchTerms, keys: Keys, modulus_pa: float, poisson_ratio: float, radius: float) -> None:
    work, healed, reach = (float(keys[name]) for name in ("work_j_per_m2", "healed", "range_m"))
    check(
        work >= 0 and 0 <= healed <= 1 and reach > 0,
        "jkr_adhesion",
        "work_j_per_m2 at least 0, healed from 0 to 1, range_m above 0",
    )
    plane_strain = modulus_pa / (1 - poisson_ratio**2)
    edge = edge_share(work, reach, plane_strain, radius)
    out = 2 * math.pi * work / (plane_strain * radius)
    whole = (1 - edge) * out
    touch.numbers[LAW] = np.array(
        [healed * edge * out, healed * whole, edge * out, whole, reach / radius, radius,
         plane_strain * radius**2]
    )  # fmt: skip


def _touch(touch: TouchTerms, keys: Keys, model: Model) -> None:
    material = model.material
    _set(touch, keys, material.young_modulus_pa, material.poisson_ratio, model.tool.tip_radius_m)


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    keys = _report(values, scene, settings.modulus)
    _set(settings.touch, keys, settings.modulus, settings.nu, scene.places.model.tool.tip_radius_m)


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    radius = scene.places.model.tool.tip_radius_m
    return {
        "work_j_per_m2": float(values[0] * modulus_pa * radius),
        "healed": float(values[1]),
        "range_m": float(values[2] * radius),
    }


EFFECT = Effect(
    name="jkr_adhesion",
    domain="contact",
    scope=Scope.TIME,
    words="the surface sticks to the tip with a work of adhesion: it snaps in, and holds on at the way out",
    parameters=(
        Parameter("work_over_er", "1", 0.0, 1.0, 0.0, (0.005, 0.03, 0.03, 0.1), 0.001),
        Parameter("healed", "1", 0.0, 1.0, 0.0, (0.1, 0.1, 0.6, 0.1), 0.05),
        Parameter("range_over_r", "1", 1e-6, 0.5, 0.01, (0.01, 0.01, 0.01, 0.1), 0.005),
    ),
    keys={
        "work_j_per_m2": FileKey(low=0.0, high=1e4, unit="J/m^2", required=True),
        "healed": FileKey(low=0.0, high=1.0, required=True),
        "range_m": FileKey(low=1e-12, high=0.1, unit="m", required=True),
    },
    report=_report,
    touch=_touch,
    change=_change,
    law=LAW,
    apply=unchanged,
    hints=SearchHints(
        phenomenon="stickiness",
        expensive=True,
    ),
)
