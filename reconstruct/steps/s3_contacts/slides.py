"""Contacts that slide over a surface: no presses, but segments of a kind of their own.

A slide tells where the surface is and how it rubs; its depth has no first touch that the place shares, so no
modulus and no 1D law is read off it.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from mechanics.errors import ContactError
from mechanics.presses import Presses
from mechanics.segments import Segment
from reconstruct.steps.s3_contacts.contacts import Exploration

SLIDE_RADII = 8.0
"""A contact whose tip wanders further than so many radii along the surface is no press: a drag within one is
shorter."""


def sliding(presses: Presses) -> np.ndarray:
    """(p,) bool: the tip ends or turns further than SLIDE_RADII from where it touched, along the surface."""
    far = np.zeros(len(presses))
    aside = np.linalg.norm(presses.travel[:, 1:], axis=1)
    inside = (presses.t >= presses.onset_s[presses.press]) & (presses.t <= presses.end_s[presses.press])
    np.maximum.at(far, presses.press[inside], aside[inside])
    return far > SLIDE_RADII * presses.tip_radius_m


def without_slides(exploration: Exploration, least: int) -> Exploration:
    """The exploration without the presses that slide; their stretches become segments 'slide'.

    Raises ContactError where fewer than `least` presses are left.
    """
    presses = exploration.presses
    slides = sliding(presses)
    if not slides.any():
        return exploration
    left = int((~slides).sum())
    if left < least:
        raise ContactError(
            f"{left} presses are left beside {int(slides.sum())} contacts that slide over the surface; at "
            f"least {least} are needed: a slide has no first touch of its place, so press as well"
        )
    starts = set(presses.onset_s[slides].tolist())
    segments = tuple(
        Segment("slide", s.start_s, s.end_s) if s.kind == "press" and s.start_s in starts else s
        for s in presses.segments
    )
    kept = dataclasses.replace(presses.of(~slides), segments=segments)
    reason = f"slides over the surface by more than {SLIDE_RADII:g} tip radii"
    refused = [(float(t), reason) for t in presses.onset_s[slides]]
    return dataclasses.replace(
        exploration, presses=kept, rejected=tuple(sorted([*exploration.rejected, *refused]))
    )
