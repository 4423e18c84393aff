"""A simulated exploration of a standing cylinder with a contact law of its own, as an oracle for the
tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.mechanics.recording.recording import Recording

RATE = 1000.0
TIP = 0.005
RADIUS, HEIGHT = 0.040, 0.080
NOISE = 0.012


@dataclass(frozen=True)
class Frame:
    """device = rotation @ object + shift."""

    rotation: np.ndarray
    shift: np.ndarray

    def device(self, points: np.ndarray) -> np.ndarray:
        return points @ self.rotation.T + self.shift

    def object(self, points: np.ndarray) -> np.ndarray:
        return (points - self.shift) @ self.rotation


TILTED = Frame(
    Rotation.from_euler("xyz", [12, -20, 70], degrees=True).as_matrix(), np.array([0.08, -0.05, 0.03])
)


def hertz_with_compliance(u: np.ndarray, modulus: float, compliance: float) -> np.ndarray:
    """Force at travel u: u = (F / h)^(2/3) + compliance F, by tabulating its inverse."""
    h = 4 / 3 * modulus / (1 - 0.49**2) * np.sqrt(TIP)
    force = np.linspace(0, 8, 200001)
    return np.interp(u, (force / h) ** (2 / 3) + compliance * force, force)


def sites() -> tuple[np.ndarray, np.ndarray]:
    """Twelve touched places: (surface points, outward normals) in the object's frame."""
    points, normals = [], []
    for height, angle in [
        (0.02, 0),
        (0.04, 70),
        (0.06, 140),
        (0.03, 200),
        (0.05, 260),
        (0.065, 320),
        (0.022, 110),
    ]:
        n = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
        points.append(RADIUS * n + [0, 0, height])
        normals.append(n)
    for x, y in [(0, 0), (0.02, 0), (-0.01, 0.018), (0, -0.022), (-0.02, -0.01)]:
        points.append(np.array([x, y, HEIGHT]))
        normals.append(np.array([0, 0, 1.0]))
    return np.array(points), np.array(normals)


def smooth(n: int) -> np.ndarray:
    """0 to 1 with zero speed at both ends."""
    s = np.linspace(0, 1, n)
    return s * s * (3 - 2 * s)


def explore_cylinder(
    *,
    frame: Frame = TILTED,
    modulus: float = 16e3,
    compliance: float = 2e-3,
    depth: float = 0.006,
    noise: float = NOISE,
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0),
    drift_n_per_s: float = 0.0,
    turn: float = 1.05,
    clockwise: bool = False,
    state_phase: bool = True,
    support_press: bool = False,
    without_phase: bool = False,
    tool_mass_kg: float = 0.0,
    lift: bool = False,
    lean_n: float = 0.03,
    unlike_speeds: bool = False,
    adhesion_n: float = 0.0,
    seed: int = 0,
) -> tuple[Recording, np.ndarray]:
    """(recording, times of first touch)."""
    random = np.random.default_rng(seed)
    paths, forces, onsets = [], [], []

    def add(path: np.ndarray, force: np.ndarray | None = None) -> None:
        paths.append(path)
        forces.append(np.zeros((len(path), 3)) if force is None else force)

    def count() -> int:
        return sum(map(len, paths))

    angle = np.linspace(0, 2 * np.pi * turn, 6000) * (-1 if clockwise else 1)
    ring = (RADIUS + TIP) * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) + [0, 0, TIP]
    along = np.gradient(ring, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    here = ring[0] + [0.02, 0, 0.03]
    add(np.tile(here, (300, 1)))
    phase = (0.3, 0.3)
    if not without_phase:
        add(here + smooth(300)[:, None] * (ring[0] - here))
        first = count()
        touch = np.ones((len(ring), 1))
        if lift:
            touch[3000:3200] = 0.0
            ring[3000:3200, 2] += 0.002 * np.sin(np.linspace(0, np.pi, 200))
        out = (ring - [0, 0, TIP]) / (RADIUS + TIP)
        add(ring, touch * (2.5 * (np.array([0, 0, 1.0]) - 0.2 * along) + lean_n * out))
        phase = (first / RATE, count() / RATE)
        here = ring[-1] + [0, 0, 0.03]
        add(ring[-1] + smooth(300)[:, None] * (here - ring[-1]))
    points, normals = sites()
    presses = [(p, n, depth * (0.7 + 0.3 * random.random())) for p, n in zip(points, normals, strict=True)]
    if support_press:
        presses.insert(3, (np.array([0.09, 0.02, 0.0]), np.array([0, 0, 1.0]), 0.0005))
    for number, (point, normal, deep) in enumerate(presses):
        start = point + (TIP + 0.02) * normal
        away = here + np.array([0, 0, 0.05])
        over = np.array([*(1.8 * start[:2]), HEIGHT + 0.05])
        for a, b in ((here, away), (away, over), (over, start)):
            add(a + smooth(250)[:, None] * (b - a))
        slow = 1.0 + 0.25 * (number % 7) if unlike_speeds else 1.0
        down, up = smooth(round(500 * slow)), 1 - smooth(round(400 * slow))
        travel = np.concatenate([down, np.ones(200), up]) * (0.02 + deep)
        side = np.cross(normal, [0.3, 0.5, 0.8])
        path = start - travel[:, None] * (normal + 0.08 * side)
        inside = travel - 0.02
        push = hertz_with_compliance(np.maximum(inside, 0), modulus, compliance)
        if point[2] == 0:
            push = np.maximum(inside, 0) * 4000
        if adhesion_n:
            held = (np.arange(len(inside)) > len(down)) & (inside > -0.0015) & (inside < 0.001)
            push -= adhesion_n * held * np.minimum(1, (inside + 0.0015) / 0.001)
        onsets.append((count() + int(np.argmax(inside > 0))) / RATE)
        add(path, push[:, None] * normal)
        here = path[-1]
    path, force = np.vstack(paths), np.vstack(forces)
    t = np.arange(len(path)) / RATE
    force = frame.rotation @ force.T
    force = force.T + np.array(bias) + np.outer(t, [0, drift_n_per_s, 0])
    quaternion = None
    if tool_mass_kg:
        turn = np.column_stack([0.5 * np.sin(0.7 * t), 0.6 * np.sin(0.4 * t + 1), 0.3 * np.sin(0.9 * t)])
        attitude = Rotation.from_rotvec(turn)
        quaternion = attitude.as_quat()[:, [3, 0, 1, 2]]
        weight = tool_mass_kg * 9.81 * np.array([0, 0, -1.0])
        tared = (attitude * attitude[0].inv()).apply(weight)
        rate = np.gradient(np.gradient(frame.device(path), t, axis=0), t, axis=0)
        force = force + weight - tared - tool_mass_kg * rate
    force += noise * random.standard_normal(force.shape)
    position = np.round(frame.device(path) / 3e-5) * 3e-5
    recording = Recording(
        t=t,
        position=position,
        force_on_tool=force,
        sample_rate_hz=RATE,
        tip_radius_m=TIP,
        quaternion=quaternion,
        boundary_phase=phase if state_phase and not without_phase else None,
        force_noise_std_n=noise,
        poisson_ratio=0.49,
        object_name="cylinder",
    )
    return recording, np.array(onsets)
