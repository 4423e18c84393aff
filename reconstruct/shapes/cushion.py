"""An extrusion whose top edge is rounded over a width: walls, a rounding, and a flat top where it is wide
enough."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.reconstruction.shapes.outline import Outline
from palpate.reconstruction.shapes.shape import ShapeParameter, project, rings_to_mesh, values_of, with_values


@dataclass(frozen=True)
class Cushion:
    """Height falls with the distance s inside the outline: ((w - s) / w)^p + ((z - h + d) / d)^p = 1 for s <
    w.

    Parameters: grown_m, height_m h, rounding_width_m w, rounding_share d / h, exponent p.
    """

    outline: Outline
    parameters: tuple[ShapeParameter, ...]
    name: str = "cushion"
    complexity: int = 3
    faceted: bool = False

    @classmethod
    def of(cls, outline: Outline, height_m: float, width_m: float) -> Cushion:
        """A first guess over an outline."""
        widest = float(-outline.distance(outline.centre[None])[0])
        return cls(
            outline,
            (
                ShapeParameter("grown_m", 0.0, 0.002, -0.006, 0.006),
                ShapeParameter("height_m", height_m, 0.02, 0.3 * height_m, 2 * height_m),
                ShapeParameter("rounding_width_m", min(width_m, 0.9 * widest), 0.005, 0.001, 1.5 * widest),
                ShapeParameter("rounding_share", min(0.8, width_m / height_m), 0.2, 0.02, 1.0),
                ShapeParameter("exponent", 2.0, 0.5, 1.0, 6.0),
            ),
        )

    def with_values(self, values: np.ndarray) -> Cushion:
        return replace(self, parameters=with_values(self.parameters, values))

    def distance(self, points: np.ndarray) -> np.ndarray:
        grown, height, width, share, p = values_of(self)
        deep = share * height

        def implicit(at: np.ndarray) -> np.ndarray:
            u = np.maximum(1 + (self.outline.distance(at[:, :2]) - grown) / width, 0)
            v = np.maximum(1 + (at[:, 2] - height) / deep, 0)
            return (u**p + v**p) ** (1 / p) - 1

        return project(implicit, points)

    def mesh(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        grown, height, width, share, p = values_of(self)
        outline, deep = self.outline.grown(grown), share * height
        rim, _ = outline.ring(spacing_m)
        shoulder = height - deep
        z = np.linspace(0, shoulder, max(2, int(np.ceil(shoulder / spacing_m)) + 1))
        wall = np.concatenate(
            [np.broadcast_to(rim, (len(z), *rim.shape)), np.ones((len(z), len(rim), 1))], axis=2
        )
        wall[..., 2] *= z[:, None]
        # towards the centre, dense at the rim where the rounding is steep
        reach = max(10, int(np.ceil(np.ptp(rim, axis=0).max() / 2 / spacing_m)) + 8)
        inwards = 1 - np.linspace(0, 1, reach + 1)[1:-1] ** 2
        flat = outline.centre + inwards[:, None, None] * (rim - outline.centre)
        u = np.clip(1 + (self.outline.distance(flat.reshape(-1, 2)) - grown) / width, 0, 1).reshape(
            flat.shape[:2]
        )
        roof = np.concatenate([flat, (shoulder + deep * (1 - u**p) ** (1 / p))[..., None]], axis=2)
        middle = np.clip(1 + (self.outline.distance(outline.centre[None])[0] - grown) / width, 0, 1)
        apex = np.array([*outline.centre, shoulder + deep * (1 - middle**p) ** (1 / p)])
        return rings_to_mesh(np.concatenate([wall, roof]), apex)
