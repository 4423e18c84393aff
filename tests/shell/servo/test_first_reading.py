"""The loop begins with a pose that the device has read: one from before would latch the force."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from palpate.devices.mapper import Mapping
from palpate.mechanics.tip_state import TipState
from palpate.servo.device_thread import DeviceThread
from palpate.servo.layout import total_bytes, views
from palpate.servo.tick import IN_CALIBRATED, IN_SEQUENCE, tick_arrays


class Slow:
    """A device whose wire brings its first reading after a few looks at it."""

    def __init__(self, looks: int) -> None:
        self.looks = looks

    def read(self) -> TipState:
        self.looks -= 1
        came = self.looks < 0
        return TipState(1.0, 0 if came else -1, np.zeros(3), calibrated=came, connected=came)


def test_the_first_pose_is_the_devices_first_reading():
    arrays = tick_arrays(views(bytearray(total_bytes())), np.zeros((1, 3)), np.zeros(3))
    thread = DeviceThread(Slow(looks=5), Mapping(), SimpleNamespace(arrays=arrays), read_ahead_s=0.0)
    thread.prepare()
    assert arrays.inbox[IN_SEQUENCE] == 0 and arrays.inbox[IN_CALIBRATED] == 1
