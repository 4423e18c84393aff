"""Tissue as robots probe it: phantoms of the virtual laboratory with a random field of the modulus and a
surface that wanders, pressed straight down place by place; rows of position and force without a time.

The laboratory solves every place on a mesh of its own, by linear elasticity with a tip that meets the moved
surface; what it solved is kept by content. Everything that a robot's owner may choose is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from palpate.mechanics.recording.recording import Recording
from palpate.scenes.laboratory.curves import Curve, PathJob, Solving, curves
from palpate.scenes.laboratory.effects import Bench, effect
from palpate.scenes.laboratory.specimen import Fineness, Specimen
from palpate.scenes.laboratory.surface import Surface
from palpate.scenes.phantoms import Phantom, column, rectangle, stacked

CHEAP = Fineness(finest=3.0, reach=5.0, growth=1.2)
"""Half a second a place."""
PEAK_N, RATE_HZ = 1.0, 100.0
_STATES = 15
_WALL_M = 0.015


@dataclass(frozen=True)
class RobotTissue:
    """A phantom that is solved, to be sampled as often as one likes. centre: (p, 3) m, of the tip at first
    touch; curves: one a place, for unit modulus; modulus_pa: of the matrix; about: what was drawn."""

    centre: np.ndarray
    curves: tuple[Curve, ...]
    modulus_pa: float
    height_m: float
    tip_radius_m: float
    noise_n: float
    about: dict[str, float]

    def sampled(self, rows: int | None, seed: int) -> Recording:
        """Each place's rows from about first touch to some 1 N. rows: a place; None: 5 to 12, as drawn."""
        rng = np.random.default_rng([71, seed])
        position, force = [], []
        for centre, curve in zip(self.centre, self.curves, strict=True):
            deep = -1e-3 * curve.travel[:, 2]
            push = 1e-6 * self.modulus_pa * curve.force
            top = rng.uniform(0.8, 1.2) * PEAK_N * (0.1 if rng.uniform() < 0.02 else 1.0)
            last = float(np.interp(min(top, push[-1, 2]), push[:, 2], deep))
            first = rng.uniform(-0.1, 0.25) * last
            count = int(rng.integers(5, 13))
            into = np.linspace(first, last, rows or count)
            read = PchipInterpolator(deep, push)(np.maximum(into, 0.0))
            position.append(centre - into[:, None] * [0.0, 0.0, 1.0])
            force.append(read + rng.normal(0, self.noise_n, read.shape))
        samples = np.concatenate(position)
        return Recording(
            t=np.arange(len(samples)) / RATE_HZ,
            position=samples,
            force_on_tool=np.concatenate(force),
            sample_rate_hz=RATE_HZ,
            tip_radius_m=self.tip_radius_m,
            object_name="robot-tissue",
            poisson_ratio=0.49,
            description={"recording": {"quasi_static": True}, "object": {"slab_m": self.height_m}},
        )


def robot_tissue(seed: int, *, places: int | None = None, solving: Solving | None = None) -> RobotTissue:
    """The phantom of a seed. places: about how many; None: 70 to 120, as drawn."""
    rng = np.random.default_rng([37, seed])
    spacing, height = rng.uniform(0.006, 0.009), rng.uniform(0.018, 0.035)
    tip = float(rng.choice([0.004, 0.005, 0.006]))
    count = places or int(rng.integers(70, 121))
    along = max(2, round(np.sqrt(count * rng.uniform(0.7, 1.4))))
    across = max(2, round(count / along))
    phantom = _phantom(rng, np.array([along - 1, across - 1]) * spacing + 2 * _WALL_M, height)
    strength = rng.uniform(0.6, 1.4)
    varies = effect("stiffness_field")
    keys = varies.parameters(strength, Bench(phantom, phantom.young_modulus_pa, tip, (), rng))
    assert varies.in_solid is not None
    specimen = varies.in_solid(Specimen(tip_radius=1e3 * tip), keys)
    points, normals = _touched(phantom, rng, along, across, spacing)
    deepest = 1e3 * min(0.3 * height, 1.2 * tip)
    travel = -deepest * np.linspace(0, 1, _STATES)[:, None] ** 1.3 * [0.0, 0.0, 1.0]
    jobs = [PathJob(point, normal, travel) for point, normal in zip(points, normals, strict=True)]
    chosen = replace(solving or Solving(workers=1, label="laboratory"), fineness=CHEAP)
    solved = tuple(curves(phantom, specimen, jobs, chosen))
    # the middle place reaches 1 N at a depth that is drawn
    there = rng.uniform(0.4, 0.75) * deepest
    unit = [1e-6 * np.interp(there, -c.travel[:, 2], c.force[:, 2]) for c in solved]
    modulus, noise = PEAK_N / float(np.median(unit)), rng.uniform(0.004, 0.012)
    wander = float(np.ptp(points[:, 2]))
    about = {
        "places": len(points), "spacing_m": spacing, "height_m": height, "tip_m": tip, "noise_n": noise,
        "log_sd": keys["log_sd"], "length_m": keys["length_m"], "layers": len(keys["layers"]),
        "wander_m": 1e-3 * wander, "modulus_pa": modulus,
    }  # fmt: skip
    centre = 1e-3 * (points + 1e3 * tip * normals)
    mean = float(1e-3 * points[:, 2].mean())
    return RobotTissue(
        centre, solved, modulus, mean, tip, float(noise), {k: float(v) for k, v in about.items()}
    )


def _phantom(rng: np.random.Generator, size: np.ndarray, height: float) -> Phantom:
    """A slab whose top wanders by 1 to 3 mm from its lowest to its highest place."""
    waves = rng.normal(0, 1 / 0.035, (6, 2))
    phases = rng.uniform(0, 2 * np.pi, 6)
    half = size / 2
    grid = np.stack(np.meshgrid(*(np.linspace(-h, h, 60) for h in half)), -1)

    def raw(xy: np.ndarray) -> np.ndarray:
        return np.cos(xy @ waves.T + phases).sum(axis=-1)

    low, high = float(raw(grid).min()), float(raw(grid).max())
    wander = rng.uniform(0.001, 0.003)

    def top(xy: np.ndarray, z: np.ndarray) -> np.ndarray:
        return z * (1 + wander * ((raw(xy) - low) / (high - low) - 0.5) / height)

    profile = column(float(half.max()), height)
    vertices, faces = stacked(rectangle(*size), profile, top)
    return Phantom("robot-tissue", "slab with a wandering top", vertices, faces, 10e3)


def _touched(
    phantom: Phantom, rng: np.random.Generator, along: int, across: int, spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    """(points (p, 3) mm on the top, outward normals (p, 3)), row by row."""
    x, y = ((np.arange(n) - (n - 1) / 2) * spacing for n in (along, across))
    flat = np.array([[a, b] for a in x for b in y]) + rng.normal(0, 0.0003, (along * across, 2))
    above = 1e3 * np.column_stack([flat, np.full(len(flat), phantom.height_m)])
    surface = Surface(phantom.vertices * 1e3, phantom.faces)
    points = surface.nearest(above)[0].round(3)
    return points, surface.normals(points)
