"""One tick of the servo: pose in, force out; compiled, on preallocated arrays, without clock, lock or device.

    inbox -> tips -> [renderer's kernel] -> support -> mapping to the device -> passivity -> safety -> outbox

The renderer's kernel is called by the loop between `before` and `after`, so that these two are compiled once
and kept. All times are ns handed in.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.devices.safety import (
    LATCHING,
    LONGEST_GAP_S,
    PASSIVITY,
    SILENT,
    RawPose,
    SafetyParameters,
    SafetyState,
    safety_state,
    safety_step,
)
from palpate.mechanics.bounds import FARTHEST_M, LARGEST_N, within
from palpate.mechanics.kernels import inner, kernel
from palpate.render.passivity import (
    PassivityParameters,
    PassivityState,
    passivity_after,
    passivity_before,
    passivity_restart,
    passivity_state,
)
from palpate.render.support import add_support_force
from palpate.servo.histogram import count
from palpate.servo.layout import (
    BEAT,
    CONTACT_TICKS,
    DEADLINE,
    ENABLE,
    HEAD_WIDTH,
    LATE,
    MISSED,
    RING_ROWS,
    STARTED,
    TICKS,
    TIP_WIDTH,
    SharedArrays,
    begin_write,
    end_write,
    fence,
    read_block,
    write_block,
)

(
    IN_TIME,
    IN_SEQUENCE,
    IN_CONNECTED,
    IN_CALIBRATED,
    IN_FAULT,
    IN_ENABLED,
    IN_BUTTONS,
    IN_POSITION,
    IN_VELOCITY,
    IN_TIP,
    IN_TIP_VELOCITY,
    IN_QUATERNION,
    IN_FORCE_MAP,
    IN_WORK,
) = (0, 1, 2, 3, 4, 5, 6, 7, 10, 13, 16, 19, 23, 32)
IN_WIDTH = 33
OUT_TICK, OUT_TIME, OUT_FORCE, OUT_HOLD = 0, 1, 2, 5
OUT_WIDTH = 6


class TickParameters(NamedTuple):
    """Fixed between swaps. silence_s: how long the parent's heartbeat may stand still; 0: nobody beats."""

    period_ns: int
    late_ns: int
    safety: SafetyParameters
    passivity: PassivityParameters
    silence_s: float = 0.0


SEQUENCE, LAST_S, COMPUTE_S, LAST_BEAT, SILENT_S, LAST_ENABLE, LAST_POSE_S = range(7)
"""Cells of `previous`, all of the tick before: the pose's sequence, when it started, what it took, the
parent's heartbeat and how long that has stood still, the enabling, and when its pose was read."""


class TickArrays(NamedTuple):
    """Everything that a tick reads and writes, made by `tick_arrays`; the parent sees `shared` as well."""

    shared: SharedArrays
    inbox_version: np.ndarray
    inbox: np.ndarray
    outbox_version: np.ndarray
    outbox: np.ndarray
    pose: np.ndarray
    offsets: np.ndarray
    tips: np.ndarray
    forces: np.ndarray
    rendered: np.ndarray
    wanted: np.ndarray
    previous: np.ndarray
    timespec: np.ndarray
    word: np.ndarray
    safety: SafetyState
    passivity: PassivityState


def tick_arrays(shared: SharedArrays, offsets_m: np.ndarray, workspace_centre_m: np.ndarray) -> TickArrays:
    """Preallocated memory for a tool with `offsets_m` (m, 3); workspace_centre_m: (3,), device frame."""
    offsets = np.ascontiguousarray(offsets_m, dtype=float)
    inbox = np.zeros(IN_WIDTH)
    inbox[IN_TIME] = -1e9
    inbox[IN_SEQUENCE] = -1.0
    inbox[IN_POSITION:IN_TIP_VELOCITY] = np.nan
    return TickArrays(
        shared=shared,
        inbox_version=np.zeros(1, dtype=np.int64),
        inbox=inbox,
        outbox_version=np.zeros(1, dtype=np.int64),
        outbox=np.zeros(OUT_WIDTH),
        pose=inbox.copy(),
        offsets=offsets,
        tips=np.full(offsets.shape, np.nan),
        forces=np.zeros(offsets.shape),
        rendered=np.zeros(3),
        wanted=np.zeros(3),
        previous=np.array([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1e9]),
        timespec=np.zeros(2, dtype=np.int64),
        word=np.ones(1, dtype=np.int64),
        safety=safety_state(workspace_centre_m),
        passivity=passivity_state(),
    )


