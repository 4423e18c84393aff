"""Both phases of an exploration; palpations by a finite state machine on the force magnitude (section 2.1).

Two modes. `paper`: contact at a threshold tau = 1 N, back-tracked to the first rise. `noise` (default):
thresholds from the sensor's noise, every press used, first touch by fitting the contact law
(reconstruct.steps.s3_contacts.contact_law).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mechanics.errors import ContactError, LoudAirError, OptionError
from mechanics.options import option
from mechanics.press_cutting import cut
from mechanics.press_sites import SITE_M
from mechanics.presses import Presses
from mechanics.recording import Recording
from mechanics.samples import runs
from mechanics.segments import ON_SUPPORT, Segment
from reconstruct.shapes.evidence import LEAST_TOUCHES
from reconstruct.steps.s1_filter.low_pass import FilterOptions, low_pass_at, noise_gain, white_noise_std
from reconstruct.steps.s1_filter.signals import Filtered, filtered_of
from reconstruct.steps.s2_base.outline import Boundary, BoundaryOptions, find_boundary
from reconstruct.steps.s3_contacts.cycles import Piece, cycles, found_cycles, free_air_seen
from reconstruct.steps.s3_contacts.first_touch import Found, Signals, fitted_contact, paper_contact
from reconstruct.steps.s3_contacts.force_delay import Delay, force_delay
from reconstruct.steps.s3_contacts.on_support import on_it, recognised, stated

PAPER_THRESHOLD_N = 1.0
METHODS = ("noise", "paper")
_CLEAR = 1.5
"""Presses must reach so many thresholds in the middle: else most were lost, and the loudest mislead."""
_ABOVE = 10.0
"""Standard deviations of the filtered force that a cycle's peak stands above the minima beside it."""
_DELAY_ROUNDS = 4
_FAR_S, _UNLIKE_S = 0.04, 0.01
"""A force that reads later than the first is read earlier before touches are looked for, where touches agree
within the second (standard error): first and last touch alone are found to some 80 ms."""


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
        "a press must peak above this; None: tau",
        unit="N",
        flag="--least-peak",
    )
    least_duration_s: float = option(0.05, "a press must last so long", unit="s")
    least_palpations: int = option(
        LEAST_TOUCHES, "fewer usable presses are an error", flag="--least-palpations"
    )
    correct_delay: bool = option(
        True, "shift a force that reads late (first against last touch); never in the paper's mode",
        flag="--correct-delay",
    )  # fmt: skip
    site_m: float = option(SITE_M, "presses closer than this repeat one site", unit="m", flag="--site-size")
    free_air: str = option(
        "auto",
        "of a known geometry: auto looks whether the tip is ever off the object, none takes the forces as "
        "tared",
        choices=("auto", "none"),
    )

    def __post_init__(self) -> None:
        """Raises OptionError for a site without size."""
        if not self.site_m > 0:
            raise OptionError(f"--site-size is {self.site_m} m; it must be greater than 0")


