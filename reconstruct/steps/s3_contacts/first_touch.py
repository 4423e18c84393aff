"""The search for first touches: everyone who needs them asks here.

`ContactSpans` are the stretches over a threshold, with a rough first touch each: enough for the check-up and
for a delay that is large. `find_first_touches` fits the contact law to each of them (`single_press`), or cuts
a contact that never breaks (`cycles`), and says of every other contact why it is no palpation.
"""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.mechanics.errors import ContactError, FewPressesError, LoudAirError, NoBaseError
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import ON_SUPPORT, TimeSegment, runs
from palpate.reconstruction.steps.s1_filter.signals import Filtered, Signals, stated_tracing
from palpate.reconstruction.steps.s2_base import (
    LEAN,
    UNTRACED,
    Boundary,
    BoundaryOptions,
    find_boundary,
    find_interval,
    lean,
    refuse_no_foot,
)
from palpate.reconstruction.steps.s3_contacts.cycles import Piece, cycles, found_cycles
from palpate.reconstruction.steps.s3_contacts.force_delay import Delay, delay_by_places
from palpate.reconstruction.steps.s3_contacts.on_support import on_it, recognised, stated
from palpate.reconstruction.steps.s3_contacts.single_press import FoundPress, fitted_touch, paper_touch

PAPER_THRESHOLD_N = 1.0
CLEAR = 1.5
"""Presses must reach so many thresholds in the middle: else most were lost, and the loudest mislead."""
_ABOVE = 10.0
"""Standard deviations of the filtered force that a cycle's peak stands above the minima beside it."""
_LEAST_SPAN_S = 0.05
_LEANED_M = 5e-5
"""A tracing leans deeper into the object's foot: by hand 0.1 to 0.6 mm, and the least of 60 simulated hands
was pushed as at 0.06 mm."""
_NOTICED_N = 1e-3
"""What a press exceeds by itself, in a recording without noise, is not asked for."""
_SLIDE = 8.0
"""Tip radii: contacts that go further are slides."""
_TIPS_M = (1e-3, 0.02)
"""Radii that are believed for that."""


@dataclass(frozen=True)
class RoughTouches:
    """k contacts after the base was traced, read off where the force passes its threshold.

    start, peak, end: (k,) samples. travel: (k, 3) m, the tip's way from first touch to the greatest force.
    push: (k, 3) N on the tool at the greatest force.
    """

    start: np.ndarray
    peak: np.ndarray
    end: np.ndarray
    travel: np.ndarray
    push: np.ndarray

    def __len__(self) -> int:
        return len(self.start)


