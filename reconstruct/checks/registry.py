"""Every check in order: first what needs only samples, then the presses, then the model.

What is wrong with units is mended for the checks that follow, so that one fault makes one finding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from mechanics.errors import ContactError, RecordingError
from mechanics.recording import Recording
from reconstruct.checks.air import air, delay
from reconstruct.checks.base import Finding
from reconstruct.checks.channels import channels
from reconstruct.checks.clock import clock
from reconstruct.checks.handedness import handedness
from reconstruct.checks.outcome import Result, outcome
from reconstruct.checks.sight import Sight
from reconstruct.checks.support import dropped, support
from reconstruct.checks.units import settled
from reconstruct.contacts import Exploration, explore

OF_SAMPLES: tuple[Callable[[Sight], Iterator[Finding]], ...] = (channels, clock, delay, handedness, air)
OF_PRESSES: tuple[Callable[[Exploration], Iterator[Finding]], ...] = (support, dropped)
OF_RESULTS: tuple[Callable[[Result], Iterator[Finding]], ...] = (outcome,)


def checked_samples(recording: Recording) -> tuple[Finding, ...]:
    """What the samples alone show."""
    if len(recording.t) < 100:
        return (_too_short(recording),)
    sight, found = settled(recording)
    return ordered([*found, *(f for check in OF_SAMPLES for f in check(sight))])


def checked_presses(exploration: Exploration) -> tuple[Finding, ...]:
    """What base and presses show."""
    return ordered(f for check in OF_PRESSES for f in check(exploration))


def checked_results(result: Result) -> tuple[Finding, ...]:
    """What the modulus and its misfit show."""
    return ordered(f for check in OF_RESULTS for f in check(result))


def check(recording: Recording) -> tuple[Finding, ...]:
    """What samples and presses show, the gravest first; the presses are looked for only in sound samples."""
    found = checked_samples(recording)
    if any(f.grave for f in found):
        return found
    try:
        exploration = explore(recording)
    except ContactError as error:
        return ordered([*found, _no_presses(recording, error)])
    return ordered([*found, *checked_presses(exploration)])


def refuse(found: Iterable[Finding], force: bool) -> None:
    """Raises RecordingError that names the first grave finding, unless `force`."""
    grave = [f for f in found if f.grave]
    if grave and not force:
        first = grave[0]
        more = f" (and {len(grave) - 1} more: palpate check REC)" if len(grave) > 1 else ""
        raise RecordingError(f"{first.name}: {first.saw}; {first.todo}{more}; --force goes on despite it")


def widened(
    modulus_pa: float, ci95_pa: tuple[float, float], found: Iterable[Finding]
) -> tuple[float, float]:
    """The 95 % interval, Pa, with what the findings add to the error of ln modulus; grave ones add none, as
    their error is not known."""
    added = 1.96 * float(np.sqrt(sum(f.error**2 for f in found if not f.grave)))
    if not added or not min(modulus_pa, *ci95_pa) > 0:
        return ci95_pa
    low, high = (float(np.log(end / modulus_pa)) for end in ci95_pa)
    return (
        modulus_pa * float(np.exp(-np.hypot(low, added))),
        modulus_pa * float(np.exp(np.hypot(high, added))),
    )


def ordered(found: Iterable[Finding]) -> tuple[Finding, ...]:
    """The gravest first, else as they came."""
    return tuple(sorted(found, key=lambda f: not f.grave))


def _too_short(recording: Recording) -> Finding:
    return Finding(
        "too short",
        f"{len(recording.t)} samples",
        "an exploration has thousands",
        "record a whole exploration: trace the base, then press",
        np.inf,
        np.inf,
        (float(recording.t[0]), float(recording.t[-1])),
    )


def _no_presses(recording: Recording, error: ContactError) -> Finding:
    return Finding(
        "no presses",
        str(error),
        "reconstruction stops there",
        "see docs/recording-format.md for what a recording holds",
        np.inf,
        np.inf,
        (float(recording.t[0]), float(recording.t[-1])),
    )
