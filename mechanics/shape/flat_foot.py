"""A closed surface put on its support: which way is up, and the flat foot that it stands on."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.disk.surface_files import ClosedSurface
from palpate.mechanics.errors import PalpateWarning, SurfaceError
from palpate.mechanics.shape.nearest import triangle_areas

UPS = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Directions out of the support along the axes of the file's frame."""
_LOW, _FACING, _LEAST_FOOT = 0.01, 0.98, 0.01
"""Of the size: how high a foot's triangles may lie; cosine of their lean; their least share of the
surface."""
_POINT, _GENTLE = 0.15, 0.8
"""A foot is a point that covers less than this share of what stands over it, where the surface beside it goes
on as gently as this (cosine)."""


class PointFoot(PalpateWarning):
    """An object stands on the lowest point of a round underside."""


@dataclass(frozen=True)
class Standing:
    """A closed surface (vertices (n, 3) m, outward triangles (m, 3)) and the plane that it stands on, in the
    file's frame: support_point (3,), the middle of the foot; support_normal (3,), into the object."""

    vertices: np.ndarray
    triangles: np.ndarray
    support_point: np.ndarray
    support_normal: np.ndarray


def standing(surface: ClosedSurface, up: str = "+z", sink_m: float = 0.0) -> Standing:
    """Put a surface on its support. up: one of UPS or a direction "X,Y,Z"; sink_m: so much is cut off flat
    at the bottom, for an object that settles or has no flat foot.

    Raises SurfaceError where there is no flat foot.
    """
    normal = _direction(up)
    vertices, triangles = surface.vertices, surface.triangles
    if not 0 <= sink_m < np.ptp(vertices @ normal):
        raise SurfaceError(f"--sink is {sink_m} m; it must lie between 0 and the object's height")
    if sink_m:
        vertices, triangles = _cut(vertices, triangles, normal, sink_m)
    foot = _foot(vertices, triangles, normal)
    if _share(vertices, triangles, foot) < _LEAST_FOOT:
        others = [
            u for u in UPS
            if _share(vertices, triangles, _foot(vertices, triangles, _direction(u))) >= _LEAST_FOOT
        ]  # fmt: skip
        hint = f"its flat ones are for --up {', '.join(others)}; or " if others else ""
        raise SurfaceError(
            f"'{surface.name}' has no flat foot to stand on with {up} up: {hint}cut off what settles, "
            f"--sink {0.02 * np.ptp(vertices @ normal):.1g}"
        )
    nodes = np.unique(triangles[foot])
    if _is_point(vertices, triangles, foot, normal):
        warnings.warn(
            f"'{surface.name}' stands on a point, the bottom of a round underside, and a real one settles: "
            f"--sink {0.05 * np.ptp(vertices @ normal):.1g} cuts so many metres off flat",
            PointFoot,
            stacklevel=2,
        )
    low = float((vertices[nodes] @ normal).min())
    vertices = vertices.copy()
    vertices[nodes] += np.outer(low - vertices[nodes] @ normal, normal)
    area = triangle_areas(vertices, triangles[foot])
    middle = np.average(vertices[triangles[foot]].mean(axis=1), axis=0, weights=area)
    return Standing(vertices, triangles, middle, normal)


def _direction(up: str) -> np.ndarray:
    """(3,) unit."""
    if up in UPS:
        return (1.0 if up[0] == "+" else -1.0) * np.eye(3)["xyz".index(up[1])]
    try:
        given = np.array([float(part) for part in up.split(",")])
    except ValueError:
        given = np.zeros(0)
    if given.shape != (3,) or not np.isfinite(given).all() or not given.any():
        raise SurfaceError(f"--up is '{up}'; allowed are {', '.join(UPS)} or three numbers X,Y,Z")
    return given / np.linalg.norm(given)


def _foot(vertices: np.ndarray, triangles: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(m,) bool: the triangles at the bottom that look down."""
    corners = vertices[triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-300)
    height = vertices @ normal
    high = height[triangles].max(axis=1) - height.min()
    return (facing @ normal < -_FACING) & (high < _LOW * np.ptp(vertices, axis=0).max())


def _is_point(vertices: np.ndarray, triangles: np.ndarray, foot: np.ndarray, normal: np.ndarray) -> bool:
    """Whether a foot (m,) bool is the bottom of a round underside."""
    corners = vertices[triangles]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ normal / 2
    if -areas[foot].sum() > _POINT * np.maximum(areas, 0.0).sum():
        return False
    beside = np.isin(triangles, np.unique(triangles[foot])).any(axis=1) & ~foot
    whole = triangle_areas(vertices, triangles[beside])
    return bool(-areas[beside].sum() > _GENTLE * whole.sum())


def _share(vertices: np.ndarray, triangles: np.ndarray, chosen: np.ndarray) -> float:
    area = triangle_areas(vertices, triangles)
    return float(area[chosen].sum() / area.sum())


def _cut(
    vertices: np.ndarray, triangles: np.ndarray, normal: np.ndarray, sink_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """The surface above a plane `sink_m` over its lowest point, closed flat there."""
    import pyvista

    height = vertices @ normal
    origin = (height.min() + sink_m) * normal
    shell = pyvista.PolyData.from_regular_faces(vertices, triangles)
    cut = shell.clip_closed_surface(normal=tuple(normal), origin=tuple(origin)).triangulate().clean()
    return np.asarray(cut.points, dtype=float), cut.regular_faces
