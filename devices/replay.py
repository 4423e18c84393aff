"""A recording as a device: its tip path in its own time, for reviewing a session at 1 kHz without a hand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.devices.base import Availability, Clock, DeviceSpec, OpenInWith, host_clock
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.options import option
from palpate.mechanics.recording.recording import Recording, read_recording
from palpate.mechanics.tip_state import IDENTITY_QUATERNION, TipState

SPEC = DeviceSpec(
    name="replay", title="a recording, played back", workspace_radius_m=1.0, max_speed_m_per_s=2.0
)


@dataclass(frozen=True)
class ReplayOptions:
    """Which part of the recording is played, and how often."""

    start_s: float = option(0.0, "begin here in the recording", unit="s", flag="--replay-start")
    loop: bool = option(False, "begin again at the end", flag="--replay-loop")


class ReplayDevice(OpenInWith):
    """A PositionSource; `sequence` is the sample's number. After the end the tip rests at the last sample."""

    spec = SPEC

    def __init__(
        self,
        recording: Recording | Path | str,
        options: ReplayOptions | None = None,
        *,
        clock: Clock = host_clock,
    ) -> None:
        self.recording = recording if isinstance(recording, Recording) else read_recording(recording)
        self.options = options or ReplayOptions()
        self._clock = clock
        t = self.recording.t
        self._velocity = np.gradient(_smoothed(self.recording.position), t, axis=0)
        if not t[0] <= self.options.start_s + t[0] < t[-1]:
            raise DeviceError(
                f"start {self.options.start_s} s lies outside the recording of {t[-1] - t[0]:.1f} s"
            )
        self._start_s: float | None = None

    def open(self) -> None:
        """Start its clock."""
        self._start_s = self._clock()

    def read(self) -> TipState:
        """The sample of this instant."""
        if self._start_s is None:
            raise DeviceError("the replay is not open: call open() or use it in a with statement")
        r = self.recording
        since, length = self.options.start_s + self._clock() - self._start_s, r.t[-1] - r.t[0]
        turns = int(since // length) if self.options.loop else 0
        at = r.t[0] + since - turns * length
        i = int(np.clip(np.searchsorted(r.t, at + 1e-9, side="right") - 1, 0, len(r.t) - 1))
        quaternion = IDENTITY_QUATERNION
        if r.quaternion is not None:
            w, x, y, z = map(float, r.quaternion[i])
            quaternion = (w, x, y, z)
        return TipState(
            time_s=self._clock(),
            sequence=turns * len(r.t) + i,
            position_m=r.position[i],
            velocity_m_per_s=self._velocity[i],
            quaternion=quaternion,
        )

    def close(self) -> None:
        """Stop."""
        self._start_s = None


def _smoothed(position: np.ndarray, samples: int = 21) -> np.ndarray:
    """A moving mean: raw differences of positions in steps of the resolution are useless."""
    samples = min(samples, len(position) // 2 * 2 - 1)
    if samples < 3:
        return position
    padded = np.pad(position, ((samples // 2, samples // 2), (0, 0)), mode="edge")
    total = np.cumsum(np.vstack([np.zeros(3), padded]), axis=0)
    return (total[samples:] - total[:-samples]) / samples


def find(options: ReplayOptions | None = None) -> list[Availability]:
    """Always there; it needs a recording."""
    return [Availability(SPEC, where="--replay REC")]
