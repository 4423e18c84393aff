"""Both phases of an exploration; palpations by a finite state machine on the force magnitude (section 2.1).

Two modes. `paper`: contact at a threshold tau = 1 N, back-tracked to the first rise. `noise` (default):
thresholds from the sensor's noise, every press used, first touch by fitting the contact law
(reconstruct.steps.s3_contacts.first_touch).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.mechanics.errors import ContactError, OptionError
from palpate.mechanics.options import option
from palpate.mechanics.presses.repeats import SITE_M
from palpate.mechanics.presses.segmentation import FoundAround, FoundPresses, segment_recording
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.shapes.fit import LEAST_TOUCHES
from palpate.reconstruction.steps.s1_filter.noise import (
    FilterOptions,
    low_pass_at,
    noise_gain,
    white_noise_std,
)
from palpate.reconstruction.steps.s1_filter.signals import Signals, filtered_of, read_rate_hz
from palpate.reconstruction.steps.s2_base import Boundary, BoundaryOptions
from palpate.reconstruction.steps.s3_contacts.air_slope import AirSlope, air_slope, without_air_slope
from palpate.reconstruction.steps.s3_contacts.cycles import free_air_seen
from palpate.reconstruction.steps.s3_contacts.first_touch import (
    ContactSpans,
    FirstTouches,
    TouchRequest,
    find_first_touches,
)
from palpate.reconstruction.steps.s3_contacts.force_delay import Delay, force_delay
from palpate.reconstruction.steps.s3_contacts.single_press import FoundPress

METHODS = ("noise", "paper")
_DELAY_ROUNDS = 4
_FAR_S, _UNLIKE_S = 0.04, 0.01
"""A force that reads later than the first is read earlier before touches are looked for, where touches agree
within the second (standard error): first and last touch alone are found to some 80 ms."""
_BETWEEN = 12**-0.5
"""Standard error of a touch that was somewhere between two readings, over the time between them."""
_KNOWN = 2.0
"""Standard errors that a correction is as large as at least."""


@dataclass(frozen=True)
class ContactOptions:
    """What counts as a palpation."""

    contact_threshold_n: float | None = option(
        None,
        "force tau that activates a contact; None: 1 N in the paper's mode, else what noise alone reaches "
        "less than once in 1000 s",
        unit="N",
        flag="--contact-threshold",
    )
    least_peak_n: float | None = option(
        None,
        "least peak force of a press; None: tau",
        unit="N",
        flag="--least-peak",
    )
    least_duration_s: float = option(0.05, "least duration of a press", unit="s")
    least_palpations: int = option(LEAST_TOUCHES, "least number of usable presses", flag="--least-palpations")
    correct_delay: bool = option(
        True, "correct a delay of the force, estimated from first and last touch; never in the paper's mode",
        flag="--correct-delay",
    )  # fmt: skip
    site_m: float = option(
        SITE_M, "presses closer than this are repeats at one site", unit="m", flag="--site-size"
    )
    free_air: str = option(
        "auto",
        "with a known geometry: auto checks whether the tip ever leaves the object, none takes the forces as "
        "tared",
        choices=("auto", "none"),
    )

    def __post_init__(self) -> None:
        """Raises OptionError for a site without size."""
        if not self.site_m > 0:
            raise OptionError(f"--site-size is {self.site_m} m; it must be greater than 0")


def explore(
    recording: Recording,
    *,
    method: str = "noise",
    contact_options: ContactOptions | None = None,
    boundary_options: BoundaryOptions | None = None,
    filter_options: FilterOptions | None = None,
    boundary: Boundary | None = None,
    spans: ContactSpans | None = None,
    unbroken: bool = False,
    flat: bool = False,
) -> Measured:
    """Phases, support, base outline and palpations of a recording.

    boundary: a known base, for recordings without phase I. spans: of this recording at this cutoff, where
    they are known already. unbroken: contact may never break, so that it is cut at its minima (`cycles`).
    flat: what is pressed is, so that free air may slope with the travel (`air_slope`).
    Raises ContactError where phase I is missing, nothing is touched or too few presses can be used.
    """
    options = contact_options or ContactOptions()
    if method not in METHODS:
        raise OptionError(f"contact method {method!r} is unknown; allowed are {', '.join(METHODS)}")
    if options.contact_threshold_n is not None and not options.contact_threshold_n > 0:
        raise OptionError(
            f"--contact-threshold is {options.contact_threshold_n} N; it must be greater than 0"
        )
    cutoff_hz = (filter_options or FilterOptions()).cutoff_hz
    request = TouchRequest(
        method=method,
        threshold_n=options.contact_threshold_n,
        least_peak_n=options.least_peak_n,
        least_duration_s=options.least_duration_s,
        least_presses=options.least_palpations,
        base=boundary,
        base_options=boundary_options or BoundaryOptions(),
        unbroken=unbroken,
    )
    tared = unbroken and not _off_the_object(recording, options, cutoff_hz)

    slope: AirSlope | None = None

    def spans_of(read: Recording) -> ContactSpans:
        if slope is not None:
            return ContactSpans(without_air_slope(read, slope, cutoff_hz))
        return ContactSpans(filtered_of(read, cutoff_hz, tared=tared))

    if spans is None or tared:
        spans = spans_of(recording)
    if flat and not tared and method != "paper" and (slope := _sloping(spans, request)) is not None:
        spans = spans_of(recording)
    shifts = method != "paper" and options.correct_delay
    delay, error = 0.0, 0.0
    if shifts and _is_far(spans.late):
        delay, error = spans.late.seconds, spans.late.error_s
        spans = spans_of(read_earlier(recording, delay))
    found = find_first_touches(spans, request)
    step = force_delay(found.spans.filtered.signals, found.touches)
    if not shifts or not (step.certain or delay):
        return _tabled(recording, found, method, options, slope=slope)
    first, before = found, (delay, error)
    for _ in range(_DELAY_ROUNDS):
        samples = round(step.seconds * recording.sample_rate_hz)
        if not samples:
            break
        delay += samples / recording.sample_rate_hz
        found = find_first_touches(spans_of(read_earlier(recording, delay)), request)
        step = force_delay(found.spans.filtered.signals, found.touches)
    error = step.error_s if np.isfinite(step.error_s) else error
    if abs(delay) < _KNOWN * error:
        dropped = (
            f"the force reads {1e3 * delay:.0f} +- {1e3 * error:.0f} ms late by first and last touch, which "
            "is less than twice its error: not corrected"
        )
        tabled = _tabled(recording, first, method, options, before, slope)
        return replace(tabled, dropped=(dropped,))
    return _tabled(recording, found, method, options, (delay, error), slope)


def _sloping(spans: ContactSpans, request: TouchRequest) -> AirSlope | None:
    try:
        return air_slope(spans.filtered, find_first_touches(spans, request).touches)
    except ContactError:
        return None  # it may read late, which is corrected next


def _is_far(late: Delay) -> bool:
    """Whether the force reads so late that touches would be missed or cut off."""
    return late.error_s < _UNLIKE_S and abs(late.seconds) > _FAR_S and late.certain


def read_earlier(recording: Recording, delay_s: float) -> Recording:
    """The recording with its force shifted earlier by `delay_s`, to whole samples; the ends are repeated."""
    force = _later(recording.t, recording.force_on_tool, delay_s, recording.sample_rate_hz)
    return replace(recording, force_on_tool=force)


def _later(t: np.ndarray, values: np.ndarray, seconds: float, rate_hz: float) -> np.ndarray:
    """Values (n, k) at t (n,) s as they are so much later, to whole samples; between samples where some are
    missing, as a busy program leaves them out. The ends are repeated."""
    at = t + seconds
    rows = np.clip(np.searchsorted(t, at - 0.5 / rate_hz), 0, len(t) - 1)
    found = values[rows]
    missing = np.flatnonzero((t[rows] - at > 0.5 / rate_hz) & (rows > 0))
    for axis in range(values.shape[1]):
        found[missing, axis] = np.interp(at[missing], t, values[:, axis])
    return found


def _tabled(
    recording: Recording,
    found: FirstTouches,
    method: str,
    options: ContactOptions,
    delay: tuple[float, float] = (0.0, 0.0),
    slope: AirSlope | None = None,
) -> Measured:
    """The table of what was found; first touches carry what the delay's error moves them by.

    delay: s, and its standard error. slope: of free air, which was taken off.
    """
    signals, contacts, (delay_s, delay_error_s) = found.spans.filtered.signals, found.touches, delay
    read_hz = read_rate_hz(recording)
    between_s = _BETWEEN / read_hz if read_hz < recording.sample_rate_hz else 0.0
    t, first_last = recording.t, found.boundary.interval
    presses = segment_recording(
        recording,
        FoundPresses(
            onset_s=t[[c.start for c in contacts]],
            peak_s=t[[c.peak for c in contacts]],
            centre=np.array([c.centre for c in contacts]),
            normal=np.array([c.normal for c in contacts]),
            onset_error_m=np.array(
                [
                    np.hypot(c.onset_error_m, _speed(signals, c) * np.hypot(delay_error_s, between_s))
                    for c in contacts
                ]
            ),
            until_s=t[[c.end - 1 for c in contacts]],
            kinds=["cycle" if c.unbroken else "press" for c in contacts],
        ),
        FoundAround(
            free_air=_later(t, found.spans.filtered.free_air, -delay_s, recording.sample_rate_hz),
            followed=found.spans.filtered.followed,
            trace_s=(t[first_last[0]], t[first_last[1] - 1]) if first_last[1] > first_last[0] else None,
            others_s=[(t[a], t[b - 1]) for a, b in (*((a, b) for a, b, _ in found.unused), *found.cut)],
            supported=found.supported,
            noise_n=signals.noise_n,
            delay_s=delay_s,
            delay_error_s=delay_error_s,
        ),
        site_m=options.site_m,
    )
    return Measured(
        recording=recording,
        position=signals.position,
        force=signals.force,
        noise_n=signals.noise_n,
        boundary=found.boundary,
        presses=presses,
        rejected=tuple((float(t[a]), reason) for a, _, reason in found.unused),
        threshold_n=found.threshold_n,
        method=method,
        delay_s=delay_s,
        delay_error_s=delay_error_s,
        spans=found.spans,
        air_slope=slope,
    )


def _speed(signals: Signals, contact: FoundPress) -> float:
    """m/s, of the approach where it touches."""
    rate = signals.recording.sample_rate_hz
    half = round(0.015 * rate)
    path = signals.position[max(contact.start - half, 0) : contact.start + half] @ contact.normal
    return float(np.ptp(path)) / max(len(path) - 1, 1) * rate


def _off_the_object(recording: Recording, contact: ContactOptions, cutoff_hz: float) -> bool:
    """Whether there is free air to be found."""
    if contact.free_air == "none":
        return False
    rate = recording.sample_rate_hz
    position, force = (
        low_pass_at(recording.t, values, rate, cutoff_hz)
        for values in (recording.position, recording.force_on_tool)
    )
    noise = max(white_noise_std(recording.force_on_tool), 0.5 * (recording.force_noise_std_n or 0.0), 1e-6)
    return free_air_seen(position, force, recording.tip_radius_m, noise * noise_gain(rate, cutoff_hz))
