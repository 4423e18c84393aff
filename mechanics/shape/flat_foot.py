"""A closed surface put on its support: which way is up, and the flat foot that it stands on."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, cKDTree

from palpate.mechanics.disk.surface_files import ClosedSurface
from palpate.mechanics.errors import PalpateWarning, SurfaceError
from palpate.mechanics.shape.nearest import facings, triangle_areas

UPS = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Directions out of the support along the axes of the file's frame."""
_LOW, _FACING, _LEAST_FOOT = 0.01, 0.98, 0.01
"""Of the size: how high a foot's triangles may lie; cosine of their lean; their least share of the
surface."""
_POINT, _GENTLE = 0.15, 0.8
"""A foot is a point that covers less than this share of what stands over it, where the surface beside it goes
on as gently as this (cosine)."""
_SINKS = (0.02, 0.03, 0.05, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3)
"""Of the height: what is tried where a value of --sink is proposed."""
_HANGING = 0.02
"""Of the volume: what may hang in the air."""
_TILT, _FLAT, _A_FOOT, _ON_IT, _ALIKE = 15.0, 0.002, 0.04, 0.5, 0.95
"""A foot that is tilted in the file: its greatest angle, degrees; how far its triangles lie off its plane, of
the size; its least share of the surface; the share of it on the stated plane from which that is right; of the
largest flat face how large another is that may be the foot as well."""


class PointFoot(PalpateWarning):
    """An object stands on the lowest point of a round underside."""


class TiltedFoot(PalpateWarning):
    """The flat foot of an object does not lie on the stated plane."""


