"""What was felt so far: segments of samples, put together to a recording like any other."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from palpate.diagnosis.explore.felt import felt
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.plausible import SAMPLE_RATE, TIP_RADIUS
from palpate.mechanics.recording.files import check_plausible
from palpate.mechanics.recording.recording import Recording, stated_object
from palpate.mechanics.recording.segments import STATED
from palpate.mechanics.recording.segments import TimeSegment as Stretch

AIR_S = 0.3
"""Before a first press, where a recording is cut that states no segments."""
KINDS = STATED
"""Kinds: the base's outline, a press, free air, presses on the bare support, the outline once more."""


@dataclass(frozen=True)
class Segment:
    """Samples of one tracing, press or the like, air before and after it included; device frame.

    t: (n,) s, increasing, from any zero. position: (n, 3) m, centre of the tip. force: (n, 3) N on the tool.
    quaternion: (n, 4) unit (w, x, y, z), tool frame to device frame, or None.
    """

    kind: str
    t: np.ndarray
    position: np.ndarray
    force: np.ndarray
    quaternion: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Raises RecordingError for shapes that do not fit, NaN, or time that goes back."""
        if self.kind not in KINDS:
            raise RecordingError(f"a segment's kind is '{self.kind}'; allowed are {', '.join(KINDS)}")
        for name, width in (("t", None), ("position", 3), ("force", 3), ("quaternion", 4)):
            if getattr(self, name) is None:
                continue
            value = np.asarray(getattr(self, name), dtype=float)
            wanted = (len(self.t),) if width is None else (len(self.t), width)
            if value.shape != wanted or len(value) < LEAST_SAMPLES or not np.isfinite(value).all():
                raise RecordingError(
                    f"a segment's {name} has shape {value.shape}; it must be {wanted}, "
                    f"{LEAST_SAMPLES} samples or more, "
                    "all finite"
                )
            object.__setattr__(self, name, value)
        if not (np.diff(self.t) > 0).all():
            raise RecordingError("a segment's time goes back or stands still: send samples in order")

    @property
    def seconds(self) -> float:
        """How long it lasted."""
        return float(self.t[-1] - self.t[0])


LEAST_SAMPLES = 20
"""Of a segment: fewer pass no filter."""


@dataclass(frozen=True)
class Instrument:
    """What is known of the device before anything is touched, SI. about: further fields of Recording."""

    tip_radius_m: float
    sample_rate_hz: float = 1000.0
    about: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raises RecordingError for what no recording may state."""
        for name, key in (("tip_radius_m", TIP_RADIUS), ("sample_rate_hz", SAMPLE_RATE)):
            if not key.takes(value := getattr(self, name)):
                raise RecordingError(f"{name} is {value}; it must be {key.words}")


def check_joined(instrument: Instrument, segments: list[Segment], segment: Segment) -> None:
    """Raises RecordingError where a segment makes what no exploration can be."""
    joined = join(instrument, [*segments, segment])
    check_plausible(joined.t, joined.sample_rate_hz, joined.position, joined.force_on_tool)


def join(instrument: Instrument, segments: list[Segment]) -> Recording:
    """The recording of all segments in order; their clocks are joined end to end.

    Phase I is the tracing where there is one; what each segment was stands in the recording. Raises
    RecordingError where there is no segment, or where some hold the tool's orientation and others do not.
    """
    if not segments:
        raise RecordingError("there are no touches yet: add a segment first")
    turned = [s.quaternion is not None for s in segments]
    if any(turned) and not all(turned):
        raise RecordingError(
            "some segments give the tool's orientation and some do not: send it always or never"
        )
    step = 1.0 / instrument.sample_rate_hz
    clocks, phase, now = [], None, 0.0
    stretches: list[Stretch] = []
    for segment in segments:
        clock = segment.t - segment.t[0] + now
        clocks.append(clock)
        now = float(clock[-1]) + step
        stretches.append(Stretch(segment.kind, float(clock[0]), float(clock[-1])))
        if segment.kind == "trace":
            phase = (phase[0] if phase else float(clock[0]), float(clock[-1]))
    first = segments[0]
    made = Recording(
        t=np.concatenate(clocks),
        position=np.concatenate([s.position for s in segments]),
        force_on_tool=np.concatenate([s.force for s in segments]),
        sample_rate_hz=instrument.sample_rate_hz,
        tip_radius_m=instrument.tip_radius_m,
        quaternion=None if first.quaternion is None else np.concatenate([s.quaternion for s in segments]),
        boundary_phase=phase,
        segments=tuple(stretches),
    )
    return replace(made, **instrument.about) if instrument.about else made


ABOUT = (
    "tool_mass_kg", "force_noise_std_n", "position_resolution_m", "object_name", "poisson_ratio",
    "base_model",
)  # fmt: skip
"""Fields of a recording that stay true when it goes on."""


def split(recording: Recording) -> tuple[Instrument, list[Segment]]:
    """The opposite of `join`: the instrument, and the segments in order. A recording that states none is cut
    half way between the presses that are found in it.

    Raises RecordingError where the stated segments do not follow one another, ContactError where nothing can
    be found.
    """
    about = {name: getattr(recording, name) for name in ABOUT if getattr(recording, name) is not None}
    if stated := stated_object(recording):
        about["description"] = {"object": stated}
    instrument = Instrument(recording.tip_radius_m, recording.sample_rate_hz, about)
    t = recording.t
    stretches = recording.segments or _found(recording)
    begin = np.array([s.start_s for s in stretches])
    if (np.diff(begin) <= 0).any():
        raise RecordingError("the recording's segments are not in order of time: sort its [[segment]] tables")
    # half a sample before, since times are written in rounded decimals
    first = np.searchsorted(t, begin - 0.5 / recording.sample_rate_hz)
    first[0], last = 0, np.append(first[1:], len(t))
    q = recording.quaternion
    return instrument, [
        Segment(
            s.kind, t[a:b], recording.position[a:b], recording.force_on_tool[a:b],
            None if q is None else q[a:b],
        )
        for s, a, b in zip(stretches, first, last, strict=True)
    ]  # fmt: skip


def _found(recording: Recording) -> tuple[Stretch, ...]:
    found, _ = felt(recording, 1)
    presses, (first, last) = found.presses, found.boundary.interval
    traced = ["trace"] if last > first else []
    cuts = np.concatenate([
        recording.t[:1], *([presses.onset_s[:1] - AIR_S] if traced else []),
        0.5 * (presses.end_s[:-1] + presses.onset_s[1:]),
        recording.t[-1:],
    ])  # fmt: skip
    kinds = [*traced, *["press"] * len(presses)]
    return tuple(Stretch(k, float(a), float(b)) for k, a, b in zip(kinds, cuts[:-1], cuts[1:], strict=True))
