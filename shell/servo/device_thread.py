"""The device's side of the servo process: reads it just before each tick, sends the force just after.

The loop never waits for this thread, nor for the interpreter's lock that it needs; poses and commands pass
through two seqlocked blocks. A command comes with the time for which it may act: where no tick has come by
then it sends zero, and zero is the last thing it sends, whatever ended it. A driver's own dead man's switch
comes after this one.

Only this side knows which force it held and for how long: ticks come late, are skipped, and a force may have
expired meanwhile. So the held force's work is summed here, reading by reading, and travels with each pose as
one number.
"""

from __future__ import annotations

import os
import select
import threading
import time
from collections import deque
from typing import Any, NamedTuple

import numpy as np

from palpate.devices import mapper
from palpate.devices.base import LONGEST_HOLD_S, ForceSink
from palpate.devices.mapper import Mapping
from palpate.mechanics.bounds import FARTHEST_M, within
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.tip_state import TipState
from palpate.servo.clock import COMPILED
from palpate.servo.layout import DEADLINE, ENABLE, STOP
from palpate.servo.loop import ServoLoop
from palpate.servo.tick import (
    IN_BUTTONS,
    IN_CALIBRATED,
    IN_CONNECTED,
    IN_ENABLED,
    IN_FAULT,
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
    OUT_TIME,
    OUT_WIDTH,
    put_pose,
    take_command,
)


class _Held(NamedTuple):
    """(3,) N that acts from one time to another, s."""

    force: np.ndarray
    from_s: float
    until_s: float


class HeldForce:
    """The forces that act on the hand, and `work_j`, what they have given to it so far.

    delay_s: from handing a force over to its acting, where the device is slower than the loop.
    """

    def __init__(self, delay_s: float = 0.0) -> None:
        self.work_j = 0.0
        self._delay_s = delay_s
        self._held: deque[_Held] = deque()
        self._time_s = -np.inf
        self._place_m: np.ndarray | None = None

    def take(self, force_n: np.ndarray, now_s: float, hold_s: float) -> None:
        """Another force (3,) N takes over, for at most `hold_s`."""
        start = now_s + self._delay_s
        if self._held and self._held[-1].until_s > start:
            self._held.append(self._held.pop()._replace(until_s=start))
        if force_n.any():
            self._held.append(_Held(np.array(force_n), start, start + hold_s))

    def move(self, time_s: float, place_m: np.ndarray) -> None:
        """The hand was read at `place_m` (3,) m: book what acted since the reading before."""
        if not (within(place_m, FARTHEST_M) and time_s > self._time_s):
            return
        if self._place_m is not None:
            self.work_j += self._work(time_s, place_m - self._place_m)
        self._time_s, self._place_m = time_s, np.array(place_m)
        while self._held and self._held[0].until_s <= time_s:
            self._held.popleft()

    def _work(self, time_s: float, moved_m: np.ndarray) -> float:
        """Of even motion since the last reading; where a force ended unseen on the way, the most it was."""
        work, most, ended = 0.0, 0.0, False
        span = time_s - self._time_s
        for k, held in enumerate(self._held):
            along = float(held.force @ moved_m)
            work += along * max(0.0, min(held.until_s, time_s) - max(held.from_s, self._time_s)) / span
            most = max(most, along)
            following = self._held[k + 1].from_s if k + 1 < len(self._held) else np.inf
            ended = ended or held.until_s < min(following, time_s)
        return max(work, most) if ended else work


ENABLING_S = 0.25
ZERO = np.zeros(3)


FIRST_READING_S = 1.0
"""How long a device may take to its first reading; slower ones begin with the force off."""


