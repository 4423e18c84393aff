"""Every check in order: first what needs only samples, then the presses, then the model.

What is wrong with units is mended for the checks that follow, so that one fault makes one finding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from palpate.mechanics.errors import ContactError, FewPressesError, NoBaseError, RecordingError
from palpate.mechanics.plausible import EXPLORATION
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import within
from palpate.reconstruction.checks.air import air, delay, sloping, slow
from palpate.reconstruction.checks.channels import channels
from palpate.reconstruction.checks.clock import clock
from palpate.reconstruction.checks.finding import (
    OF_A_KNOWN_OBJECT,
    PRESSES,
    Finding,
    ReconstructionOutcome,
    Way,
    outcome,
)
from palpate.reconstruction.checks.flat import flat
from palpate.reconstruction.checks.handedness import handedness
from palpate.reconstruction.checks.samples import Samples
from palpate.reconstruction.checks.support import dropped, support
from palpate.reconstruction.checks.units import asked, measured, settled
from palpate.reconstruction.geometry.stated import (
    GeometryOptions,
    nowhere,
    over_its_base,
    stated_geometry,
)
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s1_filter.noise import FilterOptions
from palpate.reconstruction.steps.s1_filter.signals import filtered_of
from palpate.reconstruction.steps.s2_base import BoundaryOptions
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.reconstruction.steps.s3_contacts.first_touch import ContactSpans, how_to_go_on
from palpate.reconstruction.steps.s3_contacts.left_out import within_slab, without_slides
from palpate.reconstruction.steps.s3_contacts.quasi_static import is_points
from palpate.reconstruction.steps.s3_contacts.sliding_presses import FLAT

OF_SAMPLES: tuple[Callable[[Samples], Iterator[Finding]], ...] = (channels, clock, delay, handedness, air)
OF_PRESSES: tuple[Callable[[Measured], Iterator[Finding]], ...] = (support, dropped, sloping, slow)
OF_RESULTS: tuple[Callable[[ReconstructionOutcome], Iterator[Finding]], ...] = (outcome,)
_LEAST_SAMPLES = 100


@dataclass(frozen=True)
class CheckedSamples:
    """What the samples alone show: findings, gravest first, and the samples as the checks believe them
    (None: nobody needed them)."""

    found: tuple[Finding, ...] = ()
    data: Samples | None = None

    @property
    def spans(self) -> ContactSpans | None:
        """The contacts that reconstruction would find anew; None where it would see others."""
        return self.data.contacts if self.data is not None and self.data.as_stated else None


def checked_samples(
    recording: Recording, by_hand: bool = True, cutoff_hz: float = FilterOptions.cutoff_hz
) -> CheckedSamples:
    """What the samples alone show; nothing of points that have no clock (quasi-static).

    by_hand: a hand explored a whole object. Otherwise (a slab under an indenter) only the force's direction
    is looked at, and its unit asked about, as sizes, speeds and channels that stand still may be anything.
    cutoff_hz: of the low-pass.
    """
    if is_points(recording):
        return CheckedSamples()
    if len(recording.t) < _LEAST_SAMPLES:
        return CheckedSamples((_too_short(recording),) if by_hand else ())
    if by_hand and _only_prepared(recording):
        return CheckedSamples((_without_presses(recording),))
    if not by_hand:
        data = Samples(recording, cutoff_hz=cutoff_hz)
        return CheckedSamples(ordered([*handedness(data), *asked(data)]), data)
    data, found = settled(recording, cutoff_hz)
    return CheckedSamples(ordered([*found, *(f for check in OF_SAMPLES for f in check(data))]), data)


def checked_presses(exploration: Measured) -> tuple[Finding, ...]:
    """What base and presses show."""
    return ordered(f for check in OF_PRESSES for f in check(exploration))


def checked_results(result: ReconstructionOutcome) -> tuple[Finding, ...]:
    """What the modulus and its misfit show."""
    return ordered(f for check in OF_RESULTS for f in check(result))


def check(recording: Recording) -> tuple[Finding, ...]:
    """What samples and presses show, the gravest first; the presses are looked for only in sound samples."""
    return looked_at(recording)[0]


def looked_at(
    recording: Recording, geometry: GeometryOptions | None = None
) -> tuple[tuple[Finding, ...], Seen]:
    """As `check`, and what the checks measure on the way. geometry: said beside the recording's own."""
    said = stated_geometry(recording, geometry or GeometryOptions())
    samples = checked_samples(recording, by_hand=not said.known)
    found, presses = samples.found, None
    if not any(f.grave for f in found):
        looked = _on_known(recording, samples, said) if said.known else _with_presses(recording, samples)
        found, presses = looked
    counted: Seen = () if presses is None else ((PRESSES, float(presses), np.nan),)
    return found, (*seen(samples.data), *counted)


def no_base(recording: Recording) -> bool:
    """Whether its geometry has to be said: none is stated, and no foot was traced."""
    if stated_geometry(recording, GeometryOptions()).known or recording.base_model is not None:
        return False
    if is_points(recording):
        return True
    try:
        ContactSpans(filtered_of(recording, FilterOptions.cutoff_hz)).base(BoundaryOptions())
    except NoBaseError:
        return True
    except ContactError:
        pass  # the check-up says what else is wrong
    return False


def force_unit_doubt(recording: Recording) -> Finding | None:
    """The question about its force's unit, whatever geometry is stated; None where there is none."""
    found = checked_samples(recording, by_hand=False).found
    return next((f for f in found if f.name == "force unit"), None)


