"""The tip's way through a whole exploration: tracing, reaches through the air, touches. Object frame, mm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from palpate.scenes.laboratory.hand import HandOptions, band_noise, minimum_jerk, straying
from palpate.scenes.laboratory.paths import SIDEWAYS, WAY_IN, WAY_OUT
from palpate.scenes.laboratory.presses import PlannedTouch
from palpate.scenes.laboratory.support_and_air import on_the_support, waving
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.laboratory.tracing import RATE_HZ, Trace
from palpate.scenes.phantoms import Phantom

NEAR_MM = 3.0
"""Above the surface by this much the hand slows from its reach to the press."""


@dataclass(frozen=True)
class Motion:
    """Samples of an exploration. position: (n, 3) mm, tip's centre. axis: (n, 3) unit, tip to handle.

    touch: (n,) number of the touch, -1 elsewhere. leg: (n,) leg of that touch; s: (n,) mm along it
    (negative: above the surface). stray: (n, 3) mm sideways of the touch's path since first touch.
    trace_force: (n, 3) N of phase I, and of what is done on the support after the touches.
    phase: (start, end) s of phase I. beside: (kind, start, end) s of what is done after the touches.
    """

    position: np.ndarray
    axis: np.ndarray
    touch: np.ndarray
    leg: np.ndarray
    s: np.ndarray
    stray: np.ndarray
    trace_force: np.ndarray
    phase: tuple[float, float]
    beside: tuple[tuple[str, float, float], ...] = ()

    @property
    def t(self) -> np.ndarray:
        """(n,) s."""
        return np.arange(len(self.position)) / RATE_HZ


def motion(
    phantom: Phantom,
    touches: Sequence[PlannedTouch],
    traced: Trace,
    hand: HandOptions,
    radius: float,
    rng: np.random.Generator,
    again: Trace | None = None,
) -> Motion:
    """String phase I and all touches together, with reaches around the object between them.

    again: after them three presses on the bare support, waving in the air, and the base traced once more, so.
    """
    surface = TriangleSurface(phantom.vertices * 1e3, phantom.faces)
    middle = np.array([0.0, 0.0, 0.5e3 * phantom.height_m])
    clear = np.linalg.norm(surface.vertices - middle, axis=1).max() + radius + 8.0
    parts: list[dict[str, np.ndarray]] = [_still(traced.position)]
    on = np.flatnonzero(traced.contact)
    phase = (on[0] / RATE_HZ, on[-1] / RATE_HZ)
    here = traced.position[-1]
    axes = [(0, _lean(np.array([0.0, 0.0, 1.0]), hand, rng)), (len(traced.position), None)]
    count = len(traced.position)
    for number, touch in enumerate(touches):
        part, first = _one_touch(number, touch, surface, hand, radius, rng)
        reach = _reach(here, first, middle, clear, radius, hand, rng)
        parts += [_still(reach), part]
        lean = _lean(_handle(touch.normal), hand, rng)
        count += len(reach)
        axes += [(count, lean), (count + len(part["position"]), lean)]
        count += len(part["position"])
        here = part["position"][-1]
    rest = _reach(here, here + [0, 0, 25.0], middle, clear, radius, hand, rng)
    parts.append(_still(rest))
    count += len(rest)
    done: list[_Done] = [] if again is None else _beside(surface, again, hand, radius, rng)
    beside, forces, turns = [], [(0, traced.force)], []
    here = rest[-1]
    for each in done:
        reach = _reach(here, each.position[0], middle, clear, radius, hand, rng)
        parts += [_still(reach), _still(each.position)]
        start = count + len(reach)
        count = start + len(each.position)
        beside.append((each.kind, start / RATE_HZ, (count - 1) / RATE_HZ))
        forces.append((start, each.force))
        turns.append((start, each.turn))
        here = each.position[-1]
    whole = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    trace_force = np.zeros_like(whole["position"])
    for start, force in forces:
        trace_force[start : start + len(force)] = force
    axis = _axes(axes, len(trace_force))
    for start, turn in turns:
        rows = slice(start, start + len(turn))
        axis[rows] = Rotation.from_rotvec(turn).apply(axis[rows])
    return Motion(axis=axis, trace_force=trace_force, phase=phase, beside=tuple(beside), **whole)


@dataclass(frozen=True)
class _Done:
    """kind of segment; position (n, 3) mm, force (n, 3) N, turn (n, 3) rotation vectors of the tool."""

    kind: str
    position: np.ndarray
    force: np.ndarray
    turn: np.ndarray


def _beside(
    surface: TriangleSurface, again: Trace, hand: HandOptions, radius: float, rng: np.random.Generator
) -> list[_Done]:
    """Presses on the support beside the object, waving above it, the base once more."""
    reach = float(np.linalg.norm(surface.vertices[:, :2], axis=1).max())
    height, push = on_the_support()
    sideways = straying(len(height), RATE_HZ, hand, rng) + [1.4 * reach + 2 * radius, 0.0]
    pressed = np.column_stack([sideways, radius + height])
    aside, turn = waving(rng)
    waved = [0, 0, surface.vertices[:, 2].max() + 60.0] + aside
    return [
        _Done("rigid", pressed, np.outer(push, [0, 0, 1]), np.zeros_like(pressed)),
        _Done("free", waved, np.zeros_like(waved), turn),
        _Done("retrace", again.position, again.force, np.zeros_like(again.position)),
    ]


def _still(position: np.ndarray) -> dict[str, np.ndarray]:
    """Samples outside every touch."""
    n = len(position)
    return {
        "position": position,
        "touch": np.full(n, -1),
        "leg": np.zeros(n, int),
        "s": np.full(n, -1.0),
        "stray": np.zeros((n, 3)),
    }


def _one_touch(
    number: int,
    touch: PlannedTouch,
    surface: TriangleSurface,
    hand: HandOptions,
    radius: float,
    rng: np.random.Generator,
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """(samples of one touch from its start in the air to its end, the first position)."""
    offset = rng.normal(0, 1e3 * hand.scatter_m, 3) if touch.repeat else np.zeros(3)
    offset -= (offset @ touch.normal) * touch.normal
    foot = surface.nearest((touch.point + offset)[None])[0][0]
    own = 1e3 * np.exp(rng.uniform(np.log(hand.slowest_m_per_s), np.log(hand.fastest_m_per_s)))
    speed = touch.speed or own
    height = rng.uniform(11.0, 16.0)
    legs: list[np.ndarray] = []
    s: list[np.ndarray] = []

    def add(leg: int, values: np.ndarray) -> None:
        legs.append(np.full(len(values), leg))
        s.append(values)

    near = -NEAR_MM
    add(WAY_IN, -height + (near + height) * minimum_jerk(_samples(height - NEAR_MM, rng.uniform(35, 90))))
    add(WAY_IN, near + (touch.depth - near) * minimum_jerk(_samples(touch.depth - near, speed)))
    held = rng.random() < hand.hold_share or touch.kind == "drag"
    pause = rng.uniform(0.15, 1e3 * hand.longest_hold_s / 1e3) if held else rng.uniform(0.005, 0.03)
    pause = pause if touch.hold is None else touch.hold
    add(WAY_IN, _hold(touch.depth, pause, hand, rng, back=touch.kind == "drag"))
    distance = float(np.linalg.norm(touch.side))
    if distance > 0:
        add(SIDEWAYS, distance * minimum_jerk(_samples(distance, rng.uniform(5, 25))))
        add(SIDEWAYS, np.full(int(rng.uniform(0.08, 0.4) * RATE_HZ), distance))
    release = max(speed * np.exp(rng.normal(0.2, 0.4)), 8.0)
    last = s[-1][-1] if distance == 0 else touch.depth
    end = -rng.uniform(10.0, 15.0)
    add(WAY_OUT, last + (end - last) * minimum_jerk(_samples(last - end, min(release * 1.6, 130.0))))
    leg, along = np.concatenate(legs), np.concatenate(s)
    path = np.where((leg == SIDEWAYS)[:, None], touch.depth, along[:, None]) * touch.direction
    sideways = np.where(leg == SIDEWAYS, along, np.where(leg == WAY_OUT, distance, 0.0))
    if distance > 0:
        path = path + (sideways / distance)[:, None] * touch.side
    stray = _stray(along, leg, touch, hand, rng)
    position = foot + radius * touch.normal + path + stray
    samples = {
        "position": position,
        "touch": np.full(len(leg), number),
        "leg": leg,
        "s": along,
        "stray": stray,
    }
    return samples, position[0]


def _samples(distance: float, speed: float) -> int:
    """Samples of a minimum-jerk move of mean speed `speed` mm/s, at least 60 ms."""
    return max(int(abs(distance) / speed * RATE_HZ), 60)


def _hold(
    depth: float, seconds: float, hand: HandOptions, rng: np.random.Generator, *, back: bool
) -> np.ndarray:
    """Depth while the hand holds still: it creeps out by a little and trembles, never beyond what was
    solved; `back` at the full depth in the end, where a drag begins.
    """
    count = max(int(seconds * RATE_HZ), 3)
    drift = -rng.uniform(0.0, 0.12) * np.arange(count) / RATE_HZ / max(seconds, 0.3)
    tremor = 0.5e3 * hand.tremor_m * band_noise(count, RATE_HZ, 7, 11, rng)
    window = np.minimum(1.0, np.arange(count) / 60.0)
    if back:
        window = np.minimum(window, window[::-1])
    return depth + (drift + np.minimum(tremor, 0.0)) * window


def _stray(
    along: np.ndarray, leg: np.ndarray, touch: PlannedTouch, hand: HandOptions, rng: np.random.Generator
) -> np.ndarray:
    """Sideways straying since first touch (zero there and in the air)."""
    n = len(along)
    across = np.linalg.svd(touch.normal[None])[2][1:]
    values = straying(n, RATE_HZ, hand, rng)
    first = int(np.argmax((along > 0) & (leg == WAY_IN)))
    values = values - values[first]
    # it fades in from the place of first touch, and out again in the air
    since = np.clip((np.arange(n) - first) / 60.0, 0.0, 1.0)
    fade_in = since**3 * (10 - 15 * since + 6 * since**2)
    out = np.where(leg == WAY_OUT, np.clip((along + 8.0) / 6.0, 0.0, 1.0), 1.0)
    fade_out = out**3 * (10 - 15 * out + 6 * out**2)
    return (values * (fade_in * fade_out)[:, None]) @ across


def _reach(
    start: np.ndarray,
    end: np.ndarray,
    middle: np.ndarray,
    clear: float,
    radius: float,
    hand: HandOptions,
    rng: np.random.Generator,
) -> np.ndarray:
    """Through the air from start to end: out to a sphere around the object, along it, and in again."""
    a, b = start - middle, end - middle
    angle = np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1))
    travel = angle * clear + abs(clear - np.linalg.norm(a)) + abs(clear - np.linalg.norm(b))
    count = int(max(0.45, travel / rng.uniform(120, 220)) / hand.reach_pace * RATE_HZ)
    x = minimum_jerk(count)
    unit_a, unit_b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    if angle > 1e-3:
        turn = (np.sin((1 - x) * angle)[:, None] * unit_a + np.sin(x * angle)[:, None] * unit_b) / np.sin(
            min(angle, np.pi - 1e-3)
        )
    else:
        turn = np.repeat(unit_b[None], count, axis=0)
    # a wide turn leads over the top, not through the support
    turn[:, 2] += np.sin(np.pi * x) * angle / 2.5
    turn /= np.linalg.norm(turn, axis=1)[:, None]
    bulge = min(1.0, travel / 25.0) * np.sin(np.pi * x) ** 0.7
    distance = np.linalg.norm(a) + (np.linalg.norm(b) - np.linalg.norm(a)) * x
    distance = distance + bulge * np.maximum(clear - distance, 0.0)
    way = middle + distance[:, None] * turn
    way[:, 2] = np.maximum(way[:, 2], min(radius + 3.0, start[2], end[2]))
    # an arm has mass: no corner where the way passes over the top
    way = gaussian_filter1d(way, 0.06 * RATE_HZ, axis=0, mode="nearest")
    share = np.linspace(0.0, 1.0, count)
    for weight, off in ((share**4, end - way[-1]), ((1 - share) ** 4, start - way[0])):
        way += weight[:, None] * off
    pause = int(rng.exponential(hand.pause_s) * RATE_HZ)
    return np.vstack([way, np.repeat(way[-1:], pause, axis=0)]) if pause else way


def _handle(normal: np.ndarray) -> np.ndarray:
    """Where the handle points: between the surface's normal and upwards."""
    axis = normal + np.array([0.0, 0.0, 0.9])
    return axis / np.linalg.norm(axis)


def _lean(axis: np.ndarray, hand: HandOptions, rng: np.random.Generator) -> np.ndarray:
    leaning = axis + np.radians(hand.tilt_deg) * rng.normal(size=3)
    return leaning / np.linalg.norm(leaning)


def _axes(knots: list[tuple[int, np.ndarray | None]], count: int) -> np.ndarray:
    """(count, 3) unit vectors that turn smoothly from knot to knot."""
    turns: list[np.ndarray] = []
    for _, axis in knots:
        turns.append(axis if axis is not None else turns[-1])
    at, values = np.array([sample for sample, _ in knots], float), np.array(turns)
    k = np.clip(np.searchsorted(at, np.arange(count), side="right") - 1, 0, len(at) - 2)
    x = np.clip((np.arange(count) - at[k]) / np.maximum(at[k + 1] - at[k], 1), 0, 1)
    x = x**3 * (10 - 15 * x + 6 * x * x)
    axis = values[k] + x[:, None] * (values[k + 1] - values[k])
    return axis / np.linalg.norm(axis, axis=1)[:, None]
