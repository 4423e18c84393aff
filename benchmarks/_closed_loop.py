"""The servo's own tick against a simulated hand, in virtual time: hand, device, loop and delay as one system.

Within a tick's period the hand moves in `SUBSTEPS` exact steps under the delayed, held force, so that the
energy that passes between hand and force is that of the continuous motion, not of the samples. Ticks come as
`Timing` says: meanwhile a device holds the last force, for as long as it was allowed to.

    work = integral of F . v dt: what the force gave to the hand; its greatest value is what it got back net.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit

from palpate.devices.base import DeviceSpec
from palpate.devices.impedance import HandImpedance, follow
from palpate.devices.safety import WORDS, SafetyOptions, safety_parameters
from palpate.mechanics.kernels import kept
from palpate.render.coupling import (
    series_compliance_m_per_n,
    stable_stiffness_n_per_m,
    stiffest_n_per_m,
)
from palpate.render.passivity import PassivityOptions, passivity_parameters
from palpate.render.replay import rms_n
from palpate.render.scene import in_the_air
from palpate.servo.layout import CONTACT_TICKS, ENABLE, TICKS, total_bytes, views, write_block
from palpate.servo.loop import make_program, one_tick
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
    IN_WORK,
    OUT_FORCE,
    OUT_HOLD,
    TickParameters,
    tick_arrays,
)

SUBSTEPS = 20
START_NS = 1_000_000_000


@dataclass(frozen=True)
class Loop:
    """rate_hz of the ticks; quantisation_m of the positions (0: none); delay_s from a pose to its force.

    known_delay: whether the passivity controller is told the delay. coupling: whether there is one.
    passivity, safety: of the controller and the filter. tremor_m: rms of noise on each reading, by seed.
    """

    rate_hz: float = 1000.0
    quantisation_m: float = 0.0
    delay_s: float = 0.0
    known_delay: bool = True
    coupling: bool = True
    passivity: PassivityOptions = field(default_factory=PassivityOptions)
    safety: SafetyOptions = field(default_factory=SafetyOptions)
    tremor_m: float = 0.0
    seed: int = 0


@dataclass(frozen=True)
class ClosedLoopResult:
    """position, command, rendered: (n, 3) a tick, m and N on the tool. work_j: (n,) given so far.

    given_back_j: the greatest net energy that the hand ever got. reasons: the safety filter's, of any tick.
    compliance_m_per_n: the coupling's at each tip, and stiffness_lost the share that it takes of the
    stiffness of the object's stiffest place.
    """

    position: np.ndarray
    command: np.ndarray
    rendered: np.ndarray
    work_j: np.ndarray
    given_back_j: float
    reasons: tuple[str, ...]
    compliance_m_per_n: float
    stiffness_lost: float
    contact_share: float

    @property
    def force_distortion(self) -> float:
        """rms of what controller and filter changed over rms of the rendered force, after the ramp."""
        full = slice(len(self.command) // 4, None)
        rendered = rms_n(self.rendered[full])
        changed = rms_n(self.command[full] - self.rendered[full])
        return changed / rendered if rendered > 0 else 0.0


@dataclass(frozen=True)
class Timing:
    """When ticks come, in substeps.

    read: (n + 1,) of the poses, increasing; lag: (n,) from a pose to its force taking over, before the next
    pose.
    """

    read: np.ndarray
    lag: np.ndarray

    @classmethod
    def regular(cls, ticks: int) -> Timing:
        """One a period, answered at once."""
        return cls(SUBSTEPS * np.arange(ticks + 1), np.zeros(ticks, dtype=np.int64))


@njit(cache=True, nogil=True)
def enabled_pose():
    """(IN_WIDTH,) of a device that is connected, calibrated, enabled and not turned, at the origin."""
    pose = np.zeros(IN_WIDTH)
    pose[IN_CONNECTED] = 1.0
    pose[IN_CALIBRATED] = 1.0
    pose[IN_ENABLED] = 1.0
    pose[IN_QUATERNION] = 1.0
    pose[IN_FORCE_MAP] = 1.0
    pose[IN_FORCE_MAP + 4] = 1.0
    pose[IN_FORCE_MAP + 8] = 1.0
    return pose


@njit(cache=True, nogil=True)
def _run(
    kernel,
    model,
    state,
    support,
    arrays,
    parameters,
    intended,
    transition,
    start,
    throw,
    quantum,
    delay_steps,
    noise,
    read,
    lag,
    out,
):
    """out: (n, 11) position, command, rendered, work, the most of it until the next pose. transition: (2, 3)
    over a substep. read, lag: Timing's."""
    position, velocity = start.copy(), throw.copy()
    pose = enabled_pose()
    line = np.zeros((delay_steps + 1, 3))
    work, until = 0.0, 0
    substep_ns = parameters.period_ns // SUBSTEPS
    for tick in range(out.shape[0]):
        for i in range(3):
            read_at = position[i] + noise[tick, i]
            if quantum > 0.0:
                read_at = quantum * math.floor(read_at / quantum + 0.5)
            pose[IN_VELOCITY + i] = velocity[i]
            pose[IN_TIP_VELOCITY + i] = velocity[i]
            pose[IN_POSITION + i] = read_at
            pose[IN_TIP + i] = read_at
            out[tick, i] = position[i]
        pose[IN_TIME] = (START_NS + read[tick] * substep_ns) * 1e-9
        pose[IN_SEQUENCE] = tick
        pose[IN_WORK] = work
        write_block(arrays.inbox_version, arrays.inbox, pose)
        out[tick, 9] = out[tick, 10] = work
        for at in range(read[tick], read[tick + 1]):
            if at == read[tick] + lag[tick]:
                now = START_NS + at * substep_ns
                one_tick(kernel, model, state, support, arrays, parameters, now, now)
                arrays.shared.counts[TICKS] += 1
                until = at + int(arrays.outbox[OUT_HOLD] * 1e9 / substep_ns + 0.5)
                for i in range(3):
                    out[tick, 3 + i] = arrays.outbox[OUT_FORCE + i]
                    out[tick, 6 + i] = arrays.rendered[i]
            for i in range(3):
                line[at % line.shape[0], i] = arrays.outbox[OUT_FORCE + i] if at < until else 0.0
            segment = min(at // SUBSTEPS, intended.shape[0] - 2)
            first = at - SUBSTEPS * segment
            work += follow(
                transition,
                position,
                velocity,
                intended[segment],
                intended[segment + 1],
                first,
                first + 1,
                SUBSTEPS,
                substep_ns * 1e-9,
                line[(at + 1) % line.shape[0]],
            )
            out[tick, 10] = max(out[tick, 10], work)


def closed_loop(
    renderer: Any,
    spec: DeviceSpec,
    hand: HandImpedance,
    intended_m: np.ndarray,
    *,
    loop: Loop | None = None,
    thrown_m_per_s: np.ndarray | None = None,
    tip_offsets_m: np.ndarray | None = None,
    timing: Timing | None = None,
) -> ClosedLoopResult:
    """Run a hand that means to follow `intended_m` (n + 1, 3), one place a period, for n periods.

    thrown_m_per_s: (3,) the hand's first velocity, for a free mass. tip_offsets_m: (m, 3) where on the tool
    its tips are (one, in the middle). timing: regular by default.
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
        safety_parameters(loop.safety, spec),
        passivity_parameters(
            loop.passivity,
            max_damping_n_s_per_m=spec.max_damping_n_s_per_m,
            delay_ticks=known,
            rate_hz=loop.rate_hz,
        ),
    )
    program = make_program(in_the_air(renderer), arrays, parameters)
    arrays.shared.control[ENABLE] = 1
    timing = timing or Timing.regular(len(intended) - 1)
    n = len(timing.lag)
    out = np.zeros((n, 11))
    step = HandImpedance(
        hand.mass_kg, hand.damping_n_s_per_m, hand.stiffness_n_per_m, period_ns * 1e-9 / SUBSTEPS
    )
    noise = loop.tremor_m * np.random.default_rng(loop.seed).standard_normal((n, 3))
    kept(_run, renderer.parameters)(
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
        np.ascontiguousarray(timing.read, dtype=np.int64),
        np.ascontiguousarray(timing.lag, dtype=np.int64),
        out,
    )
    return ClosedLoopResult(
        out[:, :3],
        out[:, 3:6],
        out[:, 6:9],
        out[:, 9],
        max(0.0, float(out[:, 10].max())),
        tuple(word for bit, word in WORDS.items() if arrays.shared.reason_counts[bit.bit_length() - 1]),
        compliance,
        1.0 - 1.0 / (1.0 + stiffest * compliance),
        float(arrays.shared.counts[CONTACT_TICKS]) / n,
    )


def side_by_side(off: ClosedLoopResult, on: ClosedLoopResult, **about: float) -> dict[str, float]:
    """A case of a grid: what it was, and what the hand got back without controller and coupling and with."""
    return {
        **about,
        "peak_force_n": float(np.linalg.norm(on.command, axis=1).max()),
        "given_back_unguarded_j": off.given_back_j,
        "given_back_j": on.given_back_j,
        "force_distortion": on.force_distortion,
        "stiffness_lost": on.stiffness_lost,
    }