@kernel
def before(arrays):
    """Take the newest pose and place the tips (scene frame)."""
    # a writer that died half way leaves the last good pose, which then ages
    read_block(arrays.inbox_version, arrays.inbox, arrays.pose)
    pose = arrays.pose
    w, x, y, z = (
        pose[IN_QUATERNION],
        pose[IN_QUATERNION + 1],
        pose[IN_QUATERNION + 2],
        pose[IN_QUATERNION + 3],
    )
    for t in range(arrays.tips.shape[0]):
        a, b, c = arrays.offsets[t, 0], arrays.offsets[t, 1], arrays.offsets[t, 2]
        # q v q*: v + 2 w (u x v) + 2 u x (u x v)
        cx, cy, cz = y * c - z * b, z * a - x * c, x * b - y * a
        arrays.tips[t, 0] = pose[IN_TIP] + a + 2.0 * (w * cx + y * cz - z * cy)
        arrays.tips[t, 1] = pose[IN_TIP + 1] + b + 2.0 * (w * cy + z * cx - x * cz)
        arrays.tips[t, 2] = pose[IN_TIP + 2] + c + 2.0 * (w * cz + x * cy - y * cx)
        if not within(arrays.tips[t], FARTHEST_M):
            # a garbled reading is no place: every renderer leaves contact at NaN and remembers nothing of it
            for i in range(3):
                arrays.tips[t, i] = np.nan


@kernel
def after(
    arrays,
    parameters,
    support,
    felt,
    points,
    normals,
    depths,
    touching,
    stiffness,
    radii,
    now_ns,
    deadline_ns,
):
    """From the renderer's forces `felt` and the support to the command; writes outbox, snapshot and ring."""
    pose, wanted, rendered, forces = arrays.pose, arrays.wanted, arrays.rendered, arrays.forces
    dt_s = _elapsed(arrays, parameters, now_ns)
    age_s = now_ns * 1e-9 - pose[IN_TIME]
    velocity = pose[IN_TIP_VELOCITY : IN_TIP_VELOCITY + 3]
    contacts = np.int64(0)  # a plain 0 would have numba compile twice what takes it
    # loops, not slice assignments, which take numba seconds to compile
    for i in range(3):
        rendered[i] = 0.0
    for t in range(forces.shape[0]):
        for i in range(3):
            forces[t, i] = felt[t, i]
        touches = add_support_force(support, arrays.tips[t], velocity, radii[t], forces[t])
        if touches or touching[t] != 0:
            contacts += 1
        for i in range(3):
            rendered[i] += forces[t, i]
    clutched = pose[IN_ENABLED] == 0.0
    for i in range(3):
        wanted[i] = 0.0
        for j in range(3):
            wanted[i] += pose[IN_FORCE_MAP + 3 * i + j] * rendered[j]
    enable = arrays.shared.control[ENABLE]
    if enable != arrays.previous[LAST_ENABLE]:
        arrays.previous[LAST_ENABLE] = enable
        passivity_restart(arrays.passivity)
    position = pose[IN_POSITION : IN_POSITION + 3]
    fresh = pose[IN_SEQUENCE] != arrays.previous[SEQUENCE]
    arrays.previous[SEQUENCE] = pose[IN_SEQUENCE]
    between_s = min(max(pose[IN_TIME] - arrays.previous[LAST_POSE_S], 0.0), LONGEST_GAP_S)
    arrays.previous[LAST_POSE_S] = pose[IN_TIME]
    damped = passivity_before(
        parameters.passivity,
        arrays.passivity,
        wanted,
        position,
        pose[IN_WORK],
        fresh,
        between_s,
        dt_s,
        age_s,
    )
    reading = RawPose(
        position,
        pose[IN_VELOCITY : IN_VELOCITY + 3],
        age_s,
        int(pose[IN_SEQUENCE]),
        pose[IN_CONNECTED] != 0.0,
        pose[IN_CALIBRATED] != 0.0,
        pose[IN_FAULT] != 0.0,
    )
    if clutched:
        for i in range(3):
            wanted[i] = 0.0
    silent = _parent_is_silent(arrays, parameters, dt_s)
    reasons = safety_step(
        parameters.safety, arrays.safety, wanted, reading, enable, dt_s, SILENT if silent else 0
    )
    command = arrays.safety.force
    if reasons & LATCHING:
        passivity_restart(arrays.passivity)
    passivity_after(arrays.passivity, wanted, command)
    if damped and command[0] ** 2 + command[1] ** 2 + command[2] ** 2 > 0.0:
        reasons |= PASSIVITY

    begin_write(arrays.outbox_version)
    arrays.outbox[OUT_TICK] = arrays.shared.counts[TICKS]
    arrays.outbox[OUT_TIME] = now_ns * 1e-9
    arrays.outbox[OUT_FORCE] = command[0]
    arrays.outbox[OUT_FORCE + 1] = command[1]
    arrays.outbox[OUT_FORCE + 2] = command[2]
    arrays.outbox[OUT_HOLD] = arrays.passivity.hold[0]
    end_write(arrays.outbox_version)
    if parameters.safety.max_force_n <= 0.0:
        reasons = 0  # there is no force that anything could be wrong with
    depth = depths[0] if touching[0] != 0 else 0.0
    _publish(arrays, reasons, contacts, depth, now_ns, deadline_ns, parameters.period_ns)
    _publish_tips(arrays, forces, points, normals, depths, touching, stiffness)


