"""The floor around an object: darkest where it stands, without a line."""

from __future__ import annotations

import numpy as np

from palpate.window.shadow import floor


def test_the_floor_under_an_object_is_no_darker_than_beside_it():
    """Triangles of the floor that lie half under a block showed as teeth along its foot."""
    corners = np.array([[x, y, z] for x in (-0.04, 0.04) for y in (-0.03, 0.03) for z in (0.0, 0.04)])
    disc = floor(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.3, corners)
    shade = np.asarray(disc.point_data["shade"]).mean(axis=1)
    places = np.abs(disc.points)
    under = (places[:, 0] < 0.039) & (places[:, 1] < 0.029)
    beside = (places[:, 0] > 0.0401) | (places[:, 1] > 0.0301)
    far = np.linalg.norm(disc.points, axis=1) > 0.25
    assert under.sum() > 100 and shade[under].min() >= shade[beside].min()
    assert shade[beside].min() < 0.85 * shade[far].min()


def test_the_shade_around_a_round_foot_is_even():
    """Light from few directions left clouds on the floor."""
    turn = np.linspace(0.0, 2 * np.pi, 90, endpoint=False)
    ring = 0.04 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(90)])
    disc = floor(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.3, np.vstack([ring, ring + [0, 0, 0.08]]))
    shade = np.asarray(disc.point_data["shade"], dtype=float).mean(axis=1)
    far = np.linalg.norm(disc.points, axis=1).round(6)
    rings = [shade[far == r] for r in np.unique(far) if 0.045 < r < 0.15]
    assert len(rings) > 5 and max(np.abs(np.diff(each)).max() for each in rings) < 2.5
