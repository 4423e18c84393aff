"""The base: support plane and outline, in any device frame, from the path of the tracing (section 2.1).

When the base is traced: the tip slides on the rigid support, in one plane (paper, section 2.1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter1d, label
from scipy.spatial import ConvexHull, cKDTree

from palpate.mechanics.errors import ContactError, NoBaseError, OptionError
from palpate.mechanics.options import option
from palpate.mechanics.recording.segments import runs
from palpate.reconstruction.shapes.outline import (
    FLAT,
    FOOT,
    LEAST_STEPS,
    STEP_M,
    farthest_points,
    fit_plane,
    resampled,
)

UNTRACED = (
    "say what is known of the object in [object] of its TOML (shape, slab_m or half_space), or by "
    "`palpate open REC --shape FILE`, `palpate open REC --slab M` or `palpate open REC --half-space`"
)
"""What goes on without a tracing, whatever command came upon it."""
LEAN = "trace again and lean the tip against the object's foot all the way round"
"""What mends a tracing beside the foot."""


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
    face = _enclosed(path, normal, FOOT * tip_radius_m)
    if face is not None:
        path = path[face.away(path) < face.reach_m]
    strokes = _strokes(path, FOOT * tip_radius_m)
    if sum(map(len, strokes)) < LEAST_STEPS:
        raise ContactError("the tracing of the base is shorter than 1 cm: trace the object's whole base")
    smoothed = [gaussian_filter1d(stroke, 3.0, axis=0, mode="nearest") for stroke in strokes]
    smooth = np.concatenate(smoothed)
    winding = _winding(smooth, normal)
    if face is None and abs(winding) < 0.8 * 2 * np.pi:
        raise ContactError(
            f"the tracing of the base goes {abs(np.degrees(winding)):.0f} degrees round the object; at least "
            "288 are needed: trace the whole base, or say when it was ([recording] boundary_phase)"
        )
    sideways = []
    for stroke in smoothed:
        tangent = np.gradient(stroke, axis=0)
        side = np.cross(tangent / np.linalg.norm(tangent, axis=1, keepdims=True), normal)
        step = tip_radius_m * side
        out = (
            np.sign(winding)
            if face is None
            else face.away(stroke + step).sum() - face.away(stroke - step).sum()
        )
        sideways.append(side * np.sign(out))
    outline = smooth - tip_radius_m * np.concatenate(sideways)
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


def refuse_no_foot(boundary: Boundary, touched: np.ndarray, t: np.ndarray, tip_radius_m: float) -> None:
    """Raises NoBaseError where what slides most like a tracing, of samples at t (n,) s, went round nothing.

    touched: (k, 3) m, places of the tip's centre where it pressed. A foot has an inside, and the middle of
    what was pressed stands over it, however far the object leans out.
    """
    axes = np.linalg.svd(boundary.support_normal[None])[2][1:]
    middle = boundary.centres.mean(axis=0)
    path = (boundary.centres - middle) @ axes.T
    reach = float(np.median(np.linalg.norm(path, axis=1)))
    apart = 0.0
    if len(touched):
        rim = ConvexHull(path).equations
        apart = float((rim[:, :2] @ (axes @ (np.median(touched, axis=0) - middle)) + rim[:, 2]).max())
    if apart <= 0 and reach > tip_radius_m:
        return
    first, last = boundary.interval
    beside = f", and the middle of the presses is {1e3 * apart:.3g} mm beside it" if apart > 0 else ""
    raise NoBaseError(
        f"no foot was traced: the slide most like a tracing, {t[first]:.1f} to {t[last - 1]:.1f} s, keeps "
        f"within {1e3 * reach:.3g} mm of its middle{beside}; {UNTRACED}; or trace the object's foot and "
        "record again; a tracing that is there is stated by [recording] boundary_phase"
    )


@dataclass(frozen=True)
class Lean:
    """Sideways force of a tracing, out of the object: N, the median along the way, and its standard error."""

    force_n: float
    error_n: float

    def below(self, force_n: float) -> bool:
        """Whether it is surely less than a force, N."""
        return self.force_n + _SURELY * self.error_n < force_n


def lean(boundary: Boundary, position: np.ndarray, force_on_tool: np.ndarray, rate_hz: float) -> Lean:
    """How hard the tip leaned against the object's foot; all samples (n, 3) m and N, low-passed.

    Friction on the support is along the way and a bias turns with it, so neither counts. Of a tracing too
    short to tell, the error is infinite.
    """
    rows = slice(*boundary.interval)
    off, nearest = cKDTree(boundary.centres).query(position[rows])
    out = boundary.centres - boundary.outline
    out = out - (out @ boundary.support_normal)[:, None] * boundary.support_normal
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    force = force_on_tool[rows]
    on_way = (off < _ON_WAY_M) & (force @ boundary.support_normal > 0)
    sideways = np.einsum("ij,ij->i", force, out[nearest])[on_way]
    block = round(_BLOCK_S * rate_hz)
    means = sideways[: len(sideways) // block * block].reshape(-1, block).mean(axis=1)
    if len(means) < _LEAST_BLOCKS:
        return Lean(float("nan"), float("inf"))
    middle = float(np.median(means))
    scatter = 1.4826 * float(np.median(np.abs(means - middle)))
    return Lean(middle, 1.2533 * scatter / len(means) ** 0.5)


_SURELY = 5.0  # standard errors
_BLOCK_S, _LEAST_BLOCKS = 0.5, 8
_ON_WAY_M = 0.001


@dataclass(frozen=True)
class _Face:
    """What a path on the support closes in, on a grid in its plane: `distance` m of each cell from it."""

    middle: np.ndarray
    axes: np.ndarray
    corner: np.ndarray
    cell_m: float
    distance: np.ndarray
    reach_m: float

    def away(self, points: np.ndarray) -> np.ndarray:
        """(n,) m, how far points (n, 3) are from the face; beyond the grid as far as its rim."""
        flat = (points - self.middle) @ self.axes.T
        at = np.clip(((flat - self.corner) / self.cell_m).astype(int), 0, np.array(self.distance.shape) - 1)
        return self.distance[tuple(at.T)]


def _enclosed(path: np.ndarray, normal: np.ndarray, near_m: float) -> _Face | None:
    """The largest face that a path (n, 3) m goes round with most of its way, gaps of up to `near_m` closed;
    None where it is open.

    Samples farther from it than `reach_m` were on the support alone: there the tip came down beside the
    object and slid up to it, or slid away.
    """
    axes, middle = np.linalg.svd(normal[None])[2][1:], path.mean(axis=0)
    flat = (path - middle) @ axes.T
    cell = max(near_m / 4, float(np.ptp(flat, axis=0).max()) / 600)
    wide = round(0.5 * near_m / cell)
    corner = flat.min(axis=0) - (4 * wide + 4) * cell
    steps = np.linalg.norm(np.diff(flat, axis=0), axis=1)
    drawn = [flat]
    for i in np.flatnonzero((steps > 0.5 * cell) & (steps < near_m)):
        share = np.arange(0, 1, 0.5 * cell / steps[i])[:, None]
        drawn.append((1 - share) * flat[i] + share * flat[i + 1])
    at = ((np.concatenate(drawn) - corner) / cell).astype(int)
    wall = np.zeros(at.max(axis=0) + 4 * wide + 5, dtype=bool)
    wall[tuple(at.T)] = True
    faces, _ = label(distance_transform_edt(~wall) > wide)
    sizes = np.bincount(faces.ravel())
    sizes[[0, faces[0, 0]]] = 0
    if not sizes.any():
        return None
    distance = distance_transform_edt(faces != np.argmax(sizes)) * cell
    face = _Face(middle, axes, corner, cell, distance, wide * cell + 0.5 * near_m)
    return face if np.mean(face.away(path) < face.reach_m) > 0.5 else None


def _strokes(path: np.ndarray, gap_m: float) -> list[np.ndarray]:
    """The path cut where it leaps by more than `gap_m`, each piece at equal steps; pieces of less
    than three steps are no stroke."""
    leaps = np.flatnonzero(np.linalg.norm(np.diff(path, axis=0), axis=1) > gap_m) + 1
    found = [resampled(piece, STEP_M) for piece in np.split(path, leaps)]
    return [piece for piece in found if len(piece) > 3]


def _winding(path: np.ndarray, normal: np.ndarray) -> float:
    """Angle (rad) by which the path turns round the middle of its extent, counter-clockwise about the
    normal."""
    middle = (path.max(axis=0) + path.min(axis=0)) / 2
    offset = path - middle
    a, b = offset[:-1], offset[1:]
    return float(np.arctan2(np.cross(a, b) @ normal, np.einsum("ij,ij->i", a, b)).sum())


_LEAST_SLIDE = 8.0  # tip radii; a drag within a palpation is shorter or leaves the plane
_LEAST_PIECE = 2.0  # tip radii; less tells no plane
_MOMENT_S = 0.05  # a contact that is shorter is no press
_BREAK_S = 2.5  # longer than a tracing is broken off
_THINNED = 5  # samples


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
    that plane for good. touching: (n,) bool. Raises ContactError where there is none.
    """
    found = runs(touching)
    if given is not None:
        inside = [(a, b) for a, b in found if t[min(b, len(t) - 1)] > given[0] and t[a] < given[1]]
        inside = [(a, b) for a, b in inside if _travel(position[a:b]) > 2 * tip_radius_m]
        if not inside:
            raise NoBaseError(
                f"no contact with the support between {given[0]:.2f} and {given[1]:.2f} s (boundary_phase): "
                "trace the object's base first, give [object] model = PATH of a model whose base stands in, "
                f"or {UNTRACED}"
            )
        return inside[0][0], inside[-1][1]
    for i, (a, b) in enumerate(found):
        if _travel(position[a:b]) < _LEAST_PIECE * tip_radius_m:
            continue
        centre, normal, flatness = fit_plane(position[a:b])
        if flatness > FLAT * tip_radius_m:
            continue
        first, last = _coplanar(t, position, found, i, tip_radius_m)
        if sum(_travel(position[c:d]) for c, d in found[first : last + 1]) > _LEAST_SLIDE * tip_radius_m:
            return found[first][0], found[last][1]
    raise NoBaseError(
        "no boundary phase found: nowhere does the tip slide further than 8 of its radii in one plane; trace "
        "the object's base first, state [recording] boundary_phase, give [object] model = PATH of a model "
        f"whose base stands in, or {UNTRACED}"
    )


