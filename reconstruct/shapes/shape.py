"""What every fitted shape can do: tell distances, follow its parameters, and be drawn as rings of
triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np


@dataclass(frozen=True)
class ShapeParameter:
    """One number of a shape: what it is, its prior spread (one standard deviation) and its bounds; m, rad or
    1."""

    label: str
    value: float
    spread: float
    low: float = -np.inf
    high: float = np.inf


@runtime_checkable
class Shape(Protocol):
    """A shape in the support frame with free parameters.

    name: as `--surface` spells it. complexity: how many assumptions it makes; of two that predict held-out
    touches alike the simpler is taken. faceted: side and top are separate faces that may err differently.
    """

    @property
    def name(self) -> str: ...
    @property
    def complexity(self) -> int: ...
    @property
    def faceted(self) -> bool: ...
    @property
    def parameters(self) -> tuple[ShapeParameter, ...]: ...

    def with_values(self, values: np.ndarray) -> Shape:
        """The same shape with other parameter values."""

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance (k,) m of points (k, 3), positive outside; right for points on or outside the
        shape."""

    def mesh(self, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Closed triangle surface: vertices (n, 3), outward triangles (m, 3), base on z = 0."""


def with_values(parameters: tuple[ShapeParameter, ...], values: np.ndarray) -> tuple[ShapeParameter, ...]:
    """The parameters with other values."""
    return tuple(replace(p, value=float(v)) for p, v in zip(parameters, values, strict=True))


def values_of(shape: Shape) -> np.ndarray:
    """(p,) parameter values."""
    return np.array([p.value for p in shape.parameters])


def gradient(shape: Shape, points: np.ndarray, step_m: float = 2e-5) -> np.ndarray:
    """(k, 3) unit outward direction at points (k, 3): the normal at the closest point of the surface."""
    shifts = step_m * np.vstack([np.eye(3), -np.eye(3)])
    found = shape.distance((points + shifts[:, None]).reshape(-1, 3)).reshape(6, -1)
    slope = (found[:3] - found[3:]).T
    return slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-30)


def parameter_slopes(shape: Shape, points: np.ndarray) -> np.ndarray:
    """(k, p): change of the distance at points (k, 3) with each parameter."""
    at, columns = values_of(shape), []
    for k, parameter in enumerate(shape.parameters):
        step = 1e-4 * parameter.spread
        up, down = at.copy(), at.copy()
        up[k], down[k] = min(at[k] + step, parameter.high), max(at[k] - step, parameter.low)
        rise = shape.with_values(up).distance(points) - shape.with_values(down).distance(points)
        columns.append(rise / (up[k] - down[k]))
    return np.column_stack(columns)


def rings_to_mesh(rings: np.ndarray, apex: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rings (r, n, 3), from the base's rim upwards, counter-clockwise from above, closed by an apex (3,) and
    a base.

    The base is drawn with inner rings towards the middle of the rim's radii, flat on the first ring's plane.
    """
    count, n = rings.shape[:2]
    middle = np.array([apex[0], apex[1], rings[0, 0, 2]]) if not np.isnan(apex[0]) else rings[0].mean(axis=0)
    inner = [middle + share * (rings[0] - middle) for share in (0.25, 0.5, 0.75)]
    stack = np.concatenate([np.array(inner), rings])
    i = np.arange(n)
    j = (i + 1) % n
    faces = []
    for ring in range(count + 2):
        a, b = ring * n, (ring + 1) * n
        faces += [np.column_stack([a + i, a + j, b + j]), np.column_stack([a + i, b + j, b + i])]
    first, last = (count + 3) * n, (count + 3) * n + 1
    faces.append(np.column_stack([np.full(n, first), j, i]))
    faces.append(np.column_stack([(count + 2) * n + i, (count + 2) * n + j, np.full(n, last)]))
    return np.vstack([stack.reshape(-1, 3), middle, apex]), np.vstack(faces)


def project(implicit: Callable[[np.ndarray], np.ndarray], points: np.ndarray, rounds: int = 4) -> np.ndarray:
    """Signed distance (k,) of points (k, 3) from the zero set of `implicit(points) -> (k,)`, by Newton steps.

    The foot is sought along the gradient and then, so that it is the closest one, along the normal found
    there.
    """
    step = 2e-5
    shifts = step * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])

    def value_and_slope(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = implicit((at + shifts[:, None]).reshape(-1, 3)).reshape(7, -1)
        return found[0], ((found[1:4] - found[4:]) / (2 * step)).T

    foot = points.copy()
    for _ in range(rounds):
        value, slope = value_and_slope(foot)
        square = np.maximum((slope**2).sum(axis=1), 1e-12)
        # onto the tangent plane at the present foot, from the point itself
        offset = points - foot
        along = ((offset * slope).sum(axis=1) + value) / square
        moved = points - along[:, None] * slope
        size = np.linalg.norm(moved - foot, axis=1, keepdims=True)
        foot = foot + (moved - foot) * np.minimum(1.0, 0.01 / np.maximum(size, 1e-12))
    value, slope = value_and_slope(foot)
    length = np.maximum(np.linalg.norm(slope, axis=1), 1e-6)
    normal = slope / length[:, None]
    return ((points - foot) * normal).sum(axis=1) + value / length
