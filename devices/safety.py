"""The one safety filter: last on every path from a renderer to a device.

    0 where anything is wrong, else clamp(slew(ramp * fade * wanted))

It knows no clock and no device: one compiled step on plain arrays, called once a tick by the servo with the
device's newest raw state. What is wrong falls in two kinds. *Passing* faults (a force that is not finite, a
stale or non-finite pose, outside the workspace, a silent parent) give zero at once and a fresh ramp when
they are over. *Latching* faults (unplugged, calibration lost, device fault, over-speed, a jump of the pose, a
clock that stands still or runs backwards) give zero until force is enabled anew, which starts from clean
memory: nothing that came before reaches beyond it. docs/explanation/loop-and-safety.md
lists every fault.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate.devices.base import DeviceSpec
from palpate.mechanics.bounds import FARTHEST_M, LARGEST_N, within
from palpate.mechanics.errors import OptionError
from palpate.mechanics.kernels import inner, kernel
from palpate.mechanics.options import Ranged, option

OFF, NOT_FINITE, STALE, OUTSIDE, DISCONNECTED, UNCALIBRATED, FAULT, OVER_SPEED, JUMP, CLOCK = (
    1 << k for k in range(10)
)
RAMP, CLAMPED, SLEWED, FADED, PASSIVITY, SILENT = (1 << k for k in range(10, 16))
PASSING = NOT_FINITE | STALE | OUTSIDE | SILENT
LATCHING = DISCONNECTED | UNCALIBRATED | FAULT | OVER_SPEED | JUMP | CLOCK
ZEROING = OFF | PASSING | LATCHING

WORDS = {
    OFF: "force is off",
    NOT_FINITE: "a pose or force is not a number",
    STALE: "no fresh pose",
    OUTSIDE: "outside the workspace",
    DISCONNECTED: "the device is not connected",
    UNCALIBRATED: "the device is not calibrated",
    FAULT: "the device reports a fault",
    OVER_SPEED: "too fast",
    JUMP: "the pose jumped",
    CLOCK: "the clock stood still or went backwards",
    RAMP: "ramping in",
    CLAMPED: "clamped to the greatest force",
    SLEWED: "limited in its rise",
    FADED: "fading at the workspace's edge",
    PASSIVITY: "damped to stay passive",
    SILENT: "the program beside the loop does not answer in time",
}


def reason_words(reasons: int) -> str:
    """The filter's reasons in plain words, '' where nothing was changed."""
    return ", ".join(word for bit, word in WORDS.items() if int(reasons) & bit)


@dataclass(frozen=True)
class SafetyOptions(Ranged):
    """What the filter allows; the device's own specification is never exceeded."""

    max_force_n: float | None = option(
        None,
        "greatest force, or the device's own limit if lower; None: the device's own",
        unit="N",
        low=0.01,
        high=200.0,
    )
    slew_n_per_s: float = option(
        2000.0, "fastest rise of the force", unit="N/s", flag="--slew", low=1.0, high=1e4, looser="higher"
    )
    ramp_s: float = option(
        0.5,
        "time over which force rises after it is enabled",
        unit="s",
        flag="--ramp",
        low=0.05,
        high=60.0,
        looser="lower",
    )
    stale_s: float = option(
        0.02,
        "a pose older than this gives zero force",
        unit="s",
        flag="--stale",
        low=0.002,
        high=2.0,
        looser="higher",
    )
    max_speed_m_per_s: float | None = option(
        None, "faster than this trips the filter; None: the device's own", unit="m/s", low=0.001, high=10.0
    )
    jump_m: float = option(
        0.005,
        "a jump of the pose beyond what the greatest speed explains",
        unit="m",
        low=1e-4,
        high=0.05,
        looser="higher",
    )
    workspace_radius_m: float | None = option(
        None, "no force outside this radius; None: the device's own", unit="m", low=0.001, high=10.0
    )


class SafetyParameters(NamedTuple):
    """Scalars that the compiled step reads; SI."""

    max_force_n: float
    slew_n_per_s: float
    ramp_s: float
    stale_s: float
    max_speed_m_per_s: float
    jump_m: float
    workspace_radius_m: float


