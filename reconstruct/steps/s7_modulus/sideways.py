"""A tip that slides down a slope: its force lies along the normal, where one that sticks is pulled aside too.

The touch law sticks. Of oblique presses it says a sideways force for each depth; where the measured one is
less than half of that, the tip slides, and only what goes along the normal tells the modulus: way and force
are cut to their parts along it. A diagnosis then says how much friction there is.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.steps.s7_modulus.press_fit import press_data

OBLIQUE = 0.2
"""A press tells where a tip that sticks has so much of its force sideways."""
SLIDES = 0.5
"""A tip slides that has less than this of a stuck one's sideways force (median over places)."""
LEAST_PLACES = 4


def sideways_share(presses: Presses, sites: TouchSites, law: str) -> float:
    """Sideways force over that of a tip that sticks, rms, each beside its force along the normal; median over
    places.

    NaN where fewer than LEAST_PLACES are pressed obliquely. sites: one a press, in order.
    """
    data = press_data(presses)
    stuck = forces_at(
        sites, data.displacement, data.starts, young_modulus_pa=1.0, tip_radius_m=data.tip_radius_m, law=law
    )
    along = [(force * data.normal[data.press]).sum(axis=1) for force in (stuck, data.force)]
    aside = [
        force - part[:, None] * data.normal[data.press]
        for force, part in zip((stuck, data.force), along, strict=True)
    ]

    def summed(one: np.ndarray, two: np.ndarray) -> np.ndarray:
        return np.bincount(data.press, (one * two).reshape(len(data.t), -1).sum(axis=1), len(presses))

    told, own = summed(along[0], along[0]), summed(aside[0], aside[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        level = summed(along[0], along[1]) / told
        share = np.sqrt(summed(aside[1], aside[1]) / own) / level
    oblique = (own > OBLIQUE**2 * told) & (level > 0)
    places = np.unique(presses.site[oblique])
    if len(places) < LEAST_PLACES:
        return float("nan")
    return float(np.median([np.median(share[oblique & (presses.site == place)]) for place in places]))


def along_the_normal(presses: Presses) -> Presses:
    """The presses with their way since first touch, and their force, cut to the parts along the normal."""
    n = presses.normal[presses.press]

    def cut(vectors: np.ndarray) -> np.ndarray:
        return (vectors * n).sum(axis=1)[:, None] * n

    return dataclasses.replace(
        presses,
        position=presses.centre[presses.press] + cut(presses.displacement),
        force=cut(presses.force),
        free_air=cut(presses.free_air),
    )
