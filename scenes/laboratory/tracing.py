"""Phase I: the tip slides on the support around the object's foot. Object frame, mm and N."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.scenes.laboratory.hand import HandOptions, band_noise, minimum_jerk
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.phantoms import Phantom

RATE_HZ = 1000.0


@dataclass(frozen=True)
class Trace:
    """Samples of phase I: position (n, 3) mm of the tip's centre, force (n, 3) N on the tool, contact (n,)
    bool.
    """

    position: np.ndarray
    force: np.ndarray
    contact: np.ndarray


def foot_path(surface: TriangleSurface, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(positions (k, 3), outward horizontal directions (k, 3), arc length (k,)) once around the foot.

    The tip's centre runs at the height of its radius and touches the wall.
    """
    outline, outward = _outline(surface)
    low, high = np.full(len(outline), -3.0 * radius), np.full(len(outline), 2.0 * radius)
    for _ in range(26):
        middle = (low + high) / 2
        centres = outline + middle[:, None] * outward + [0, 0, radius]
        near, distance, face = surface.nearest(centres)
        inside = ((centres - near) * surface.face_normals[face]).sum(axis=1) < 0
        # the base itself lies one radius below: only the wall counts
        on_base = near[:, 2] < 1e-6
        gap = np.where(inside & ~on_base, -distance, distance)
        closer = (gap < radius - 1e-9) | (inside & on_base)
        low, high = np.where(closer, middle, low), np.where(closer, high, middle)
    centres = outline + high[:, None] * outward + [0, 0, radius]
    loop = np.vstack([centres, centres[:1]])
    return centres, outward, np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(loop, axis=0), axis=1))])


def _outline(surface: TriangleSurface) -> tuple[np.ndarray, np.ndarray]:
    """The base's rim as an ordered loop, and outward horizontal unit normals, smoothed."""
    flat = surface.corners[..., 2].max(axis=1) < 1e-6
    edges = np.sort(surface.faces[flat][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    rim = unique[count == 1]
    neighbours: dict[int, list[int]] = {}
    for a, b in rim.tolist():
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    loops, left = [], set(neighbours)
    while left:
        loop = [min(left)]
        left.discard(loop[0])
        while True:
            onward = [n for n in neighbours[loop[-1]] if n in left]
            if not onward:
                break
            loop.append(onward[0])
            left.discard(onward[0])
        loops.append(loop)
    points = surface.vertices[max(loops, key=len)].copy()
    area = 0.5 * np.sum(points[:, 0] * np.roll(points[:, 1], -1) - points[:, 1] * np.roll(points[:, 0], -1))
    if area < 0:
        points = points[::-1]
    arc = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(np.vstack([points, points[:1]]), axis=0), axis=1))]
    )
    wanted = np.arange(0, arc[-1], 0.8)
    closed = np.vstack([points, points[:1]])
    points = np.column_stack([np.interp(wanted, arc, closed[:, k]) for k in range(3)])
    tangent = np.roll(points, -4, axis=0) - np.roll(points, 4, axis=0)
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0], np.zeros(len(points))])
    kernel = 13
    normal = np.sum([np.roll(normal, k, axis=0) for k in range(-kernel, kernel + 1)], axis=0)
    return points, normal / np.linalg.norm(normal, axis=1)[:, None]


