"""The ghost tip: where the suggested press begins, and how deep it goes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyvista

from palpate.window.picture import arrow_matrix


@dataclass(frozen=True)
class Ghost:
    """Where the tip is to go: centre (3,) m at first touch, into (3,) unit, how deep, m."""

    centre: np.ndarray
    into: np.ndarray
    depth_m: float


COLOUR = "#1a9850"
STAFF_M = 0.03
"""Of the staff along which the tip comes."""


class GhostTip:
    """On a plotter's first picture; `show` moves it."""

    def __init__(self, plotter: pyvista.Plotter, tip_radius_m: float) -> None:
        plotter.subplot(0, 0)
        ball = pyvista.Sphere(radius=tip_radius_m, theta_resolution=20, phi_resolution=20)
        self._tips = [plotter.add_mesh(ball.copy(), color=COLOUR, opacity=o) for o in (0.55, 0.25)]
        staff = pyvista.Arrow(start=(-1, 0, 0), tip_length=0.25, tip_radius=0.09, shaft_radius=0.03)
        self._staff = plotter.add_mesh(staff, color=COLOUR, opacity=0.7)
        self._radius = tip_radius_m
        self.show(None)

    def show(self, ghost: Ghost | None) -> None:
        """There, or nowhere."""
        for actor in (*self._tips, self._staff):
            actor.SetVisibility(ghost is not None)
        if ghost is None:
            return
        self._tips[0].SetPosition(*ghost.centre)
        self._tips[1].SetPosition(*(ghost.centre + ghost.depth_m * ghost.into))
        start = ghost.centre - self._radius * ghost.into
        self._staff.SetUserMatrix(arrow_matrix(start, ghost.into, STAFF_M))