@dataclass(frozen=True)
class Exploration:
    """Everything read off a recording before any shape: both phases, filtered signals, noise, the presses.

    recording: as given. position, force: (n, 3) low-passed, force on the tool with the free-air force taken
    off and read earlier by delay_s, as late as it comes (standard error: delay_error_s).
    noise_n: standard deviation of the raw force an axis. presses: the table, forces in it as read; places and
    normals those of the touches themselves. rejected: (t, reason) of contacts not used. threshold_n: tau.
    method: 'noise' or 'paper'.
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


def explore(
    recording: Recording,
    *,
    method: str = "noise",
    contact_options: ContactOptions | None = None,
    boundary_options: BoundaryOptions | None = None,
    filter_options: FilterOptions | None = None,
    boundary: Boundary | None = None,
    filtered: Filtered | None = None,
    unbroken: bool = False,
) -> Exploration:
    """Phases, support, base outline and palpations of a recording.

    boundary: a known base, for recordings without phase I. filtered: of this recording at this cutoff, where
    it is known already. unbroken: contact may never break, so that it is cut at its minima
    (`unbroken`). Raises ContactError where phase I is missing, nothing is touched or too few
    presses can be used.
    """
    options = contact_options or ContactOptions()
    if method not in METHODS:
        raise OptionError(f"contact method {method!r} is unknown; allowed are {', '.join(METHODS)}")
    if options.contact_threshold_n is not None and not options.contact_threshold_n > 0:
        raise OptionError(
            f"--contact-threshold is {options.contact_threshold_n} N; it must be greater than 0"
        )
    cutoff_hz = (filter_options or FilterOptions()).cutoff_hz
    given = _Given(method, options, boundary_options or BoundaryOptions(), boundary, unbroken)
    tared = unbroken and not _off_the_object(recording, options, cutoff_hz)
    if filtered is None or tared:
        filtered = filtered_of(recording, cutoff_hz, tared=tared)
    shifts = method != "paper" and options.correct_delay
    delay, error = 0.0, 0.0
    if shifts and _is_far(filtered.late):
        delay, error = filtered.late.seconds, filtered.late.error_s
        filtered = filtered_of(read_earlier(recording, delay), cutoff_hz, tared=tared)
    found = _searched(filtered, given)
    step = force_delay(found.signals, found.contacts)
    if not shifts or not (step.certain or delay):
        return _tabled(recording, found, given)
    for _ in range(_DELAY_ROUNDS):
        samples = round(step.seconds * recording.sample_rate_hz)
        if not samples:
            break
        delay += samples / recording.sample_rate_hz
        found = _searched(filtered_of(read_earlier(recording, delay), cutoff_hz, tared=tared), given)
        step = force_delay(found.signals, found.contacts)
    error = step.error_s if np.isfinite(step.error_s) else error
    return _tabled(recording, found, given, delay, error)


def _is_far(late: Delay) -> bool:
    """Whether the force reads so late that touches would be missed or cut off."""
    return late.error_s < _UNLIKE_S and abs(late.seconds) > _FAR_S and late.certain


@dataclass(frozen=True)
class _Given:
    method: str
    contact: ContactOptions
    boundary: BoundaryOptions
    known_base: Boundary | None
    unbroken: bool


def read_earlier(recording: Recording, delay_s: float) -> Recording:
    """The recording with its force shifted earlier by `delay_s`, to whole samples; the ends are repeated."""
    rows = np.arange(len(recording.t)) + round(delay_s * recording.sample_rate_hz)
    return replace(recording, force_on_tool=recording.force_on_tool[np.clip(rows, 0, len(rows) - 1)])


@dataclass(frozen=True)
class _Found:
    """What one pass finds. unused: (start, end, reason) samples of contacts that are no palpations. cut:
    (start, end) of those that were cut into cycles. supported: with the support, as recognised."""

    signals: Signals
    free_air: np.ndarray
    boundary: Boundary
    contacts: tuple[Found, ...]
    unused: tuple[tuple[int, int, str], ...]
    threshold_n: float
    cut: tuple[tuple[int, int], ...]
    supported: tuple[Segment, ...]


def _tabled(
    recording: Recording, found: _Found, given: _Given, delay_s: float = 0.0, delay_error_s: float = 0.0
) -> Exploration:
    """The table of what was found; first touches carry what the delay's error moves them by."""
    signals, contacts = found.signals, found.contacts
    t, first_last = recording.t, found.boundary.interval
    late = np.clip(np.arange(len(t)) - round(delay_s * recording.sample_rate_hz), 0, len(t) - 1)
    presses = cut(
        recording,
        onset_s=t[[c.start for c in contacts]],
        peak_s=t[[c.peak for c in contacts]],
        centre=np.array([c.centre for c in contacts]),
        normal=np.array([c.normal for c in contacts]),
        onset_error_m=np.array(
            [np.hypot(c.onset_error_m, delay_error_s * _speed(signals, c)) for c in contacts]
        ),
        free_air=found.free_air[late],
        trace_s=(t[first_last[0]], t[first_last[1] - 1]) if first_last[1] > first_last[0] else None,
        others_s=[(t[a], t[b - 1]) for a, b in (*((a, b) for a, b, _ in found.unused), *found.cut)],
        supported=found.supported,
        noise_n=signals.noise_n,
        delay_s=delay_s,
        delay_error_s=delay_error_s,
        site_m=given.contact.site_m,
        kinds=["cycle" if c.unbroken else "press" for c in contacts],
        until_s=t[[c.end - 1 for c in contacts]],
    )
    return Exploration(
        recording=recording,
        position=signals.position,
        force=signals.force,
        noise_n=signals.noise_n,
        boundary=found.boundary,
        presses=presses,
        rejected=tuple((float(t[a]), reason) for a, _, reason in found.unused),
        threshold_n=found.threshold_n,
        method=given.method,
        delay_s=delay_s,
        delay_error_s=delay_error_s,
    )


def _speed(signals: Signals, contact: Found) -> float:
    """m/s, of the approach where it touches."""
    rate = signals.recording.sample_rate_hz
    half = round(0.015 * rate)
    path = signals.position[max(contact.start - half, 0) : contact.start + half] @ contact.normal
    return float(np.ptp(path)) / max(len(path) - 1, 1) * rate


