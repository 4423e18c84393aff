"""The presses as a diagnosis weighs them: thinned to 100 Hz, from shortly before first touch to shortly after
its loss."""

from __future__ import annotations

import dataclasses

import numpy as np

from palpate.mechanics.effects.base import Role, Scope
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.errors import DiagnosisError
from palpate.mechanics.presses.table import LEAD_S, STEP_S, Presses
from palpate.mechanics.recording.side_of_play import sides

REACH_M = 2.4e-3
"""Most by which a first touch is moved."""
LEAST_PRESSES, LEAST_SITES = 6, 4
LEAST_S = 0.08
LEAST_ROWS = 12
LEAST_POINTS = 3
FOLLOWED = "followed"
"""Column of touches whose free air was followed from before to after them: (n, 3) N, what was taken off."""


def reached(presses: Presses) -> np.ndarray:
    """(p,) bool: presses that met the surface that was fitted to them, or can be moved there. The others lie
    on a shape that the surface has not got, or are no presses: a heavy tool that was swung."""
    passed = np.einsum("pi,pi->p", presses.centre - presses.point, presses.normal) - presses.tip_radius_m
    return np.abs(passed) < REACH_M


def touches_of(presses: Presses, *, step_s: float = STEP_S) -> Presses:
    """The thinned view of a table; its columns hold `lead` and `unsure`, the side of the tip in a play and
    its standard deviation (`side_of_play`).

    Presses of fewer places than 4 are a group each: they are held out press by press, and show nothing from
    place to place (`unobservable_effects`). Raises DiagnosisError with fewer than 6 presses: nothing can be
    held out.
    """
    if len(presses) < LEAST_PRESSES:
        raise DiagnosisError(
            f"the model has {len(presses)} palpations; a diagnosis holds some sites out and needs at least "
            f"{LEAST_PRESSES}"
        )
    if not presses.sampled:
        raise DiagnosisError("the table of presses has no samples: reconstruct the recording again")
    if presses.quasi_static:
        return _enough(presses, np.diff(presses.starts) >= LEAST_POINTS, f"have {LEAST_POINTS} rows or more")
    each_way = [sides(presses.t[part], presses.position[part]) for part in presses.parts]
    lead, unsure = (np.concatenate(each) for each in zip(*each_way, strict=True))
    limit = np.append(presses.onset_s[1:] - LEAD_S, np.inf)
    seen = dataclasses.replace(presses, columns={"lead": lead, "unsure": unsure})
    rows = (seen.t >= (seen.onset_s - LEAD_S)[seen.press]) & (
        seen.t < np.minimum(seen.end_s + LEAD_S, limit)[seen.press]
    )
    seen = seen.where(rows).thinned(step_s)
    lasting = (seen.end_s - seen.onset_s >= LEAST_S) & (np.diff(seen.starts) >= LEAST_ROWS)
    return _enough(seen, lasting, f"last {LEAST_S} s or more")


def _enough(seen: Presses, good: np.ndarray, words: str) -> Presses:
    if good.sum() < LEAST_PRESSES:
        raise DiagnosisError(
            f"only {good.sum()} palpations {words}; a diagnosis needs at least {LEAST_PRESSES}"
        )
    seen = seen.of(good)
    if "lead" not in seen.columns:
        seen = dataclasses.replace(seen, columns={"lead": np.zeros_like(seen.position)})
    if seen.sites < LEAST_SITES:
        # one place pressed again and again: each press is held out by itself, and remembers the others
        place = {"place": seen.site[seen.press].astype(float)}
        seen = dataclasses.replace(seen, site=np.arange(len(seen)), columns={**seen.columns, **place})
    return seen


def place_of(touches: Presses) -> np.ndarray:
    """(p,) number of the place of each press, which presses that are held out one by one share."""
    if "place" not in touches.columns:
        return touches.site
    place = touches.columns["place"][np.minimum(touches.starts[:-1], len(touches.t) - 1)]
    return np.ascontiguousarray(np.round(place), dtype=touches.site.dtype)


def unobservable_effects(presses: Presses) -> set[str]:
    """Names of the effects that presses of this kind cannot show: points have no time, one axis has nothing
    sideways, one place has no other place, and what never leaves the object has no free air."""
    hidden: set[Scope] = set()
    if presses.quasi_static:
        hidden |= {Scope.TIME, Scope.READING}
    if presses.sites < LEAST_SITES:
        hidden |= {Scope.PLACES}
    names = {e.name for e in effects() if e.scope in hidden}
    if not presses.local_force[:, 1:].any():
        # a machine of one axis: nothing sideways, and no axis beside another
        names |= {e.name for e in effects() if e.hints.slips or e.hints.common_factor > 0}
    return names - {e.name for e in effects() if e.role is Role.KNOWN}