class HangingError(SurfaceError):
    """Bodies of a file hang in the air. parts: their names, where the file's parts are known and each hangs
    whole."""

    def __init__(self, message: str, parts: tuple[str, ...]) -> None:
        super().__init__(message)
        self.parts = parts


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

    Raises SurfaceError where there is no flat foot, HangingError where a body stands on nothing.
    """
    normal = direction(up)
    vertices, triangles = surface.vertices, surface.triangles
    if not 0 <= sink_m < np.ptp(vertices @ normal):
        raise SurfaceError(f"--sink is {sink_m} m; it must lie between 0 and the object's height")
    if not sink_m:
        normal = _righted(surface, up, normal)
    if sink_m:
        vertices, triangles = _cut(vertices, triangles, normal, sink_m)
    foot = _foot(vertices, triangles, normal)
    if _share(vertices, triangles, foot) < _LEAST_FOOT:
        raise SurfaceError(
            f"'{surface.name}' has no flat foot to stand on with {up} up: "
            f"{_feet(surface, normal)}{_way(surface, normal)}"
        )
    hanging, of = _hanging(vertices, triangles, foot)
    if hanging > _HANGING:
        raise HangingError(
            f"'{surface.name}' is of several bodies, and {100 * hanging:.0f} % of their volume touches "
            f"neither the support nor what stands on it with {up} up: {_way(surface, normal)}",
            _names(surface, vertices[np.unique(triangles[of])]),
        )
    nodes = np.unique(triangles[foot])
    if _is_point(vertices, triangles, foot, normal):
        warnings.warn(
            f"'{surface.name}' stands on a point, the bottom of a round underside, and a real one settles: "
            f"--sink {sink_m + 0.05 * np.ptp(vertices @ normal):.1g} cuts so many metres off flat",
            PointFoot,
            stacklevel=2,
        )
    height = vertices @ normal
    low = float(height[nodes].min())
    nodes = np.union1d(nodes, np.flatnonzero(height < low))  # of a rough foot some corners hang lower
    vertices = vertices.copy()
    vertices[nodes] += np.outer(low - height[nodes], normal)
    area = triangle_areas(vertices, triangles[foot])
    middle = np.average(vertices[triangles[foot]].mean(axis=1), axis=0, weights=area)
    return Standing(vertices, triangles, middle, normal)


def _feet(surface: ClosedSurface, normal: np.ndarray) -> str:
    """The ways up in which it stands flat, in words: along the file's axes, else on its largest flat face, of
    alike ones that nearest to the stated plane."""
    vertices, triangles = surface.vertices, surface.triangles
    feet = {up: _foot(vertices, triangles, direction(up)) for up in UPS}
    share = {up: _share(vertices, triangles, foot) for up, foot in feet.items()}
    flat = [
        up for up in sorted(UPS, key=lambda up: -round(share[up], 3))
        if share[up] >= _LEAST_FOOT and not _is_point(vertices, triangles, feet[up], direction(up))
    ]  # fmt: skip
    if flat:
        return f"its flat ones are for --up {', '.join(flat)}; or "
    tilted = _tilted(vertices, triangles, normal, 180.0)
    return (
        "" if tilted is None else f"its flat foot is for --up={','.join(f'{x:.4g}' for x in tilted[2])}; or "
    )


def direction(up: str) -> np.ndarray:
    """(3,) unit, out of the support. up: one of UPS or "X,Y,Z"; raises SurfaceError for another."""
    if up in UPS:
        return (1.0 if up[0] == "+" else -1.0) * np.eye(3)["xyz".index(up[1])]
    try:
        given = np.array([float(part) for part in up.split(",")])
    except ValueError:
        given = np.zeros(0)
    if given.shape != (3,) or not np.isfinite(given).all() or not given.any():
        raise SurfaceError(f"--up is '{up}'; allowed are {', '.join(UPS)} or three numbers X,Y,Z")
    return given / np.linalg.norm(given)


def _way(surface: ClosedSurface, normal: np.ndarray) -> str:
    """What to do where an object does not stand; a value of --sink is named where it was tried and holds."""
    height = float(np.ptp(surface.vertices @ normal))
    for share in _SINKS:
        sink_m = float(f"{share * height:.2g}")
        vertices, triangles = _cut(surface.vertices, surface.triangles, normal, sink_m)
        if not len(triangles):
            continue
        foot = _foot(vertices, triangles, normal)
        stands = _share(vertices, triangles, foot) >= 2 * _LEAST_FOOT
        if stands and _hanging(vertices, triangles, foot)[0] <= _HANGING:
            return f"cut off what settles, --sink {sink_m:g}"
    return (
        f"cutting off up to {100 * _SINKS[-1]:.0f} % of its height (--sink) does not help; turn it (--up), "
        "or give the file of one body that stands"
    )


def _names(surface: ClosedSurface, hanging: np.ndarray) -> tuple[str, ...]:
    """Of the surface's parts, those all of whose corners are among the hanging ones (k, 3) m."""
    among, near = cKDTree(hanging), 1e-6 * surface.size_m
    return tuple(part.name for part in surface.parts if among.query(part.vertices)[0].max() < near)


def _hanging(vertices: np.ndarray, triangles: np.ndarray, foot: np.ndarray) -> tuple[float, np.ndarray]:
    """The share of the volume in bodies that neither stand on a foot (m,) bool nor touch one that does, and
    which triangles (m,) bool are theirs."""
    import pyvista

    count, piece = connected_components(_graph(triangles, len(vertices)), directed=False)
    owner = piece[triangles[:, 0]]
    corners = vertices[triangles] - vertices.mean(axis=0)
    volumes = np.bincount(owner, np.linalg.det(corners) / 6, count)
    left = [k for k in np.unique(owner) if volumes[k] > 0]
    held = [k for k in left if foot[owner == k].any()]
    if len(left) == 1 or not held:
        return 0.0, np.zeros(len(triangles), dtype=bool)
    drawn = {k: pyvista.PolyData.from_regular_faces(vertices, triangles[owner == k]).clean() for k in left}
    left = [k for k in left if k not in held]
    for at in held:  # which grows
        box = np.reshape(drawn[at].bounds, (3, 2))
        for k in list(left):
            other = np.reshape(drawn[k].bounds, (3, 2))
            if (box[:, 0] > other[:, 1]).any() or (other[:, 0] > box[:, 1]).any():
                continue
            inside = (other[:, 0] >= box[:, 0]).all() and (other[:, 1] <= box[:, 1]).all()
            if inside or drawn[at].collision(drawn[k], contact_mode=1)[1] > 0:
                held.append(k)
                left.remove(k)
    return float(volumes[left].sum() / np.maximum(volumes, 0.0).sum()), np.isin(owner, left)