@dataclass(frozen=True)
class ContactSpans:
    """Where a filtered recording touches anything: the tracing, and the contacts after it."""

    filtered: Filtered

    @property
    def recording(self) -> Recording:
        """As filtered."""
        return self.filtered.signals.recording

    @cached_property
    def tracing(self) -> tuple[int, int]:
        """Samples [first, last) of the tracing. Raises NoBaseError where none is found."""
        recording, signals = self.recording, self.filtered.signals
        given, radius = stated_tracing(recording), recording.tip_radius_m
        return find_interval(recording.t, signals.position, self.filtered.touching, given, radius)

    @cached_property
    def traced(self) -> tuple[int, int]:
        """The tracing; (0, 0) where none is found."""
        try:
            return self.tracing
        except ContactError:
            return 0, 0

    def base(self, options: BoundaryOptions) -> Boundary:
        """Support and base outline. Raises ContactError where the path is open, NoBaseError where none is
        traced, or where nobody states a tracing and what looks most like one is none."""
        signals, touching = self.filtered.signals, self.filtered.touching
        radius, stated = self.recording.tip_radius_m, stated_tracing(self.recording) is not None
        try:
            found = find_boundary(signals.position, signals.force, touching, self.tracing, radius, options)
        except NoBaseError:
            raise
        except ContactError as error:
            if stated and (more := how_to_go_on(self.recording)):
                raise ContactError(f"{error}; {more}") from error
            if stated:
                raise
            raise NoBaseError(f"{error}; if none was traced, {UNTRACED}") from error
        if not stated:
            touched = signals.position[[a for a, _ in self.spans]]
            refuse_no_foot(found, touched, self.recording.t, radius)
            if why := self.beside_foot(found):
                raise NoBaseError(f"no foot was traced: {why}; {LEAN}; or {UNTRACED}")
        return found

    def beside_foot(self, base: Boundary) -> str:
        """Why a tracing went beside the object's foot and not along it; '' where it leaned, or may have."""
        signals, rough = self.filtered.signals, self.rough
        deep = np.linalg.norm(rough.travel, axis=1)
        pressed = deep > 0
        if not pressed.any():
            return ""
        # force grows with depth^1.5 (Hertz)
        grown = np.linalg.norm(rough.push[pressed], axis=1) * (_LEANED_M / deep[pressed]) ** 1.5
        least = float(np.median(grown))
        found = lean(base, signals.position, signals.force, self.recording.sample_rate_hz)
        if not found.below(least):
            return ""
        return (
            "the tip slid on the support and nothing pushed it sideways "
            f"({1e3 * found.force_n:.1f} mN out of the object, standard error {1e3 * found.error_n:.1f} mN, "
            f"where a tip that leans {1e3 * _LEANED_M:g} mm into this object is pushed by "
            f"{1e3 * least:.1f} mN)"
        )

    @cached_property
    def spans(self) -> list[tuple[int, int]]:
        """[start, end) samples of each contact after the tracing, short ones and slides left out."""
        recording, path = self.recording, self.filtered.signals.position
        touching = self.filtered.touching.copy()
        touching[: self.traced[1]] = False
        shortest = max(3, round(_LEAST_SPAN_S * recording.sample_rate_hz))
        found = [(a, b) for a, b in runs(touching) if b - a >= shortest and a > 0 and b < len(recording.t)]
        reach = _SLIDE * float(np.clip(recording.tip_radius_m, *_TIPS_M))
        return [(a, b) for a, b in found if np.ptp(path[a:b], axis=0).max() < reach]

    @cached_property
    def late(self) -> Delay:
        """How late the force reads, by places that are passed twice."""
        signals = self.filtered.signals
        return delay_by_places(self.recording.t, signals.position, signals.magnitude, self.spans)

    @cached_property
    def rough(self) -> RoughTouches:
        """The contacts of `spans`, their force read earlier by `late`."""
        signals = self.filtered.signals
        late, last = round(self.late.seconds * self.recording.sample_rate_hz), len(self.recording.t) - 1
        rows = []
        for a, b in self.spans:
            peak = a + int(np.argmax(signals.magnitude[a:b]))
            start, top = (min(max(i - late, 0), last) for i in (a, peak))
            rows.append(
                (a, peak, b, *(signals.position[top] - signals.position[start]), *signals.force[peak])
            )
        table = np.array(rows, dtype=float).reshape(-1, 9)
        start, peak, end = table[:, :3].T.astype(int)
        return RoughTouches(start, peak, end, table[:, 3:6], table[:, 6:])


@dataclass(frozen=True)
class TouchRequest:
    """What counts as a palpation.

    method: 'noise' or 'paper'. threshold_n, least_peak_n: N, None: by the noise, and as the threshold.
    least_presses: fewer are an error. base: known already; None: it was traced, and is sampled as
    base_options say. unbroken: contact may never break, so that it is cut at its minima.
    """

    method: str
    threshold_n: float | None
    least_peak_n: float | None
    least_duration_s: float
    least_presses: int
    base: Boundary | None
    base_options: BoundaryOptions
    unbroken: bool


@dataclass(frozen=True)
class FirstTouches:
    """The palpations, in order of time, and what else was touched.

    unused: (start, end, reason) samples of contacts that are no palpations. cut: (start, end) of those that
    were cut into cycles. supported: contacts with the support, as recognised.
    """

    spans: ContactSpans
    boundary: Boundary
    touches: tuple[FoundPress, ...]
    unused: tuple[tuple[int, int, str], ...]
    threshold_n: float
    cut: tuple[tuple[int, int], ...]
    supported: tuple[TimeSegment, ...]


