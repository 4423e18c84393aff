"""Contact that never breaks: whether there is free air at all, and where a contact is cut into cycles.

A cycle is cut at the minima of force and depth. Its first touch was not recorded: it is carried back along
the contact law, whose stiffness all cycles share (`contact_law.first_touches`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from palpate.reconstruction.steps.s1_filter.signals import Signals
from palpate.reconstruction.steps.s3_contacts.contact_law import Loading, first_touches
from palpate.reconstruction.steps.s3_contacts.single_press import FoundPress, initial_normal

_STEP_RADII = 1 / 8
"""Of the tip: a way straight in or out so long without a change of the force is free air."""
_AIR_WAYS = 2
_FLAT = 6.0
"""Standard deviations (an axis) that the force may range over such a way."""
_FALLS = 0.2
"""A cycle ends where the force falls by this share of its peak, and the tip withdraws by this share of the
way of its loading."""
_SIDEWAYS = 1.5
"""A cycle begins and ends where the tip goes so many times as far along the surface as in or out ..."""
_RISES = 0.5
"""... and slides where its force does not rise by this share of its peak in between."""
_ROWS = 250
_LEAST_PEAKS, _PLANE, _GOES_WITH = 6, 3.0, 0.9
"""Peaks that tell a plane, and by how much they must be spread along it more than off it; how closely a
slide's force must follow its depth (correlation) to be a press."""