def _graph(triangles: np.ndarray, count: int) -> coo_matrix:
    ends = triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel()
    return coo_matrix((np.ones(len(ends[0])), ends), shape=(count, count))


def _righted(surface: ClosedSurface, up: str, normal: np.ndarray) -> np.ndarray:
    """The stated normal, or that of a flat foot which is tilted against the stated plane; that is said.

    Three numbers are taken at their word.
    """
    found = _tilted(surface.vertices, surface.triangles, normal)
    if found is None:
        return normal
    tilt, share, foot = found
    words = ",".join(f"{x:.4g}" for x in foot)
    taken, way = (foot, f"--up {','.join(f'{x:g}' for x in normal)} keeps the stated plane")
    if up not in UPS:
        taken, way = normal, f"the plane is taken as stated; --up={words} stands it on that foot"
    warnings.warn(
        f"{100 * share:.0f} % of the flat foot of '{surface.name}' stands on the plane of --up {up}: it is "
        f"tilted by {tilt:.1f} degrees in the file"
        + (f"; the foot's own plane is taken, as by --up={words} ({way})" if up in UPS else f"; {way}"),
        TiltedFoot,
        stacklevel=3,
    )
    return taken


def _tilted(
    vertices: np.ndarray, triangles: np.ndarray, normal: np.ndarray, most: float = _TILT
) -> tuple[float, float, np.ndarray] | None:
    """The angle of the largest flat face that an object can stand on, within `most` degrees of the stated
    plane; the share of it on that plane; and the direction (3,) out of it. None where the object stands as
    stated."""
    size = float(np.ptp(vertices, axis=0).max())
    area, (_, facing) = triangle_areas(vertices, triangles), facings(vertices, triangles)
    hull = ConvexHull(vertices)
    planes = hull.equations[np.argsort(triangle_areas(vertices, hull.simplices))[::-1]]
    planes = planes[planes[:, :3] @ normal <= -np.cos(np.radians(most))][:50]

    def on(plane: np.ndarray) -> np.ndarray:
        off = np.abs(vertices @ plane[:3] + plane[3])[triangles].max(axis=1)
        return (facing @ plane[:3] > _FACING) & (off < _FLAT * size)

    if not len(planes):
        return None
    flat = np.array([area[on(plane)].sum() for plane in planes])
    alike = planes[flat >= _ALIKE * flat.max()]  # a cylinder's two ends: it stands as it is, not on its head
    best = alike[np.argmin(alike[:, :3] @ normal)]
    foot, stated = on(best), on(np.array([*-normal, float((vertices @ normal).min())]))
    share = float(area[foot & stated].sum() / max(area[foot].sum(), 1e-300))
    if area[foot].sum() < _A_FOOT * area.sum() or share >= _ON_IT or area[stated].sum() > area[foot].sum():
        return None
    # of the many triangles of a scanned foot the mean is its plane
    own = -(area[foot, None] * facing[foot]).sum(axis=0)
    own /= np.linalg.norm(own)
    if own @ normal > np.sqrt(1 - _LOW**2):  # within what a foot is levelled by anyway
        return None
    return float(np.degrees(np.arccos(np.clip(own @ normal, -1, 1)))), share, own


def _foot(vertices: np.ndarray, triangles: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(m,) bool: the triangles at the bottom that look down."""
    _, facing = facings(vertices, triangles)
    height = vertices @ normal
    high = height[triangles].max(axis=1) - height.min()
    return (facing @ normal < -_FACING) & (high < _LOW * np.ptp(vertices, axis=0).max())


def _is_point(vertices: np.ndarray, triangles: np.ndarray, foot: np.ndarray, normal: np.ndarray) -> bool:
    """Whether a foot (m,) bool is the bottom of a round underside."""
    areas = facings(vertices, triangles)[0] @ normal / 2
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
