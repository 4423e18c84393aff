"""What the checks look at: the samples in the units believed so far, their noise, steps and touches.

Nothing here relies on the stated rate, on the force's direction or on a base, as these are what is checked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.steps.s1_filter.noise import FilterOptions, white_noise_std
from palpate.reconstruction.steps.s1_filter.signals import Filtered, filtered_of
from palpate.reconstruction.steps.s3_contacts.first_touch import ContactSpans, RoughTouches
from palpate.reconstruction.steps.s3_contacts.force_delay import Delay

CHANNELS = ("x", "y", "z", "fx", "fy", "fz")
_LATTICE = 0.02  # of a step: how well increments must be its multiples
_EVEN = 0.02
"""The stated rate is believed where it is so near to the samples' own."""
_GAP_S = 1.0
_BLOCK = 32


@dataclass(frozen=True)
class Units:
    """Factors that samples are divided by to have s, m and N."""

    time: float = 1.0
    position: float = 1.0
    force: float = 1.0
    tip: float = 1.0


class Samples:
    """A recording as the checks see it.

    times: (n,) s as they are; t: (n,) s, gaps cut to a second. position (n, 3) m, force (n, 3) N on the tool.
    """

    def __init__(
        self, recording: Recording, units: Units | None = None, cutoff_hz: float = FilterOptions.cutoff_hz
    ) -> None:
        self.recording, self.cutoff_hz = recording, cutoff_hz
        self.units = units or Units()
        self.times = recording.t / self.units.time
        self.t = _without_gaps(self.times)
        self.tip_radius_m = recording.tip_radius_m / self.units.tip
        self.position = recording.position / self.units.position
        self.force = recording.force_on_tool / self.units.force

    @cached_property
    def values(self) -> np.ndarray:
        """(n, 6), CHANNELS."""
        return np.hstack([self.position, self.force])

    @cached_property
    def rate_hz(self) -> float:
        """Of most samples, by their own times: neither gaps nor jitter count."""
        blocks = self.times[: len(self.times) // _BLOCK * _BLOCK].reshape(-1, _BLOCK)
        return (_BLOCK - 1) / float(np.median(blocks[:, -1] - blocks[:, 0]))

    @cached_property
    def step(self) -> np.ndarray:
        """(6,) the least step of each channel; 0 where none shows."""
        return np.array([_lattice(self.values[:, k]) for k in range(6)])

    @cached_property
    def noise_n(self) -> float:
        """N an axis, of a raw force: of second differences, and of steps that hide it."""
        return max(white_noise_std(self.force), float(np.median(self.step[3:])) / np.sqrt(12), 1e-9)

    @cached_property
    def filtered(self) -> Filtered:
        """As reconstruction reads them, at the rate and in the units that are believed."""
        if self.as_stated:
            return filtered_of(self.recording, self.cutoff_hz)
        believed = replace(
            self.recording,
            t=self.t,
            position=self.position,
            force_on_tool=self.force,
            sample_rate_hz=self.rate_hz,
            tip_radius_m=self.tip_radius_m,
        )
        return filtered_of(believed, self.cutoff_hz)

    @cached_property
    def contacts(self) -> ContactSpans:
        """Where it touches anything."""
        return ContactSpans(self.filtered)

    @property
    def as_stated(self) -> bool:
        """Whether units, times and rate are believed as they stand: then reconstruction sees the same."""
        even = abs(np.log(self.rate_hz / self.recording.sample_rate_hz)) < _EVEN
        return self.units == Units() and bool(even) and np.array_equal(self.t, self.recording.t)

    @property
    def path(self) -> np.ndarray:
        """(n, 3) m, low-passed position."""
        return self.filtered.signals.position

    @property
    def air(self) -> np.ndarray:
        """(n, 3) N, what is read in free air."""
        return self.filtered.free_air

    @cached_property
    def spread_n(self) -> float:
        """N an axis, noise of the filtered force of a tip that is not moved."""
        return float(self.filtered.spread.min())

    @property
    def net(self) -> np.ndarray:
        """(n, 3) N, low-passed, free air taken off."""
        return self.filtered.signals.force

    @property
    def size(self) -> np.ndarray:
        """(n,) N, length of the net force."""
        return self.filtered.signals.magnitude

    @cached_property
    def contact(self) -> np.ndarray:
        """(n,) bool, whether something is touched."""
        return self.filtered.touching

    @property
    def traced(self) -> tuple[int, int]:
        """Samples [first, last) of the tracing; (0, 0) where none is found."""
        return self.contacts.traced

    @property
    def spans(self) -> list[tuple[int, int]]:
        """[start, end) of each touch after the tracing, short ones and slides left out."""
        return self.contacts.spans

    @property
    def late(self) -> Delay:
        """How late the force reads, by places that are passed twice."""
        return self.contacts.late

    @property
    def touches(self) -> RoughTouches:
        """The contacts' rough first touches, their force read earlier by `late`."""
        return self.contacts.rough


def _without_gaps(t: np.ndarray) -> np.ndarray:
    dt = np.diff(t)
    longest = max(_GAP_S, 2 * float(np.median(dt)))
    if dt.max() <= longest:
        return t
    return t[0] + np.concatenate([[0.0], np.cumsum(np.minimum(dt, longest))])


def _lattice(values: np.ndarray) -> float:
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-12 * max(float(np.ptp(values)), 1e-300)]
    if len(steps) < 20:
        return 0.0
    step = float(np.percentile(steps, 2))
    for reach in (4, 40, 400):  # rounding in the file makes the least increments a coarse scale
        few = steps[steps < (reach + 0.5) * step]
        step = float(few.sum() / np.round(few / step).sum())
    multiple = steps / step
    off = np.abs(multiple - np.round(multiple))[multiple < 1000]
    return step if np.mean(off < _LATTICE) > 0.98 else 0.0
