"""A free-air force that changes fast: found where the tip only passes, and followed through the touches.

A tool whose weight turns with it unseen (no orientation in the recording) reads in free air what no law of
time or acceleration tells, as loud as a press. But an object is pressed where the tip turns back, and the
support lies where no tip gets below: wherever the tip only passes, it is in the air. What the force reads
before and after a touch is what it would have read in between.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import solveh_banded
from scipy.ndimage import binary_dilation, gaussian_filter1d, uniform_filter1d
from scipy.spatial import ConvexHull, QhullError

_REACH = 2.5
"""Tip radii: a press is shallower, and the hand lifts higher between most."""
_BACK = 0.5
"""Cosine between the ways there and away: a corner is less, a press with a drag more."""
_STEP = 0.1
"""Tip radii between the points that stand for the way."""
_SEEN_S = 0.004
_FARTHEST = 600
"""Points: a tip that has not come away by then may be pressing all the while."""
_FLAT = 0.1
"""Tip radii off the support while the base is traced."""
_SLIDE = 8.0
"""Tip radii that are traced at least."""
_FACETS = 40
_ENOUGH = 4000
"""Points of the way that tell the support."""
_MARGIN_S = 0.1
"""A force may read so late."""
_BLOCK_S = 0.02
_LAG_S = 0.1
"""Changes over so long tell how fast the force walks."""
_SLOW_S = 0.15
"""A mass that is moved makes what changes faster."""
_LEAST_S = 4.0
"""Of such air, at least."""
_CLEAR_S = 0.03
_ROUNDS = 3
_TOUCH_S = 0.3
"""Touches last so long, about."""
_MAXWELL = 1.538
"""Median length of a 3-vector of unit variance an axis."""


def passing(
    t: np.ndarray,
    position: np.ndarray,
    force: np.ndarray,
    tip_radius_m: float,
    sliding: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) bool: where the tip only passes, so that it is in the air; and where it is on the support.

    position (n, 3) m and force (n, 3) N low-passed. sliding: (n,) bool, where the base is traced for certain.
    """
    rate = (len(t) - 1) / (t[-1] - t[0])
    knots = _knots(position, _STEP * tip_radius_m, max(1, round(_SEEN_S * rate)))
    way = position[knots]
    turns = _turns_back(way, _REACH * tip_radius_m)
    at = np.clip(np.searchsorted(knots, np.arange(len(t)), side="right") - 1, 0, len(knots) - 1)
    near = turns[at] | turns[np.minimum(at + 1, len(knots) - 1)]
    on = _on_support(position, force, knots, tip_radius_m) | sliding
    margin = np.ones(2 * max(1, round(_MARGIN_S * rate)) + 1, dtype=bool)
    return ~binary_dilation(near | on, margin), on


def _knots(position: np.ndarray, step_m: float, every: int) -> np.ndarray:
    """Indices of samples a step apart; a step is taken only once the tip has moved so far."""
    kept, last = [0], position[0]
    for i, here in zip(range(0, len(position), every), position[::every], strict=True):
        gone = here - last
        if gone @ gone >= step_m**2:
            kept.append(i)
            last = here
    return np.array(kept)


def _turns_back(way: np.ndarray, reach_m: float) -> np.ndarray:
    """(k,) bool: points (k, 3) of a way which it reaches from the side to which it leaves, `reach_m` off."""
    before, after = _away(way[::-1], reach_m)[::-1], _away(way, reach_m)
    back = np.einsum("ij,ij->i", before, after)
    # where the way begins, ends or stays near it may turn back
    return ~(before.any(axis=1) & after.any(axis=1)) | (back >= _BACK * reach_m**2)


def _away(way: np.ndarray, reach_m: float) -> np.ndarray:
    """(k, 3) m: from each point to the first later one that is so far away; zero where none is."""
    out = np.zeros(way.shape)
    left = np.arange(len(way))
    for lag in range(1, min(_FARTHEST, len(way))):
        left = left[left + lag < len(way)]
        if not len(left):
            break
        gone = way[left + lag] - way[left]
        far = (gone**2).sum(axis=1) > reach_m**2
        out[left[far]] = gone[far]
        left = left[~far]
    return out


def _on_support(position: np.ndarray, force: np.ndarray, knots: np.ndarray, radius_m: float) -> np.ndarray:
    """(n,) bool: where the tip slides on the support: the plane that bounds its way and pushes back.

    Of the planes that the way's hull touches, the one with most of the way on it, a push inwards counted.
    """
    position = position - position.mean(axis=0)  # the planes are rounded
    thin = 1 + len(knots) // _ENOUGH
    way, read = position[knots][::thin], force[knots][::thin]
    nowhere = np.zeros(len(position), dtype=bool)
    try:
        hull = ConvexHull(way)
    except QhullError:
        return nowhere
    planes = np.unique(np.round(hull.equations, 4), axis=0)
    height = -(way @ planes[:, :3].T + planes[:, 3])  # inwards
    on = height < _FLAT * radius_m
    best, found = 0.0, None
    for k in np.argsort(-on.sum(axis=0))[:_FACETS]:
        inside = on[:, k]
        if inside.sum() * thin * _STEP < _SLIDE or inside.all():
            continue
        near = ~inside & (height[:, k] < 4 * radius_m)
        if near.sum() < 5:
            near = ~inside
        push = -float(np.median(read[inside] @ planes[k, :3]) - np.median(read[near] @ planes[k, :3]))
        if push * inside.sum() > best:
            best, found = push * inside.sum(), planes[k]
    if found is None:
        return nowhere
    return -(position @ found[:3] + found[3]) < _FLAT * radius_m


