"""Phase II: palpations found by a finite state machine on the force magnitude (paper, section 2.1).

Two modes. `paper`: contact at a threshold tau = 1 N, back-tracked to the first rise. `noise` (default): thresholds
from the sensor's noise, every press used, first touch by fitting the contact law (reconstruct.onset).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechanics.errors import ContactError
from mechanics.options import option
from mechanics.recording import Recording
from reconstruct.baseline import free_air_force
from reconstruct.boundary import Boundary, BoundaryOptions, find_boundary, find_interval, runs
from reconstruct.filtering import FilterOptions, low_pass, noise_gain, white_noise_std
from reconstruct.onset import Rise, fit_rise

PAPER_THRESHOLD_N = 1.0


@dataclass(frozen=True)
class ContactOptions:
    """What counts as a palpation."""

    contact_threshold_n: float | None = option(
        None,
        "force tau that activates a contact (paper: 1 N; default: 10 sigma)",
        unit="N",
        flag="--contact-threshold",
    )
    least_peak_n: float | None = option(
        None, "a press must peak above this (default: 12 sigma)", unit="N", flag="--least-peak"
    )
    least_duration_s: float = option(0.05, "a press must last so long", unit="s")
    least_palpations: int = option(
        4, "fewer usable presses than this are an error", flag="--least-palpations"
    )


@dataclass(frozen=True)
class Contact:
    """One press; device frame, SI.

    start, peak, end: sample indices of first touch, greatest force, loss of touch (end exclusive).
    centre: (3,) tip's centre at first touch. point: (3,) surface point there. normal: (3,) outward.
    depth_m: greatest travel of the centre along -normal. peak_n: greatest force. onset_error_m: of the first touch
    along the normal. law: the fitted rise, None in the paper's mode.
    """

    start: int
    peak: int
    end: int
    t_onset: float
    t_peak: float
    centre: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    depth_m: float
    peak_n: float
    onset_error_m: float = 0.0
    law: Rise | None = None


@dataclass(frozen=True)
class Exploration:
    """Everything read off a recording before any shape: both phases, filtered signals, noise.

    position, force: (n, 3) low-passed, force on the tool with the free-air force taken off. free_air: (n, 3) N.
    noise_n: standard deviation of the raw force an axis. rejected: (t, reason) of contacts not used.
    boundary: None where the recording has no phase I.
    """

    recording: Recording
    position: np.ndarray
    force: np.ndarray
    free_air: np.ndarray
    noise_n: float
    boundary: Boundary | None
    contacts: tuple[Contact, ...]
    rejected: tuple[tuple[float, str], ...]
    threshold_n: float

    @property
    def points(self) -> np.ndarray:
        """(k, 3) P_S of the paper: surface points at first touch."""
        return np.array([c.point for c in self.contacts])

    @property
    def normals(self) -> np.ndarray:
        """(k, 3) outward normals at first touch, from the force."""
        return np.array([c.normal for c in self.contacts])


def explore(
    recording: Recording,
    *,
    method: str = "noise",
    contact_options: ContactOptions | None = None,
    boundary_options: BoundaryOptions | None = None,
    filter_options: FilterOptions | None = None,
    boundary: Boundary | None = None,
) -> Exploration:
    """Phases, support, base outline and palpations of a recording.

    method: 'noise' or 'paper'. boundary: a known base, for recordings without phase I.
    Raises ContactError where phase I is missing, nothing is touched or too few presses can be used.
    """
    contact_options = contact_options or ContactOptions()
    cutoff = (filter_options or FilterOptions()).cutoff_hz
    rate = recording.sample_rate_hz
    position = low_pass(recording.position, rate, cutoff)
    filtered = low_pass(recording.force_on_tool, rate, cutoff)
    noise = max(white_noise_std(recording.force_on_tool), 1e-6)
    if recording.force_noise_std_n:
        noise = max(noise, 0.5 * recording.force_noise_std_n)
    spread = noise * noise_gain(rate, cutoff)
    free_air, _ = free_air_force(recording.t, filtered, spread)
    force = filtered - free_air
    magnitude = np.linalg.norm(force, axis=1)
    low, high = 5 * spread, contact_options.contact_threshold_n
    if high is None:
        high = PAPER_THRESHOLD_N if method == "paper" else 10 * spread
    touching = hysteresis(magnitude, low, max(10 * spread, low))
    if not touching.any():
        raise ContactError(
            f"no contact: the force never leaves the noise ({noise:.3g} N an axis): press the object"
        )
    start = 0
    if boundary is None:
        interval = find_interval(
            recording.t, position, touching, recording.boundary_phase, recording.tip_radius_m
        )
        boundary = find_boundary(
            position, force, touching, interval, recording.tip_radius_m, boundary_options or BoundaryOptions()
        )
        start = interval[1]
    state = hysteresis(magnitude, low, high)
    state[:start] = False
    candidates = runs(state)
    build = _paper_contact if method == "paper" else _noise_contact
    contacts: list[Contact] = []
    rejected: list[tuple[float, str]] = []
    least_peak = contact_options.least_peak_n
    if least_peak is None:
        least_peak = high if method == "paper" else 12 * noise
    for a, b in candidates:
        reason = ""
        if (b - a) / rate < contact_options.least_duration_s:
            reason = f"lasts only {(b - a) / rate * 1e3:.0f} ms"
        elif magnitude[a:b].max() < least_peak:
            reason = f"peaks at {magnitude[a:b].max():.3f} N, below {least_peak:.3f} N"
        elif b == len(state):
            reason = "is cut off by the end of the recording" if a + 50 > b else ""
        if not reason and boundary is not None:
            reason = _on_support(boundary, position[a:b], recording.tip_radius_m)
        if not reason:
            contact = build(recording, position, force, magnitude, a, b, low, noise)
            if contact is None:
                reason = "shows no rise of force with depth"
            else:
                contacts.append(contact)
        if reason:
            rejected.append((float(recording.t[a]), reason))
    if method == "paper":
        weak = [r for r in runs(hysteresis(magnitude, low, max(10 * spread, low))) if r[0] >= start]
        for a, b in weak:
            if magnitude[a:b].max() < high and (b - a) / rate >= contact_options.least_duration_s:
                rejected.append(
                    (float(recording.t[a]), f"peaks at {magnitude[a:b].max():.2f} N, below tau = {high:g} N")
                )
    if len(contacts) < contact_options.least_palpations:
        why = f"; not used: {rejected[0][1]} (at {rejected[0][0]:.1f} s)" if rejected else ""
        hint = "lower --contact-threshold or press harder" if method == "paper" else "press at more places"
        raise ContactError(
            f"{len(contacts)} usable palpations of {len(candidates)} contacts found; at least "
            f"{contact_options.least_palpations} are needed{why}: {hint}"
        )
    return Exploration(
        recording=recording,
        position=position,
        force=force,
        free_air=free_air,
        noise_n=noise,
        boundary=boundary,
        contacts=tuple(contacts),
        rejected=tuple(sorted(rejected)),
        threshold_n=high,
    )


def hysteresis(magnitude: np.ndarray, low: float, high: float) -> np.ndarray:
    """(n,) bool: runs above `low` that reach `high`; each is the state machine's contact, back-tracked to its rise."""
    state = np.zeros(len(magnitude), dtype=bool)
    for a, b in runs(magnitude > low):
        if magnitude[a:b].max() > high:
            state[a:b] = True
    return state


