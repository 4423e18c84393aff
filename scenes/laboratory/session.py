"""One hand on one object: the same exploration with any subset of its effects."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.mechanics.options import option
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import TimeSegment
from palpate.scenes.laboratory.curves import Solving
from palpate.scenes.laboratory.effects import SensedSamples, effect
from palpate.scenes.laboratory.effects.solid import scaled
from palpate.scenes.laboratory.force import beyond_quasilinear, elastic_force
from palpate.scenes.laboratory.frame import axes_of, quaternions, random_frame
from palpate.scenes.laboratory.hand import HandOptions, band_noise
from palpate.scenes.laboratory.hand_path import Motion, motion
from palpate.scenes.laboratory.paths import SIDEWAYS, TouchForce, touch_forces
from palpate.scenes.laboratory.presses import PROTOCOLS, PlannedTouch
from palpate.scenes.laboratory.specimen import Fineness, Specimen, ball
from palpate.scenes.laboratory.tracing import RATE_HZ, trace
from palpate.scenes.phantoms import Phantom


@dataclass(frozen=True)
class SimulateOptions:
    """What a person may choose about a simulated exploration."""

    young_modulus_pa: float | None = option(
        None, "Young's modulus of the matrix; None: the phantom's own", unit="Pa", flag="--modulus"
    )
    protocol: str = option("ordinary", "how much is touched", choices=tuple(PROTOCOLS))
    presses: int = option(0, "number of the press set: which places, how deep, in which order")
    tip_radius_m: float = option(0.005, "radius of the spherical tip", unit="m", flag="--tip-radius")
    force_noise_std_n: float = option(0.012, "sensor noise, standard deviation per axis", unit="N")
    coloured_share: float = option(0.15, "share of the noise's power below 10 Hz, 0 to 1")
    position_resolution_m: float = option(3.0e-5, "step of the position reading", unit="m")
    frame: bool = option(
        False, "turn and shift the device frame at random (else the base's middle is the origin)"
    )
    relaxation: str = option(
        "quasi-linear",
        "viscoelasticity: a law on the elastic force, or solved in the solid for every touch",
        choices=("quasi-linear", "solid"),
    )
    finest_mm: float = option(
        Fineness.finest, "longest edge of the solid's elements next to the touch", unit="mm"
    )


@dataclass(frozen=True)
class Staging:
    """What may be laid down about an exploration instead of being left to numbers and seeds.

    hand: whose habits. touches: instead of a press set. complete: what `--protocol complete` does after the
    touches. frame: (rotation (3, 3), shift (3,) m) from the object's frame to the device's. instrument: what
    the readings go through before any effect; no effect of its own.
    """

    hand: HandOptions = HandOptions()
    touches: tuple[PlannedTouch, ...] | None = None
    complete: bool = False
    frame: tuple[np.ndarray, np.ndarray] | None = None
    instrument: Callable[[SensedSamples], SensedSamples] | None = None


class Session:
    """One hand on one object; runs the same exploration with any subset of its effects."""

    def __init__(
        self,
        phantom: Phantom,
        modulus: float,
        options: SimulateOptions,
        touches: tuple[PlannedTouch, ...],
        parameters: Mapping[str, Mapping[str, Any]],
        seed: int,
        staging: Staging,
        solving: Solving,
    ) -> None:
        self.phantom, self.modulus, self.options, self.staging = phantom, modulus, options, staging
        self.touches, self.parameters, self.seed = touches, parameters, seed
        self._solving = replace(solving, fineness=Fineness(finest=options.finest_mm))
        self._ways: dict[float, Motion] = {}
        self.rotation, self.shift = np.eye(3), np.zeros(3)
        if options.frame:
            self.rotation, self.shift = random_frame(seed, 1e3 * phantom.height_m)
        if staging.frame is not None:
            self.rotation, self.shift = staging.frame

    def _rng(self, what: str) -> np.random.Generator:
        return np.random.default_rng([self.seed, zlib.crc32(what.encode())])

    def specimen(self, present: Sequence[str], regions: bool) -> Specimen:
        """The solid with the effects `present`, and with the phantom's own regions or without."""
        balls = tuple(ball(r.centre_m, r.radius_m, r.modulus_ratio) for r in self.phantom.regions)
        specimen = Specimen(
            poisson_ratio=self.phantom.poisson_ratio,
            tip_radius=round(1e3 * self.options.tip_radius_m, 6),
            balls=balls if regions else (),
        )
        for name in present:
            change = effect(name).in_solid
            if change is not None:
                specimen = change(specimen, scaled(name, self.parameters[name], self.modulus))
        return specimen

    def forces(self, present: Sequence[str], regions: bool) -> list[TouchForce]:
        """Solved touches with the effects `present`."""
        inside = [name for name in present if effect(name).in_solid or effect(name).on_shape]
        label = "solving " + (" + ".join(inside) if inside else "the ideal object")
        solving = replace(self._solving, label=label)
        return touch_forces(self._shape(present), self.specimen(present, regions), self.touches, solving)

    def motion(self, radius: float) -> Motion:
        """The same hand's way every time, made once."""
        if radius in self._ways:
            return self._ways[radius]
        hand = self.staging.hand
        traced = trace(self.phantom, hand, radius, self.modulus, self._rng("trace"))
        again = None
        if self.staging.complete or PROTOCOLS[self.options.protocol].complete:
            again = trace(self.phantom, hand, radius, self.modulus, self._rng("retrace"))
        way = motion(self.phantom, self.touches, traced, hand, radius, self._rng("motion"), again)
        self._ways[radius] = way
        return way

    def run(
        self, present: Sequence[str], regions: bool = True, moved: np.ndarray | None = None
    ) -> tuple[SensedSamples, np.ndarray]:
        """(readings, their force without noise), device frame, SI, with the effects `present`; `felt` is then
        the object's part (n, 3) N of it.

        moved: (n, 3) mm, object frame: the tip goes this much aside of the hand's way.
        """
        specimen = self.specimen(present, regions)
        # the hand is the same whatever is left out: its tip has the radius that it really has
        way = self.motion(self.specimen(tuple(self.parameters), regions).tip_radius)
        if moved is not None:
            way = _aside(way, moved, self.touches)
        force = elastic_force(way, self.forces(present, regions), self.modulus)
        normals = self._normals(way)
        if specimen.friction is not None:
            force = _capped(force, specimen.friction, normals)
        for name in present:
            act = effect(name).on_force
            if act is not None:
                force = act(force, way, normals, self.parameters[name])
            if name == "viscoelasticity" and self.options.relaxation == "solid":
                force = force + self._beyond_quasilinear(present, regions, way, normals)
        turn = self.rotation
        self.felt = (force + way.trace_force) @ turn.T
        readings = SensedSamples(
            way.t,
            1e-3 * (way.position @ turn.T) + self.shift,
            self.felt,
            turn @ axes_of(way.axis),
            way.t > way.phase[1] + 0.05,
        )
        if self.staging.instrument is not None:
            readings = self.staging.instrument(readings)
        for name in present:
            read = effect(name).on_readings
            if read is not None:
                readings = read(readings, self.parameters[name])
        self.way = way
        return readings, readings.force

    def _beyond_quasilinear(
        self, present: Sequence[str], regions: bool, way: Motion, normals: np.ndarray
    ) -> np.ndarray:
        """(n, 3) N: what the relaxing solid answers beyond the quasi-linear law."""
        p = self.parameters["viscoelasticity"]
        straight = replace(way, stray=np.zeros_like(way.stray))
        elastic = elastic_force(straight, self.forces(present, regions), self.modulus)
        quasilinear = effect("viscoelasticity").on_force
        assert quasilinear is not None, "viscoelasticity acts on the elastic force"
        law = quasilinear(elastic, way, normals, p)
        prony = tuple(zip(p["g"], p["tau_s"], strict=True))
        relaxing = replace(self.specimen(present, regions), prony=prony)
        solving = replace(self._solving, label="solving the relaxing solid")
        return beyond_quasilinear(
            self._shape(present), relaxing, self.touches, way, law, self.modulus, solving
        )

    def _shape(self, present: Sequence[str]) -> Phantom:
        """The object's surface with the effects `present`."""
        phantom = replace(self.phantom, regions=())
        for name in present:
            change = effect(name).on_shape
            if change is not None:
                phantom = change(phantom, self.parameters[name])
        return phantom

    def _normals(self, way: Motion) -> np.ndarray:
        normals = np.zeros_like(way.position)
        inside = way.touch >= 0
        normals[inside] = np.array([t.normal for t in self.touches])[way.touch[inside]]
        return normals

    def recording(self, readings: SensedSamples, clean: np.ndarray, truth: Mapping[str, Any]) -> Recording:
        """Noise added, positions quantised."""
        options, rng = self.options, self._rng("noise")
        n = len(readings.t)
        white = rng.normal(size=(n, 3)) * np.sqrt(1 - options.coloured_share)
        slow = np.column_stack([band_noise(n, RATE_HZ, 0.3, 10.0, rng) for _ in range(3)])
        noise = options.force_noise_std_n * (white + np.sqrt(options.coloured_share) * slow)
        step = options.position_resolution_m
        position = np.round(readings.position / step) * step if step > 0 else readings.position
        return Recording(
            t=readings.t,
            position=position,
            force_on_tool=clean + noise,
            sample_rate_hz=RATE_HZ,
            tip_radius_m=options.tip_radius_m,
            quaternion=quaternions(readings.axes),
            boundary_phase=(round(self.way.phase[0], 2), round(self.way.phase[1], 2)),
            segments=tuple(TimeSegment(kind, round(a, 2), round(b, 2)) for kind, a, b in self.way.beside),
            force_noise_std_n=options.force_noise_std_n,
            position_resolution_m=step,
            object_name=self.phantom.name,
            poisson_ratio=self.phantom.poisson_ratio,
            truth=dict(truth),
        )


