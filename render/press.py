"""One scripted press, headless: the force response of a model at one place.

The tip starts in the air, moves along a straight line at constant speed, goes in by the depth asked for, may
hold, and comes back the same way. Sampled at the rate of the servo; no clock, no randomness.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.disk.reading import read_text
from palpate.mechanics.disk.writing import Kind, atomic_file
from palpate.mechanics.errors import OptionError, RecordingError
from palpate.mechanics.plausible import TIP_RADIUS
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.result import Result
from palpate.render.base import Renderer
from palpate.render.force_error import error_figures, force_errors
from palpate.render.scene import TouchScene, scene_of
from palpate.render.surface.bvh import STACK, closest_triangle
from palpate.render.surface.contact_surface import SurfaceArrays
from palpate.render.surface.walking import foot

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model
    from palpate.render.exact import ExactPlaces, SolvedPlace

WRITTEN_DIGITS = 10
"""Of a number in a curve's file."""
COLUMNS = ("t", "x", "y", "z", "depth", "fx", "fy", "fz")
CURVE = Kind("a curve of palpate press", (",".join(COLUMNS).encode(),))
_MARCH = 400
_GRAZING = float(np.cos(np.radians(80)))
MOST_SAMPLES = 1_000_000
BESIDE = 1.1
"""Of the object's diagonal: from its middle so far the support is aimed at on purpose (and drawn)."""


@dataclass(frozen=True, eq=False, repr=False)
class Curve(Result):
    """A force response: t (n,) s, position (n, 3) m of the tip's centre, depth (n,) m, force (n, 3) N on the
    tool.

    Depth is travel along -n since first touch, 0 before it. normal: (3,) outward at first touch; renderer,
    tip_radius_m: what it was pressed with; None for a curve that was read. on_support: the first contact is
    the support, and no force is the object's. unsettled: samples whose force did not settle, and that hold
    the one before. exact: the place as it was solved, where the force is by that. `plot`: force along the
    normal, and its length, over depth. `show`: the object as it is deformed at the deepest, with tip and
    force.
    """

    t: np.ndarray
    position: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    normal: np.ndarray | None = None
    renderer: Renderer | None = None
    tip_radius_m: float | None = None
    exact: SolvedPlace | None = None
    on_support: bool = False
    unsettled: int = 0

    @cached_property
    def error_figures(self) -> dict[str, float]:
        """What the force at the deepest may be off by, N: keys of render.force_error; {} where unknown."""
        if self.renderer is None or self.tip_radius_m is None or self.on_support:
            return {}
        part = slice(self.deepest, self.deepest + 1)
        errors = force_errors(self.renderer, self.position[part], self.force[part], self.tip_radius_m)
        return error_figures(errors)

    @property
    def deepest(self) -> int:
        """Sample of the greatest depth."""
        return int(np.argmax(self.depth))

    @property
    def touched_at(self) -> np.ndarray:
        """(3,) m, of the surface, where the tip first touched; of what was pressed, not read."""
        assert self.normal is not None and self.tip_radius_m is not None, (
            "a curve that was read knows no place"
        )
        felt = int(np.argmax(self.depth > 0))
        along = self.position[felt] - self.position[felt - 1]
        along /= -(along @ self.normal)
        return self.position[felt] - self.depth[felt] * along - self.tip_radius_m * self.normal

    def save(self, path: Path | str) -> Path:
        """Write `t,x,y,z,depth,fx,fy,fz` (s, m, m, N), which `palpate press --expect` takes."""
        write_curve(path, self)
        return Path(path)

    @property
    def peak_force_n(self) -> float:
        """Greatest length of the force, N."""
        return float(np.linalg.norm(self.force, axis=1).max())

    def force_at(self, depth_m: float) -> np.ndarray:
        """(3,) N, on the way in, at a depth; raises OptionError beyond the deepest by more than a sample."""
        last = int(np.argmax(self.depth)) + 1
        deepest = self.depth[last - 1]
        # the turn lies between two samples
        if not 0 <= depth_m <= deepest + np.abs(np.diff(self.depth)).max(initial=0.0):
            raise OptionError(f"depth {depth_m} m is not on the curve: 0 to {deepest:.6g} m")
        return np.array([np.interp(depth_m, self.depth[:last], f) for f in self.force[:last].T])