_last_foot: dict[tuple[bytes, bytes, float], tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
"""`foot_path` of the object that was traced last: recordings are made of one object after the other."""


def trace(
    phantom: Phantom, hand: HandOptions, radius: float, modulus_pa: float, rng: np.random.Generator
) -> Trace:
    """Comes down from the air, goes around one and a bit times while leaning, slipping and lifting off, goes
    up.
    """
    key = (phantom.vertices.tobytes(), phantom.faces.tobytes(), radius)
    if key not in _last_foot:
        _last_foot.clear()
        _last_foot[key] = foot_path(TriangleSurface(phantom.vertices * 1e3, phantom.faces), radius)
    path, outward, arc = _last_foot[key]
    total = arc[-1]
    turns = hand.trace_rounds + rng.uniform(0.08, 0.22)
    duration = turns * total / (1e3 * hand.trace_speed_m_per_s)
    count = int(duration * RATE_HZ)
    pace = 1 + 0.35 * band_noise(count, RATE_HZ, 0.1, 1.0, rng)
    away = _breaks(count, hand.trace_breaks, rng)
    # broken off, the tip comes back a little before the place where it left
    progress = np.cumsum(np.where(away > 0, -0.1, np.maximum(pace, 0.1)))
    # slips: the tip jumps ahead a few millimetres
    for at in rng.integers(count // 10, count - 400, size=int(rng.integers(2, 5))):
        progress[at:] += (
            np.minimum(np.arange(count - at) / 60.0, 1.0) * rng.uniform(2, 5) * progress[-1] / (turns * total)
        )
    along = (rng.uniform(0, total) + progress / progress[-1] * turns * total) % total
    sense = rng.choice([-1, 1])
    along = along if sense > 0 else total - along
    closed, normals = np.vstack([path, path[:1]]), np.vstack([outward, outward[:1]])
    position = np.column_stack([np.interp(along, arc, closed[:, k]) for k in range(3)])
    normal = np.column_stack([np.interp(along, arc, normals[:, k]) for k in range(3)])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    lean = np.clip(1e3 * hand.lean_m * (1 + 0.6 * band_noise(count, RATE_HZ, 0.2, 3, rng)), -0.4, 0.65)
    lean -= (lean + 4.0) * away
    position -= lean[:, None] * normal
    load = np.maximum(0.7 + 0.25 * band_noise(count, RATE_HZ, 0.2, 4, rng), 0.15)
    lift = np.zeros(count)
    for at in rng.integers(count // 8, count - 700, size=int(rng.integers(1, 3))):
        length = int(rng.integers(120, 260))
        lift[at : at + length] = rng.uniform(0.5, 1.6) * np.sin(np.pi * np.arange(length) / length) ** 2
    lift = np.maximum(lift, 15.0 * away)
    position[:, 2] += lift
    touching = lift <= 0
    velocity = np.gradient(position, axis=0)
    speed = np.linalg.norm(velocity[:, :2], axis=1) + 1e-9
    force = np.zeros((count, 3))
    force[:, 2] = np.where(touching, load, 0.0)
    force[:, :2] -= 0.22 * (np.where(touching, load, 0.0) / speed)[:, None] * velocity[:, :2]
    push = 1e-6 * modulus_pa * 4 / 3 / (1 - 0.49**2) * np.sqrt(radius) * np.maximum(lean, 0.0) ** 1.5
    force += push[:, None] * normal
    down, up = _descent(position[0], rng), _descent(position[-1], rng)[::-1]
    ramp = np.minimum(1.0, np.minimum(np.arange(count), np.arange(count)[::-1]) / 80.0)
    force *= ramp[:, None]
    everything = np.vstack([down, position, up])
    forces = np.vstack([np.zeros_like(down), force, np.zeros_like(up)])
    contact = np.concatenate([np.zeros(len(down), bool), np.ones(count, bool), np.zeros(len(up), bool)])
    return Trace(everything, forces, contact)


def _breaks(count: int, breaks: int, rng: np.random.Generator) -> np.ndarray:
    """(count,) 0 to 1: how far the tip is lifted off, `breaks` times for most of a second."""
    away = np.zeros(count)
    for at in (np.arange(breaks) + rng.uniform(0.3, 0.7, breaks)) / max(breaks, 1) * count:
        length = int(rng.uniform(600, 1100))
        part = away[int(at) : int(at) + length]
        part[:] = np.sin(np.pi * np.arange(1, length + 1) / (length + 1))[: len(part)] ** 2
    return away


def _descent(end: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """From some 45 mm up and away down to `end`; the hand moves from the first sample."""
    count = int(rng.uniform(0.9, 1.3) * RATE_HZ)
    away = end * [1, 1, 0] / max(np.linalg.norm(end[:2]), 1e-9)
    start = end + [0, 0, rng.uniform(35, 50)] + rng.uniform(12, 20) * away
    x = np.concatenate([[0.0], minimum_jerk(count - 1)])[:, None]
    return start + (end - start) * x
