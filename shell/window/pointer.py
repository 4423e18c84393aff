"""From a mouse over a picture to a tip over an object.

The tip hovers over the place that the mouse points at, a little off the surface; while the button is held it
goes in along the inward normal, and out again when it is let go. Over the support it comes down onto the
support, and beside the object it leans against the foot and slides along it, so that the base can be traced.
To a place far from the last one it travels in free air, over the object where that stands in the way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyvista
from vtkmodules.vtkCommonCore import mutable
from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator

from palpate.mechanics.shape.tetmesh import vertex_normals
from palpate.window.base_tracing import NEAR_M

HOVER_M = 0.008
PRESS_SPEED_M_PER_S = 0.02
RELEASE_SPEED_M_PER_S = 0.06
BEAR_DOWN_M = 0.0003
LEAN_M = 0.0003
CLEAR_M = 0.001
LEAST_PRESS_M, MOST_PRESS_M = 0.0005, 0.010
MOST_SPEED_M_PER_S = 0.4
_CLOSE_M = 1e-6
LEAP_M, ARRIVED_M = 0.02, 0.002
"""Farther than a leap from where it should be, the tip travels until it has arrived."""


@dataclass(frozen=True)
class Target:
    """A place that the mouse points at: (3,) m on the surface, outward unit normal, and on what."""

    point: np.ndarray
    normal: np.ndarray
    on_support: bool


class Pointer:
    """Holds where the mouse points, whether it presses and how deep; `place` moves the tip for one frame.

    tip_m: (3,) m, where the hand means the tip's centre to be.
    """

    def __init__(
        self,
        points: np.ndarray,
        triangles: np.ndarray,
        tip_radius_m: float,
        support_point: np.ndarray,
        support_normal: np.ndarray,
    ) -> None:
        self._points = np.asarray(points, dtype=float)
        self._triangles = np.asarray(triangles)
        self._normals = vertex_normals(self._points, self._triangles)
        self._shell = pyvista.PolyData.from_regular_faces(self._points, self._triangles)
        self._locator: Any = vtkStaticCellLocator()
        self._locator.SetDataSet(self._shell)
        self._locator.BuildLocator()
        self.radius = tip_radius_m
        self._support_point = np.asarray(support_point, dtype=float)
        self._up = np.asarray(support_normal, dtype=float)
        self.press_depth_m = 0.004
        self.pressing = False
        self.target: Target | None = None
        top = ((self._points - self._support_point) @ self._up).max() + 0.03
        middle = self._points.mean(axis=0)
        self.tip_m = middle + (top - (middle - self._support_point) @ self._up) * self._up
        self._depth = -HOVER_M
        self._safe = top  # height over the support at which nothing is in the way
        self._travelling = False

    def point_along(self, near: np.ndarray, far: np.ndarray) -> Target | None:
        """What a ray from the eye meets first; None where it meets nothing (the target then stays)."""
        found = self._hit(near, far)
        if found is not None:
            self.target = found
        return found

    def below(self, place_m: np.ndarray) -> Target | None:
        """What lies straight under a place (3,) m; None where nothing does."""
        return self._hit(place_m, place_m - 2.0 * self._safe * self._up)

    def inside(self, point_m: np.ndarray, under_m: float) -> np.ndarray:
        """(3,) m: the place itself, or the nearest one that lies so far under the surface; half way through
        where the object is thinner than twice that."""
        closest, normal = self._nearest(np.asarray(point_m, dtype=float))
        if (point_m - closest) @ normal <= -under_m:
            return np.asarray(point_m, dtype=float)
        return closest - min(under_m, 0.5 * self._thickness(closest, normal)) * normal

    def under(self, radius_m: float) -> tuple[np.ndarray, float]:
        """Where a ball goes that is put under the tip: its centre (3,) m, a radius under the surface, and
        its radius m, smaller in a thin object."""
        target = self.target
        if target is None or target.on_support:
            point, normal = self._nearest(self.tip_m)
        else:
            point, normal = target.point, target.normal
        thickness = self._thickness(point, normal)
        return point - min(2.0 * radius_m, 0.5 * thickness) * normal, min(radius_m, 0.45 * thickness)

    def _thickness(self, point: np.ndarray, normal: np.ndarray) -> float:
        """m, from a place of the surface straight through to the other side."""
        met = self._meets(point - 1e-4 * normal, point - 2.0 * self._safe * normal)
        return 2e-3 if met is None else float(np.linalg.norm(met[1] - point))

    def deeper(self, steps: float) -> None:
        """The wheel: how deep a press goes, 0.5 mm a step."""
        self.go_deep(1e3 * self.press_depth_m + 0.5 * steps)

    def go_deep(self, depth_mm: float) -> None:
        """The slider: how deep a press goes."""
        self.press_depth_m = float(np.clip(1e-3 * depth_mm, LEAST_PRESS_M, MOST_PRESS_M))

    def place(self, duration_s: float, felt: np.ndarray | None = None) -> np.ndarray:
        """(3,) m, where the hand means the tip's centre to be after another frame.

        felt: (3,) m, where the tip is. On its way over the object the hand waits for a tip that stays behind,
        which would cut the corner, through the object.
        """
        target = self.target
        if target is None:
            return self.tip_m
        if self._travelling and felt is not None and np.linalg.norm(felt - self.tip_m) > LEAP_M:
            return self.tip_m
        reach = MOST_SPEED_M_PER_S * duration_s
        away = float(np.linalg.norm(self._centre(target, self._depth) - self.tip_m))
        self._travelling = away > (ARRIVED_M if self._travelling else LEAP_M)
        if self._travelling:
            self._depth = -HOVER_M
            return self._go(self._way(self._centre(target, -HOVER_M)), reach)
        deepest = BEAR_DOWN_M if target.on_support else self.press_depth_m
        goal = deepest if self.pressing else -HOVER_M
        speed = PRESS_SPEED_M_PER_S if goal > self._depth else RELEASE_SPEED_M_PER_S
        # far away one may be quick; near the surface a press has the speed of a press
        if goal > self._depth and self._depth < -0.002:
            speed = RELEASE_SPEED_M_PER_S
        step = speed * duration_s
        self._depth += float(np.clip(goal - self._depth, -step, step))
        self._depth = min(self._depth, deepest)
        return self._go(self._centre(target, self._depth), reach)

    def _centre(self, target: Target, depth_m: float) -> np.ndarray:
        centre = target.point + (self.radius - depth_m) * target.normal
        if not target.on_support:
            return centre
        if depth_m < 0:
            return self._beside(centre, self.radius + CLEAR_M)
        return self._beside(centre, self.radius - LEAN_M, self.radius + NEAR_M)

    def _go(self, to: np.ndarray, reach_m: float) -> np.ndarray:
        move = to - self.tip_m
        distance = float(np.linalg.norm(move))
        self.tip_m = self.tip_m + move * min(1.0, reach_m / max(distance, 1e-12))
        return self.tip_m

    def _way(self, goal: np.ndarray) -> np.ndarray:
        """The goal where the way there is free; else up, then across, until it is."""
        if self._free(goal):
            return goal
        missing = self._safe - float((self.tip_m - self._support_point) @ self._up)
        if missing > ARRIVED_M:
            return self.tip_m + missing * self._up
        return goal + (self._safe - float((goal - self._support_point) @ self._up)) * self._up

    def _free(self, goal: np.ndarray) -> bool:
        """Whether the tip meets nothing on the straight way, but where that begins and ends."""
        length = float(np.linalg.norm(goal - self.tip_m))
        steps = np.arange(1.5 * self.radius, length - 1.5 * self.radius, 0.5 * self.radius)
        for step in steps:
            centre = self.tip_m + step / length * (goal - self.tip_m)
            closest, inside = self._closest(centre)
            if inside or np.linalg.norm(centre - closest) < self.radius:
                return False
        return True

    def _beside(self, centre: np.ndarray, gap_wanted: float, drawn_m: float = 0.0) -> np.ndarray:
        """Moved along the support until the tip's centre is this far from the foot; to it where it is nearer
        than drawn_m, so that what counts as traced leans."""
        for _ in range(8):
            closest, inside = self._closest(centre)
            away = centre - closest
            gap = -float(np.linalg.norm(away)) if inside else float(np.linalg.norm(away))
            if gap >= max(gap_wanted, drawn_m) or abs(gap - gap_wanted) < _CLOSE_M:
                break
            sideways = (-away if inside else away) - ((-away if inside else away) @ self._up) * self._up
            length = float(np.linalg.norm(sideways))
            if length < 1e-9:
                break
            centre = centre + (gap_wanted - gap) * sideways / length
        return centre

    def _closest(self, point: np.ndarray) -> tuple[np.ndarray, bool]:
        place, normal = self._nearest(point)
        return place, float((point - place) @ normal) < 0

    def _nearest(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The surface's nearest place, (3,) m, and the normal there."""
        found, cell, sub, squared = [0.0] * 3, mutable(0), mutable(0), mutable(0.0)
        self._locator.FindClosestPoint(point, found, cell, sub, squared)
        place = np.array(found)
        return place, self._normal_at(int(cell), place)

    def _hit(self, near: np.ndarray, far: np.ndarray) -> Target | None:
        ray = far - near
        met = self._meets(near, far)
        downward = float(ray @ self._up)
        on_plane = float((self._support_point - near) @ self._up) / downward if downward < -1e-12 else np.inf
        if met is not None and met[0] <= on_plane:
            return Target(met[1], self._normal_at(met[2], met[1]), False)
        if 0 < on_plane <= 1:
            return Target(near + on_plane * ray, self._up, True)
        return None

    def _meets(self, near: np.ndarray, far: np.ndarray) -> tuple[float, np.ndarray, int] | None:
        """Where a line first meets the object: the share of it, the place (3,) m and the triangle."""
        share: Any = mutable(0.0)
        place, parametric = [0.0] * 3, [0.0] * 3
        sub, cell = mutable(0), mutable(0)
        met = self._locator.IntersectWithLine(near, far, 1e-9, share, place, parametric, sub, cell)
        return (float(share), np.array(place), int(cell)) if met else None

    def _normal_at(self, cell: int, point: np.ndarray) -> np.ndarray:
        """Interpolated over the triangle, so that the tip does not jerk from facet to facet."""
        corners = self._triangles[cell]
        a, b, c = self._points[corners]
        matrix = np.column_stack([b - a, c - a])
        u, v = np.linalg.lstsq(matrix, point - a, rcond=None)[0]
        weights = np.clip([1 - u - v, u, v], 0.0, 1.0)
        normal = weights @ self._normals[corners]
        return normal / np.linalg.norm(normal)