def _coplanar(
    t: np.ndarray, position: np.ndarray, found: list[tuple[int, int]], start: int, tip_radius_m: float
) -> tuple[int, int]:
    """First and last of the contacts around `start` that lie in one plane with it, none left out between.

    The plane is fitted anew with each contact that is tried: one straight side of a foot alone tells no
    plane. A contact of a moment, as of a tip that bounces, ends nothing; nor does one that slides nowhere and
    stays within a tip's radius of the plane, as of a tip that is lifted along the object's wall, or comes so
    soon that it may be the swing of a heavy tool while the tracing is broken off.
    """
    lasting = [k for k, (a, b) in enumerate(found) if k == start or t[b - 1] - t[a] > _MOMENT_S]
    at = lasting.index(start)
    low = high = at

    def thinned(k: int) -> np.ndarray:
        a, b = found[lasting[k]]
        return position[a:b:_THINNED]

    def off(pieces: list[np.ndarray], of: list[np.ndarray]) -> float:
        """m, the most by which the middle of any piece is off the plane of some."""
        centre, normal, _ = fit_plane(np.concatenate(of))
        return max(float(np.median(np.abs((piece - centre) @ normal))) for piece in pieces)

    def apart(k: int, other: int) -> float:
        """s between two contacts."""
        early, late = found[lasting[min(k, other)]], found[lasting[max(k, other)]]
        return float(t[late[0]] - t[early[1] - 1])

    pieces = [thinned(at)]
    for step in (1, -1):
        tried = at
        while 0 <= (tried := tried + step) < len(lasting):
            own = thinned(tried)
            together = [*pieces, own]
            if off(together, together) <= FLAT * tip_radius_m:
                pieces, low, high = together, min(low, tried), max(high, tried)
            elif _travel(position[slice(*found[lasting[tried]])]) > _LEAST_PIECE * tip_radius_m:
                break
            elif apart(tried, high if step > 0 else low) > _BREAK_S and off([own], pieces) > tip_radius_m:
                break
    return lasting[low], lasting[high]


def _travel(points: np.ndarray) -> float:
    # positions come in steps, so the path is measured on every 50th sample
    return float(np.linalg.norm(np.diff(points[::50], axis=0), axis=1).sum()) if len(points) > 50 else 0.0
