"""The part of a sphere or of an ellipsoid above the support.

A dome over any base outline: (rho)^p + (z / h)^q = 1 with rho the outline's gauge; the top may lean
over.

An extrusion whose top edge is rounded over a width: walls, a rounding, and a flat top where it is wide
enough.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.reconstruction.shapes.outline import Outline
from palpate.reconstruction.shapes.shape import ShapeParameter, project, rings_to_mesh, values_of, with_values


@dataclass(frozen=True)
class Cap:
    """Sphere: centre_x_m, centre_y_m, centre_z_m, radius_m. Ellipsoid: the three semi-axes and turn_rad
    instead."""

    name: str
    parameters: tuple[ShapeParameter, ...]
    complexity: int
    faceted: bool = False

    @classmethod
    def sphere(cls, centre: np.ndarray, radius_m: float) -> Cap:
        """A first guess."""
        return cls(
            "sphere", (*_centre(centre, radius_m), ShapeParameter("radius_m", radius_m, 0.02, 0.003)), 1
        )

    @classmethod
    def ellipsoid(cls, centre: np.ndarray, axes_m: np.ndarray, turn_rad: float) -> Cap:
        """A first guess: axes (3,), the third upright; turn about the upright."""
        axes = [
            ShapeParameter(f"axis_{k}_m", float(a), 0.02, 0.003, 0.5)
            for k, a in zip("abc", axes_m, strict=True)
        ]
        return cls(
            "ellipsoid", (*_centre(centre, axes_m[2]), *axes, ShapeParameter("turn_rad", turn_rad, 0.5)), 2
        )

    def with_values(self, values: np.ndarray) -> Cap:
        return replace(self, parameters=with_values(self.parameters, values))

    def _frame(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        values = values_of(self)
        axes = np.full(3, values[3]) if self.name == "sphere" else values[3:6]
        turn = 0.0 if self.name == "sphere" else values[6]
        c, s = np.cos(turn), np.sin(turn)
        return values[:3], axes, np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])

    def distance(self, points: np.ndarray) -> np.ndarray:
        centre, axes, turned = self._frame()
        if self.name == "sphere":
            return np.linalg.norm(points - centre, axis=1) - axes[0]

        def implicit(at: np.ndarray) -> np.ndarray:
            return np.linalg.norm((at - centre) @ turned.T / axes, axis=1) - 1

        return project(implicit, points)

    def mesh(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        centre, axes, turned = self._frame()
        low = np.arcsin(np.clip(-centre[2] / axes[2], -0.999, 0.999))
        size = axes.max()
        latitude = np.linspace(
            low, np.pi / 2, max(5, int(np.ceil((np.pi / 2 - low) * size / spacing_m))) + 1
        )[:-1]
        count = max(24, int(np.ceil(2 * np.pi * size / spacing_m)))
        angle = 2 * np.pi * np.arange(count) / count
        unit = np.stack(
            [
                np.cos(latitude)[:, None] * np.cos(angle),
                np.cos(latitude)[:, None] * np.sin(angle),
                np.broadcast_to(np.sin(latitude)[:, None], (len(latitude), count)),
            ],
            axis=2,
        )
        rings = centre + (unit * axes) @ turned
        rings[0, :, 2] = 0.0
        return rings_to_mesh(rings, centre + np.array([0, 0, axes[2]]))


def _centre(centre: np.ndarray, size_m: float) -> tuple[ShapeParameter, ...]:
    spreads = (0.01, 0.01, 0.02)
    bounds = ((-np.inf, np.inf), (-np.inf, np.inf), (-0.95 * size_m - 0.3, 0.9 * size_m))
    return tuple(
        ShapeParameter(f"centre_{k}_m", float(c), s, *b)
        for k, c, s, b in zip("xyz", centre, spreads, bounds, strict=True)
    )


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