def free_air_seen(position: np.ndarray, force: np.ndarray, radius_m: float, noise_n: float) -> bool:
    """Whether the tip is ever off the object: it goes straight in or out and the force stays.

    position (n, 3) m and force (n, 3) N low-passed; noise_n of such a force, N an axis. A way along the
    surface tells nothing: sliding at one depth changes no force either.
    """
    centred = force - force.mean(axis=0)
    along = np.linalg.svd(centred[:: max(1, len(centred) // 5000)], full_matrices=False)[2][0]
    step = _STEP_RADII * radius_m
    deep = position @ along
    aside = position - deep[:, None] * along
    flat = 0
    for a, b in _ways(deep, step):
        way = abs(deep[b] - deep[a])
        straight = way > 0.9 * step and np.linalg.norm(aside[b] - aside[a]) < way
        flat += bool(straight and np.ptp(force[a : b + 1], axis=0).max() < _FLAT * noise_n)
    return flat >= _AIR_WAYS


def _ways(x: np.ndarray, step: float) -> list[tuple[int, int]]:
    """Consecutive pieces [a, b] over which x (n,) changes by a step."""
    cells = np.floor(x / step).astype(int)
    turns = np.flatnonzero(np.diff(cells)) + 1
    return list(zip(turns[:-1].tolist(), turns[1:].tolist(), strict=True))


@dataclass(frozen=True)
class Piece:
    """Samples [start, end) of a contact and its peak."""

    start: int
    peak: int
    end: int


def cycles(signals: Signals, a: int, b: int, least_n: float) -> list[Piece]:
    """The contact [a, b) cut at its minima of force, where the tip withdraws as well.

    least_n: N, a peak stands at least so far above the minima beside it.
    """
    size = signals.magnitude[a:b]
    peaks, about = find_peaks(np.concatenate([[0.0], size, [0.0]]), prominence=least_n)
    if not len(peaks):
        return [Piece(a, a + int(size.argmax()), b)]
    peaks = np.minimum(peaks - 1, len(size) - 1)
    peaks = peaks[about["prominences"] > _FALLS * size[peaks]]
    cuts, kept = [0], list(peaks[:1])
    for peak in peaks[1:]:
        low = kept[-1] + int(size[kept[-1] : peak].argmin())
        if _withdrawn(signals, a + cuts[-1], a + kept[-1], a + low, a + int(peak)):
            cuts.append(low)
            kept.append(peak)
        elif size[peak] > size[kept[-1]]:
            kept[-1] = peak
    ends = [*cuts[1:], len(size)]
    return [
        Piece(a + s, a + int(p), a + e) for s, p, e in zip(cuts, kept or [size.argmax()], ends, strict=True)
    ]


def _withdrawn(signals: Signals, start: int, peak: int, low: int, after: int) -> bool:
    """Whether the tip went out by then and in again, along the force of the peaks: a force that only relaxes
    or slips does not."""
    push = signals.force[peak] + signals.force[after]
    deep = -signals.position @ (push / max(float(np.linalg.norm(push)), 1e-300))
    way = min(deep[peak], deep[after]) - deep[low]
    return bool(way > _FALLS * max(deep[peak] - min(deep[start], deep[low]), 1e-9))


def loading(signals: Signals, piece: Piece, normal: np.ndarray | None = None) -> Loading | None:
    """The loading of a piece, along its own force or a normal that is known; None where the force has no
    direction or hardly grows."""
    if normal is None:
        normal = initial_normal(signals, piece.start, piece.peak)
    if normal is None or piece.peak - piece.start < 3:
        return None
    rows = slice(piece.start, piece.peak + 1)
    u = -(signals.position[rows] - signals.position[piece.start]) @ normal
    push = signals.raw_force[rows] @ normal
    block = max(1, len(u) // _ROWS)
    count = len(u) // block
    u, push = (v[-count * block :].reshape(count, block).mean(axis=1) for v in (u, push))
    return Loading(u, push, signals.position[piece.start], normal)


def in_place(signals: Signals, piece: Piece) -> Piece | None:
    """The piece as long as the tip goes in and out rather than along; None where it slides into its peak."""
    start = _goes_in(signals, piece, -1)
    end = _goes_in(signals, piece, 1)
    if signals.magnitude[start : piece.peak + 1].min() > (1 - _RISES) * signals.magnitude[piece.peak]:
        return None
    return dataclasses.replace(piece, start=start, end=end)


def _plane_of_peaks(signals: Signals, pieces: Sequence[Piece]) -> np.ndarray | None:
    """Outward normal of the plane that the tip is in at the peaks, by which a slide's way in is told whatever
    its friction; None where the peaks lie on a line or are none."""
    if len(pieces) < _LEAST_PEAKS:
        return None
    at = signals.position[[piece.peak for piece in pieces]]
    _, spread, axes = np.linalg.svd(at - at.mean(axis=0), full_matrices=False)
    if spread[1] < _PLANE * spread[2]:
        return None
    push = signals.force[[piece.peak for piece in pieces]].sum(axis=0)
    return axes[2] if push @ axes[2] > 0 else -axes[2]


def _sliding_in(signals: Signals, piece: Piece, up: np.ndarray) -> tuple[Piece | None, Loading | None]:
    """A piece whose tip slides while it goes in: kept where its force rises with its depth along `up`."""
    push = signals.force[piece.start : piece.peak + 1] @ up
    deep = -signals.position[piece.start : piece.peak + 1] @ up
    if len(push) < 4 or not push[-1] > 0 or push.min() > (1 - _RISES) * push[-1]:
        return None, None
    first = int(push.argmin())
    push, deep = push[first:], deep[first:]
    if len(push) < 4 or np.ptp(deep) == 0 or np.corrcoef(push, deep)[0, 1] < _GOES_WITH:
        return None, None
    begun = dataclasses.replace(piece, start=piece.start + first)
    return begun, loading(signals, begun, up)


def _goes_in(signals: Signals, piece: Piece, way: int) -> int:
    """How far from its peak, backwards (-1) or forwards (1), a piece goes in or out: the sample to cut at."""
    normal = signals.force[piece.peak] / signals.magnitude[piece.peak]
    step = 0.5 * _STEP_RADII * signals.recording.tip_radius_m
    last = piece.start if way < 0 else piece.end - 1
    anchor = piece.peak
    for i in range(piece.peak, last + way, way):
        moved = signals.position[i] - signals.position[anchor]
        if moved @ moved < step**2:
            continue
        deep = abs(float(moved @ normal))
        if moved @ moved > (1 + _SIDEWAYS**2) * deep**2:
            return anchor if way < 0 else anchor + 1
        anchor = i
    return piece.start if way < 0 else piece.end


def found_cycles(
    signals: Signals, pieces: Sequence[Piece]
) -> tuple[list[FoundPress], list[tuple[int, int, str]]]:
    """The cycles of one recording as presses, and the pieces that are none: (start, end, reason)."""
    kept, loadings, unused = [], [], []
    up = _plane_of_peaks(signals, pieces)
    for piece in pieces:
        steady = in_place(signals, piece)
        each = None if steady is None else loading(signals, steady)
        if steady is None and up is not None:
            steady, each = _sliding_in(signals, piece, up)
        if steady is None or each is None:
            why = "slides into its peak" if steady is None else "shows no rise of force with depth"
            unused.append((piece.start, piece.end, why))
        else:
            kept.append(steady)
            loadings.append(each)
    if not kept:
        return [], unused
    noise = signals.noise_n / np.sqrt(max(1, np.median([p.peak - p.start for p in kept]) // _ROWS))
    try:
        shift, error = first_touches(loadings, float(noise))
    except ValueError:
        return [], [*unused, *((p.start, p.end, "has too few samples") for p in kept)]
    found = []
    for piece, each, at, sd in zip(kept, loadings, shift, error, strict=True):
        # straight over the peak: the tip may come from beside
        peak = signals.position[piece.peak]
        deep = -(peak - each.origin) @ each.normal - at
        centre = peak + deep * each.normal
        found.append(FoundPress(piece.start, piece.peak, piece.end, centre, each.normal, float(sd), True))
    return found, unused
