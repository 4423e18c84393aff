"""Phase I: the tip slides on the rigid support around the object (paper, section 2.1).

From its path come the support plane, in any device frame, and the outline of the object's base.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from mechanics.errors import ContactError, NoBaseError, OptionError
from mechanics.options import option
from mechanics.robust import biweight
from mechanics.samples import runs

_LEAST_SLIDE = 8.0  # tip radii; a drag within a palpation is shorter or leaves the plane
_LEAST_PIECE = 2.0  # tip radii; less tells no plane
_FLAT = 0.1  # tip radii off the plane
_MOMENT_S = 0.05  # a contact that is shorter is no press
_THINNED = 5  # samples


@dataclass(frozen=True)
class BoundaryOptions:
    """How the base is sampled."""

    base_spacing_m: float = option(
        0.005, "threshold d of the farthest-point sampling of the base", unit="m", flag="--base-spacing"
    )

    def __post_init__(self) -> None:
        """Raises OptionError for a spacing that is not positive."""
        if not self.base_spacing_m > 0:
            raise OptionError(f"--base-spacing is {self.base_spacing_m} m; it must be greater than 0")


@dataclass(frozen=True)
class Boundary:
    """The object's base and the plane it stands on; device frame, m.

    support_point, support_normal: (3,), the plane of the support's surface, its normal into the object.
    outline: (k, 3) dense points of the base's rim on the plane, in order along the path; the tip's radius is
    taken off. centres: (k, 3) where the tip's centre was. points: (j, 3) P_B of the paper, farthest-point
    sample of the outline. interval: sample indices (first, last) of phase I; flatness_m: rms of the path off
    the plane.
    """

    support_point: np.ndarray
    support_normal: np.ndarray
    outline: np.ndarray
    centres: np.ndarray
    points: np.ndarray
    interval: tuple[int, int]
    flatness_m: float

    def height(self, points: np.ndarray) -> np.ndarray:
        """Height of points (..., 3) above the support, m."""
        return (np.asarray(points) - self.support_point) @ self.support_normal


def fit_plane(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """(centre, unit normal, rms) of the plane through points (n, 3), robust (Tukey's biweight on
    distances)."""

    def plane(weight: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        centre = np.average(points, axis=0, weights=weight)
        offset = points - centre
        normal = np.linalg.eigh((offset * weight[:, None]).T @ offset)[1][:, 0]
        return (centre, normal), offset @ normal

    found = biweight(plane, len(points), least=1e-7, reach=6.0, rounds=12)
    return *found.fitted, float(np.sqrt(np.average(found.residual**2, weights=found.weight)))


def farthest_points(points: np.ndarray, spacing_m: float, start: int = 0) -> np.ndarray:
    """Indices of a farthest-point sample: added until no point is further than `spacing_m` from the
    sample."""
    chosen = [start]
    distance = np.linalg.norm(points - points[start], axis=1)
    while distance.max() > spacing_m:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


def find_interval(
    t: np.ndarray,
    position: np.ndarray,
    touching: np.ndarray,
    given: tuple[float, float] | None,
    tip_radius_m: float,
) -> tuple[int, int]:
    """Sample indices [first, last) of phase I.

    given: approximate times from the recording; contact that starts inside is followed to its end. Without
    them: contacts in which the tip slides further than 8 radii while it stays in one plane, until one leaves
    that plane. touching: (n,) bool. Raises ContactError
    where there is none.
    """
    found = runs(touching)
    if given is not None:
        inside = [(a, b) for a, b in found if t[min(b, len(t) - 1)] > given[0] and t[a] < given[1]]
        inside = [(a, b) for a, b in inside if _travel(position[a:b]) > 2 * tip_radius_m]
        if not inside:
            raise NoBaseError(
                f"no contact with the support between {given[0]:.2f} and {given[1]:.2f} s (boundary_phase): "
                "trace the object's base first, or give [object] model = PATH of a model whose base stands in"
            )
        return inside[0][0], inside[-1][1]
    for i, (a, b) in enumerate(found):
        if _travel(position[a:b]) < _LEAST_PIECE * tip_radius_m:
            continue
        centre, normal, flatness = fit_plane(position[a:b])
        if flatness > _FLAT * tip_radius_m:
            continue
        first, last = _coplanar(t, position, found, i, _FLAT * tip_radius_m)
        if sum(_travel(position[c:d]) for c, d in found[first : last + 1]) > _LEAST_SLIDE * tip_radius_m:
            return found[first][0], found[last][1]
    raise NoBaseError(
        "no boundary phase found: nowhere does the tip slide further than 8 of its radii in one plane; trace "
        "the object's base first, state [recording] boundary_phase, or give [object] model = PATH of a "
        "model whose base stands in"
    )


def _coplanar(
    t: np.ndarray, position: np.ndarray, found: list[tuple[int, int]], start: int, limit_m: float
) -> tuple[int, int]:
    """First and last of the contacts around `start` that lie in one plane with it, none left out between.

    The plane is fitted anew with each contact that is tried: one straight side of a foot alone tells no
    plane. A contact of a moment, as of a tip that bounces, ends nothing.
    """
    lasting = [k for k, (a, b) in enumerate(found) if k == start or t[b - 1] - t[a] > _MOMENT_S]
    at = lasting.index(start)
    low = high = at
    for step in (1, -1):
        while 0 <= (tried := (high if step > 0 else low) + step) < len(lasting):
            chosen = [found[k] for k in lasting[min(low, tried) : max(high, tried) + 1]]
            thinned = [position[a:b:_THINNED] for a, b in chosen]
            centre, normal, _ = fit_plane(np.concatenate(thinned))
            if max(float(np.median(np.abs((x - centre) @ normal))) for x in thinned) > limit_m:
                break
            low, high = min(low, tried), max(high, tried)
    return lasting[low], lasting[high]


def _travel(points: np.ndarray) -> float:
    # positions come in steps, so the path is measured on every 50th sample
    return float(np.linalg.norm(np.diff(points[::50], axis=0), axis=1).sum()) if len(points) > 50 else 0.0


def find_boundary(
    position: np.ndarray,
    force_on_tool: np.ndarray,
    touching: np.ndarray,
    interval: tuple[int, int],
    tip_radius_m: float,
    options: BoundaryOptions,
) -> Boundary:
    """Support plane and base outline from the samples of phase I (low-passed position, force on the tool).

    Raises ContactError where the path does not go round the object.
    """
    first, last = interval
    inside = np.arange(first, last)[touching[first:last]]
    path, force = position[inside], force_on_tool[inside]
    centre, normal, flatness = fit_plane(path)
    if np.mean(force @ normal) < 0:
        normal = -normal
    centre = centre - tip_radius_m * normal
    height = (path - centre) @ normal - tip_radius_m
    path = path[np.abs(height) < max(6 * flatness, 2e-4)]
    path = path - ((path - centre) @ normal)[:, None] * normal
    path = _resampled(path, 0.0005)
    if len(path) < 20:
        raise ContactError("the boundary phase is shorter than 1 cm: trace the object's whole base")
    smooth = gaussian_filter1d(path, 3.0, axis=0, mode="nearest")
    tangent = np.gradient(smooth, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    winding = _winding(smooth, normal)
    if abs(winding) < 0.8 * 2 * np.pi:
        raise ContactError(
            f"the boundary phase goes {abs(np.degrees(winding)):.0f} degrees round the object; at least "
            "288 are needed: trace the whole base"
        )
    outward = np.cross(tangent, normal) * np.sign(winding)
    outline = smooth - tip_radius_m * outward
    chosen = farthest_points(outline, options.base_spacing_m)
    return Boundary(
        support_point=outline.mean(axis=0),
        support_normal=normal,
        outline=outline,
        centres=smooth + tip_radius_m * normal,
        points=outline[chosen],
        interval=interval,
        flatness_m=flatness,
    )


def _resampled(path: np.ndarray, step_m: float) -> np.ndarray:
    """The path at equal steps of its length; a step is taken only once the tip has moved so far (no
    jitter)."""
    kept = [0]
    for i in range(0, len(path), 5):
        if np.linalg.norm(path[i] - path[kept[-1]]) >= step_m:
            kept.append(i)
    return path[kept]


def _winding(path: np.ndarray, normal: np.ndarray) -> float:
    """Angle (rad) by which the path turns round the middle of its extent, counter-clockwise about the
    normal."""
    middle = (path.max(axis=0) + path.min(axis=0)) / 2
    offset = path - middle
    a, b = offset[:-1], offset[1:]
    return float(np.arctan2(np.cross(a, b) @ normal, np.einsum("ij,ij->i", a, b)).sum())
