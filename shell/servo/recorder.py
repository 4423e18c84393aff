"""A recording of a servo session: the ring's rows, drained by the parent, written as any other recording."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

import numpy as np

from palpate.mechanics.errors import RecordingError
from palpate.mechanics.recording.recording import Recording, write_recording
from palpate.servo.client import Servo
from palpate.servo.layout import ROW


class Recorder:
    """Call `collect` at least every few seconds, then `write`.

    Recorded are the first tip's centre and the rendered force on the tool (support included), scene frame.
    Rows wait in a file without a name, so that an hour of them takes no memory and nothing is left behind.
    """

    def __init__(self, servo: Servo) -> None:
        self._servo = servo
        self._spool = tempfile.TemporaryFile(prefix="palpate-rows-", buffering=0)
        self._kept = 0
        self._next = int(servo.arrays.ring_head[0])

    def collect(self) -> np.ndarray:
        """Take what came since the last time, and return it. Raises RecordingError where it finds no room,
        and takes it once more the next time."""
        rows, following = self._servo.history(self._next)
        data = rows.tobytes()
        try:
            if self._spool.write(data) != len(data):  # a disk that fills up takes the first part
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            self._spool.seek(self._kept)
            self._spool.truncate()
            raise RecordingError(
                f"there is no room for the recording in {tempfile.gettempdir()} ({error.strerror}): free "
                f"some, "
                "or set TMPDIR to another place"
            ) from error
        self._kept += len(data)
        self._next = following
        return rows

    def recording(self, tip_radius_m: float, object_name: str = "object") -> Recording:
        """What was collected; raises RecordingError where there is nothing."""
        self._spool.seek(0)
        rows = np.frombuffer(self._spool.read(), dtype=ROW)
        self._spool.seek(self._kept)
        rows = rows[np.isfinite(rows["tip"]).all(axis=1)]
        if len(rows) < 2:
            raise RecordingError("nothing was recorded: the servo ran for less than two ticks")
        period_s = self._servo.options.period_ns * 1e-9
        return Recording(
            t=(rows["tick"] - rows["tick"][0]) * period_s,
            position=rows["tip"],
            force_on_tool=rows["rendered"],
            quaternion=rows["quaternion"],
            sample_rate_hz=self._servo.options.rate_hz,
            tip_radius_m=tip_radius_m,
            object_name=object_name,
        )

    def write(self, path: Path | str, tip_radius_m: float | None = None) -> Path:
        """Write the recording; the tip's radius is the model's unless given."""
        self.collect()
        radius = self._servo.tip_radius_m if tip_radius_m is None else tip_radius_m
        return write_recording(path, self.recording(radius))
