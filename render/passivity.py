"""Time-domain passivity: no energy comes out of the rendering that did not go in, whenever ticks come.

A force held over a tick does work on a moving hand that the model's continuous force would not do: a half
tick late on the way in it absorbs too little, on the way out it gives too much, K |dx|^2 / 2 a tick for a
stiffness K; every further tick of delay adds K |dx|^2. Three parts mend it:

1. *Reference following* (Ryu, Preusche, Hannaford, Hirzinger 2005): the energy that the model's force
   exchanges along the measured path, by the trapezoidal rule, is the reference; what the held force gave
   beyond it is owed, and a variable damper on the hand takes it back at once, spread over `payback_s`.
2. *Net guard* (the passivity controller of Hannaford and Ryu 2002, acting before the energy leaves): over
   each contact, the part of the force along the motion is cut to what the observed energy still affords.
3. *Expiry*: nobody knows when the next tick comes. Every force goes out with the time for which it may act,
   the longest in which a hand of the least mass could not get more than is left; then the device lets go.

What was given is no guess of the tick's: whoever holds the force books its work (the servo's device thread).

Signs: forces on the tool, device frame; energy is positive where it went into the rendering. Pure step on
preallocated arrays; it knows no clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate.mechanics.bounds import FARTHEST_M, LARGEST_N, within
from palpate.mechanics.errors import OptionError
from palpate.mechanics.kernels import inner, kernel
from palpate.mechanics.options import Ranged, option

LONGEST_DELAY_TICKS = 64
MOST_OWED_J = 2e-3
LONGEST_HOLD_S = 0.02
"""No force outlives its tick by more, whatever energy is left."""
AFFORDED_TICKS = 1.5
"""The guard leaves a force that may act for at least so long: a tick and its usual lateness."""


@dataclass(frozen=True)
class PassivityOptions(Ranged):
    """How strictly energy is kept, and what it may cost."""

    passivity: bool = option(True, "time-domain passivity observer and controller")
    allowance_j: float = option(
        1e-4,
        "energy that may be owed before the guard cuts in",
        unit="J",
        low=1e-7,
        high=0.01,
        looser="higher",
    )
    payback_s: float = option(
        0.005, "time over which owed energy is damped away", unit="s", low=1e-4, high=1.0, looser="higher"
    )
    velocity_time_s: float = option(
        0.002, "time constant of the velocity that damping uses", unit="s", low=1e-4, high=0.1
    )
    most_damping_n_s_per_m: float = option(
        10.0, "the damper's limit; the device's if lower", unit="N s/m", low=0.01, high=100.0
    )
    least_mass_kg: float = option(
        0.05, "the least mass that the device moves", unit="kg", low=0.001, high=10.0, looser="higher"
    )
    forgiven_w: float = option(
        5e-5,
        "power at which spent allowance comes back",
        unit="W",
        low=1e-8,
        high=0.01,
        looser="higher",
    )


class PassivityParameters(NamedTuple):
    """Scalars of the compiled step. delay_ticks: from a pose to the force that it caused, in ticks."""

    active: bool
    allowance_j: float
    payback_s: float
    velocity_time_s: float
    max_damping_n_s_per_m: float
    least_mass_kg: float
    forgiven_w: float
    delay_ticks: float
    period_s: float


class PassivityState(NamedTuple):
    """Memory between ticks. energies: (5,) J: net in this contact, owed, dissipated by the damper, least net,
    net since the start. work: (1,) J that held forces had done by the last reading. hold: (1,) s for which
    this tick's force may act."""

    position: np.ndarray
    velocity: np.ndarray
    swift: np.ndarray
    moved: np.ndarray
    base: np.ndarray
    damping_force: np.ndarray
    commanded: np.ndarray
    work: np.ndarray
    energies: np.ndarray
    ticks: np.ndarray
    cut: np.ndarray
    hold: np.ndarray


NET, OWED, DISSIPATED, LEAST, TOTAL = range(5)