class SafetyState(NamedTuple):
    """Memory between ticks, preallocated; `reasons` is the last tick's, `counts` how often each occurred.

    force: (3,) N, the last output. gain: of the ramp, 0 to 1. since: s since the last pose was read.
    """

    force: np.ndarray
    position: np.ndarray
    speed: np.ndarray
    gain: np.ndarray
    since: np.ndarray
    sequence: np.ndarray
    latched: np.ndarray
    enable: np.ndarray
    reasons: np.ndarray
    counts: np.ndarray
    workspace_centre: np.ndarray


class RawPose(NamedTuple):
    """The device's newest raw state, as the filter needs it: (3,) arrays in the device frame, SI."""

    position: np.ndarray
    velocity: np.ndarray
    age_s: float
    sequence: int
    connected: bool
    calibrated: bool
    fault: bool


def safety_parameters(options: SafetyOptions, spec: DeviceSpec) -> SafetyParameters:
    """The tighter of what the user allows and what the device can do.

    Raises OptionError where a device with force states a limit that is none (0, negative, not finite).
    """

    def tighter(name: str) -> float:
        if not spec.has_force:
            return math.inf  # such a device states 0 for every limit, and its force stays 0
        mine, device = getattr(options, name), float(getattr(spec, name))
        if not (math.isfinite(device) and device > 0.0):
            raise OptionError(f"the {name} of {spec.title} is {device:g}; it must be greater than 0")
        return device if mine is None else min(float(mine), device)

    return SafetyParameters(
        tighter("max_force_n") if spec.has_force else 0.0,
        float(options.slew_n_per_s),
        float(options.ramp_s),
        float(options.stale_s),
        tighter("max_speed_m_per_s"),
        float(options.jump_m),
        tighter("workspace_radius_m"),
    )


def safety_state(workspace_centre_m: np.ndarray | None = None) -> SafetyState:
    """A filter with force off; the workspace is a ball round `workspace_centre_m`, device frame (origin)."""
    centre = np.zeros(3) if workspace_centre_m is None else np.array(workspace_centre_m, dtype=float)
    return SafetyState(
        force=np.zeros(3),
        position=np.full(3, np.nan),
        speed=np.zeros(1),
        gain=np.zeros(1),
        since=np.zeros(1),
        sequence=np.full(1, -1, dtype=np.int64),
        latched=np.zeros(1, dtype=np.int64),
        enable=np.zeros(1, dtype=np.int64),
        reasons=np.zeros(1, dtype=np.int64),
        counts=np.zeros(len(WORDS), dtype=np.int64),
        workspace_centre=centre,
    )


SPEED_TIME_S = 0.005
"""Time constant of the speed estimate: one coarse encoder step in a tick must not look like over-speed."""
LONGEST_STEP_S = 0.005
"""A longer tick raises the force no more than this one: a stall is no licence to skip ramp and slew."""
LONGEST_GAP_S = 10.0


@inner
def _norm3(vector):
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


@inner
def _start_clean(state):
    """As made by `safety_state`, but for the workspace and the counts."""
    for i in range(3):
        state.force[i] = 0.0
        state.position[i] = math.nan
    state.speed[0] = 0.0
    state.gain[0] = 0.0
    state.since[0] = 0.0
    state.sequence[0] = -1
    state.latched[0] = 0


@inner
def _clock_faults(state, reading, dt_s):
    """A sequence that runs backwards, a pose from the future, fresh poses while time stands still."""
    backwards = reading.sequence < state.sequence[0] or reading.age_s < -0.001
    stands = dt_s == 0.0 and reading.sequence > state.sequence[0]
    return CLOCK if backwards or stands else 0


@inner
def _motion_faults(parameters, state, reading, dt_s):
    """Over-speed and jump, from fresh poses that can be ones."""
    faults = 0
    state.since[0] = min(state.since[0] + dt_s, LONGEST_GAP_S)
    age_s = min(reading.age_s, LONGEST_GAP_S) if reading.age_s > 0.0 else 0.0
    if reading.sequence != state.sequence[0]:
        state.sequence[0] = reading.sequence
        if not within(reading.position, FARTHEST_M):
            return 0
        if within(state.position, FARTHEST_M):
            moved = 0.0
            for i in range(3):
                moved += (reading.position[i] - state.position[i]) ** 2
            moved = math.sqrt(moved)
            # by the readings' own times: several ticks may pass between two of a slow device, and a late
            # tick sees in one reading what moved during all of its lateness
            between = max(state.since[0] - age_s, 0.0)
            if moved > parameters.jump_m + parameters.max_speed_m_per_s * between:
                faults |= JUMP
            # the low pass of moved / between, without a division that a clock could make infinite
            state.speed[0] += (moved - between * state.speed[0]) / (SPEED_TIME_S + between)
        for i in range(3):
            state.position[i] = reading.position[i]
        state.since[0] = age_s
    fastest = parameters.max_speed_m_per_s
    if state.speed[0] > fastest or _norm3(reading.velocity) > fastest:
        faults |= OVER_SPEED
    return faults