def find_first_touches(spans: ContactSpans, request: TouchRequest) -> FirstTouches:
    """Every palpation with its first touch.

    Raises ContactError where nothing is touched, no base is traced or too few presses can be used,
    LoudAirError where free motion alone is nearly as loud as the presses.
    """
    filtered, signals, recording = spans.filtered, spans.filtered.signals, spans.recording
    threshold = request.threshold_n or _threshold_n(filtered, request)
    touching = filtered.touching.copy()
    if not touching.any():
        raise ContactError(
            f"no contact: the force never leaves the noise ({signals.noise_n:.3g} N an axis): "
            "press the object"
        )
    boundary = request.base
    if boundary is None:
        boundary = spans.base(request.base_options)
    if request.base is None or stated_tracing(recording) is not None:
        touching[: spans.traced[1]] = False
    contacts = runs(touching)
    said = any(s.kind in ON_SUPPORT for s in recording.segments)
    known = {} if said or request.base else recognised(signals, boundary, contacts)
    touches: list[FoundPress] = []
    unused: list[tuple[int, int, str]] = []
    pieces: list[Piece] = []
    cut: list[tuple[int, int]] = []
    for a, b in contacts:
        if request.unbroken and (parts := _parts(filtered, a, b)):
            pieces += parts
            cut.append((a, b))
            continue
        reason = stated(recording, a, b)
        if not reason and (a, b) in known:
            reason = f"is with the support ({known[a, b]})"
        reason = reason or _unusable(signals, boundary, a, b, request, threshold)
        touch = None
        if not reason:
            touch = (paper_touch if request.method == "paper" else fitted_touch)(signals, a, b)
        if touch:
            touches.append(touch)
        else:
            unused.append((a, b, reason or "shows no rise of force with depth"))
    if pieces:
        found, slipped = found_cycles(signals, pieces)
        touches = sorted([*touches, *found], key=lambda c: c.start)
        unused = sorted([*unused, *slipped])
    if len(touches) < request.least_presses:
        below = len(contacts) and np.median([boundary.height(signals.position[a]) for a, _ in contacts]) < 0
        raise _too_few(recording, request, threshold, (len(touches), len(contacts)), unused, bool(below))
    _check_loudness(signals, touches, request, threshold)
    t = recording.t
    supported = tuple(TimeSegment(kind, float(t[a]), float(t[b - 1])) for (a, b), kind in known.items())
    return FirstTouches(spans, boundary, tuple(touches), tuple(unused), threshold, tuple(cut), supported)


def _threshold_n(filtered: Filtered, request: TouchRequest) -> float:
    return PAPER_THRESHOLD_N if request.method == "paper" else filtered.threshold_n


def _parts(filtered: Filtered, a: int, b: int) -> list[Piece]:
    """The cycles of a contact [a, b) that is more than one, or goes on from the first sample."""
    pieces = cycles(filtered.signals, a, b, _ABOVE * float(filtered.spread[a:b].min()))
    return pieces if len(pieces) > 1 or (a == 0 and not filtered.free_air.any()) else []


def _unusable(
    signals: Signals, boundary: Boundary, a: int, b: int, request: TouchRequest, threshold_n: float
) -> str:
    """Why the contact of samples [a, b) is no palpation; '' where it is one."""
    t = signals.recording.t
    top, least = float(signals.magnitude[a:b].max()), max(threshold_n, request.least_peak_n or threshold_n)
    if t[b - 1] - t[a] < request.least_duration_s:
        return f"lasts only {(t[b - 1] - t[a]) * 1e3:.0f} ms"
    if top < least:
        return f"peaks at {top:.3f} N, below {least:.3g} N"
    if a == 0:
        return "has no approach: the recording starts in contact"
    return on_it(signals.position[a:b], boundary, signals.recording.tip_radius_m)


def _too_few(
    recording: Recording,
    request: TouchRequest,
    threshold_n: float,
    counts: tuple[int, int],
    unused: list[tuple[int, int, str]],
    below: bool,
) -> ContactError:
    """The error of too few presses. counts: of presses and of contacts. below: they lie below the support."""
    why = f" (the first not used, at {recording.t[unused[0][0]]:.1f} s, {unused[0][2]})" if unused else ""
    felt = f", and until the force is above {1e3 * threshold_n:.2g} mN" if threshold_n > _NOTICED_N else ""
    hint = how_to_go_on(recording) or f"press at more places{felt}"
    if request.method == "paper":
        hint = "lower --contact-threshold or press harder"
    elif below:
        hint = (
            "they lie below the support, so forces have the wrong sign; state the other force_on in the "
            "recording's TOML"
        )
    return FewPressesError(
        f"{counts[0]} of {counts[1]} contacts are usable presses{why}; at least "
        f"{request.least_presses} {'is' if request.least_presses == 1 else 'are'} needed: {hint}",
        0 if below else counts[0],
    )


GOES_ON = "with its --scene; or --phantom NAME or --robot, as it was begun"
"""What an exploration's file does not hold of the command that goes on with it."""


def how_to_go_on(recording: Recording) -> str:
    """How an exploration whose file this is goes on; '' of another recording."""
    if recording.path is None or not recording.segments:
        return ""
    file = shlex.quote(str(recording.path))
    return f"go on exploring: `palpate explore --device mouse --continue {file} --output {file}` ({GOES_ON})"


def _check_loudness(
    signals: Signals, touches: list[FoundPress], request: TouchRequest, threshold_n: float
) -> None:
    """Raises LoudAirError where a threshold by the noise is nearly as high as the presses."""
    if request.method != "noise" or request.threshold_n is not None or not touches:
        return
    middle = np.median(signals.magnitude[[c.peak for c in touches]])
    if middle < CLEAR * threshold_n:
        raise LoudAirError(
            f"the presses reach {middle:.2g} N in the middle, where free motion alone reaches "
            f"{threshold_n:.2g} N: weaker ones are lost; press deeper"
        )