def passivity_parameters(
    options: PassivityOptions,
    *,
    max_damping_n_s_per_m: float,
    delay_ticks: float = 0.0,
    rate_hz: float = 1000.0,
) -> PassivityParameters:
    """max_damping_n_s_per_m: what the device renders stably. delay_ticks: 0 where the force that a pose
    causes acts from the instant of that pose; raises OptionError beyond LONGEST_DELAY_TICKS - 2."""
    if not 0.0 <= delay_ticks <= LONGEST_DELAY_TICKS - 2:
        raise OptionError(f"delay_ticks is {delay_ticks}; allowed is 0 to {LONGEST_DELAY_TICKS - 2}")
    # a sampled, delayed damper on a mass is itself stable only well below m / T
    damping = min(
        max_damping_n_s_per_m, options.most_damping_n_s_per_m, 0.2 * options.least_mass_kg * rate_hz
    )
    return PassivityParameters(
        options.passivity,
        options.allowance_j * min(1.0, rate_hz / 1000.0),
        options.payback_s,
        options.velocity_time_s,
        damping / (1.0 + 2.0 * delay_ticks),
        options.least_mass_kg,
        options.forgiven_w,
        delay_ticks,
        1.0 / rate_hz,
    )


def passivity_state() -> PassivityState:
    """At rest, nothing exchanged."""
    return PassivityState(
        position=np.full(3, np.nan),
        velocity=np.zeros(3),
        swift=np.zeros(3),
        moved=np.zeros(3),
        base=np.zeros(3),
        damping_force=np.zeros(3),
        commanded=np.zeros((LONGEST_DELAY_TICKS, 3)),
        work=np.zeros(1),
        energies=np.zeros(5),
        ticks=np.zeros(1, dtype=np.int64),
        cut=np.zeros(1),
        hold=np.zeros(1),
    )


@inner
def passivity_restart(state):
    """As at rest with nothing exchanged; the least net energy so far stays for the report.

    When force is enabled anew, and while a fault is latched: what the pose did then was no work of a hand.
    """
    for i in range(3):
        state.position[i] = math.nan
        state.velocity[i] = state.swift[i] = state.moved[i] = state.base[i] = state.damping_force[i] = 0.0
        for k in range(LONGEST_DELAY_TICKS):
            state.commanded[k, i] = 0.0
    state.energies[NET] = state.energies[OWED] = state.energies[TOTAL] = 0.0
    state.ticks[0] = 0
    state.cut[0] = 0.0


@kernel
def passivity_before(parameters, state, wanted, position, work_j, fresh, between_s, dt_s, age_s):
    """Observe what held forces did and change `wanted` (3,) in place; True where it was changed.

    position: (3,) m, the device's. work_j: what all held forces had given to the hand at that reading. fresh:
    whether it is a new reading; between_s: since the one before, on the readings' own clock. dt_s: since the
    last tick. age_s: of the reading. Call `passivity_after` with the force that was really sent, in the same
    tick; it may act for `state.hold`.
    """
    energies = state.energies
    here = within(position, FARTHEST_M)
    known = here and math.isfinite(state.position[0])
    if fresh:
        given = work_j - state.work[0] if known else 0.0
        state.work[0] = work_j
        lag = parameters.velocity_time_s + between_s
        force2 = 0.0
        for i in range(3):
            moved = position[i] - state.position[i] if known else 0.0
            state.moved[i] = moved
            # the low pass of moved / between
            state.velocity[i] += (moved - between_s * state.velocity[i]) / lag
            state.swift[i] = moved / max(between_s, 0.1 * parameters.period_s)
            # the reference's half of this tick; the other half is added once this tick's force is known
            energies[OWED] -= 0.5 * state.base[i] * moved
            force2 += wanted[i] * wanted[i]
        energies[NET] -= given
        energies[TOTAL] -= given
        energies[OWED] += given
        if force2 == 0.0 and _under_way(parameters, state) == 0.0:
            # out of contact nothing is stored: what was dissipated is no licence for the next contact
            energies[NET] = min(energies[NET], 0.0)
            energies[OWED] = 0.0
        if here:
            for i in range(3):
                state.position[i] = position[i]
    else:
        for i in range(3):
            state.moved[i] = 0.0
    if energies[NET] < 0.0:
        energies[NET] = min(0.0, energies[NET] + parameters.forgiven_w * dt_s)
    for i in range(3):
        state.damping_force[i] = 0.0
    state.cut[0] = 0.0
    state.hold[0] = LONGEST_HOLD_S
    # what is no force becomes zero in the safety filter: it must not enter the books on the way
    if not (parameters.active and within(wanted, LARGEST_N)):
        return False
    return _control(parameters, state, wanted, dt_s, age_s)


