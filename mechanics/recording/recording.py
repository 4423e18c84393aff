"""A recording: what a haptic device with a force sensor logs while a person explores one object.

Two files of one stem: `NAME.csv` or `NAME.csv.gz` (samples) and `NAME.toml` (what they mean). The format is
described in docs/reference/recording-format.md. SI units; device frame; forces: on the tool.
"""

from __future__ import annotations

import dataclasses
import gzip
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from palpate.mechanics.contact.tip import other_tip
from palpate.mechanics.disk.reading import named_in, read_toml, sha256_of_file
from palpate.mechanics.disk.schema import check_table
from palpate.mechanics.disk.store import content_key
from palpate.mechanics.disk.toml_text import dump_toml
from palpate.mechanics.disk.writing import atomic_file, check_target
from palpate.mechanics.errors import PalpateWarning, RecordingError
from palpate.mechanics.plausible import POISSON_RATIO, QUICKEST_HZ, SAMPLE_RATE
from palpate.mechanics.recording.calibration import Calibration, read_calibration
from palpate.mechanics.recording.files import (
    QUATERNION_COLUMNS,
    REQUIRED_COLUMNS,
    SAMPLES,
    SCHEMA,
    check_plausible,
    description_of,
    read_samples,
    recording_files,
    samples_path,
)
from palpate.mechanics.recording.segments import STATED, TimeSegment
from palpate.mechanics.result import Result


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
    segments: tuple[TimeSegment, ...] = ()

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

    @property
    def tip_assumed(self) -> bool:
        """Whether the samples are another program's, and nobody said that its tip is a sphere."""
        return "import" in self.description and "tip" not in self.description.get("tool", {})

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
    if tool.get("tip", "sphere") != "sphere":
        raise RecordingError(
            other_tip(
                tool["tip"],
                f"'{description}': [tool] tip",
                str(samples),
                tool.get("tip_radius_m"),
                tool.get("tip_angle_deg"),
                own=True,
            )
        )
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
        if np.isfinite(t).all() and not SAMPLE_RATE.takes(rate):
            raise RecordingError(
                f"'{samples}': t steps by {1 / rate:.4g} s, which is {rate:.4g} Hz; it must be "
                f"{SAMPLE_RATE.words}"
                + (
                    ": these look like milliseconds; write t in seconds"
                    if rate < SAMPLE_RATE.low <= rate * 1e3 <= QUICKEST_HZ
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
            base_model=None if base is None else Path(os.path.normpath(description.parent / base)),
            truth=table.get("truth"),
            path=samples,
            sha256=sha256_of_file(samples),
            description=table,
            segments=tuple(
                TimeSegment(s["kind"], float(s["start_s"]), float(s["end_s"]))
                for s in table.get("segment", ())
            ),
        )
        check_plausible(t, recording.sample_rate_hz, recording.position, force)
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
    one that is not within its folder (mechanics.disk.reading.named_in)."""
    if recording.base_model is None:
        raise RecordingError("the recording names no model whose base stands in: [object] model = PATH")
    if recording.path is None:
        return recording.base_model
    return named_in(recording.path, str(recording.base_model.absolute()), RecordingError)


GEOMETRY = ("shape", "shape_unit", "shape_pose", "shape_up", "shape_sink_m", "slab_m", "half_space")
"""Keys of [object] that say what and where the object is."""


def stated_object(recording: Recording) -> dict[str, Any]:
    """What the recording's [object] says of its geometry, by key (GEOMETRY); a shape's file as seen from
    here."""
    thing = recording.description.get("object", {})
    stated = {key: thing[key] for key in GEOMETRY if key in thing} if isinstance(thing, Mapping) else {}
    if "shape" in stated and recording.path is not None:
        stated["shape"] = os.path.normpath(recording.path.parent / str(stated["shape"]))
    return stated


def named_beside(path: Path, stated: Mapping[str, Any]) -> dict[str, Any]:
    """What is stated of an object, its files as seen from here, as a description at `path` names them."""

    def from_there(file: str) -> str:
        try:
            return os.path.relpath(file, path.parent)
        except ValueError:  # on another drive
            return os.path.abspath(file)

    return {**stated, **{key: from_there(str(stated[key])) for key in ("shape", "model") if key in stated}}


def _optional_float(value: Any) -> float | None:
    return None if value is None else float(value)


def write_recording(
    path: Path | str, recording: Recording, *, truth: Mapping[str, Any] | None = None
) -> Path:
    """Write `NAME.csv.gz` (or `.csv`) and `NAME.toml`; the description goes last, so a half pair never reads.

    Times are written to 0.1 ms, positions to 1 nm, forces to 1 uN. Returns the path of the samples.
    """
    path = samples_path(path)
    [(description, kind)] = description_of(path)
    check_target(description, kind)
    write_samples(path, recording, ["%.4f"] + ["%.9f"] * 3 + ["%.6f"] * 3 + ["%.7f"] * 4)
    table = description_table(recording)
    table["object"] = named_beside(path, table["object"])
    if truth is not None:
        table["truth"] = dict(truth)
    # each segment under a header of its own, last: a description begins with [recording]
    segments = table.pop("segment", [])
    words = [dump_toml(table), *("[[segment]]\n" + dump_toml(each) for each in segments)]
    with atomic_file(description, kind) as temporary:
        temporary.write_text("\n".join(words), encoding="utf-8")
    return path


def write_samples(path: Path, recording: Recording, formats: Sequence[str]) -> None:
    """Write the samples, in these formats of t, x, y, z, fx, fy, fz and, where they are there, qw to qz."""
    columns = [recording.t[:, None], recording.position, recording.force_on_tool]
    names = list(REQUIRED_COLUMNS)
    if recording.quaternion is not None:
        columns.append(recording.quaternion)
        names += QUATERNION_COLUMNS
    header, written = ",".join(names), list(formats[: len(names)])
    with atomic_file(path, SAMPLES) as temporary:
        opener = gzip.open if path.suffix == ".gz" else open
        with opener(temporary, "wt", encoding="utf-8", newline="\n") as file:
            np.savetxt(file, np.hstack(columns), fmt=written, delimiter=",", header=header, comments="")


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
    table["object"] |= stated_object(recording)
    if "tip" in (tool := recording.description.get("tool", {})):
        table["tool"]["tip"] = tool["tip"]
    if recording.tip_assumed:
        table["import"] = {}
    if recording.segments:
        table["segment"] = [dataclasses.asdict(each) for each in recording.segments]
    if recording.truth is not None:
        table["truth"] = dict(recording.truth)
    return table
