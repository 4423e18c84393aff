"""Presses that turn out to be none once all are found: they slide, lie on a support that is known later, or
not on the object at all.

A slide shows where the surface is and how it rubs; its depth has no first touch that the place shares, so no
modulus and no 1D law is read off it.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from palpate.mechanics.errors import ContactError
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.segments import TimeSegment
from palpate.mechanics.statistics import spread_about_zero
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s2_base import Boundary
from palpate.reconstruction.steps.s3_contacts.contact_law import contact_law, fit_offset, fit_rise
from palpate.reconstruction.steps.s3_contacts.on_support import on_it

SLIDE_RADII = 8.0
"""A contact whose tip wanders further than so many radii along the surface is no press: a drag within one is
shorter."""
_FAR_SPREADS = 6.0
"""A first touch so many spreads of the others off the surface, and a tip's radius, lies on something else;
nearer, its force may have an offset."""
_LEAST_ROWS, _ODDS = 5, 9.0


def sliding(presses: Presses) -> np.ndarray:
    """(p,) bool: the tip ends or turns further than SLIDE_RADII from where it touched, along the surface."""
    far = np.zeros(len(presses))
    aside = np.linalg.norm(presses.travel[:, 1:], axis=1)
    inside = (presses.t >= presses.onset_s[presses.press]) & (presses.t <= presses.end_s[presses.press])
    np.maximum.at(far, presses.press[inside], aside[inside])
    return far > SLIDE_RADII * presses.tip_radius_m


def without_slides(measured: Measured, least: int) -> Measured:
    """What was measured, without the presses that slide; their stretches become segments 'slide'.

    Raises ContactError where fewer than `least` presses are left.
    """
    reason = f"slides over the surface by more than {SLIDE_RADII:g} tip radii"
    slides = sliding(measured.presses)
    left = int((~slides).sum())
    if slides.any() and left < least:
        raise ContactError(
            f"{left} presses remain, next to {int(slides.sum())} contacts that slide over the surface; at "
            f"least {least} are needed: a slide has no first touch of its place, so press as well"
        )
    return _without(measured, np.where(slides, reason, "").tolist(), "slide")


def on_base(measured: Measured, base: Boundary, least: int) -> Measured:
    """What was measured, over a base that its own touches placed: without presses whose tip came down to it.

    Raises ContactError where fewer than `least` presses are left.
    """
    presses, t = measured.presses, measured.recording.t
    spans = np.searchsorted(t, np.column_stack([presses.onset_s, presses.end_s])) + [0, 1]
    reasons = [
        on_it(measured.position[a:b], base, presses.tip_radius_m) if kind == "press" else ""
        for (a, b), kind in zip(spans, presses.kinds, strict=True)
    ]
    left = reasons.count("")
    if left < min(least, len(reasons)):
        raise ContactError(
            f"{left} presses remain, next to {len(reasons) - left} on the support of the known geometry; at "
            f"least {least} are needed: press the object, or check --unit, --pose and --up"
        )
    return _without(dataclasses.replace(measured, boundary=base), reasons, None)


def within_slab(measured: Measured, thickness_m: float | None) -> Measured:
    """What was measured, without the few presses that would go through the slab that it lies on; as it is
    where they are not few: then the thickness is wrong."""
    presses = measured.presses
    through = presses.depth_m >= (thickness_m or np.inf)
    if through.mean() >= 0.5:
        return measured
    reasons = [
        f"goes {1e3 * depth:.1f} mm deep, through the slab" if out else ""
        for depth, out in zip(presses.depth_m, through, strict=True)
    ]
    return _without(measured, reasons, None)


def off_surface(presses: Presses, points: np.ndarray, normals: np.ndarray, base: Boundary) -> list[str]:
    """Why each press cannot be pressed into the surface, '' where it can: the nearest point (p, 3) m that
    faces it, with outward normal (p, 3), is far from its first touch, or on the base that is held."""
    away = np.linalg.norm(presses.point - points, axis=1)
    usual = float(np.median(away))
    strange = _FAR_SPREADS * max(spread_about_zero(away), usual)
    most = max(strange, presses.tip_radius_m)
    held = (base.height(points) < 1e-6) & (normals @ base.support_normal < -0.5)
    reasons = []
    for p, (far, under) in enumerate(zip(away, held, strict=True)):
        why = f"touches {1e3 * far:.1f} mm off the surface, where others touch {1e3 * usual:.1f} mm off it"
        reason = "has a force that points into the support" if under else why if far > most else ""
        if not reason and far > strange and presses.quasi_static:
            offset = _offset(presses, p, points[p], normals[p])
            reason = f"has a force that is off by {offset:.3g} N: {why}" if offset else ""
        reasons.append(reason)
    return reasons


def _offset(presses: Presses, p: int, point: np.ndarray, normal: np.ndarray) -> float:
    """N, by which the force of a press of points is off, if that explains it nine times better than a touch
    off the surface does; 0.0 if not. Points have no free air that would tell it."""
    rows = presses.parts[p]
    push = presses.force[rows] @ normal
    u = -(presses.position[rows] - point) @ normal + presses.tip_radius_m
    if len(u) < _LEAST_ROWS:
        return 0.0
    noise = presses.noise_n
    touched = fit_rise(u, push, noise, guess_m=float(u.min()))
    shifted = fit_offset(u, push, noise)
    least = len(u) * noise**2
    off = float(((contact_law(u - touched.u0_m, touched.hertz, touched.compliance) - push) ** 2).sum())
    own = float(((shifted[0] + contact_law(u, *shifted[1:]) - push) ** 2).sum())
    better = 0.5 * len(u) * np.log(max(off, least) / max(own, least))
    return shifted[0] if better > np.log(_ODDS) else 0.0


def on_surface(
    measured: Measured, points: np.ndarray, normals: np.ndarray, least: int
) -> tuple[Measured, np.ndarray]:
    """What was measured, without the presses that are not on the surface (`off_surface`), and which (p,) bool
    of those before are left.

    Raises ContactError where fewer than `least` presses are left.
    """
    reasons = off_surface(measured.presses, points, normals, measured.boundary)
    kept = np.array([not reason for reason in reasons])
    if kept.sum() < min(least, len(kept)):
        first = next(reason for reason in reasons if reason)
        raise ContactError(
            f"{int(kept.sum())} presses of {len(kept)} lie on the surface (one that does not {first}); at "
            f"least {least} are needed: check the position's frame, force_on and what the object lies on"
        )
    return _without(measured, reasons, None), kept


def _without(measured: Measured, reasons: list[str], kind: str | None) -> Measured:
    """Without the presses that have a reason; their stretches become segments of a kind, None: are no
    segments any more."""
    presses, out = measured.presses, np.array([bool(r) for r in reasons])
    if not out.any():
        return measured
    starts = set(presses.onset_s[out].tolist())
    segments = []
    for s in presses.segments:
        if s.kind != "press" or s.start_s not in starts:
            segments.append(s)
        elif kind is not None:
            segments.append(TimeSegment(kind, s.start_s, s.end_s))
    kept = dataclasses.replace(presses.of(~out), segments=tuple(segments))
    refused = [(float(t), r) for t, r in zip(presses.onset_s, reasons, strict=True) if r]
    return dataclasses.replace(measured, presses=kept, rejected=tuple(sorted([*measured.rejected, *refused])))