def _on_known(
    recording: Recording, samples: CheckedSamples, geometry: GeometryOptions
) -> tuple[tuple[Finding, ...], int | None]:
    """With what touches say of a geometry that is stated, and how many they are; where they cannot be found,
    reconstruction says why."""
    if geometry.kind not in FLAT:
        return samples.found, None
    try:
        measured = explore(recording, boundary=nowhere(recording), spans=samples.spans, unbroken=True)
        measured = within_slab(without_slides(measured, 1), geometry.slab_m)
    except ContactError:
        return samples.found, None
    return ordered([*samples.found, *flat(measured, geometry)]), len(measured.presses)


def _with_presses(recording: Recording, samples: CheckedSamples) -> tuple[tuple[Finding, ...], int | None]:
    """With what base and presses show, and how many presses there are."""
    found = samples.found
    try:
        exploration = over_its_base(
            recording, lambda base: explore(recording, boundary=base, spans=samples.spans)
        )
    except NoBaseError as error:
        return ordered([*found, _refused(recording, "no base", error, OF_A_KNOWN_OBJECT)]), None
    except ContactError as error:
        return ordered([*found, _refused(recording, "no presses", error, _with_few(recording, error))]), None
    return ordered([*found, *checked_presses(exploration)]), len(exploration.presses)


Seen = tuple[tuple[str, float, float], ...]
"""Words with the unit, value, and what is usual (NaN: anything)."""


def seen(data: Samples | None) -> Seen:
    """What the checks measure on the way."""
    if data is None:
        return ()
    rows = [(EXPLORATION[k].words, v, EXPLORATION[k].usual) for k, v in measured(data).items()]
    free = np.linalg.norm(data.air, axis=1)
    return (
        *rows,
        ("rate by the times of the samples [Hz]", data.rate_hz, np.nan),
        ("touches after the trace", float(len(data.spans)), np.nan),
        (
            "the force reads late [s]",
            data.late.seconds if np.isfinite(data.late.error_s) else np.nan,
            0.0,
        ),
        ("force in free air, mean [N]", float(free.mean()), np.nan),
        (
            "force in free air, change over the recording [N]",
            float(np.ptp(data.air, axis=0).max()),
            np.nan,
        ),
        ("steps of the force [N]", float(data.step[3:].max()), 0.0),
    )


def refuse_grave(found: Iterable[Finding], force: bool = False) -> None:
    """Raises RecordingError where a finding is grave, unless `force`."""
    grave = [f for f in found if f.grave]
    if grave and not force:
        first, more = grave[0], f" (and {len(grave) - 1} more)" if len(grave) > 1 else ""
        raise RecordingError(
            f"{first.name}: {first.saw}{more}; {first.todo}; `palpate check REC --report PAGE` shows "
            "where, `palpate reconstruct --force` continues despite it"
        )


def with_findings(exploration: Measured, found: Iterable[Finding], force: bool = False) -> Measured:
    """With what one more stage of the check-up has found. Raises RecordingError as `refuse_grave`."""
    found = tuple(found)
    refuse_grave(found, force)
    return replace(exploration, findings=ordered([*exploration.findings, *found]))


def widened(modulus_pa: float, ci95_pa: tuple[float, float], found: Iterable[Finding]) -> tuple[float, float]:
    """The 95 % interval, Pa, with what the findings add to the error of ln modulus; grave ones add none, as
    their error is not known."""
    added = 1.96 * float(np.sqrt(sum(f.error**2 for f in found if not f.grave)))
    if not added or not min(modulus_pa, *ci95_pa) > 0:
        return ci95_pa
    low, high = (float(np.hypot(np.log(end / modulus_pa), added)) for end in ci95_pa)
    return modulus_pa * float(np.exp(-low)), modulus_pa * float(np.exp(high))


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
        ways=OF_A_KNOWN_OBJECT,
    )


def _only_prepared(recording: Recording) -> bool:
    """Whether an exploration ended before its first press: its segments hold every sample, none of a press.
    Of another recording they name what lies beside its presses."""
    kinds = {each.kind for each in recording.segments}
    if not how_to_go_on(recording) or "press" in kinds:
        return False
    held = np.any([within(recording.segments, kind, recording.t) for kind in kinds], axis=0)
    return bool(held[1:-1].all())  # the ends are rounded


def _without_presses(recording: Recording) -> Finding:
    """An exploration that ended before its first press, whose samples show nothing of drift or noise."""
    return Finding(
        "no presses",
        f"it ended after {recording.duration_s:.0f} s, before anything was pressed",
        "its segments say so",
        how_to_go_on(recording),
        np.inf,
        np.inf,
        (float(recording.t[0]), float(recording.t[-1])),
        ways=(),
    )


def _with_few(recording: Recording, error: ContactError) -> tuple[Way, ...]:
    """Ways for the presses that there are: on something flat few tell a modulus, less surely. None of an
    exploration, whose object was traced and which goes on."""
    if how_to_go_on(recording):
        return ()
    few = error.usable if isinstance(error, FewPressesError) else 0
    flat = (way for way in OF_A_KNOWN_OBJECT if few and "shape" not in way.options)
    return tuple(Way(way.says, {**way.options, "least_palpations": few}) for way in flat)


def _refused(recording: Recording, name: str, error: ContactError, ways: tuple[Way, ...]) -> Finding:
    more = "press at more places, each from the air and back"
    return Finding(
        name,
        str(error),
        "reconstruction stops there",
        "say what is known of the object" if ways else how_to_go_on(recording) or more,
        np.inf,
        np.inf,
        (float(recording.t[0]), float(recording.t[-1])),
        ways=ways,
    )
