"""Presses of a tip that slides as it goes in, kept for what they tell: how the flat thing under it pushes
back along its normal.

A finite-element tip sticks where it touches; one that slides over a slab would be dragged sideways by what
only friction resists. So each such press becomes a straight one, down the surface's normal at the place of
its peak, with the normal part of its force; its first touch is found anew along that normal.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.steps.s3_contacts.contact_law import Loading, first_touches

_ALONG, _RADII = 0.2, 0.05
"""A press slides where, up to its peak, the tip goes along the surface by more than the first share of what
it goes in, and by more than the second of its radius. A tip that is taken to stick errs by 2 % below that."""
_ROWS, _LEAST = 250, 4
FLAT = ("slab", "half-space")
"""Kinds of geometry whose top is flat."""


def slid_in(presses: Presses) -> np.ndarray:
    """(p,) bool: presses whose tip goes along the surface as it goes in."""
    found = np.zeros(len(presses), dtype=bool)
    for i in range(len(presses)):
        rows = _loading_rows(presses, i)
        way = presses.position[rows]
        if len(way) < _LEAST:
            continue
        moved = way[-1] - way[0]
        deep = -float(moved @ presses.normal[i])
        aside = float(np.linalg.norm(moved + deep * presses.normal[i]))
        found[i] = deep > 0 and aside > max(_ALONG * abs(deep), _RADII * presses.tip_radius_m)
    return found


def laid(presses: Presses, points: np.ndarray, normals: np.ndarray, kind: str) -> Presses:
    """The presses on a surface: at its points (p, 3) m, along its outward normals (p, 3); over a flat one
    those that slide are made straight. kind: of the geometry, as a known one says it ('' for others)."""
    placed = presses.on_surface(points, normals)
    return straightened(placed) if kind in FLAT else placed


def straightened(presses: Presses) -> Presses:
    """The presses, which lie on a flat surface, those that slide made straight."""
    slid = np.flatnonzero(slid_in(presses)).tolist()
    if not slid:
        return presses
    rows = [_loading_rows(presses, i) for i in slid]
    loadings = [_loading(presses, i, own) for i, own in zip(slid, rows, strict=True)]
    noise = presses.noise.raw_n / np.sqrt(max(1, np.median([len(own) for own in rows]) // _ROWS))
    try:
        shift, error = first_touches(loadings, float(noise))
    except ValueError:  # too few rows to tell any first touch
        return presses
    arrays: dict[str, Any] = {name: np.array(getattr(presses, name)) for name in (*_OF_ROWS, *_OF_PRESSES)}
    for i, each, at, sd in zip(slid, loadings, shift, error, strict=True):
        if at >= 0:
            continue
        n, part = presses.normal[i], presses.parts[i]
        along = (arrays["position"][part] - each.origin) @ n
        arrays["position"][part] = each.origin + along[:, None] * n
        for name in ("force", "free_air"):
            arrays[name][part] = (arrays[name][part] @ n)[:, None] * n
        moved = each.origin - presses.centre[i]
        arrays["point"][i] += moved - (moved @ n) * n
        arrays["centre"][i], arrays["contact_normal"][i] = each.origin - at * n, n
        arrays["depth_m"][i], arrays["onset_error_m"][i] = -at, sd
    return dataclasses.replace(presses, **arrays)


_OF_ROWS = ("position", "force", "free_air")
_OF_PRESSES = ("centre", "point", "contact_normal", "depth_m", "onset_error_m")


def _loading(presses: Presses, i: int, rows: np.ndarray) -> Loading:
    """The way in along the surface's normal; its origin is the peak."""
    n, peak = presses.normal[i], presses.position[rows[-1]]
    block = max(1, len(rows) // _ROWS)
    count = len(rows) // block
    u, push = (
        (values[rows] @ n)[-count * block :].reshape(count, block).mean(axis=1)
        for values in (peak - presses.position, presses.force - presses.free_air)
    )
    return Loading(u, push, peak, n)


def _loading_rows(presses: Presses, i: int) -> np.ndarray:
    """Rows of a press from first touch to its peak."""
    part = presses.parts[i]
    t = presses.t[part]
    inside = (t >= presses.onset_s[i]) & (t <= presses.peak_s[i])
    return part.start + np.flatnonzero(inside)
