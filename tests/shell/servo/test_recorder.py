"""Rows of a session wait in a file: one that fills up keeps whole rows and loses none."""

from __future__ import annotations

import tempfile
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.mechanics.errors import RecordingError
from palpate.servo import Recorder
from palpate.servo.layout import ROW


class SmallDisk:
    """A file in memory that takes so many bytes, and what fits of more."""

    def __init__(self, room):
        self.data, self.room, self.at = bytearray(), room, 0

    def write(self, data):
        fits = data[: max(self.room - self.at, 0)]
        self.data[self.at :] = fits
        self.at += len(fits)
        return len(fits)

    def seek(self, at):
        self.at = at

    def truncate(self):
        del self.data[self.at :]

    def read(self):
        return bytes(self.data[self.at :])


def test_a_disk_that_fills_up_keeps_whole_rows_and_takes_the_rest_later(monkeypatch):
    disk = SmallDisk(int(25.5 * ROW.itemsize))
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **_: disk)
    rows = np.zeros(0, dtype=ROW)
    servo = SimpleNamespace(
        arrays=SimpleNamespace(ring_head=[0]),
        options=SimpleNamespace(period_ns=1_000_000, rate_hz=1000.0),
        history=lambda since: (rows[since:], len(rows)),
    )
    recorder = Recorder(servo)
    for count in (20, 30):
        rows = np.zeros(count, dtype=ROW)
        rows["tick"], rows["quaternion"][:, 0] = np.arange(count), 1.0
        if count == 20:
            recorder.collect()
            continue
        for _ in range(2):
            with pytest.raises(RecordingError, match="no room"):
                recorder.collect()
        assert len(recorder.recording(0.005).t) == 20
    disk.room *= 2
    assert len(recorder.collect()) == 10
    assert recorder.recording(0.005).t == pytest.approx(0.001 * np.arange(30))