@dataclass(frozen=True)
class Stroke:
    """How a press moves, sampled at rate_hz.

    depth_m: of the tip's centre along -n after first touch, of the object or of the support beside it.
    hold_s: at depth. approach_m: of free air before. Raises OptionError for what cannot be gone.
    """

    depth_m: float
    speed_m_per_s: float
    hold_s: float = 0.0
    approach_m: float = 2e-3
    rate_hz: float = 1000.0

    def __post_init__(self) -> None:
        for value, name in ((self.depth_m, "depth"), (self.speed_m_per_s, "speed"), (self.rate_hz, "rate")):
            if not (np.isfinite(value) and value > 0):
                raise OptionError(f"{name} is {value}; it must be greater than 0")
        if self.hold_s < 0 or self.approach_m <= 0:
            raise OptionError(
                f"hold is {self.hold_s} s and approach {self.approach_m} m: at least 0 s and more than 0 m"
            )

    def samples(self, steepness: float) -> tuple[np.ndarray, np.ndarray]:
        """(t (n,) s, way (n,) m past first touch) of a line that goes in by `steepness` for each metre."""
        before, deepest = self.approach_m, self.depth_m / steepness
        out = before + deepest
        times = np.array([0.0, out, out, 2 * out]) / self.speed_m_per_s
        times += np.array([0.0, 0.0, self.hold_s, self.hold_s])
        if not times[-1] * self.rate_hz <= MOST_SAMPLES:
            raise OptionError(
                f"the press would last {times[-1]:.4g} s, {times[-1] * self.rate_hz:.3g} samples, "
                f"at most {MOST_SAMPLES}: press faster or hold it for less long"
            )
        t = np.arange(0.0, times[-1] + 0.5 / self.rate_hz, 1.0 / self.rate_hz)
        return t, np.interp(t, times, [-before, out - before, out - before, -before])


def press(
    touched: Renderer | TouchScene,
    at: np.ndarray | None,
    direction: np.ndarray,
    stroke: Stroke,
    tip_radius_m: float | None = None,
) -> Curve:
    """Press along `direction` (3,) with the tip's centre aimed at the point `at` (3,) m, device frame; None:
    at the object's centre of volume.

    touched: a scene, or a renderer, which stands on its model's support. Raises OptionError where the line
    misses both, enters the object through its base, grazes what it meets (more than 80 degrees off the
    normal), or starts inside the object or under the support.
    """
    scene = scene_of(touched)
    at = centre_of_volume(scene.model) if at is None else np.asarray(at, dtype=float)
    direction = np.asarray(direction, dtype=float)
    length = float(np.linalg.norm(direction))
    if not length > 0 or not np.isfinite(at).all() or not np.isfinite(length):
        raise OptionError(f"direction is {direction.tolist()}; it must be a finite vector that is not 0")
    direction = direction / length
    radius = scene.model.tool.tip_radius_m if tip_radius_m is None else float(tip_radius_m)
    if not TIP_RADIUS.takes(radius):
        raise OptionError(f"the tip's radius is {radius:g}; it must be {TIP_RADIUS.words}")
    height = float(scene.model.support.height(scene.model.mesh.points).max())
    if stroke.depth_m > height:
        raise OptionError(
            f"depth is {stroke.depth_m:g} m, and the object is {height:.4g} m high: "
            "press less deep (in metres)"
        )
    touch, normal, on_support = first_touch(scene, at, direction, radius)
    steepness = -float(normal @ direction)
    if steepness < _GRAZING:
        raise OptionError(
            f"the press runs along the surface, normal {np.round(normal, 3).tolist()}: turn it into the "
            "surface"
        )
    t, along = stroke.samples(steepness)
    position = touch + along[:, None] * direction
    check_start(scene, position[0], touch, radius)
    step_s = 1.0 / stroke.rate_hz
    state = scene.start([radius], dt_s=step_s)
    force = scene.follow(state, np.ascontiguousarray(position[:, None]), np.full(len(t), step_s))
    depth = np.maximum(along * steepness, 0.0)
    unsettled = int(state.touch.unsettled[0])
    return Curve(
        t, position, depth, force[:, 0], normal, scene.renderer, radius, on_support=on_support,
        unsettled=unsettled,
    )  # fmt: skip


def centre_of_volume(model: Model) -> np.ndarray:
    """(3,) m, device frame."""
    corners = model.mesh.points[model.mesh.tetrahedra[:, :4]]
    return np.average(corners.mean(axis=1), axis=0, weights=model.mesh.volumes)


def check_start(scene: TouchScene, start: np.ndarray, touch: np.ndarray, radius: float) -> None:
    """Raise OptionError where the tip's centre starts, at (3,) m, in the object or under the support.

    touch: (3,) m, the centre at first touch. A tip that starts beside the foot may graze the support.
    """
    plane = scene.support
    there = f"the press would start at {np.round(start, 6).tolist()} m, "
    meets = f"along this direction its centre is at {np.round(touch, 6).tolist()} m as it meets the surface: "
    if not scene.is_free(start, radius):
        raise OptionError(
            f"{there}where a tip of radius {radius:g} m is in the object; {meets}approach through less free "
            "air (--approach), or press from another side"
        )
    height = float((start - plane.point) @ plane.normal)
    if plane.stiffness_n_per_m > 0 and height <= 0:
        raise OptionError(
            f"{there}{-height:.4g} m under the support; {meets}aim at least {radius:g} m above it, or "
            "leave it out (--no-support)"
        )


