"""A prism with a ball taken out of its top: bowls, dished blocks. Not convex."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.reconstruction.shapes.outline import Outline
from palpate.reconstruction.shapes.prism import Prism
from palpate.reconstruction.shapes.shape import ShapeParameter, rings_to_mesh, values_of, with_values


@dataclass(frozen=True)
class Dish:
    """The prism's parameters, then ball_x_m, ball_y_m, ball_z_m (its centre) and ball_radius_m.

    Nobody touches the rim, so its height is known from the highest touch only: its prior stands half a touch
    spacing above, as far as hands keep away from edges.
    """

    prism: Prism
    parameters: tuple[ShapeParameter, ...]
    name: str = "dish"
    complexity: int = 4
    faceted: bool = True

    @classmethod
    def of(cls, outline: Outline, height_m: float, bottom: np.ndarray) -> Dish:
        """A first guess: the rim's height, and the lowest place (3,) touched in the dish."""
        prism = Prism.of(outline, height_m, sloped=False, drafted=False)
        deep = max(height_m - bottom[2], 0.004)
        mouth = 0.75 * float(np.abs(outline.distance(outline.centre[None])[0]))
        radius = (mouth**2 + deep**2) / (2 * deep)
        ball = (
            ShapeParameter("ball_x_m", float(outline.centre[0]), 0.01),
            ShapeParameter("ball_y_m", float(outline.centre[1]), 0.01),
            ShapeParameter("ball_z_m", float(bottom[2] + radius), 0.02),
            ShapeParameter("ball_radius_m", float(radius), 0.02, 0.006, 0.5),
        )
        own = tuple(replace(p, spread=0.004) if p.label == "height_m" else p for p in prism.parameters)
        return cls(prism, (*own, *ball))

    def with_values(self, values: np.ndarray) -> Dish:
        return replace(
            self, prism=self.prism.with_values(values[:-4]), parameters=with_values(self.parameters, values)
        )

    def distance(self, points: np.ndarray) -> np.ndarray:
        *centre, radius = values_of(self)[-4:]
        return np.maximum(self.prism.distance(points), radius - np.linalg.norm(points - centre, axis=1))

    def mesh(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        *centre, radius = values_of(self)[-4:]
        vertices, triangles = self.prism.mesh(spacing_m)
        rim = self.prism.rim(spacing_m)
        height = float(self.prism.height)
        middle = np.array(centre[:2])
        # rays from the ball's axis to the rim: the mouth is where the ball leaves the top's plane
        offset = rim - middle
        reach = np.linalg.norm(offset, axis=1)
        mouth = (
            np.sqrt(max(radius**2 - (centre[2] - height) ** 2, 0.0)) if centre[2] - radius < height else 0.0
        )
        edge = np.minimum(mouth, 0.98 * reach)
        if mouth < 2 * spacing_m or self.prism.outline.distance(middle[None])[0] > -0.005:
            return vertices, triangles
        levels = np.linspace(0, 1, max(3, int(np.ceil(height / spacing_m)) + 1))
        wall = [np.column_stack([rim, np.full(len(rim), height * u)]) for u in levels]
        steps = max(2, int(np.ceil((reach - edge).max() / spacing_m)))
        unit = offset / reach[:, None]
        flat = [
            np.column_stack(
                [middle + (reach + (edge - reach) * u)[:, None] * unit, np.full(len(rim), height)]
            )
            for u in np.linspace(0, 1, steps + 1)[1:]
        ]
        down = []
        for u in np.linspace(1, 0, max(5, int(np.ceil(edge.max() / spacing_m))) + 1)[1:-1]:
            away = u * edge
            z = np.minimum(centre[2] - np.sqrt(np.maximum(radius**2 - away**2, 0)), height)
            down.append(np.column_stack([middle + away[:, None] * unit, z]))
        return rings_to_mesh(np.array([*wall, *flat, *down]), np.array([*middle, centre[2] - radius]))
