"""What a guided exploration knows so far, drawn on the scene: which part of the foot was gone round, which is
missing, and where the object was pressed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista

from palpate.show.colours import COLOURS
from palpate.window.guide import Guide

WIDE_PX = 7.0
"""Of a point of the foot or a place."""
MISSING, TRACED = "touch", "next-touch"
"""Things of the table of colours, for what of the foot is missing, and what is not."""


class KnownSoFar:
    """On a plotter's first picture; `show` brings it up to date, and draws nothing without a guide."""

    def __init__(self, plotter: pyvista.Plotter) -> None:
        self._plotter = plotter
        self._drawn: dict[str, pyvista.Actor] = {}
        self.shown: dict[str, int] = {}

    def show(self, guide: Guide) -> None:
        """The foot in two colours while it is traced, and a dot a press."""
        points, seen = guide.foot
        tracing = guide.suggestion.kind in ("trace", "retrace")
        self._draw("missing", points[~seen & tracing], COLOURS[MISSING])
        self._draw("traced", points[seen | (not tracing)], COLOURS[TRACED])
        self._draw("pressed", guide.touched, COLOURS["press"])

    def _draw(self, name: str, points: np.ndarray, colour: str) -> None:
        if self.shown.get(name, 0) == len(points):
            return
        self.shown[name] = len(points)
        self._plotter.subplot(0, 0)
        if (old := self._drawn.pop(name, None)) is not None:
            self._plotter.remove_actor(old, render=False)
        if len(points):
            cloud = pyvista.PolyData(np.array(points, dtype=float))
            look: dict[str, Any] = {"render_points_as_spheres": True, "point_size": WIDE_PX}
            self._drawn[name] = self._plotter.add_mesh(cloud, color=colour, lighting=False, **look)
