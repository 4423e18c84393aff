"""Presses that turn out to be none once all are found: they slide, or lie on a support that is known later.

A slide shows where the surface is and how it rubs; its depth has no first touch that the place shares, so no
modulus and no 1D law is read off it.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from mechanics.errors import ContactError
from mechanics.presses import Presses
from mechanics.segments import Segment
from reconstruct.steps.s2_base.outline import Boundary
from reconstruct.steps.s3_contacts.contacts import Exploration
from reconstruct.steps.s3_contacts.on_support import on_it

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
    reason = f"slides over the surface by more than {SLIDE_RADII:g} tip radii"
    slides = sliding(exploration.presses)
    left = int((~slides).sum())
    if slides.any() and left < least:
        raise ContactError(
            f"{left} presses are left beside {int(slides.sum())} contacts that slide over the surface; at "
            f"least {least} are needed: a slide has no first touch of its place, so press as well"
        )
    return _without(exploration, np.where(slides, reason, "").tolist(), "slide")


def on_base(exploration: Exploration, base: Boundary, least: int) -> Exploration:
    """The exploration over a base that its own touches placed: without presses whose tip came down to it.

    Raises ContactError where fewer than `least` presses are left.
    """
    presses, t = exploration.presses, exploration.recording.t
    spans = np.searchsorted(t, np.column_stack([presses.onset_s, presses.end_s])) + [0, 1]
    reasons = [
        on_it(exploration.position[a:b], base, presses.tip_radius_m) if kind == "press" else ""
        for (a, b), kind in zip(spans, presses.kinds, strict=True)
    ]
    left = reasons.count("")
    if left < min(least, len(reasons)):
        raise ContactError(
            f"{left} presses are left beside {len(reasons) - left} on the support of the known geometry; at "
            f"least {least} are needed: press the object, or check --unit, --pose and --up"
        )
    return _without(dataclasses.replace(exploration, boundary=base), reasons, None)


def _without(exploration: Exploration, reasons: list[str], kind: str | None) -> Exploration:
    """Without the presses that have a reason; their stretches become segments of a kind, None: are no
    segments any more."""
    presses, out = exploration.presses, np.array([bool(r) for r in reasons])
    if not out.any():
        return exploration
    starts = set(presses.onset_s[out].tolist())
    segments = []
    for s in presses.segments:
        if s.kind != "press" or s.start_s not in starts:
            segments.append(s)
        elif kind is not None:
            segments.append(Segment(kind, s.start_s, s.end_s))
    kept = dataclasses.replace(presses.of(~out), segments=tuple(segments))
    refused = [(float(t), r) for t, r in zip(presses.onset_s, reasons, strict=True) if r]
    return dataclasses.replace(
        exploration, presses=kept, rejected=tuple(sorted([*exploration.rejected, *refused]))
    )