def solved(curve: Curve, exact: ExactPlaces, progress: Progress = silent) -> Curve:
    """The curve with its place solved. Raises OptionError where the solver finds no equilibrium there."""
    place = exact(curve.touched_at, np.asarray(curve.normal), float(curve.depth.max()), progress)
    if place is None:
        raise OptionError(
            "this press cannot be solved (no equilibrium, or it meets the support): press less deep, or "
            "leave out --exact"
        )
    force = curve.force * place.factor(curve.depth)[:, None]
    return replace(curve, force=force, exact=place)


def first_touch(
    scene: TouchScene, at: np.ndarray, direction: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Centre (3,) m of a sphere that comes along `direction` (3, unit) through `at` when it first touches the
    object or the support beside it, the outward normal (3,) there, and whether it is the support.

    Raises OptionError where the line misses both or first meets the base.
    """
    surface = scene.renderer.contact.arrays
    beside = _on_support(scene, surface, at, direction, radius)
    on_object = _on_object(surface, at, direction, radius)
    if on_object is None and beside is None:
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        meant = _in_millimetres(at, low, high)
        if not meant and _on_object(surface, at, -direction, radius) is not None:
            turned = ",".join(f"{v:g}" for v in np.round(-direction, 4) + 0.0)
            meant = f": the other way it does, --direction={turned}"
        raise OptionError(
            f"a tip of radius {radius} m aimed at {at.tolist()} along {np.round(direction, 4).tolist()} does "
            f"not meet the touchable surface (object within {np.round(low, 4).tolist()} to "
            f"{np.round(high, 4).tolist()} m), nor a support next to it{meant}"
        )
    found = [(*each, each is beside) for each in (on_object, beside) if each is not None]
    return min(found, key=lambda f: f[0] @ direction)


def _in_millimetres(at: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    """That a point missed the object, which lies within low to high (3,) m, because it is in mm; '' where a
    thousandth of it is not near the object either."""
    near, size = at / 1e3, float(np.linalg.norm(high - low))
    if (
        np.abs(at).max() < 10 * np.abs([low, high]).max()
        or not ((near > low - size) & (near < high + size)).all()
    ):
        return ""
    return f": these look like mm; in metres it is --at {','.join(f'{v:g}' for v in near)}"


def _on_support(
    scene: TouchScene, surface: SurfaceArrays, at: np.ndarray, direction: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Where it comes down onto the support, not farther from the object than BESIDE; None where it does not,
    or would only graze it."""
    plane = scene.support
    down = float(direction @ plane.normal)
    if plane.stiffness_n_per_m <= 0 or down > -_GRAZING:
        return None
    centre = at + (radius - float((at - plane.point) @ plane.normal)) / down * direction
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    across = centre - (low + high) / 2
    across -= (across @ plane.normal) * plane.normal
    near = np.linalg.norm(across) <= BESIDE * np.linalg.norm(high - low)
    return (centre, plane.normal) if near else None


def _on_object(
    surface: SurfaceArrays, at: np.ndarray, direction: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Where it meets the touchable surface; None where it misses that or meets the base before."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    reach = float(np.linalg.norm(high - low)) + radius + float(np.linalg.norm(at - (low + high) / 2))
    weights, stack = np.zeros(3), np.zeros(STACK, dtype=np.int64)
    point, normal, move = np.zeros(3), np.zeros(3), np.zeros(3)
    along = -reach
    for _ in range(_MARCH):
        centre = at + along * direction
        triangle, distance = closest_triangle(
            surface.bvh, surface.vertices, surface.triangles, centre, np.inf, weights, stack
        )
        gap = distance - radius
        if gap <= 1e-9:
            if surface.free[triangle] == 0:
                return None
            triangle, height = foot(surface, triangle, weights, centre, point, normal, move)
            gap = height - radius
            if gap <= 1e-9:
                return centre, normal
        along += max(gap, 1e-9)
        if along > reach:
            return None
    return None


def write_curve(path: Path | str, curve: Curve) -> None:
    """Write `t,x,y,z,depth,fx,fy,fz` (s, m, m, N)."""
    table = np.column_stack([curve.t, curve.position, curve.depth, curve.force])
    with atomic_file(path, CURVE) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        np.savetxt(
            file, table, fmt=f"%.{WRITTEN_DIGITS}g", delimiter=",", header=",".join(COLUMNS), comments=""
        )


def read_curve(path: Path | str) -> Curve:
    """Read what `write_curve` wrote; raises RecordingError where a column is missing or no number."""
    try:
        rows = list(csv.DictReader(io.StringIO(read_text(path, RecordingError))))
        missing = [c for c in COLUMNS if not rows or c not in rows[0]]
        if missing:
            raise RecordingError(
                f"'{path}' lacks the columns {', '.join(missing)}: needed are {', '.join(COLUMNS)}"
            )
        table = np.array([[float(row[c]) for c in COLUMNS] for row in rows])
    except (TypeError, ValueError) as error:
        raise RecordingError(f"'{path}' has a value that is no number: {error}") from error
    return Curve(table[:, 0], table[:, 1:4], table[:, 4], table[:, 5:8])