class DeviceThread:
    """Owns the open device from `start` to `join`."""

    def __init__(
        self,
        device: Any,
        mapping: Mapping,
        loop: ServoLoop,
        *,
        read_ahead_s: float,
        delay_s: float = 0.0,
        on_start: Any = None,
    ) -> None:
        self.device = device
        self.mapping = mapping
        self.words: list[str] = []
        self.failure = ""
        self._loop = loop
        self._arrays = loop.arrays
        self._read_ahead_ns = round(read_ahead_s * 1e9)
        self._on_start = on_start
        self._mapper_state = mapper.start(mapping)
        self._mapped: tuple[int, TipState] | None = None
        self._pose = np.zeros(IN_WIDTH)
        self._command = np.zeros(OUT_WIDTH)
        self._held = HeldForce(delay_s)
        self._until_s = float("-inf")
        self._enabled = 0
        self._enabled_s = 0.0
        self._sink = device if isinstance(device, ForceSink) else None
        self._thread = threading.Thread(target=self._run, name="servo device", daemon=True)

    def prepare(self) -> None:
        """Take a first pose, so that the loop's first tick has one and everything here is loaded.

        A device on a wire has none before its first reading, and one that is not calibrated yet would latch
        the force at zero: so the first reading is waited for, FIRST_READING_S at most.
        """
        until = time.monotonic() + FIRST_READING_S
        while self.device.read().sequence < 0 and time.monotonic() < until:
            time.sleep(1e-3)
        self.read_pose()
        take_command(self._arrays, self._command)

    def start(self) -> None:
        """Begin reading and sending."""
        self._thread.start()

    def join(self, timeout_s: float | None = None) -> bool:
        """Wait for the end; True once zero was sent and the device closed."""
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def set_mapping(self, mapping: Mapping) -> None:
        """Take another mapping from the next reading on; the tip leaps there, so enable force afterwards."""
        self._mapper_state, self.mapping = mapper.start(mapping), mapping

    def read_pose(self) -> None:
        """Read the device and hand its pose to the next tick."""
        raw = self._look()
        if self._mapped is None or raw.sequence != self._mapped[0]:
            self._mapper_state, tip = mapper.step(self.mapping, self._mapper_state, raw)
            self._mapped = raw.sequence, tip
        tip = self._mapped[1]
        pose = self._pose
        pose[IN_TIME] = raw.time_s
        pose[IN_SEQUENCE] = raw.sequence
        pose[IN_CONNECTED] = raw.connected
        pose[IN_CALIBRATED] = raw.calibrated
        pose[IN_FAULT] = bool(raw.fault) or self._refuses_force(raw)
        # the mapper clears the flag while the clutch is held
        pose[IN_ENABLED] = tip.force_enabled or not raw.force_enabled
        pose[IN_BUTTONS] = raw.buttons
        pose[IN_POSITION : IN_POSITION + 3] = raw.position_m
        pose[IN_VELOCITY : IN_VELOCITY + 3] = raw.velocity_m_per_s
        pose[IN_TIP : IN_TIP + 3] = tip.position_m
        pose[IN_TIP_VELOCITY : IN_TIP_VELOCITY + 3] = tip.velocity_m_per_s
        pose[IN_QUATERNION : IN_QUATERNION + 4] = tip.quaternion
        pose[IN_FORCE_MAP : IN_FORCE_MAP + 9] = mapper.force_map(self.mapping).ravel()
        pose[IN_WORK] = self._held.work_j
        put_pose(self._arrays, pose)

    def send_command(self, *, fresh: bool = True) -> None:
        """Send the newest command, or zero where it is not fresh; follow enabling and disabling."""
        if self._sink is None:
            return
        self._follow_enable(self._sink)
        left = 0.0
        if fresh and take_command(self._arrays, self._command) >= 0:
            left = float(self._command[OUT_TIME] + self._command[OUT_HOLD]) - time.perf_counter()
        self._send(self._sink, self._command[OUT_FORCE : OUT_FORCE + 3] if left > 0.0 else ZERO, left)

    def _look(self) -> TipState:
        """Read the device, and book what the held force did meanwhile."""
        raw: TipState = self.device.read()
        self._held.move(raw.time_s, raw.position_m)
        return raw

    def _send(self, sink: ForceSink, force_n: np.ndarray, hold_s: float) -> None:
        """Let another force take over, and book the one before."""
        self._look()
        hold_s = max(hold_s, 0.0)
        now = time.perf_counter()
        sink.send_force(force_n, hold_s)
        acts = self._enabled != 0
        self._held.take(force_n if acts else ZERO, now, hold_s)
        self._until_s = now + hold_s if acts and force_n.any() else float("inf")

    def _refuses_force(self, raw: TipState) -> bool:
        """Whether the driver takes no force although enabled (it came back after an unplugging, say)."""
        wanted = self._sink is not None and self._enabled != 0
        settled = time.perf_counter() - self._enabled_s > ENABLING_S
        return wanted and settled and not raw.force_enabled

    def _follow_enable(self, sink: ForceSink) -> None:
        wanted = int(self._arrays.shared.control[ENABLE])
        if wanted == self._enabled:
            return
        self._enabled = wanted
        self._enabled_s = time.perf_counter()
        try:
            if wanted:
                sink.enable_force()
            else:
                sink.disable_force()
        except PalpateError as error:
            self.words.append(str(error))

    def _run(self) -> None:
        try:
            if self._on_start is not None:
                self._on_start()
            while self._arrays.shared.control[STOP] == 0:
                sleep_to_read(int(self._arrays.shared.counts[DEADLINE]) - self._read_ahead_ns)
                self.read_pose()
                self.send_command(fresh=self._await_tick())
        except Exception as error:  # whatever a driver raises must end in zero force, with its reason
            self.failure = f"the device failed: {str(error) or type(error).__name__}"
            self._arrays.shared.control[STOP] = 1
        finally:
            self._release()

    def _await_tick(self) -> bool:
        """Until the next tick; lets the force go where it expires before. False where none comes."""
        now = time.perf_counter()
        end = now + LONGEST_HOLD_S
        while now < end:
            if self._ticked_within(max(0.0, min(end, self._until_s) - now)):
                return True
            now = time.perf_counter()
            if self._sink is not None and now >= self._until_s:
                self._send(self._sink, ZERO, 0.0)
        return False

    def _ticked_within(self, seconds: float) -> bool:
        if not COMPILED:
            came = self._loop.ticked.wait(seconds)
            self._loop.ticked.clear()
            return came
        if not select.select([self._loop.wake_descriptor], [], [], seconds)[0]:
            return False
        os.eventfd_read(self._loop.wake_descriptor)
        return True

    def _release(self) -> None:
        try:
            if self._sink is not None:
                self._sink.send_force(ZERO)
                self._sink.disable_force()
        finally:
            self.device.close()


def sleep_to_read(deadline_ns: int) -> None:
    """Sleep until the reading is due; imprecise by the operating system's timer, which is enough here."""
    left = deadline_ns * 1e-9 - time.perf_counter()
    if left > 0:
        time.sleep(min(left, LONGEST_HOLD_S))