def _on_support(boundary: Boundary, path: np.ndarray, tip_radius_m: float) -> str:
    low = float(boundary.height(path).min()) - tip_radius_m
    slack = max(3 * boundary.flatness_m, 1e-4)
    return f"is on the support (the tip's lowest point is {low * 1e3:.2f} mm above it)" if low < slack else ""


def _paper_contact(
    recording: Recording,
    position: np.ndarray,
    force: np.ndarray,
    magnitude: np.ndarray,
    a: int,
    b: int,
    low: float,
    noise: float,
) -> Contact | None:
    """First touch where the force started to rise: the last sample before `low` was passed at which it still fell."""
    start = a
    while start > 0 and magnitude[start - 1] < magnitude[start]:
        start -= 1
    peak = a + int(np.argmax(magnitude[a:b]))
    normal = force[peak] / magnitude[peak]
    return _contact(recording, position, magnitude, start, peak, b, position[start], normal)


def _noise_contact(
    recording: Recording,
    position: np.ndarray,
    force: np.ndarray,
    magnitude: np.ndarray,
    a: int,
    b: int,
    low: float,
    noise: float,
) -> Contact | None:
    peak = a + int(np.argmax(magnitude[a:b]))
    normal = initial_normal(position, force, magnitude, a, peak)
    if normal is None:
        return None
    rate = recording.sample_rate_hz
    rising = slice(max(0, a - int(0.15 * rate)), peak + 1)
    # only the approach itself: further back the hand may come from anywhere
    travel = -(position[rising] - position[a]) @ normal
    approach = a - rising.start
    before = np.flatnonzero(travel[:approach] > 0.0005)
    first = int(before[-1]) + 1 if len(before) else 0
    raw = (recording.force_on_tool[rising] - (force * 0)[rising]) @ normal
    raw = (
        raw - np.median(raw[first : max(first + 1, approach - int(0.05 * rate))])
        if approach - first > 80
        else raw
    )
    travel, push = travel[first:], raw[first:]
    thin = max(1, len(travel) // 400)
    rise = fit_rise(travel[::thin], push[::thin], noise, guess_m=0.0)
    along = -(position[max(0, a - int(0.15 * rate)) : peak + 1] - position[a]) @ normal
    after = np.flatnonzero(along[first:] >= rise.u0_m)
    start = rising.start + first + (int(after[0]) if len(after) else approach - first)
    centre = position[start] + (-(rise.u0_m + (position[start] - position[a]) @ normal)) * normal
    contact = _contact(recording, position, magnitude, start, peak, b, centre, normal)
    return None if contact.depth_m <= 0 else _with_law(contact, rise)


def _with_law(contact: Contact, rise: Rise) -> Contact:
    from dataclasses import replace

    return replace(contact, onset_error_m=rise.u0_error_m, law=rise)


def initial_normal(
    position: np.ndarray, force: np.ndarray, magnitude: np.ndarray, a: int, peak: int
) -> np.ndarray | None:
    """Outward normal from the first force: its mean direction while it rises from 15 to 60 % of the peak."""
    level = magnitude[a : peak + 1] / magnitude[peak]
    chosen = (level > 0.15) & (level < 0.6)
    if chosen.sum() < 3:
        chosen = level > 0.1
    direction = force[a : peak + 1][chosen].sum(axis=0)
    length = np.linalg.norm(direction)
    return direction / length if length > 0 else None


def _contact(
    recording: Recording,
    position: np.ndarray,
    magnitude: np.ndarray,
    start: int,
    peak: int,
    end: int,
    centre: np.ndarray,
    normal: np.ndarray,
) -> Contact:
    depth = -(position[start:end] - centre) @ normal
    return Contact(
        start=start,
        peak=peak,
        end=end,
        t_onset=float(recording.t[start]),
        t_peak=float(recording.t[peak]),
        centre=centre,
        point=centre - recording.tip_radius_m * normal,
        normal=normal,
        depth_m=float(depth.max()),
        peak_n=float(magnitude[peak]),
    )