@inner
def _fade(parameters, state, position):
    """1 inside the workspace, falling to 0 at 1.05 of its radius; negative outside that."""
    radius, distance = parameters.workspace_radius_m, 0.0
    for i in range(3):
        distance += (position[i] - state.workspace_centre[i]) ** 2
    distance = math.sqrt(distance)
    if distance <= radius:
        return 1.0
    if not distance <= 1.05 * radius:
        return -1.0
    return 1.0 - (distance / radius - 1.0) / 0.05


@kernel
def safety_step(parameters, state, wanted, reading, enable, dt_s, faults=0):
    """Filter one tick's force; writes `state.force`, returns the reasons (bits; `reason_words` reads them).

    wanted: (3,) N on the tool, device frame. enable: 0 for force off, else the number of the user's enabling;
    a latched fault is left only by a number not seen before, which starts from clean memory. dt_s: s since
    the last call. faults: reasons that the caller found itself.
    """
    reasons = faults
    if enable != state.enable[0]:
        state.enable[0] = enable
        _start_clean(state)
    if not (math.isfinite(dt_s) and dt_s >= 0.0):
        reasons |= CLOCK
        dt_s = 0.0
    if not reading.connected:
        reasons |= DISCONNECTED
    if not reading.calibrated:
        reasons |= UNCALIBRATED
    if reading.fault:
        reasons |= FAULT
    if not (reading.age_s <= parameters.stale_s):
        reasons |= STALE
    reasons |= _clock_faults(state, reading, dt_s)
    reasons |= _motion_faults(parameters, state, reading, min(dt_s, LONGEST_GAP_S))
    fade = 1.0
    if within(reading.position, FARTHEST_M):
        fade = _fade(parameters, state, reading.position)
        if fade < 0.0:
            reasons |= OUTSIDE
    else:
        reasons |= NOT_FINITE
    if not within(wanted, LARGEST_N):
        reasons |= NOT_FINITE

    state.latched[0] |= reasons & LATCHING
    reasons |= state.latched[0]
    if enable == 0:
        reasons |= OFF

    if reasons & ZEROING:
        state.gain[0] = 0.0
        for i in range(3):
            state.force[i] = 0.0
    else:
        step_s = min(dt_s, LONGEST_STEP_S)
        if state.gain[0] < 1.0:
            state.gain[0] = min(1.0, state.gain[0] + step_s / parameters.ramp_s)
            reasons |= RAMP
        if fade < 1.0:
            reasons |= FADED
        reasons |= _limit(parameters, state, wanted, fade * state.gain[0], step_s)
    state.reasons[0] = reasons
    for k in range(state.counts.size):
        if reasons & (1 << k):
            state.counts[k] += 1
    return reasons


@inner
def _limit(parameters, state, wanted, gain, dt_s):
    """Clamp keeping direction, then slew: falling towards zero is free, rising and turning are limited."""
    reasons = 0
    length = gain * _norm3(wanted)
    scale = gain
    if length > parameters.max_force_n:
        scale = gain * parameters.max_force_n / length
        reasons |= CLAMPED
    # the nearest point of the segment from zero to the last force is reached at once
    along, last2 = 0.0, 0.0
    for i in range(3):
        along += scale * wanted[i] * state.force[i]
        last2 += state.force[i] * state.force[i]
    share = min(max(along / last2, 0.0), 1.0) if last2 > 0.0 else 0.0
    change2 = 0.0
    for i in range(3):
        change2 += (scale * wanted[i] - share * state.force[i]) ** 2
    change = math.sqrt(change2)
    step = parameters.slew_n_per_s * dt_s
    part = 1.0
    if change > step:
        part = step / change
        reasons |= SLEWED
    for i in range(3):
        state.force[i] = share * state.force[i] + part * (scale * wanted[i] - share * state.force[i])
    return reasons
