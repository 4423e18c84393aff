"""Lines of JSON between the explorer and a robot: a suggestion out, what was felt in.

Out, one line each: {"suggest": {...}, "state": {...}} after the greeting and after every segment. In:
{"segment": "trace" or "press", "t": [...], "position": [[x, y, z], ...], "force": [[x, y, z], ...],
"quaternion": [[w, x, y, z], ...] (where known)}, or {"end": true}. Device frame, SI units; force on the
tool. A line that cannot be used is answered with {"error": "..."} and nothing of it is kept.

A robot in the virtual laboratory: carries suggestions out on a phantom, with errors of place, way and
depth.

What is new is simulated after the touch before it, and joined to where the tip was left in the air. Where
the object remembers earlier touches, or an effect depends on all of them, the whole exploration is simulated
with one touch more: a hand of the same seed goes the same way up to there.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from palpate.diagnosis.explore.explorer import Explorer, Suggestion
from palpate.diagnosis.explore.segments import Instrument, Segment
from palpate.mechanics.errors import RecordingError, SceneError
from palpate.mechanics.options import option
from palpate.mechanics.shape.nearest import closest, first_hits
from palpate.scenes.laboratory.curves import ALONE, Solving
from palpate.scenes.laboratory.effects import SensedSamples, effect
from palpate.scenes.laboratory.frame import quaternions
from palpate.scenes.laboratory.hand import HandOptions, minimum_jerk
from palpate.scenes.laboratory.presses import PlannedTouch
from palpate.scenes.laboratory.session import SimulateOptions, Staging
from palpate.scenes.laboratory.simulate import Simulation, simulate
from palpate.scenes.laboratory.support_and_air import on_the_support, waving
from palpate.scenes.laboratory.tracing import RATE_HZ
from palpate.scenes.phantoms import Phantom
from palpate.words import mm

MOST_CHARACTERS = 64_000_000
"""Of one line: a minute at 1 kHz takes some 8 million."""


def segment_of(line: str) -> Segment | None:
    """What a robot's line says; None: it wants to end. Raises RecordingError for anything else."""
    if len(line) > MOST_CHARACTERS:
        raise RecordingError(f"a line of {len(line)} characters; at most {MOST_CHARACTERS} are read")
    try:
        said = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"a line is no JSON ({error}): send one object a line") from None
    if not isinstance(said, dict):
        raise RecordingError(f"a line holds a {type(said).__name__}; send an object with 'segment'")
    if said.get("end") is True:
        return None
    missing = [name for name in ("segment", "t", "position", "force") if name not in said]
    if missing:
        raise RecordingError(f"a segment lacks {', '.join(missing)}: send segment, t, position and force")
    try:
        return Segment(said["segment"], said["t"], said["position"], said["force"], said.get("quaternion"))
    except (TypeError, ValueError) as error:
        raise RecordingError(f"a segment's samples are no numbers in rows: {error}") from None


def answer(explorer: Explorer) -> dict[str, Any]:
    """What is said to the robot now."""
    return {"suggest": explorer.suggest().table(), "state": explorer.state.table()}


def serve(
    explorer: Explorer,
    lines: Iterable[str],
    say: Callable[[str], None],
    kept: Callable[[Explorer], object],
) -> None:
    """Talk until the robot ends, its lines do, or there is nothing left to suggest.

    kept: called after every segment that was taken in, so that nothing felt is lost.
    """
    reply = answer(explorer)
    say(json.dumps(reply))
    for line in lines:
        if not line.strip():
            continue
        try:
            segment = segment_of(line)
            if segment is None:
                return
            explorer.add(segment)
        except RecordingError as error:
            say(json.dumps({"error": str(error)}))
            continue
        kept(explorer)
        reply = answer(explorer)
        say(json.dumps(reply))
        if reply["suggest"]["kind"] == "stop":
            return


@dataclass(frozen=True)
class RobotOptions:
    """How well it does what it is told: standard deviations."""

    place_error_m: float = option(0.001, "sideways error of the pressed place", unit="m")
    way_error_deg: float = option(4.0, "error of the approach direction", unit="deg")
    depth_error: float = option(0.08, "error of the depth, as a share of the depth")
    speed_error: float = option(0.15, "error of the speed, as a share of the speed")


