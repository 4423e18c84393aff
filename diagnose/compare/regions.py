"""Regions of an object that a comparison holds out as wholes: what lies beyond the presses that were seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechanics.model.model import Model

LEAST_HELD, LEAST_SEEN = 2, 4  # presses; smaller regions say nothing


@dataclass(frozen=True)
class Region:
    """name: as in the report. words: what it is. members: (p,) bool, the presses inside."""

    name: str
    words: str
    members: np.ndarray


def regions(model: Model, points: np.ndarray, normals: np.ndarray) -> list[Region]:
    """The regions of an object that hold enough presses; points, normals: (p, 3) of the presses.

    top: faces up (within 40 degrees of the support's normal). top-centre: its inner part, so that the data
    left lie towards the rim. base-band: the side's lowest 35 %. corners: where the outline reaches out by
    more than 10 % beyond the largest circle in it.
    """
    up = model.support.normal
    nodes = model.mesh.points[np.unique(model.mesh.surface[:, :3])]
    height = model.support.height(nodes)
    middle = nodes.mean(axis=0)

    def across(x: np.ndarray) -> np.ndarray:
        offset = x - middle
        return offset - (offset @ up)[:, None] * up

    h = model.support.height(points) / height.max()
    out = np.linalg.norm(across(points), axis=1)
    inscribed = _inscribed_radius(across(nodes), up)
    faces_up = normals @ up > np.cos(np.radians(40))
    top = np.flatnonzero(faces_up)
    centre = np.zeros(len(points), dtype=bool)
    if len(top):
        centre[top] = out[top] < min(0.55 * inscribed, np.quantile(out[top], 0.5) + 1e-6)
    found = [
        Region("top-centre", "the inner part of the top; seen: the rest, towards the rim", centre),
        Region("top", "the whole top; seen: the side", faces_up),
        Region("base-band", "the lowest 35 % of the side; seen: what is above", ~faces_up & (h < 0.35)),
        Region(
            "corners", "beyond the largest circle in the outline; seen: what is inside", out > 1.1 * inscribed
        ),
    ]
    return [r for r in found if r.members.sum() >= LEAST_HELD and (~r.members).sum() >= LEAST_SEEN]


def _inscribed_radius(flat: np.ndarray, up: np.ndarray) -> float:
    """Distance of the outline from the middle where it is nearest, m."""
    from scipy.spatial import ConvexHull

    u = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    u /= np.linalg.norm(u)
    plane = np.column_stack([flat @ u, flat @ np.cross(up, u)])
    return float(-ConvexHull(plane).equations[:, 2].max())
