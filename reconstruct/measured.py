"""What was measured: a recording and all that is read off it, made once (`pipeline.measure`).

No step after it takes the recording. It is frozen and grows: each step gives it back with what it has found,
and without the presses that turned out to be none.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.steps.s2_base import Boundary
from palpate.reconstruction.steps.s3_contacts.first_touch import ContactSpans

if TYPE_CHECKING:
    from palpate.reconstruction.checks.finding import Finding
    from palpate.reconstruction.steps.s3_contacts.air_slope import AirSlope


@dataclass(frozen=True)
class Measured:
    """Everything read off a recording before any shape: signals, noise, base, presses with their first
    touches, findings.

    recording: as given. position, force: (n, 3) low-passed, force on the tool with the free-air force taken
    off and read earlier by delay_s, as late as it comes (standard error: delay_error_s).
    noise_n: standard deviation of the raw force an axis. presses: the table, forces in it as read; places and
    normals those of the touches themselves. rejected: (t, reason) of contacts not used. threshold_n: tau.
    method: 'noise' or 'paper'. dropped: corrections that were not made, and why. spans: of all contacts, None
    for points without a time. findings: of the check-up so far, grave ones first. air_slope: of free air with
    the travel, taken off; None where it shows none.
    """

    recording: Recording
    position: np.ndarray
    force: np.ndarray
    noise_n: float
    boundary: Boundary
    presses: Presses
    rejected: tuple[tuple[float, str], ...]
    threshold_n: float
    method: str
    delay_s: float = 0.0
    delay_error_s: float = 0.0
    dropped: tuple[str, ...] = ()
    spans: ContactSpans | None = field(default=None, repr=False, compare=False)
    findings: tuple[Finding, ...] = ()
    air_slope: AirSlope | None = None
