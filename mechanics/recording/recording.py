"""A recording: what a haptic device with a force sensor logs while a person explores one object.

Two files of one stem: `NAME.csv` or `NAME.csv.gz` (samples) and `NAME.toml` (what they mean). The format is
described in docs/reference/recording-format.md. SI units; device frame; forces: on the tool.
"""

from __future__ import annotations

import dataclasses
import gzip
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from mechanics.bounds import LARGEST_N
from mechanics.disk.files import (
    Kind,
    atomic_file,
    check_target,
    named_in,
    no_file,
    read_toml,
    sha256_of_file,
)
from mechanics.disk.schema import ANY, Key, Listed, Schema, check_table
from mechanics.disk.store import content_key
from mechanics.disk.surface_files import UNITS
from mechanics.disk.toml_text import dump_toml
from mechanics.errors import PalpateWarning, RecordingError
from mechanics.quantities import POISSON_RATIO, TIP_RADIUS
from mechanics.recording.calibration import Calibration, read_calibration
from mechanics.recording.samples_file import MOST_SAMPLES, QUATERNION_COLUMNS, REQUIRED_COLUMNS, read_samples
from mechanics.recording.segments import STATED, Segment
from mechanics.result import Result

SCHEMA: Schema = {
    "recording": {
        "sample_rate_hz": Key(low=60.0, high=1e5, unit="Hz"),
        "force_on": Key(str, choices=("tool", "object"), required=True),
        "boundary_phase": Key(size=2, unit="s"),
        "quasi_static": Key(bool),
        "read_rate_hz": Key(low=1e-3, high=1e5, unit="Hz"),
    },
    "tool": {
        "tip_radius_m": TIP_RADIUS,
        "mass_kg": Key(low=0.0, high=5.0, unit="kg"),
        "calibration": Key(str),
    },
    "sensor": {
        "force_noise_std_n": Key(low=0.0, high=10.0, unit="N"),
        "position_resolution_m": Key(low=0.0, high=0.01, unit="m"),
    },
    "object": {
        "name": Key(str),
        "poisson_ratio": POISSON_RATIO,
        "model": Key(str),
        "shape": Key(str),
        "shape_unit": Key(str, choices=tuple(UNITS)),
        "shape_pose": Key(str, choices=("auto", "given")),
        "shape_up": Key(str),
        "shape_sink_m": Key(low=0.0, high=1.0, unit="m"),
        "slab_m": Key(low=1e-6, high=2.0, unit="m"),
        "half_space": Key(bool),
    },
    "segment": Listed(
        {
            "kind": Key(str, choices=STATED, required=True),
            "start_s": Key(unit="s", required=True),
            "end_s": Key(unit="s", required=True),
        }
    ),
    "import": ANY,
    "truth": ANY,
}
"""What a recording's TOML may hold; further keys are left alone."""

