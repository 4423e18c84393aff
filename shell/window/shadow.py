"""Soft shadows that cost nothing while a person touches: the floor's is worked out once, the tip's is a
disc."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import ConvexHull, QhullError, cKDTree

from palpate.mechanics.frames import tangents
from palpate.show.colours import COLOURS

FLOOR_COLOUR = np.array(pyvista.Color(COLOURS["support"]).int_rgb, dtype=float)
DARKEST, UNDER = 0.5, 0.97
_DIRECTIONS, _OUTERMOST, _ANGLES, _NEAR_RINGS, _FAR_RINGS, _SMOOTH = 96, 300, 72, 28, 12, 2.0


def floor(middle: np.ndarray, up: np.ndarray, radius_m: float, points: np.ndarray) -> pyvista.PolyData:
    """A disc of the support about `middle` (3,) m, seen from above; point data "shade": RGB, darker where an
    object of these points (n, 3) m takes the sky away."""
    across, along = tangents(up)
    foot = float(np.linalg.norm((points - middle) @ np.column_stack([across, along]), axis=1).max())
    # close rings where the foot's shadow falls, ever wider ones outside
    near = 1.6 * foot
    far = np.geomspace(near, max(radius_m, 1.1 * near), _FAR_RINGS)[1:]
    rings = np.concatenate([np.linspace(0.0, near, _NEAR_RINGS), far])
    disc = _disc(middle, across, along, rings)
    taken = occlusion(disc.points, points, up)
    open_ = np.flatnonzero(taken < UNDER)
    # as dark under the object as beside it: a triangle that lies half under it would show as a tooth
    beside = open_[cKDTree(disc.points[open_]).query(disc.points)[1]]
    # the directions are few: along each ring, the clouds that they leave are smoothed
    even = gaussian_filter1d(taken[beside].reshape(-1, _ANGLES), _SMOOTH, axis=1, mode="wrap").ravel()
    shade = 1.0 - DARKEST * even[beside]
    disc.point_data["shade"] = (shade[:, None] * FLOOR_COLOUR).astype(np.uint8)
    return disc


def occlusion(places: np.ndarray, points: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(k,) share of an even sky's light that an object (n, 3) takes from places (k, 3) of a plane below it.

    The object is taken for the hull of its points that lie outermost in some direction; those of the sky are
    spread by the cosine law.
    """
    across, along = tangents(up)
    share, turn = _spread(_OUTERMOST)
    z = 1 - 2 * share
    every = np.stack([z, np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn)])
    hull = points[np.unique((every.T @ points.T).argmax(axis=1))]
    share, turn = _spread(_DIRECTIONS)
    flat = np.sqrt(share)
    steep = np.sqrt(1 - flat**2)
    height = (hull - places[0]) @ up
    found = np.zeros(len(places))
    seen, flat_hull = ((each - places[0]) @ np.column_stack([across, along]) for each in (places, hull))
    for slope, angle in zip(flat / steep, turn, strict=True):
        # where the sun's ray through each corner meets the plane
        cast = flat_hull - height[:, None] * slope * np.array([np.cos(angle), np.sin(angle)])
        try:
            found += _within(seen, cast[ConvexHull(cast).vertices])
        except QhullError:
            continue
    return found / _DIRECTIONS


def _spread(count: int) -> tuple[np.ndarray, np.ndarray]:
    """(count,) shares of an axis, turns about it by the golden angle, rad: even on a sphere or disc."""
    k = np.arange(count) + 0.5
    return k / count, np.pi * (1 + np.sqrt(5)) * k


def _within(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(k,) bool, places (k, 2) inside of a convex polygon of corners (c, 2), counterclockwise."""
    middle = corners.mean(axis=0)
    angle, turned = (np.arctan2(*(each - middle).T[::-1]) for each in (places, corners))
    first = int(turned.argmin())
    corners, turned = np.roll(corners, -first, axis=0), np.roll(turned, -first)
    end = np.searchsorted(turned, angle) % len(corners)
    start, side = corners[end - 1], corners[end] - corners[end - 1]
    return side[:, 0] * (places - start)[:, 1] >= side[:, 1] * (places - start)[:, 0]


def blot(radius_m: float) -> pyvista.PolyData:
    """A disc in the plane z = 0 that fades outwards; point data "shade": RGBA."""
    rings = np.linspace(0.0, radius_m, 8)
    disc = _disc(np.zeros(3), np.eye(3)[0], np.eye(3)[1], rings)
    fade = (1.0 - np.linalg.norm(disc.points, axis=1) / radius_m).clip(0.0, 1.0) ** 0.7
    disc.point_data["shade"] = np.column_stack([np.zeros((len(fade), 3)), 150 * fade]).astype(np.uint8)
    return disc


def _disc(middle: np.ndarray, across: np.ndarray, along: np.ndarray, rings: np.ndarray) -> pyvista.PolyData:
    angle = np.linspace(0.0, 2 * np.pi, _ANGLES, endpoint=False)
    level = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * along
    points = middle + rings[:, None, None] * level
    i, j = np.arange(_ANGLES), (np.arange(_ANGLES) + 1) % _ANGLES
    faces = []
    for ring in range(len(rings) - 1):
        a, b = ring * _ANGLES, (ring + 1) * _ANGLES
        faces += [np.column_stack([a + i, b + i, b + j]), np.column_stack([a + i, b + j, a + j])]
    triangles: Any = np.vstack(faces)
    return pyvista.PolyData.from_regular_faces(points.reshape(-1, 3), triangles)
