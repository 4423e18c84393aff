"""The mouse in the touch window: the window writes where the hand means to be, this gives a 1 kHz tip from
it.

A window writes a place a picture, sixty times a second or once: on the way to each the hand means to go
evenly, in the time that the window took for it, so that slow pictures make late motion and not steps. A
critically damped hand of `follow_s` follows that, so that the renderer gets a smooth path and a velocity.
There is no force to feel: the window shows it as an arrow and a plot.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.devices.base import Availability, Clock, DeviceSpec, OpenInWith, host_clock
from palpate.devices.channel import PoseChannel
from palpate.devices.impedance import HandImpedance
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.options import option
from palpate.mechanics.tip_state import TipState

SPEC = DeviceSpec(
    name="mouse",
    title="mouse in the touch window",
    workspace_radius_m=1.0,
    max_speed_m_per_s=1.0,
    buttons=3,
)
WINDOW_SILENT_S = 2.0
MOST_STEPS = 500
"""Made up for in one reading: a program that was paused for longer does not replay it."""
_ZERO = np.zeros(3)
_NOWHERE = np.full(3, np.nan)


@dataclass(frozen=True)
class MouseOptions:
    """follow_s: how long the tip takes to come up with the mouse."""

    follow_s: float = option(0.04, "time in which the tip follows the mouse", unit="s", flag="--mouse-follow")


class MouseDevice(OpenInWith):
    """A PositionSource over a PoseChannel that the touch window writes at every frame."""

    spec = SPEC

    def __init__(
        self,
        channel: Path | str | None = None,
        options: MouseOptions | None = None,
        *,
        clock: Clock = host_clock,
    ) -> None:
        self._path = channel
        self._clock = clock
        rate = 4.0 / (options or MouseOptions()).follow_s
        self._hand = HandImpedance(1.0, 2.0 * rate, rate * rate)
        self._channel: PoseChannel | None = None
        self._sequence = -1
        self._position: np.ndarray | None = None

    def open(self) -> None:
        """Attach to the window's channel; raises DeviceError where no window offers one."""
        if self._path is None:
            raise DeviceError(
                "the mouse works in the touch window only: run 'palpate touch ... --device mouse' "
                "with a screen, or headless with --device simulated"
            )
        try:
            self._channel = PoseChannel(self._path)
        except OSError as error:
            raise DeviceError(
                f"the touch window's channel '{self._path}' is gone: start the window again"
            ) from error
        self._position = None
        self._time = self._clock()
        self._written_s = float("-inf")

    def read(self) -> TipState:
        """The following tip, advanced to the clock; disconnected while the window is silent."""
        if self._channel is None:
            raise DeviceError("the mouse is not open: call open() or use it in a with statement")
        now = self._clock()
        pose = self._channel.read()
        if pose is None:
            self._sequence = max(self._sequence, 0)
            fault = "no pose from the window yet"
            return TipState(self._time, self._sequence, _NOWHERE, connected=False, fault=fault)
        if self._position is None:
            self._position, self._velocity = np.array(pose.position_m), _ZERO
            self._from = self._to = self._position
            self._left, self._written_s = 0, pose.time_s
            self._sequence += 1
        if pose.time_s != self._written_s:
            took_s = min(max(pose.time_s - self._written_s, 0.0), WINDOW_SILENT_S)
            self._from, self._to = self._meant, np.array(pose.position_m)
            # and no sooner than it was to be at the place before
            self._left = self._number = max(1, self._left, round(took_s / self._hand.step_s))
            self._written_s = pose.time_s
        steps = int((now - self._time) / self._hand.step_s + 1e-6)
        if steps > 0:
            self._sequence += 1
        for _ in range(min(steps, MOST_STEPS)):
            self._left = max(self._left - 1, 0)
            # towards where it means to be and no farther: no press overshoots its depth
            meant = self._meant
            self._position, self._velocity = self._hand.step(
                self._position, self._velocity, meant, meant, _ZERO
            )
        self._time += steps * self._hand.step_s
        silent = now - pose.time_s > WINDOW_SILENT_S
        return TipState(
            time_s=min(self._time, pose.time_s + WINDOW_SILENT_S),
            sequence=self._sequence,
            position_m=self._position,
            velocity_m_per_s=self._velocity,
            buttons=pose.buttons,
            connected=not silent,
            fault="the window is silent" if silent else "",
        )

    @property
    def _meant(self) -> np.ndarray:
        """(3,) m, where the hand means to be now: on the way to the window's newest place."""
        if not self._left:
            return self._to
        return self._to + self._left / self._number * (self._from - self._to)

    def close(self) -> None:
        """Let go of the channel."""
        if self._channel is not None:
            self._channel.close()
            self._channel = None


def find(options: MouseOptions | None = None) -> list[Availability]:
    """There wherever a window can open: on a screen, or on macOS and Windows."""
    import os
    import sys

    variables = ("DISPLAY", "WAYLAND_DISPLAY")
    if sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in variables):
        return [Availability(SPEC, where="on this screen")]
    return [
        Availability(
            SPEC,
            why_not="there is no screen (neither DISPLAY nor WAYLAND_DISPLAY is set)",
            remedy="use a desktop, 'ssh -X' or 'xvfb-run', or --device simulated --headless",
        )
    ]