WIDEST_PATH_M = 1.5
"""Greatest extent of a recorded path: objects are at most 1 m."""
_UNITS = {"micrometres": 1e-6, "millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254}
_HAND_M = (0.02, 0.6)
"""Extent of a path that a hand makes round an object, to guess a wrong unit by."""
_QUICKEST_HZ = 2e4
"""No hand's exploration is sampled faster: a slower clock is then no clock in milliseconds."""
_RATE_FACTOR = 1.5


class NotRead(PalpateWarning):
    """Something in a file was not read: a key that looks like one that is known, a segment of a time that was
    not recorded, rows without a number."""


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Result):
    """What a device logged while a hand explored one object; arrays are read-only.

    t: (n,) s, strictly increasing. position: (n, 3) m, centre of the spherical tip, device frame.
    force_on_tool: (n, 3) N, the reaction that pushes the tool out, device frame.
    quaternion: (n, 4) unit (w, x, y, z), tool frame to device frame, or None.
    boundary_phase: (start, end) s of phase I, or None where it is to be detected. segments: what was done
    when, as far as it is stated. `plot`: force over time. `show`: the tip's path, coloured by force.
    """

    t: np.ndarray
    position: np.ndarray
    force_on_tool: np.ndarray
    sample_rate_hz: float
    tip_radius_m: float
    quaternion: np.ndarray | None = None
    boundary_phase: tuple[float, float] | None = None
    tool_mass_kg: float = 0.0
    force_noise_std_n: float | None = None
    position_resolution_m: float | None = None
    object_name: str = "object"
    poisson_ratio: float | None = None
    base_model: Path | None = None
    truth: Mapping[str, Any] | None = None
    path: Path | None = None
    sha256: str = ""
    description: Mapping[str, Any] = field(default_factory=dict)
    segments: tuple[Segment, ...] = ()

    def __post_init__(self) -> None:
        for name in ("t", "position", "force_on_tool", "quaternion"):
            value = getattr(self, name)
            if value is not None:
                value = np.ascontiguousarray(value, dtype=float)
                value.setflags(write=False)
                object.__setattr__(self, name, value)
        for name in ("truth", "description"):
            value = getattr(self, name)
            if isinstance(value, dict):
                object.__setattr__(self, name, MappingProxyType(value))
        _check_samples(self)

    @property
    def name(self) -> str:
        """The stem of the files, or the object's name where the recording was never on disk."""
        return self.path.name.removesuffix(".gz").rsplit(".", 1)[0] if self.path else self.object_name

    @property
    def duration_s(self) -> float:
        """From the first sample to the last, s."""
        return float(self.t[-1] - self.t[0])

    @property
    def force_n(self) -> np.ndarray:
        """(n,) N, length of the force."""
        return np.linalg.norm(self.force_on_tool, axis=1)

    def save(self, path: Path | str) -> Path:
        """Write NAME.csv.gz (or .csv) and NAME.toml; returns the samples' path."""
        return write_recording(path, self)

    @cached_property
    def content(self) -> str:
        """A key of the samples themselves: what was altered after reading has another."""
        none = np.zeros(0)
        quaternion = none if self.quaternion is None else self.quaternion
        return content_key(self.t, self.position, self.force_on_tool, quaternion, self.tip_radius_m)

    def corrected(self, calibration: Calibration) -> Recording:
        """The recording as an ideal instrument had read it."""
        force, position = calibration.as_ideal(self.t, self.force_on_tool, self.position)
        return dataclasses.replace(
            self,
            force_on_tool=force,
            position=position,
            tip_radius_m=calibration.tip_radius_m or self.tip_radius_m,
            force_noise_std_n=calibration.force_noise_std_n or self.force_noise_std_n,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled by its fields and built anew, since a mapping proxy cannot be and arrays come back
        writable."""
        values = (getattr(self, f.name) for f in fields(self))
        return Recording, tuple(dict(v) if isinstance(v, MappingProxyType) else v for v in values)


def _check_samples(recording: Recording) -> None:
    t, position, force = recording.t, recording.position, recording.force_on_tool
    if t.ndim != 1 or len(t) < 2:
        raise RecordingError(
            f"a recording needs at least 2 samples; got {t.size}: record a whole exploration"
        )
    if position.shape != (len(t), 3) or force.shape != (len(t), 3):
        raise RecordingError(
            f"position {position.shape} and force {force.shape} must both be ({len(t)}, 3), one row a sample"
        )
    for columns, values in (("t", t[:, None]), ("x,y,z", position), ("fx,fy,fz", force)):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            raise RecordingError(
                f"{len(bad)} samples have a value in {columns} that is not a finite number "
                f"(first in data row {bad[0] + 1}): every value must be finite; remove or repair those rows"
            )
    back = np.flatnonzero(np.diff(t) <= 0)
    if len(back):
        i = back[0]
        raise RecordingError(
            f"time goes from {t[i]:.6g} s to {t[i + 1]:.6g} s after data row {i + 1} "
            f"({len(back)} such places): t must increase strictly; sort the rows or mend the clock"
        )
    if recording.quaternion is not None:
        norms = np.linalg.norm(recording.quaternion, axis=1)
        if recording.quaternion.shape != (len(t), 4) or not np.all(np.abs(norms - 1) < 1e-2):
            raise RecordingError("qw,qx,qy,qz must be unit quaternions (norm 1 within 0.01) in every row")
    if not recording.tip_radius_m > 0:
        raise RecordingError(f"tip_radius_m is {recording.tip_radius_m}; it must be greater than 0 m")
    if not recording.sample_rate_hz > 0:
        raise RecordingError(f"sample_rate_hz is {recording.sample_rate_hz}; it must be greater than 0 Hz")
    nu = recording.poisson_ratio
    if nu is not None and not POISSON_RATIO.takes(float(nu)):
        raise RecordingError(f"poisson_ratio is {nu}; it must be {POISSON_RATIO.words} (0.49 for silicone)")
    if recording.boundary_phase is not None:
        start, end = recording.boundary_phase
        if not start < end:
            raise RecordingError(f"boundary_phase = [{start}, {end}]: the start must come before the end (s)")
    for each in recording.segments:
        if each.kind not in STATED or not each.start_s < each.end_s:
            raise RecordingError(
                f"a segment is '{each.kind}' from {each.start_s} to {each.end_s} s: its kind must be one of "
                f"{', '.join(STATED)}, and the start must come before the end"
            )


def check_sane(recording: Recording) -> None:
    """What no exploration of an object of 1 mm to 1 m by hand can be; raises RecordingError."""
    t, rate = recording.t, recording.sample_rate_hz
    block = min(100, len(t) - 1)
    read = block / float(np.median(t[block:] - t[:-block]))
    if not _near(read, rate):
        units = {"milliseconds": 1e3, "microseconds": 1e6}
        like = next((unit for unit, scale in units.items() if _near(read * scale, rate)), "")
        raise RecordingError(
            f"t steps by {1 / read:.4g}, in seconds {read:.4g} Hz, where sample_rate_hz is {rate:g}: "
            + (f"these look like {like}; write t in seconds" if like else "state the true rate")
        )
    if (t[-1] - t[0]) * max(rate, read) > MOST_SAMPLES:
        gap = int(np.argmax(np.diff(t)))
        raise RecordingError(
            f"the clock runs from {t[0]:.6g} to {t[-1]:.6g} s (longest gap {t[gap + 1] - t[gap]:.4g} s, "
            f"after data row {gap + 1}): at most {MOST_SAMPLES / rate:.6g} s at {rate:g} Hz; mend the clock "
            "or cut the recording"
        )
    extent = float(np.ptp(recording.position, axis=0).max())
    if extent > WIDEST_PATH_M:
        guesses = [u for u, s in _UNITS.items() if _HAND_M[0] <= extent * s <= _HAND_M[1]]
        like = f"these look like {' or '.join(guesses)}; " if guesses else ""
        raise RecordingError(
            f"the tip's path is {extent:.4g} m across: {like}x, y, z must be metres, at most "
            f"{WIDEST_PATH_M:g} m across"
        )
    loud = np.flatnonzero((np.abs(recording.force_on_tool) > LARGEST_N).any(axis=1))
    if len(loud):
        raise RecordingError(
            f"{len(loud)} samples have a force above {LARGEST_N:g} N (first in data row {loud[0] + 1}): no "
            "sensor reads that; remove or repair those rows"
        )


def _near(value: float, other: float) -> bool:
    return other / _RATE_FACTOR < value < other * _RATE_FACTOR


def recording_files(path: Path | str) -> tuple[Path, Path]:
    """(samples, description) for a recording named by its .csv, .csv.gz or .toml."""
    path = Path(path)
    if path.name.endswith(".csv.gz"):
        stem = path.name.removesuffix(".csv.gz")
    elif path.suffix in (".csv", ".toml"):
        stem = path.name.removesuffix(path.suffix)
    else:
        raise RecordingError(f"'{path}' is no recording: name its .csv, .csv.gz or .toml")
    if path.suffix == ".toml":
        candidates = [path.with_name(stem + ending) for ending in (".csv.gz", ".csv")]
        samples = next((c for c in candidates if c.exists()), candidates[1])
    else:
        samples = path
    description = path.with_name(stem + ".toml")
    for file in (samples, description):
        if not file.is_file():
            raise RecordingError(
                f"'{file}' {no_file(file)}: a recording is NAME.csv (or NAME.csv.gz) "
                "and NAME.toml side by side"
            )
    return samples, description


def read_recording(path: Path | str) -> Recording:
    """Read and validate a recording.

    What [tool] calibration names is taken off (mechanics.recording.calibration).

    Raises RecordingError for missing files or columns, values that are not finite, time that does not
    increase, keys of a wrong type or out of range (SCHEMA), a path, clock or size that no exploration has;
    the message names the first place. Warns of keys that are probably misspelt.
    """
    samples, description = recording_files(path)
    table = read_toml(description, RecordingError)
    for note in check_table(table, SCHEMA, description, RecordingError, strict=False):
        warnings.warn(note, NotRead, stacklevel=2)
    about, sensor = table.get("recording", {}), table.get("sensor", {})
    thing, tool = table.get("object", {}), table.get("tool", {})
    for name, part, key in (("recording", about, "force_on"), ("tool", tool, "tip_radius_m")):
        if key not in part:
            words = SCHEMA[name][key].words  # type: ignore[index, union-attr]
            raise RecordingError(f"'{description}': [{name}] {key} is missing: it must be {words}")
    data = read_samples(samples)
    force = np.column_stack([data[c] for c in ("fx", "fy", "fz")])
    quaternion = None
    if all(c in data for c in QUATERNION_COLUMNS):
        quaternion = np.column_stack([data[c] for c in QUATERNION_COLUMNS])
    t = data["t"]
    rate = about.get("sample_rate_hz")
    if rate is None:
        rate = 1 / float(np.median(np.diff(t))) if len(t) > 1 and (np.diff(t) > 0).all() else 1000.0
        limits = SCHEMA["recording"]["sample_rate_hz"]  # type: ignore[index]
        if np.isfinite(t).all() and not limits.takes(rate):  # type: ignore[union-attr]
            raise RecordingError(
                f"'{samples}': t steps by {1 / rate:.4g} s, which is {rate:.4g} Hz; it must be "
                f"{limits.words}"  # type: ignore[union-attr]
                + (
                    ": these look like milliseconds; write t in seconds"
                    if rate < 60 <= rate * 1e3 <= _QUICKEST_HZ
                    else ""
                )
            )
    phase = about.get("boundary_phase")
    base = thing.get("model")
    try:
        recording = Recording(
            t=t,
            position=np.column_stack([data[c] for c in ("x", "y", "z")]),
            force_on_tool=force if about["force_on"] == "tool" else -force,
            quaternion=quaternion,
            sample_rate_hz=float(rate),
            tip_radius_m=float(tool["tip_radius_m"]),
            tool_mass_kg=float(tool.get("mass_kg", 0.0)),
            boundary_phase=None if phase is None else (float(phase[0]), float(phase[1])),
            force_noise_std_n=_optional_float(sensor.get("force_noise_std_n")),
            position_resolution_m=_optional_float(sensor.get("position_resolution_m")),
            object_name=thing.get("name", "object"),
            poisson_ratio=_optional_float(thing.get("poisson_ratio")),
            base_model=None if base is None else (description.parent / base),
            truth=table.get("truth"),
            path=samples,
            sha256=sha256_of_file(samples),
            description=table,
            segments=tuple(
                Segment(s["kind"], float(s["start_s"]), float(s["end_s"])) for s in table.get("segment", ())
            ),
        )
        check_sane(recording)
    except RecordingError as error:
        raise RecordingError(f"'{samples}': {error}") from error
    beside = [s for s in recording.segments if s.end_s < t[0] or s.start_s > t[-1]]
    if beside:
        first = beside[0]
        warnings.warn(
            f"'{description}': {len(beside)} segments lie outside the recording, from {t[0]:.6g} to "
            f"{t[-1]:.6g} s, and are not read (first: {first.kind}, {first.start_s:g} to {first.end_s:g} s)",
            NotRead,
            stacklevel=2,
        )
    if "calibration" in tool:
        named = named_in(description, str(tool["calibration"]), RecordingError)
        return recording.corrected(read_calibration(named))
    return recording


def base_model_of(recording: Recording) -> Path:
    """The MODEL folder whose base stands in; raises RecordingError where the recording's TOML names none, or
    one that is not within its folder (mechanics.disk.files.named_in)."""
    if recording.base_model is None:
        raise RecordingError("the recording names no model whose base stands in: [object] model = PATH")
    if recording.path is None:
        return recording.base_model
    return named_in(recording.path, str(recording.base_model.absolute()), RecordingError)


def _optional_float(value: Any) -> float | None:
    return None if value is None else float(value)


def samples_path(path: Path | str) -> Path:
    """Where the samples of a recording to be written go; raises RecordingError for another ending."""
    path = Path(path)
    if path.suffix == ".toml":
        path = path.with_suffix(".csv.gz")
    if not path.name.endswith((".csv", ".csv.gz")):
        raise RecordingError(f"'{path}' must end in .csv, .csv.gz or .toml")
    return path


def _description_of(path: Path) -> list[tuple[Path, Kind]]:
    path = samples_path(path)
    stem = path.name.removesuffix(".gz").removesuffix(".csv")
    return [(path.with_name(stem + ".toml"), DESCRIPTION)]


DESCRIPTION = Kind("a recording's description", (b"[recording]",))
SAMPLES = Kind(
    "a recording", (",".join(REQUIRED_COLUMNS).encode(),), likely_bytes=1 << 24, goes=samples_path,
    beside=_description_of,
)  # fmt: skip


def write_recording(
    path: Path | str, recording: Recording, *, truth: Mapping[str, Any] | None = None
) -> Path:
    """Write `NAME.csv.gz` (or `.csv`) and `NAME.toml`; the description goes last, so a half pair never reads.

    Times are written to 0.1 ms, positions to 1 nm, forces to 1 uN. Returns the path of the samples.
    """
    path = samples_path(path)
    [(description, kind)] = _description_of(path)
    check_target(description, kind)
    columns = [recording.t[:, None], recording.position, recording.force_on_tool]
    formats = ["%.4f"] + ["%.9f"] * 3 + ["%.6f"] * 3
    names = list(REQUIRED_COLUMNS)
    if recording.quaternion is not None:
        columns.append(recording.quaternion)
        formats += ["%.7f"] * 4
        names += QUATERNION_COLUMNS
    with atomic_file(path, SAMPLES) as temporary:
        opener = gzip.open if path.suffix == ".gz" else open
        with opener(temporary, "wt", encoding="utf-8", newline="\n") as file:
            np.savetxt(
                file, np.hstack(columns), fmt=formats, delimiter=",", header=",".join(names), comments=""
            )
    table = description_table(recording)
    if truth is not None:
        table["truth"] = dict(truth)
    # each segment under a header of its own, last: a description begins with [recording]
    segments = table.pop("segment", [])
    words = [dump_toml(table), *("[[segment]]\n" + dump_toml(each) for each in segments)]
    with atomic_file(description, kind) as temporary:
        temporary.write_text("\n".join(words), encoding="utf-8")
    return path


def description_table(recording: Recording) -> dict[str, Any]:
    """What NAME.toml says of a recording whose samples hold the force on the tool."""
    table: dict[str, Any] = {
        "recording": {"sample_rate_hz": recording.sample_rate_hz, "force_on": "tool"},
        "tool": {"tip_radius_m": recording.tip_radius_m, "mass_kg": recording.tool_mass_kg},
        "sensor": {},
        "object": {"name": recording.object_name},
    }
    if recording.boundary_phase is not None:
        table["recording"]["boundary_phase"] = list(recording.boundary_phase)
    for key in ("force_noise_std_n", "position_resolution_m"):
        if getattr(recording, key) is not None:
            table["sensor"][key] = getattr(recording, key)
    if recording.poisson_ratio is not None:
        table["object"]["poisson_ratio"] = recording.poisson_ratio
    if recording.base_model is not None:
        table["object"]["model"] = str(recording.base_model)
    if recording.segments:
        table["segment"] = [dataclasses.asdict(each) for each in recording.segments]
    if recording.truth is not None:
        table["truth"] = dict(recording.truth)
    return table