JOIN_S = 0.25
"""In free air, over which a touch's way is joined to where the last one ended."""


class LaboratoryRobot:
    """A phantom, its effects, and a hand that follows suggestions. Device frame: the object's own.

    places: touches that may be made, lengths mm, object frame; a suggestion is carried out at the nearest of
    them, as deep as it is solved. None: anywhere, which solves every touch anew. made: presses of an
    exploration that is gone on with.
    """

    def __init__(
        self,
        phantom: Phantom,
        effects: Mapping[str, float] | None = None,
        *,
        seed: int = 0,
        options: SimulateOptions | None = None,
        robot: RobotOptions | None = None,
        solving: Solving | None = None,
        places: Sequence[PlannedTouch] | None = None,
    ) -> None:
        self.phantom, self.effects, self.seed = phantom, dict(effects or {}), seed
        self.options = options or SimulateOptions()
        self.robot = robot or RobotOptions()
        self.hand = HandOptions(hold_share=0.3, longest_hold_s=0.5, pause_s=0.1, tilt_deg=4.0)
        self._solving = solving or ALONE
        self._surface = trimesh.Trimesh(phantom.vertices, phantom.faces, process=False)
        self._rng = np.random.default_rng([seed, 16])
        self._touches: list[PlannedTouch] = []
        self._places = places
        self._left: np.ndarray | None = None
        self.made = 0
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
        if suggestion.kind in ("trace", "retrace"):
            made = self._simulated([self._aside()], self.seed + (suggestion.kind == "retrace"))
            # with the way to a touch that is only laid down to have one: free air, which tells the noise
            return self._part(made, suggestion.kind, 0, int(np.argmax(made.motion.touch >= 0)))
        if suggestion.kind in ("rigid", "free"):
            return self._without_object(suggestion.kind)
        self._touches.append(self._touch(suggestion))
        forgets = all(effect(name).forgets for name in self.effects)
        if self.made and not forgets:
            raise SceneError(
                "an exploration of this phantom cannot be continued: its effects remember earlier touches"
            )
        new = self._touches[-2:] if forgets else self._touches
        made = self._simulated(
            new, self.seed + 7919 * (self.made + len(self._touches)) if forgets else self.seed
        )
        rows = np.flatnonzero(made.motion.touch == len(new) - 1)
        # after the touch before, or where the tracing's segment ended
        start = int((made.motion.phase[1] + 0.6) * 1000)
        if len(new) > 1:
            start = int(np.flatnonzero(made.motion.touch == len(new) - 2)[-1]) + 1
        return self._part(made, "press", start, int(rows[-1]) + 1)

    def _simulated(self, touches: list[PlannedTouch], seed: int) -> Simulation:
        self.last = simulate(
            self.phantom,
            self.effects,
            self.options,
            seed=seed,
            sizes=False,
            staging=Staging(self.hand, tuple(touches)),
            solving=self._solving,
        )
        return self.last

    def _without_object(self, kind: str) -> Segment:
        """Three presses on the bare support, or waving and turning in the air, as they are read."""
        rng, options = np.random.default_rng([self.seed, len(kind), len(self._touches)]), self.options
        if kind == "rigid":
            height, push = on_the_support()
            reach = float(np.linalg.norm(self._surface.vertices[:, :2], axis=1).max())
            way = [1.4 * reach, 0, options.tip_radius_m] + np.outer(1e-3 * height, [0, 0, 1])
            force, turn = np.outer(push, [0, 0, 1]), np.zeros_like(way)
        else:
            aside, turn = waving(rng)
            way = [0, 0, float(self._surface.vertices[:, 2].max()) + 0.06] + 1e-3 * aside
            force = np.zeros_like(way)
        axes, all_of_it = Rotation.from_rotvec(turn).as_matrix(), np.ones(len(way), dtype=bool)
        readings = SensedSamples(np.arange(len(way)) / RATE_HZ, way, force, axes, all_of_it)
        known = {} if self.last is None else dict(self.last.truth["parameters"])
        for name in self.effects:
            read = effect(name).on_readings
            if read is not None:
                readings = read(readings, known[name])
        noisy = readings.force + options.force_noise_std_n * rng.normal(size=force.shape)
        step = options.position_resolution_m
        position = np.round(readings.position / step) * step if step > 0 else readings.position
        self._left = position[-1]
        return Segment(kind, readings.t, position, noisy, quaternions(readings.axes))

    def _part(self, made: Simulation, kind: str, start: int, end: int) -> Segment:
        r = made.recording
        turned = None if r.quaternion is None else r.quaternion[start:end]
        position = r.position[start:end].copy()
        if self._left is not None:
            fade = 1 - minimum_jerk(int(JOIN_S * r.sample_rate_hz))[: len(position), None]
            position[: len(fade)] += fade * (self._left - position[0])
        self._left = position[-1]
        return Segment(kind, r.t[start:end], position, r.force_on_tool[start:end], turned)

    def _aside(self) -> PlannedTouch:
        if self._places is not None:
            return replace(self._places[0], depth=1.0)
        # the middle of a face: a ray that meets a vertex or an edge may pass between its faces
        middles = self._surface.triangles_center
        top = middles[np.argmax(middles[:, 2])]
        return self._landed(top + [0, 0, 0.02], np.array([0.0, 0.0, -1.0]), 0.001)

    def _touch(self, suggestion: Suggestion) -> PlannedTouch:
        assert suggestion.point is not None and suggestion.normal is not None
        rng, error = self._rng, self.robot
        turn = np.radians(error.way_error_deg) * rng.normal(size=3)
        way = -suggestion.normal + np.cross(turn, suggestion.normal)
        way /= np.linalg.norm(way)
        off = error.place_error_m * rng.normal(size=3)
        depth = suggestion.depth_m * float(np.exp(error.depth_error * rng.normal()))
        speed = 1e3 * suggestion.speed_m_per_s * float(np.exp(error.speed_error * rng.normal()))
        if self._places is not None:
            touch = self._nearest(1e3 * (suggestion.point + off), 1e3 * depth)
        else:
            touch = self._landed(suggestion.point + off + 0.05 * suggestion.normal, way, depth)
        return replace(touch, speed=speed, hold=suggestion.hold_s)

    def _nearest(self, point_mm: np.ndarray, depth_mm: float) -> PlannedTouch:
        assert self._places is not None
        touch = min(self._places, key=lambda p: float(np.linalg.norm(p.point - point_mm)))
        visits = sum(t.site == touch.site for t in self._touches)
        depth = float(np.clip(depth_mm, 0.5, max(touch.reach, touch.depth)))
        return replace(touch, depth=depth, repeat=visits)

    def _landed(self, start: np.ndarray, way: np.ndarray, depth: float) -> PlannedTouch:
        """The touch of a tip that comes from `start` along `way` until it feels something, then `depth` m."""
        surface = self._surface
        far, face = (x[0] for x in first_hits(surface.vertices, surface.faces, start[None], way[None]))
        if face >= 0:
            point = start + far * way
        else:
            # a miss: the nearest place to where it aimed stands for where the robot feels its way to
            at = np.atleast_2d(start + 0.05 * way)
            (point,), (face,), _ = closest(surface.vertices, surface.faces, at)
        normal = surface.face_normals[face]
        if point[2] < 0.004:
            raise SceneError(
                f"a touch {mm(point[2], '.1f')} above the support would press the support: choose a "
                "higher place"
            )
        if -way @ normal < np.cos(np.radians(35)):
            # steeper than a tip holds: it turns towards the surface that it feels
            way = -normal
        return PlannedTouch(
            site=len(self._touches),
            point=np.round(1e3 * point, 3),
            normal=normal / np.linalg.norm(normal),
            kind="oblique",
            depth=round(1e3 * depth * 8) / 8 or 0.125,
            direction=way / np.linalg.norm(way),
            side=np.zeros(3),
        )
