"""A robot in the virtual laboratory: carries suggestions out on a phantom, with errors of place, way and
depth.

The same exploration is simulated with one touch more each time; a hand of the same seed goes the same way up
to there, so what is new is the part after it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from mechanics.errors import SceneError
from mechanics.options import option
from mechanics.progress import Progress, silent
from palpate.exploring.explorer import Suggestion
from palpate.exploring.rows import Instrument, Segment
from scenes.laboratory.hand import HandOptions
from scenes.laboratory.presses import Touch
from scenes.laboratory.session import SimulateOptions, Staging
from scenes.laboratory.simulate import Simulation, simulate
from scenes.phantoms import Phantom


@dataclass(frozen=True)
class RobotOptions:
    """How well it does what it is told: standard deviations."""

    place_error_m: float = option(0.001, "sideways, of where it presses", unit="m")
    way_error_deg: float = option(4.0, "of the direction in which it comes", unit="deg")
    depth_error: float = option(0.08, "of the depth, as a share of it")


class LaboratoryRobot:
    """A phantom, its effects, and a hand that follows suggestions. Device frame: the object's own."""

    def __init__(
        self,
        phantom: Phantom,
        effects: Mapping[str, float] | None = None,
        *,
        seed: int = 0,
        options: SimulateOptions | None = None,
        robot: RobotOptions | None = None,
        workers: int | None = 1,
        cache: Path | None = None,
        progress: Progress = silent,
    ) -> None:
        self.phantom, self.effects, self.seed = phantom, dict(effects or {}), seed
        self.options = options or SimulateOptions()
        self.robot = robot or RobotOptions()
        self.hand = HandOptions(hold_share=0.3, longest_hold_s=0.5, pause_s=0.1, tilt_deg=4.0)
        self._workers, self._cache, self._progress = workers, cache, progress
        self._surface = trimesh.Trimesh(phantom.vertices, phantom.faces, process=False)
        self._rng = np.random.default_rng([seed, 16])
        self._touches: list[Touch] = []
        self._emitted = 0
        self.last: Simulation | None = None

    @property
    def instrument(self) -> Instrument:
        """What the explorer may know."""
        about = {
            "force_noise_std_n": self.options.force_noise_std_n,
            "position_resolution_m": self.options.position_resolution_m,
            "object_name": self.phantom.name,
            "poisson_ratio": self.phantom.poisson_ratio,
        }
        return Instrument(self.options.tip_radius_m, 1000.0, about)

    def carry_out(self, suggestion: Suggestion) -> Segment:
        """What the device reads while the suggestion is followed. Raises SceneError where it misses."""
        if suggestion.kind == "trace":
            made = self._simulated([self._aside()])
            # with the way to a touch that is only laid down to have one: free air, which tells the noise
            end = int(np.argmax(made.motion.touch >= 0))
            return self._part(made, "trace", 0, end)
        self._touches.append(self._touch(suggestion))
        made = self._simulated(self._touches)
        rows = np.flatnonzero(made.motion.touch == len(self._touches) - 1)
        # after the touch before, or where the tracing's segment ended
        start = int((made.motion.phase[1] + 0.6) * 1000)
        if len(self._touches) > 1:
            start = int(np.flatnonzero(made.motion.touch == len(self._touches) - 2)[-1]) + 1
        return self._part(made, "press", start, int(rows[-1]) + 1)

    def _simulated(self, touches: list[Touch]) -> Simulation:
        self.last = simulate(
            self.phantom,
            self.effects,
            self.options,
            hand=self.hand,
            seed=self.seed,
            sizes=False,
            staging=Staging(touches=tuple(touches)),
            workers=self._workers,
            cache=self._cache,
            progress=self._progress,
        )
        return self.last

    def _part(self, made: Simulation, kind: str, start: int, end: int) -> Segment:
        r = made.recording
        turned = None if r.quaternion is None else r.quaternion[start:end]
        return Segment(kind, r.t[start:end], r.position[start:end], r.force_on_tool[start:end], turned)

    def _aside(self) -> Touch:
        top = self._surface.vertices[np.argmax(self._surface.vertices[:, 2])]
        return self._landed(top + [0, 0, 0.02], np.array([0.0, 0.0, -1.0]), 0.001)

    def _touch(self, suggestion: Suggestion) -> Touch:
        assert suggestion.point is not None and suggestion.normal is not None
        rng, error = self._rng, self.robot
        turn = np.radians(error.way_error_deg) * rng.normal(size=3)
        way = -suggestion.normal + np.cross(turn, suggestion.normal)
        way /= np.linalg.norm(way)
        off = error.place_error_m * rng.normal(size=3)
        start = suggestion.point + off + 0.05 * suggestion.normal
        depth = suggestion.depth_m * float(np.exp(error.depth_error * rng.normal()))
        return self._landed(start, way, depth)

    def _landed(self, start: np.ndarray, way: np.ndarray, depth: float) -> Touch:
        """The touch of a tip that comes from `start` along `way` until it feels something, then `depth` m."""
        met = _first_hit(self._surface, start, way)
        if met is None:
            # a miss: the nearest place to where it aimed stands for where the robot feels its way to
            at = np.atleast_2d(start + 0.05 * way)
            hits, _, faces = trimesh.proximity.closest_point(self._surface, at)
            met = hits[0], int(faces[0])
        point, normal = met[0], self._surface.face_normals[met[1]]
        if point[2] < 0.004:
            raise SceneError(
                f"a touch {1e3 * point[2]:.1f} mm above the support would press the support: choose a "
                "higher place"
            )
        if -way @ normal < np.cos(np.radians(35)):
            # steeper than a tip holds: it turns towards the surface that it feels
            way = -normal
        return Touch(
            site=len(self._touches),
            point=np.round(1e3 * point, 3),
            normal=normal / np.linalg.norm(normal),
            kind="oblique",
            depth=round(1e3 * depth * 8) / 8 or 0.125,
            direction=way / np.linalg.norm(way),
            side=np.zeros(3),
        )


def _first_hit(surface: trimesh.Trimesh, start: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, int] | None:
    """(point (3,), triangle) where a ray first meets a surface (Moeller and Trumbore 1997), or None."""
    corner = surface.triangles
    one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    across = np.cross(way, two)
    size = np.einsum("ij,ij->i", one, across)
    safe = np.where(np.abs(size) > 1e-15, size, 1.0)
    off = start - corner[:, 0]
    u = np.einsum("ij,ij->i", off, across) / safe
    other = np.cross(off, one)
    v = other @ way / safe
    far = np.einsum("ij,ij->i", two, other) / safe
    met = (np.abs(size) > 1e-15) & (u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0)
    if not met.any():
        return None
    face = int(np.argmin(np.where(met, far, np.inf)))
    return start + far[face] * way, face
