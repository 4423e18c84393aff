"""A dome over any base outline: (rho)^p + (z / h)^q = 1 with rho the outline's gauge; the top may lean
over."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.reconstruction.shapes.outline import Outline
from palpate.reconstruction.shapes.shape import ShapeParameter, project, rings_to_mesh, values_of, with_values


@dataclass(frozen=True)
class Dome:
    """Every level is the base outline shrunk towards its centre: cushions, breasts, kidneys, rounded columns.

    Parameters: grown_m, height_m, wall_exponent p, cap_exponent q, and how far the top leans, lean_x_m,
    lean_y_m (growing with the square of the height).
    """

    outline: Outline
    parameters: tuple[ShapeParameter, ...]
    name: str = "dome"
    complexity: int = 3
    faceted: bool = False

    @classmethod
    def of(cls, outline: Outline, height_m: float, exponent: float) -> Dome:
        """A first guess over an outline."""
        return cls(
            outline,
            (
                ShapeParameter("grown_m", 0.0, 0.002, -0.008, 0.008),
                ShapeParameter("height_m", height_m, 0.02, 0.3 * height_m, 3 * height_m),
                ShapeParameter("wall_exponent", exponent, 1.0, 0.8, 16.0),
                ShapeParameter("cap_exponent", exponent, 1.0, 0.8, 16.0),
                ShapeParameter("lean_x_m", 0.0, 0.01, -0.03, 0.03),
                ShapeParameter("lean_y_m", 0.0, 0.01, -0.03, 0.03),
            ),
        )

    def with_values(self, values: np.ndarray) -> Dome:
        return replace(self, parameters=with_values(self.parameters, values))

    def distance(self, points: np.ndarray) -> np.ndarray:
        grown, height, p, q, *lean = values_of(self)
        rim, _ = self.outline.grown(grown).ring(0.0015)
        offset = rim - self.outline.centre
        angle = np.arctan2(offset[:, 1], offset[:, 0])
        order = np.argsort(angle)
        angle, radius = angle[order], np.linalg.norm(offset, axis=1)[order]

        def implicit(at: np.ndarray) -> np.ndarray:
            z = at[:, 2] / height
            flat = at[:, :2] - self.outline.centre - np.sign(z)[:, None] * (z**2)[:, None] * np.array(lean)
            rho = np.linalg.norm(flat, axis=1) / np.interp(
                np.arctan2(flat[:, 1], flat[:, 0]), angle, radius, period=2 * np.pi
            )
            # the p-th root keeps it of degree one, so that Newton's steps see nearly straight slopes
            return (rho**p + np.maximum(z, 0) ** q) ** (1 / p) - 1

        return project(implicit, points)

    def mesh(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        grown, height, p, q, *lean = values_of(self)
        outline = self.outline.grown(grown)
        rim, _ = outline.ring(spacing_m)
        angle = np.linspace(0, np.pi / 2, 400)
        scale, z = np.cos(angle) ** (2 / p), height * np.sin(angle) ** (2 / q)
        size = np.linalg.norm(rim - outline.centre, axis=1).mean()
        length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(scale * size), np.diff(z)))])
        at = np.linspace(0, length[-1], max(6, int(np.ceil(length[-1] / spacing_m))) + 1)[:-1]
        scale, z = np.interp(at, length, scale), np.interp(at, length, z)
        lift = (z / height)[:, None, None] ** 2 * np.array(lean)
        flat = outline.centre + scale[:, None, None] * (rim - outline.centre) + lift
        rings = np.concatenate([flat, np.broadcast_to(z[:, None, None], (*flat.shape[:2], 1))], axis=2)
        vertices, triangles = rings_to_mesh(rings, np.array([*outline.centre, height]))
        vertices[-1, :2] += lean
        return vertices, triangles