@inner
def _parent_is_silent(arrays, parameters, dt_s):
    """Whether the parent's heartbeat has stood still for longer than it may."""
    previous, beat = arrays.previous, float(arrays.shared.control[BEAT])
    if beat != previous[LAST_BEAT]:
        previous[LAST_BEAT] = beat
        previous[SILENT_S] = 0.0
    else:
        previous[SILENT_S] += dt_s
    return 0.0 < parameters.silence_s < previous[SILENT_S]


@inner
def _elapsed(arrays, parameters, now_ns):
    """Seconds since the last tick started; what moved meanwhile is told by the readings' own times."""
    elapsed = parameters.period_ns * 1e-9
    if arrays.previous[LAST_S] > 0.0:
        elapsed = now_ns * 1e-9 - arrays.previous[LAST_S]
    arrays.previous[LAST_S] = now_ns * 1e-9
    return elapsed


@inner
def _publish(arrays, reasons, contacts, depth, now_ns, deadline_ns, period_ns):
    """The tick's row in the ring and the statistics."""
    pose, command, counts = arrays.pose, arrays.safety.force, arrays.shared.counts
    if counts[STARTED] == 0:
        counts[STARTED] = deadline_ns
    row = arrays.shared.ring[arrays.shared.ring_head[0] % RING_ROWS]
    row[0] = (deadline_ns - counts[STARTED]) // period_ns
    row[1] = deadline_ns * 1e-9
    force2, command2 = 0.0, 0.0
    for i in range(3):
        row[2 + i] = pose[IN_POSITION + i]
        row[5 + i] = arrays.tips[0, i]
        row[8 + i] = arrays.rendered[i]
        row[11 + i] = command[i]
        force2 += arrays.rendered[i] ** 2
        command2 += command[i] ** 2
    for i in range(4):
        row[14 + i] = pose[IN_QUATERNION + i]
    row[18] = reasons
    row[19] = pose[IN_BUTTONS]
    row[20] = contacts
    row[21] = arrays.shared.control[ENABLE]
    row[22] = (now_ns - deadline_ns) * 1e-9
    row[23] = arrays.previous[COMPUTE_S]
    row[24] = depth
    fence()
    arrays.shared.ring_head[0] += 1
    if contacts:
        counts[CONTACT_TICKS] += 1
    for k in range(arrays.shared.reason_counts.size):
        if reasons & (1 << k):
            arrays.shared.reason_counts[k] += 1
    if within(arrays.rendered, LARGEST_N):
        arrays.shared.peak[0] = max(arrays.shared.peak[0], force2**0.5)
    arrays.shared.peak[1] = max(arrays.shared.peak[1], command2**0.5)
    for k in range(arrays.passivity.energies.size):
        arrays.shared.energies[k] = arrays.passivity.energies[k]


@inner
def _publish_tips(arrays, forces, points, normals, depths, touching, stiffness):
    """The newest row and every tip's contact, for a window."""
    block = arrays.shared.snapshot
    begin_write(arrays.shared.snapshot_version)
    row = arrays.shared.ring[(arrays.shared.ring_head[0] - 1) % RING_ROWS]
    for k in range(row.size):
        block[k] = row[k]
    block[HEAD_WIDTH - 1] = forces.shape[0]
    for t in range(forces.shape[0]):
        at = HEAD_WIDTH + t * TIP_WIDTH
        for i in range(3):
            block[at + i] = arrays.tips[t, i]
            block[at + 3 + i] = forces[t, i]
            block[at + 6 + i] = points[t, i]
            block[at + 9 + i] = normals[t, i]
        block[at + 12] = depths[t]
        block[at + 13] = touching[t]
        block[at + 14] = stiffness[t]
    end_write(arrays.shared.snapshot_version)


@kernel
def account(arrays, parameters, deadline_ns, started_ns, ended_ns):
    """Count the tick and set the next deadline: absolute, in phase; those that passed wholly are missed."""
    counts = arrays.shared.counts
    counts[TICKS] += 1
    lateness = started_ns - deadline_ns
    if lateness > parameters.late_ns:
        counts[LATE] += 1
    count(arrays.shared.compute_bins, arrays.shared.compute_extremes, ended_ns - started_ns)
    count(arrays.shared.lateness_bins, arrays.shared.lateness_extremes, lateness)
    arrays.previous[COMPUTE_S] = (ended_ns - started_ns) * 1e-9
    following = deadline_ns + parameters.period_ns
    if ended_ns >= following + parameters.period_ns:
        skipped = (ended_ns - following) // parameters.period_ns
        counts[MISSED] += skipped
        following += skipped * parameters.period_ns
    counts[DEADLINE] = following


def put_pose(arrays: TickArrays, pose: np.ndarray) -> None:
    """Hand a pose (IN_WIDTH,) to the next tick."""
    write_block(arrays.inbox_version, arrays.inbox, pose)


def take_command(arrays: TickArrays, command: np.ndarray) -> int:
    """Copy the newest command (OUT_WIDTH,); returns its version, -1 where it could not be read."""
    version: int = read_block(arrays.outbox_version, arrays.outbox, command)
    return version
