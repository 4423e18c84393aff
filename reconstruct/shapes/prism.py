"""A base outline drawn upwards to a flat top: cylinder, cone's frustum, block, L-shaped or free extrusion.

Upright walls under a top that curves: arches, saddles, cambered blocks.

A prism with a ball taken out of its top: bowls, dished blocks. Not convex.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.reconstruction.shapes.outline import Outline, corners, sides
from palpate.reconstruction.shapes.shape import ShapeParameter, project, rings_to_mesh, values_of, with_values


def _outline_parameters(outline: Outline) -> tuple[ShapeParameter, ...]:
    if outline.kind == "circle":
        radius = float(np.linalg.norm(outline.vertices[0] - outline.centre))
        x, y = outline.centre
        return (
            ShapeParameter("centre_x_m", float(x), 0.01),
            ShapeParameter("centre_y_m", float(y), 0.01),
            ShapeParameter("radius_m", radius, 0.01, 0.002),
        )
    if outline.kind == "polygon":
        angles, offsets = sides(outline.vertices)
        turned = [ShapeParameter(f"side_{k + 1}_rad", float(a), 0.05) for k, a in enumerate(angles)]
        placed = [ShapeParameter(f"side_{k + 1}_m", float(o), 0.01) for k, o in enumerate(offsets)]
        return (*turned, *placed)
    return (ShapeParameter("grown_m", 0.0, 0.002, -0.006, 0.006),)


def _outline_with(outline: Outline, values: np.ndarray) -> Outline:
    if outline.kind == "circle":
        angle = 2 * np.pi * np.arange(len(outline.vertices)) / len(outline.vertices)
        rim = values[2] * np.column_stack([np.cos(angle), np.sin(angle)])
        return Outline("circle", values[:2] + rim, values[:2].copy())
    if outline.kind == "polygon":
        half = len(values) // 2
        return Outline("polygon", corners(values[:half], values[half:]), outline.centre)
    return outline


@dataclass(frozen=True)
class Prism:
    """Walls over an outline, all leaning inwards by one angle (the draft), and a plane top that may slope.

    The parameters are the outline's, then height_m (at the outline's centre), then, if free: slope_x, slope_y
    (rise over run) and draft_rad.
    """

    name: str
    outline: Outline
    parameters: tuple[ShapeParameter, ...]
    sloped: bool
    drafted: bool
    complexity: int
    faceted: bool = True

    @classmethod
    def of(cls, outline: Outline, height_m: float, *, sloped: bool, drafted: bool) -> Prism:
        """A first guess over an outline."""
        found = [*_outline_parameters(outline), ShapeParameter("height_m", height_m, 0.02, 0.002)]
        if sloped:
            found += [
                ShapeParameter("slope_x", 0.0, 0.2, -1.5, 1.5),
                ShapeParameter("slope_y", 0.0, 0.2, -1.5, 1.5),
            ]
        if drafted:
            found.append(ShapeParameter("draft_rad", 0.0, 0.15, -0.3, 0.9))
        names = {"circle": "cylinder", "polygon": "block", "curve": "extrusion"}
        complexity = {"circle": 1, "polygon": 1, "curve": 2}[outline.kind] + sloped + drafted
        return cls(names[outline.kind], outline, tuple(found), sloped, drafted, complexity)

    def with_values(self, values: np.ndarray) -> Prism:
        return replace(self, parameters=with_values(self.parameters, values))

    def _parts(self) -> tuple[Outline, float, np.ndarray, float]:
        values = np.array([p.value for p in self.parameters])
        extra = 1 + 2 * self.sloped + self.drafted
        own, rest = values[:-extra], values[-extra:]
        slope = rest[1:3] if self.sloped else np.zeros(2)
        return (
            _outline_with(self.outline, own),
            float(rest[0]),
            slope,
            float(rest[-1]) if self.drafted else 0.0,
        )

    def distance(self, points: np.ndarray) -> np.ndarray:
        outline, height, slope, draft = self._parts()
        flat = self.wall_distance(points)
        wall = flat * np.cos(draft) + points[:, 2] * np.sin(draft)
        rise = points[:, 2] - height - (points[:, :2] - outline.centre) @ slope
        top = rise / np.sqrt(1 + slope @ slope)
        return np.hypot(np.maximum(wall, 0), np.maximum(top, 0)) + np.minimum(np.maximum(wall, top), 0)

    def wall_distance(self, points: np.ndarray) -> np.ndarray:
        """(k,) m: horizontal distance of points (k, 3) from the base's outline, negative inside."""
        outline = self._parts()[0]
        if outline.kind == "circle":
            radius = np.linalg.norm(outline.vertices[0] - outline.centre)
            return np.linalg.norm(points[:, :2] - outline.centre, axis=1) - radius
        flat = outline.distance(points[:, :2])
        return flat - self.parameters[0].value if outline.kind == "curve" else flat

    @property
    def height(self) -> float:
        """Of the top at the outline's centre, m."""
        return self._parts()[1]

    def rim(self, spacing_m: float) -> np.ndarray:
        """(n, 2) the base's rim about `spacing_m` apart."""
        outline = self._parts()[0]
        if outline.kind == "curve":
            outline = outline.grown(self.parameters[0].value)
        return outline.ring(spacing_m)[0]

    def mesh(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        outline, height, slope, draft = self._parts()
        if outline.kind == "curve":
            outline = outline.grown(self.parameters[0].value)
        rim, outward = outline.ring(spacing_m)
        lean = _lean(outline, rim, outward) * np.tan(draft)
        # up the wall p - z lean, until the top's plane: z = height + slope . (p - z lean - centre)
        edge = (height + (rim - outline.centre) @ slope) / (1 + lean @ slope)
        levels = np.linspace(0, 1, max(3, int(np.ceil(height / spacing_m)) + 1))
        z = levels[:, None] * edge
        wall = np.concatenate([rim - z[..., None] * lean, z[..., None]], axis=2)
        inwards = np.linspace(1, 0, max(4, int(np.ceil(np.ptp(rim, axis=0).max() / 2 / spacing_m)) + 1))[1:-1]
        flat = outline.centre + inwards[:, None, None] * (wall[-1, :, :2] - outline.centre)
        roof = np.concatenate([flat, (height + (flat - outline.centre) @ slope)[..., None]], axis=2)
        return rings_to_mesh(np.concatenate([wall, roof]), np.array([*outline.centre, height]))


def _lean(outline: Outline, rim: np.ndarray, outward: np.ndarray) -> np.ndarray:
    """(n, 2): how far the rim moves inwards a metre of height for a draft of 45 degrees; mitred at
    corners."""
    if outline.kind != "polygon":
        return outward
    moved = outline.grown(-1e-4).vertices
    start = outline.vertices
    ends = np.roll(np.arange(len(start)), -1)
    a, b = start, start[ends]
    along = ((rim[:, None] - a) * (b - a)).sum(axis=2) / ((b - a) ** 2).sum(axis=1)
    miss = np.linalg.norm(a + np.clip(along, 0, 1)[..., None] * (b - a) - rim[:, None], axis=2)
    k = np.argmin(miss, axis=1)
    share = np.clip(along[np.arange(len(rim)), k], 0, 1)[:, None]
    return ((1 - share) * (start - moved)[k] + share * (start - moved)[ends[k]]) / 1e-4


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