def slow_part(t: np.ndarray, raw: np.ndarray, air: np.ndarray) -> np.ndarray | None:
    """(n, 3) N: what of the force raw (n, 3) changes more slowly in `air` (n,) bool than a mass that is
    moved; None where there is too little air."""
    rate = (len(t) - 1) / (t[-1] - t[0])
    if air.sum() < _LEAST_S * rate:
        return None
    return gaussian_filter1d(_followed(t, raw, air)[0], _SLOW_S * rate, axis=0)


def follow_free_air(
    t: np.ndarray, raw: np.ndarray, air: np.ndarray, touching: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) N: the force of free air, found where the tip passes, `air` (n,) bool; and (n,) N an axis, how
    far it may have gone another way where it is not seen.

    raw: (n, 3) N as read. touching: (n,) bool of both, where something is touched despite them: the rest is
    air as well.
    """
    margin = np.ones(2 * max(1, round(_CLEAR_S * (len(t) - 1) / (t[-1] - t[0]))) + 1, dtype=bool)
    found = _followed(t, raw, air)
    for _ in range(_ROUNDS):
        found = _followed(t, raw, air | ~binary_dilation(touching(*found), margin))
    return found


def crowd_median(size: np.ndarray) -> float:
    """Standard deviation an axis of 3-vectors, from the median of their lengths (n,)."""
    return float(np.median(size)) / _MAXWELL


def interpolation_error(t: np.ndarray, force: np.ndarray, air: np.ndarray) -> float:
    """N an axis: what a line from before a touch to after it misses of the force (n, 3) in between, by what
    it misses in `air` (n,) bool; infinite where there is too little air."""
    half = max(1, round(0.5 * _TOUCH_S * (len(t) - 1) / (t[-1] - t[0])))
    inside = np.flatnonzero(uniform_filter1d(air.astype(float), 2 * half + 1) > 1 - 0.5 / (2 * half + 1))
    inside = inside[(inside >= half) & (inside < len(t) - half)]
    if len(inside) < 10 * half:
        return np.inf
    off = force[inside] - 0.5 * (force[inside - half] + force[inside + half])
    return crowd_median(np.linalg.norm(off, axis=1))


def _followed(t: np.ndarray, force: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) N: the force followed through the free samples, straight from one to the next across touches;
    and (n,) N an axis, its standard deviation there, a Brownian bridge's.

    A random walk of blocks, smoothed; how fast it walks is read off the force's own changes nearby, beyond
    noise.
    """
    lasts = max(_BLOCK_S, 2 * float(t[-1] - t[0]) / (len(t) - 1))
    block = ((t - t[0]) / lasts).astype(int)
    count = np.bincount(block, weights=free, minlength=block[-1] + 1)
    used = np.flatnonzero(count > 0)
    total = np.column_stack([np.bincount(block, weights=free * force[:, k])[used] for k in range(3)])
    level = total / count[used][:, None]
    centre = t[0] + (used + 0.5) * lasts
    lag = max(2, round(_LAG_S / lasts))
    noise, walk = _walk(used, level, lag)
    gap = np.diff(centre)
    rate = 0.5 * (walk[1:] + walk[:-1]) / lasts
    stiff = noise / np.maximum(rate * gap, 1e-6 * noise)
    weight = np.minimum(count[used] / np.median(count[used]), 1.0)
    bands = np.zeros((2, len(used)))
    bands[1] = weight
    bands[1, 1:] += stiff
    bands[1, :-1] += stiff
    bands[0, 1:] = -stiff
    smooth = solveh_banded(bands, weight[:, None] * level)
    left = np.clip(np.searchsorted(centre, t, side="right") - 1, 0, len(centre) - 2)
    apart = np.maximum(gap[left] - lasts, 0.0)  # neighbours are not apart
    into = np.clip(t - centre[left] - 0.5 * lasts, 0.0, apart)
    loose = np.sqrt(rate[left] * into * (apart - into) / np.maximum(apart, lasts))
    return np.column_stack([np.interp(t, centre, smooth[:, k]) for k in range(3)]), loose


def _walk(used: np.ndarray, level: np.ndarray, lag: int) -> tuple[float, np.ndarray]:
    """(noise variance of a block, variance (k,) by which the level walks from block to block), N^2."""

    def changes(step: int) -> tuple[np.ndarray, np.ndarray]:
        first = np.flatnonzero(used[step:] - used[:-step] == step)
        return first, ((level[first + step] - level[first]) ** 2).mean(axis=1)

    _, one = changes(1)
    if not len(one):  # no two blocks are neighbours
        one = (np.diff(level, axis=0, append=level[-1:]) ** 2).mean(axis=1)
    noise = max(0.5 * float(np.median(one)) / 0.79, 1e-12)
    first, far = changes(lag)
    if len(first) < lag:
        return noise, np.full(len(used), 1e-3 * noise)
    walked = np.full(len(used), np.nan)
    walked[first + lag // 2] = far
    known = np.flatnonzero(np.isfinite(walked))
    whole = np.interp(np.arange(len(used)), known, walked[known])
    near = uniform_filter1d(whole, lag)
    return noise, np.maximum(near - 2 * noise, 1e-3 * noise) / lag
