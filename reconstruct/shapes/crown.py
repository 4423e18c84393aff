"""Upright walls under a top that curves: arches, saddles, cambered blocks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.reconstruction.shapes.outline import Outline
from palpate.reconstruction.shapes.prism import Prism
from palpate.reconstruction.shapes.shape import ShapeParameter, project, rings_to_mesh, values_of, with_values


@dataclass(frozen=True)
class Crown:
    """The upright prism's parameters, then slope_x, slope_y (1) and bend_xx, bend_xy, bend_yy (1/m) of the
    top: z = height + slope . d + d . bend . d / 2 with d from the outline's centre."""

    prism: Prism
    parameters: tuple[ShapeParameter, ...]
    name: str = "crown"
    complexity: int = 5  # outline, slope, three bends
    faceted: bool = True

    @classmethod
    def of(cls, outline: Outline, height_m: float) -> Crown:
        """A first guess over an outline."""
        prism = Prism.of(outline, height_m, sloped=False, drafted=False)
        slopes = (ShapeParameter("slope_x", 0.0, 0.2, -2, 2), ShapeParameter("slope_y", 0.0, 0.2, -2, 2))
        bends = tuple(ShapeParameter(f"bend_{k}", 0.0, 8.0, -60, 60) for k in ("xx", "xy", "yy"))
        return cls(prism, (*prism.parameters, *slopes, *bends))

    def with_values(self, values: np.ndarray) -> Crown:
        return replace(
            self, prism=self.prism.with_values(values[:-5]), parameters=with_values(self.parameters, values)
        )

    def _top(self, flat: np.ndarray) -> np.ndarray:
        sx, sy, xx, xy, yy = values_of(self)[-5:]
        x, y = (flat - self.prism.outline.centre).T
        return self.prism.height + sx * x + sy * y + 0.5 * (xx * x * x + 2 * xy * x * y + yy * y * y)

    def distance(self, points: np.ndarray) -> np.ndarray:
        wall = self.prism.wall_distance(points)
        top = project(lambda at: at[:, 2] - self._top(at[:, :2]), points, rounds=3)
        return np.hypot(np.maximum(wall, 0), np.maximum(top, 0)) + np.minimum(np.maximum(wall, top), 0)

    def mesh(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        rim, centre = self.prism.rim(spacing_m), self.prism.outline.centre
        edge = np.maximum(self._top(rim), 0.001)
        levels = np.linspace(0, 1, max(3, int(np.ceil(edge.max() / spacing_m)) + 1))
        wall = [np.column_stack([rim, edge * u]) for u in levels]
        inwards = np.linspace(1, 0, max(6, int(np.ceil(np.ptp(rim, axis=0).max() / 2 / spacing_m)) + 1))[1:-1]
        flats = [centre + u * (rim - centre) for u in inwards]
        roof = [np.column_stack([f, np.maximum(self._top(f), 0.001)]) for f in flats]
        return rings_to_mesh(np.array([*wall, *roof]), np.array([*centre, self._top(centre[None])[0]]))