def _aside(way: Motion, moved: np.ndarray, touches: Sequence[PlannedTouch]) -> Motion:
    """The way of a tip that is displaced by `moved` (n, 3) mm: along each touch's path, and
    sideways of it.
    """
    s, stray = way.s.copy(), way.stray.copy()
    for number, touch in enumerate(touches):
        rows = way.touch == number
        direction = np.repeat(touch.direction[None], rows.sum(), axis=0)
        distance = np.linalg.norm(touch.side)
        if distance > 0:
            direction[way.leg[rows] == SIDEWAYS] = touch.side / distance
        along = (moved[rows] * direction).sum(axis=1)
        s[rows] += along
        stray[rows] += moved[rows] - along[:, None] * direction
    return replace(way, position=way.position + moved, s=s, stray=stray)


def _capped(force: np.ndarray, mu: float, normals: np.ndarray) -> np.ndarray:
    """Straying cannot drag along more than friction holds; the solved path itself obeys it already."""
    along = (force * normals).sum(axis=1)
    side = force - along[:, None] * normals
    size = np.linalg.norm(side, axis=1)
    # on a curved or sloping place the pressure itself has a part sideways
    most = (mu + 0.35) * np.maximum(along, 0.0)
    factor = np.where(size > most, most / np.maximum(size, 1e-12), 1.0)
    return along[:, None] * normals + factor[:, None] * side
