"""The local dent under a tip as it is drawn (not felt): the smooth field plus what clears the tip's
sphere."""

from __future__ import annotations

import numpy as np


def draw_dent(
    vertices: np.ndarray,
    moved: np.ndarray,
    point: np.ndarray,
    normal: np.ndarray,
    radius: float,
    depth: float,
) -> None:
    """Add to `moved` (v, 3) m what it lacks of `depth` under a tip held at `point`, and clear the sphere."""
    offset = vertices - point
    near = np.flatnonzero(np.einsum("ij,ij->i", offset, offset) < (4 * radius) ** 2)
    squared = np.einsum("ij,ij->i", offset[near], offset[near])
    lacks = depth + float(moved[near[squared.argmin()]] @ normal) if len(near) else 0.0
    moved[near] -= lacks * np.exp(-squared / (2 * radius**2))[:, None] * normal
    centre = point + (radius - depth) * normal
    away = vertices[near] + moved[near] - centre
    height = away @ normal
    flat = np.einsum("ij,ij->i", away, away) - height**2
    inside = flat < radius**2
    floor = -np.sqrt(np.maximum(radius**2 - flat, 0.0))
    push = np.where(inside & (height > floor) & (height < radius), floor - height, 0.0)
    moved[near] += push[:, None] * normal
