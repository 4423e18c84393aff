"""The compiled safety filter as an object that a test can step."""

from __future__ import annotations

import numpy as np

from palpate.devices.base import DeviceSpec, finite_vector
from palpate.devices.safety import (
    RawPose,
    SafetyOptions,
    reason_words,
    safety_parameters,
    safety_state,
    safety_step,
)


class SafetyFilter:
    """The safety filter as an object."""

    def __init__(
        self, options: SafetyOptions, spec: DeviceSpec, workspace_centre_m: np.ndarray | None = None
    ) -> None:
        self.parameters = safety_parameters(options, spec)
        self.state = safety_state(workspace_centre_m)

    def step(
        self, wanted_n: np.ndarray, reading: RawPose, enable: int, dt_s: float
    ) -> tuple[np.ndarray, str]:
        """(3,) N that may be sent, and why it differs from what was wanted.

        Raises DeviceError for anything but 3-vectors, which compiled code would read past.
        """
        checked = reading._replace(
            position=finite_vector(reading.position), velocity=finite_vector(reading.velocity)
        )
        reasons = safety_step(self.parameters, self.state, finite_vector(wanted_n), checked, enable, dt_s)
        return self.state.force.copy(), reason_words(reasons)
