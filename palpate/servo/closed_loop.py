"""The servo's own tick against a simulated hand, in virtual time: hand, device, loop and delay as one system.

Between two ticks the hand moves in `SUBSTEPS` exact steps under the delayed, held force, so that the energy
that passes between hand and force is that of the continuous motion, not of the samples.

    work = integral of F . v dt: what the force gave to the hand; its greatest value is what it got back net.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from devices.base import DeviceSpec
from devices.impedance import HandImpedance
from devices.safety import SafetyOptions, safety_parameters
from palpate.servo.layout import CONTACT_TICKS, ENABLE, TICKS, total_bytes, views
from palpate.servo.loop import kept, make_program, one_tick
from palpate.servo.tick import (
    IN_CALIBRATED,
    IN_CONNECTED,
    IN_ENABLED,
    IN_FORCE_MAP,
    IN_POSITION,
    IN_QUATERNION,
    IN_SEQUENCE,
    IN_TIME,
    IN_TIP,
    IN_TIP_VELOCITY,
    IN_VELOCITY,
    IN_WIDTH,
    OUT_FORCE,
    TickParameters,
    put_pose,
    tick_arrays,
)
from render.coupling import (
    series_compliance_m_per_n,
    stable_stiffness_n_per_m,
    stiffest_n_per_m,
    stiffness_distortion,
)
from render.passivity import PassivityOptions, passivity_parameters
from render.scene import in_the_air

SUBSTEPS = 20
START_NS = 1_000_000_000


@dataclass(frozen=True)
class Loop:
    """rate_hz of the ticks; quantisation_m of the positions (0: none); delay_s from a pose to its force.

    known_delay: whether the passivity controller is told the delay. coupling: whether there is one.
    """

    rate_hz: float = 1000.0
    quantisation_m: float = 0.0
    delay_s: float = 0.0
    known_delay: bool = True
    coupling: bool = True


@dataclass(frozen=True)
class ClosedLoopResult:
    """position, command, rendered: (n, 3) a tick, m and N on the tool. work_j: (n,) given so far.

    compliance_m_per_n: the coupling's at each tip, and stiffness_lost the
    share that it takes of the stiffness of the object's stiffest place.
    """

    position: np.ndarray
    command: np.ndarray
    rendered: np.ndarray
    work_j: np.ndarray
    compliance_m_per_n: float
    stiffness_lost: float
    contact_share: float

    @property
    def given_back_j(self) -> float:
        """The greatest net energy that the hand ever got."""
        return max(0.0, float(self.work_j.max()))

    @property
    def force_distortion(self) -> float:
        """rms of what controller and filter changed over rms of the rendered force, after the ramp."""
        full = slice(len(self.command) // 4, None)
        rendered = np.sqrt((self.rendered[full] ** 2).sum(axis=1).mean())
        changed = np.sqrt(((self.command[full] - self.rendered[full]) ** 2).sum(axis=1).mean())
        return float(changed / rendered) if rendered > 0 else 0.0


@njit(cache=True, nogil=True)
def _run(
    kernel,
    model,
    state,
    support,
    arrays,
    parameters,
    intended,
    hand,
    start,
    throw,
    quantum,
    delay_steps,
    noise,
    out,
):
    """out: (n, 10) position, command, rendered, work. hand: (2, 3) transition over a substep."""
    position, velocity = start.copy(), throw.copy()
    pose = np.zeros(IN_WIDTH)
    pose[IN_CONNECTED] = 1.0
    pose[IN_CALIBRATED] = 1.0
    pose[IN_ENABLED] = 1.0
    pose[IN_QUATERNION] = 1.0
    pose[IN_FORCE_MAP] = 1.0
    pose[IN_FORCE_MAP + 4] = 1.0
    pose[IN_FORCE_MAP + 8] = 1.0
    lag = delay_steps + 1
    line = np.zeros((lag, 3))
    at = 0
    work = 0.0
    substep_s = parameters.period_ns * 1e-9 / SUBSTEPS
    for tick in range(out.shape[0]):
        now = START_NS + tick * parameters.period_ns
        for i in range(3):
            read = position[i] + noise[tick, i]
            if quantum > 0.0:
                read = quantum * math.floor(read / quantum + 0.5)
            pose[IN_VELOCITY + i] = velocity[i]
            pose[IN_TIP_VELOCITY + i] = velocity[i]
            pose[IN_POSITION + i] = read
            pose[IN_TIP + i] = read
        pose[IN_TIME] = now * 1e-9
        pose[IN_SEQUENCE] = tick
        put_pose(arrays, pose)
        one_tick(kernel, model, state, support, arrays, parameters, now, now)
        arrays.shared.counts[TICKS] += 1
        for i in range(3):
            out[tick, i] = position[i]
            out[tick, 3 + i] = arrays.outbox[OUT_FORCE + i]
            out[tick, 6 + i] = arrays.rendered[i]
        out[tick, 9] = work
        for s in range(SUBSTEPS):
            for i in range(3):
                line[at % lag, i] = arrays.outbox[OUT_FORCE + i]
            acting = (at + 1) % lag
            at += 1
            share, following = s / SUBSTEPS, (s + 1) / SUBSTEPS
            for i in range(3):
                low, high = intended[tick, i], intended[tick + 1, i]
                here = low + share * (high - low)
                there = low + following * (high - low)
                meant = (there - here) / substep_s
                offset, speed = position[i] - here, velocity[i] - meant
                force = line[acting, i]
                moved = there + hand[0, 0] * offset + hand[0, 1] * speed + hand[0, 2] * force
                work += force * (moved - position[i])
                position[i] = moved
                velocity[i] = meant + hand[1, 0] * offset + hand[1, 1] * speed + hand[1, 2] * force


def closed_loop(
    renderer: Any,
    spec: DeviceSpec,
    hand: HandImpedance,
    intended_m: np.ndarray,
    *,
    loop: Loop | None = None,
    passivity: PassivityOptions | None = None,
    safety: SafetyOptions | None = None,
    thrown_m_per_s: np.ndarray | None = None,
    tip_offsets_m: np.ndarray | None = None,
    tremor_m: float = 0.0,
    seed: int = 0,
) -> ClosedLoopResult:
    """Run a hand that means to follow `intended_m` (n + 1, 3), one place a tick, for n ticks.

    thrown_m_per_s: (3,) the hand's first velocity, for a free mass. tip_offsets_m: (m, 3) where on the tool
    its tips are (one, in the middle). tremor_m: rms of noise on each reading.
    Force is enabled from the first tick; it ramps in, so begin out of contact.
    """
    loop = loop or Loop()
    period_ns = round(1e9 / loop.rate_hz)
    intended = np.ascontiguousarray(intended_m, dtype=float)
    delay_ticks = loop.delay_s * loop.rate_hz
    known = delay_ticks if loop.known_delay else 0.0
    offsets = np.zeros((1, 3)) if tip_offsets_m is None else tip_offsets_m
    compliance = stiffest = 0.0
    if loop.coupling:
        limit = stable_stiffness_n_per_m(spec.max_stiffness_n_per_m, loop.rate_hz, known) / len(offsets)
        stiffest = stiffest_n_per_m(renderer, spec.max_force_n)
        compliance = series_compliance_m_per_n(stiffest, limit)
    renderer = renderer.with_series_compliance(compliance)
    arrays = tick_arrays(views(bytearray(total_bytes())), offsets, np.zeros(3))
    parameters = TickParameters(
        period_ns,
        period_ns,
        safety_parameters(safety or SafetyOptions(), spec),
        passivity_parameters(
            passivity or PassivityOptions(),
            max_damping_n_s_per_m=spec.max_damping_n_s_per_m,
            delay_ticks=known,
            rate_hz=loop.rate_hz,
        ),
    )
    program = make_program(in_the_air(renderer), arrays, parameters)
    arrays.shared.control[ENABLE] = 1
    n = len(intended) - 1
    out = np.zeros((n, 10))
    step = HandImpedance(
        hand.mass_kg, hand.damping_n_s_per_m, hand.stiffness_n_per_m, period_ns * 1e-9 / SUBSTEPS
    )
    noise = tremor_m * np.random.default_rng(seed).standard_normal((n, 3))
    kept(_run, renderer)(
        program.kernel,
        renderer.parameters,
        program.state,
        program.scene.support,
        arrays,
        parameters,
        intended,
        np.ascontiguousarray(step.transition),
        intended[0].copy(),
        np.zeros(3) if thrown_m_per_s is None else np.array(thrown_m_per_s, dtype=float),
        loop.quantisation_m,
        round(delay_ticks * SUBSTEPS),
        noise,
        out,
    )
    return ClosedLoopResult(
        out[:, :3],
        out[:, 3:6],
        out[:, 6:9],
        out[:, 9],
        compliance,
        stiffness_distortion(stiffest, compliance),
        float(arrays.shared.counts[CONTACT_TICKS]) / n,
    )