@inner
def _under_way(parameters, state):
    """The greatest force, N, that was sent and may still act or come to act."""
    greatest2 = 0.0
    for j in range(1 + int(math.ceil(parameters.delay_ticks))):
        way2 = 0.0
        for i in range(3):
            way2 += state.commanded[(state.ticks[0] - 1 - j) % LONGEST_DELAY_TICKS, i] ** 2
        greatest2 = max(greatest2, way2)
    return math.sqrt(greatest2)


@inner
def _control(parameters, state, wanted, dt_s, age_s):
    velocity, energies = state.velocity, state.energies
    speed2 = velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2
    force2 = wanted[0] ** 2 + wanted[1] ** 2 + wanted[2] ** 2
    changed = False
    if force2 == 0.0:
        return False
    if energies[OWED] > 0.0 and speed2 > 1e-12:
        damping = min(
            energies[OWED] / (speed2 * max(parameters.payback_s, dt_s)), parameters.max_damping_n_s_per_m
        )
        for i in range(3):
            state.damping_force[i] = -damping * velocity[i]
            wanted[i] += state.damping_force[i]
        changed = True
    _guard(parameters, state, wanted, age_s)
    return changed or state.cut[0] > 0.0


@inner
def _guard(parameters, state, wanted, age_s):
    """Cut what could give out more than the energy that is left, and say for how long the rest may act.

    A hand of the least mass m that moves at u along the force F, and pushes as hard itself, gets
    F u h + F^2 h^2 / m in the time h.
    """
    mass, period_s = parameters.least_mass_kg, parameters.period_s
    size2, smooth, last, speed2 = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        size2 += wanted[i] ** 2
        smooth += wanted[i] * state.velocity[i]
        last += wanted[i] * state.swift[i]
        speed2 += state.velocity[i] ** 2
    if size2 == 0.0:
        return
    size = math.sqrt(size2)
    # since the reading, and until this force acts, those before it go on and speed the hand up
    way_s = max(age_s, parameters.delay_ticks * period_s)
    before = _under_way(parameters, state)
    left = state.energies[NET] + parameters.allowance_j - before * math.sqrt(speed2) * way_s
    left = max(left, 0.0)
    along = max(smooth, last) / size + before * way_s / mass
    horizon = AFFORDED_TICKS * period_s
    # the largest F with F (u T + F T^2 / m) <= left
    reach, twice = along * horizon, 2.0 * horizon * horizon / mass
    affordable = (math.sqrt(reach * reach + 2.0 * twice * left) - reach) / twice
    if size > affordable:
        state.cut[0] = size - affordable
        for i in range(3):
            kept = wanted[i] * affordable / size
            state.damping_force[i] += kept - wanted[i]
            wanted[i] = kept
        size = affordable
    if size > 0.0:
        hold = 0.5 * mass / size * (math.sqrt(along * along + 4.0 * left / mass) - along)
        state.hold[0] = max(min(hold, LONGEST_HOLD_S), horizon)


@kernel
def passivity_after(state, wanted, sent):
    """Remember the force `sent`, which safety made of the `wanted` that `passivity_before` left."""
    wanted2, sent2 = 0.0, 0.0
    for i in range(3):
        wanted2 += wanted[i] * wanted[i]
        sent2 += sent[i] * sent[i]
    share = min(1.0, math.sqrt(sent2 / wanted2)) if wanted2 > 0.0 else 0.0
    energies = state.energies
    for i in range(3):
        moved = state.moved[i]
        state.base[i] = sent[i] - share * state.damping_force[i]
        energies[OWED] -= 0.5 * state.base[i] * moved
        energies[DISSIPATED] -= share * state.damping_force[i] * moved
        state.commanded[state.ticks[0] % LONGEST_DELAY_TICKS, i] = sent[i]
    energies[OWED] = min(max(energies[OWED], -1e-5), MOST_OWED_J)
    energies[LEAST] = min(energies[LEAST], energies[TOTAL])
    state.ticks[0] += 1