def _searched(filtered: Filtered, given: _Given) -> _Found:
    signals = filtered.signals
    found = _found(filtered, given)
    peaks = signals.magnitude[[c.peak for c in found.contacts]]
    automatic = given.method == "noise" and given.contact.contact_threshold_n is None
    if automatic and len(peaks) and np.median(peaks) < _CLEAR * found.threshold_n:
        raise LoudAirError(
            f"the presses reach {np.median(peaks):.2g} N in the middle, where free motion alone reaches "
            f"{found.threshold_n:.2g} N: weaker ones are lost; press deeper"
        )
    return found


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


def _found(filtered: Filtered, given: _Given) -> _Found:
    signals, recording = filtered.signals, filtered.signals.recording
    spread, free_air = filtered.spread, filtered.free_air
    method, options, boundary = given.method, given.contact, given.known_base
    high = PAPER_THRESHOLD_N if method == "paper" else filtered.least * float(filtered.spread.min())
    high = options.contact_threshold_n or high
    touching = filtered.touching.copy()
    if not touching.any():
        raise ContactError(
            f"no contact: the force never leaves the noise ({signals.noise_n:.3g} N an axis): "
            "press the object"
        )
    start = 0
    if boundary is None:
        traced, radius = filtered.tracing, recording.tip_radius_m
        boundary = find_boundary(signals.position, signals.force, touching, traced, radius, given.boundary)
        start = traced[1]
    touching[:start] = False
    least_peak = options.least_peak_n or high
    contacts: list[Found] = []
    unused: list[tuple[int, int, str]] = []
    cut_apart: list[Piece] = []
    cut_up: list[tuple[int, int]] = []
    touches = runs(touching)
    said = any(s.kind in ON_SUPPORT for s in recording.segments)
    known = {} if said or given.known_base else recognised(signals, boundary, touches)
    for a, b in touches:
        if given.unbroken:
            pieces = cycles(signals, a, b, _ABOVE * float(spread[a:b].min()))
            if len(pieces) > 1 or (a == 0 and not free_air.any()):
                cut_apart += pieces
                cut_up.append((a, b))
                continue
        reason = stated(recording, a, b)
        if not reason and (a, b) in known:
            reason = f"is with the support ({known[a, b]})"
        reason = reason or _unusable(signals, boundary, a, b, max(high, least_peak), options.least_duration_s)
        contact = None
        if not reason:
            contact = (paper_contact if method == "paper" else fitted_contact)(signals, a, b)
            reason = "" if contact else "shows no rise of force with depth"
        if contact:
            contacts.append(contact)
        else:
            unused.append((a, b, reason))
    if cut_apart:
        found, slipped = found_cycles(signals, cut_apart)
        contacts = sorted([*contacts, *found], key=lambda c: c.start)
        unused = sorted([*unused, *slipped])
    if len(contacts) < options.least_palpations:
        why = f" (the first not used, at {recording.t[unused[0][0]]:.1f} s, {unused[0][2]})" if unused else ""
        hint = f"press at more places, and until the force is above {high:.2g} N"
        if method == "paper":
            hint = "lower --contact-threshold or press harder"
        elif touches and np.median([boundary.height(signals.position[a]) for a, _ in touches]) < 0:
            hint = (
                "they lie below the support, so forces have the wrong sign; state the other force_on in the "
                "recording's TOML"
            )
        raise ContactError(
            f"{len(contacts)} usable palpations among {len(touches)} contacts of phase II{why}; at least "
            f"{options.least_palpations} are needed: {hint}"
        )
    t = recording.t
    supported = tuple(Segment(kind, float(t[a]), float(t[b - 1])) for (a, b), kind in known.items())
    return _Found(signals, free_air, boundary, tuple(contacts), tuple(unused), high, tuple(cut_up), supported)


def _unusable(
    signals: Signals, boundary: Boundary, a: int, b: int, least_peak_n: float, least_duration_s: float
) -> str:
    """Why the contact of samples [a, b) is no palpation; '' where it is one."""
    t = signals.recording.t
    top = float(signals.magnitude[a:b].max())
    if t[b - 1] - t[a] < least_duration_s:
        return f"lasts only {(t[b - 1] - t[a]) * 1e3:.0f} ms"
    if top < least_peak_n:
        return f"peaks at {top:.3f} N, below {least_peak_n:.3g} N"
    if a == 0:
        return "has no approach: the recording starts in contact"
    return on_it(signals, boundary, a, b)
