"""The simulated hand: a device without hardware, for demonstrations, tests and headless sessions.

It has mass, damping, stiffness and tremor (devices.impedance), an intention (devices.intention), and feels
the force that is sent to it: from then on, until the next one or until it expires, whoever is late. It goes
on in fixed steps up to the clock whenever it is read or sent a force, so that with a fake clock a session is
the same bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.devices.base import (
    LONGEST_HOLD_S,
    Availability,
    Clock,
    DeviceSpec,
    OpenInWith,
    finite_vector,
    host_clock,
)
from palpate.devices.impedance import HandImpedance, follow
from palpate.devices.intention import FreeExploration, Intention
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.options import Ranged, option
from palpate.mechanics.tip_state import TipState

SPEC = DeviceSpec(
    name="simulated",
    title="simulated hand",
    actuated_axes=("x", "y", "z"),
    max_force_n=20.0,
    max_stiffness_n_per_m=5000.0,
    max_damping_n_s_per_m=50.0,
    max_speed_m_per_s=2.0,
    workspace_radius_m=1.0,
    buttons=1,
    simulated=True,
)
INTENTION_S = 0.001
"""How often the hand makes up its mind."""
SUBSTEPS = 20
"""Steps in that time, at which forces come and go."""
LONGEST_CATCH_UP_S = 0.5
"""A program that was paused for longer paused the hand as well: it must not replay minutes at once."""
TREMOR_HZ = (8.0, 9.7, 11.3)


@dataclass(frozen=True)
class SimulatedOptions(Ranged):
    """The simulated hand. Impedance values are of a light grasp; tremor is physiological, rms an axis."""

    mass_kg: float = option(0.15, "moving mass of hand and tool", unit="kg", flag="--hand-mass", low=0.001)
    damping_n_s_per_m: float = option(12.0, "the grasp's damping", unit="N s/m", flag="--hand-damping")
    stiffness_n_per_m: float = option(600.0, "the grasp's stiffness", unit="N/m", flag="--hand-stiffness")
    tremor_m: float = option(2e-5, "tremor, rms per axis", unit="m", flag="--tremor", high=0.01)


class SimulatedHand(OpenInWith):
    """A PositionSource and ForceSink. `intention` defaults to exploring a 10 cm ball round the origin.

    work_j: what the forces that acted have given to the hand.
    """

    spec = SPEC

    def __init__(
        self,
        options: SimulatedOptions | None = None,
        intention: Intention | None = None,
        *,
        clock: Clock = host_clock,
        seed: int = 0,
    ) -> None:
        self.options = options or SimulatedOptions()
        self.intention = intention or FreeExploration(np.zeros(3), 0.1, seed=seed)
        self.impedance = HandImpedance(
            self.options.mass_kg,
            self.options.damping_n_s_per_m,
            self.options.stiffness_n_per_m,
            INTENTION_S / SUBSTEPS,
        )
        self.work_j = 0.0
        self._clock = clock
        self._phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, (len(TREMOR_HZ), 3))
        self._open = False
        self._force_enabled = False
        self._force = np.zeros(3)
        self._until = 0
        self._sequence = -1

    def open(self) -> None:
        """Take the hand to where the intention starts."""
        self._start_s = self._clock()
        self._steps = 0
        self._velocity = np.zeros(3)
        self._intended = self._intend(0.0, np.zeros(3))
        self._following = self._intended
        self._position = self._intended.copy()
        self._open = True
        self._sequence += 1

    def _intend(self, time_s: float, position_m: np.ndarray) -> np.ndarray:
        amplitude = self.options.tremor_m * np.sqrt(2.0 / len(TREMOR_HZ))
        angle = 2 * np.pi * np.array(TREMOR_HZ)[:, None] * time_s + self._phases
        tremor = amplitude * np.sin(angle).sum(axis=0)
        return self.intention.place(time_s, position_m, self._felt) + tremor

    @property
    def _felt(self) -> np.ndarray:
        return self._force if self._force_enabled and self._steps < self._until else np.zeros(3)

    def _advance(self) -> None:
        """Go on to the clock; raises DeviceError before `open`."""
        if not self._open:
            raise DeviceError("the simulated hand is not open: call open() or use it in a with statement")
        step_s = self.impedance.step_s
        due = self._step_at(self._clock())
        most = round(LONGEST_CATCH_UP_S / step_s)
        if due - self._steps > most:
            # the hand's own time skips the pause
            self._start_s += (due - self._steps - most) * step_s
            due = self._steps + most
        if due > self._steps:
            self._sequence += 1
        while self._steps < due:
            first = self._steps % SUBSTEPS
            if first == 0:
                self._intended = self._following
                self._following = self._intend((self._steps + SUBSTEPS) * step_s, self._position)
            force, last = self._felt, min(SUBSTEPS, first + due - self._steps)
            if self._steps < self._until:
                last = min(last, first + self._until - self._steps)
            self.work_j += follow(
                self.impedance.transition,
                self._position,
                self._velocity,
                self._intended,
                self._following,
                first,
                last,
                SUBSTEPS,
                step_s,
                force,
            )
            self._steps += last - first

    def _step_at(self, time_s: float) -> int:
        return int((time_s - self._start_s) / self.impedance.step_s + 1e-6)

    def read(self) -> TipState:
        """Advance to the clock and return the tip; raises DeviceError before `open`."""
        self._advance()
        return TipState(
            time_s=self._start_s + self._steps * self.impedance.step_s,
            sequence=self._sequence,
            position_m=self._position.copy(),
            velocity_m_per_s=self._velocity.copy(),
            force_enabled=self._force_enabled,
        )

    def enable_force(self) -> None:
        """From now on the hand feels what is sent."""
        if not self._open:
            raise DeviceError("the simulated hand is not open: open it before enabling force")
        self._force_enabled = True

    def disable_force(self) -> None:
        """The hand feels nothing any more."""
        if self._open:
            self._advance()
        self._force_enabled = False
        self._force = np.zeros(3)

    def send_force(self, force_on_tool_n: np.ndarray, hold_s: float = LONGEST_HOLD_S) -> None:
        """(3,) N on the tool, until the next one and for at most `hold_s`; ignored until force is enabled."""
        force = finite_vector(force_on_tool_n)
        if self._force_enabled:
            self._advance()
            self._force = np.where(np.isfinite(force), force, 0.0)
            self._until = self._steps + round(hold_s / self.impedance.step_s)

    def close(self) -> None:
        """Let go."""
        self.disable_force()
        self._open = False


def find(options: SimulatedOptions | None = None) -> list[Availability]:
    """Always there."""
    return [Availability(SPEC, where="in this program")]
