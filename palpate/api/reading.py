"""Recordings and tables: read, checked, imported."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanics.errors import OptionError
from mechanics.progress import Progress
from palpate.api.telling import told

if TYPE_CHECKING:
    from mechanics.recording import Recording
    from palpate.api.telling import RecordingLike
    from palpate.importing.imported import Imported
    from reconstruct.checks.checkup import Checkup


def read_recording(source: RecordingLike) -> Recording:
    """Read a recording: NAME.csv, NAME.csv.gz or NAME.toml, or an embedded one by its name.

    source: the file, or "silicone-1-cylinder". Times s, positions of the tip's centre m, forces on the tool
    N, device frame (docs/recording-format.md). Raises RecordingError for what is missing or impossible.
    """
    from mechanics.errors import RecordingError
    from mechanics.recording import Recording
    from mechanics.recording import read_recording as read
    from scenes.embedded import embedded_names, embedded_recording

    if isinstance(source, Recording):
        return source
    held = getattr(source, "recording", None)
    if isinstance(held, Recording):
        return held
    if str(source) in embedded_names():
        return read(embedded_recording(str(source)))
    if not isinstance(source, str | Path):
        raise OptionError(f"a {type(source).__name__} is no recording: give one, or the path of its file")
    try:
        return read(source)
    except RecordingError as error:
        if Path(source).exists() or "." in Path(source).name:
            raise
        raise RecordingError(f"{error}; embedded are {', '.join(embedded_names())}") from error


def check(recording: RecordingLike, *, full: bool = False, progress: bool | Progress = True) -> Checkup:
    """What may be wrong with a recording: units, axes, channels, clock, traced base, presses (docs/check.md).

    full: reconstruct it too, some 20 s, and check its modulus. The result has findings, the gravest first,
    each with a stretch in s; `reconstruct` refuses what is grave. Raises RecordingError for what is no
    recording, and what `reconstruct` raises with `full`.
    """
    from reconstruct.checks.checkup import Checkup
    from reconstruct.checks.registry import looked_at
    from reconstruct.pipeline import ReconstructOptions, reconstruct_fully

    measured = read_recording(recording)
    with told("check", progress) as tell:
        findings, seen = looked_at(measured)
        if full and not any(f.grave for f in findings):
            findings = reconstruct_fully(measured, ReconstructOptions(force=True), tell).findings
    return Checkup(measured, findings, seen, full)


def import_table(*files: str | Path, mapping: str | Path | None = None, **said: Any) -> Imported:
    """What other programs' files hold, as a recording: CSV, TSV, text, NumPy, MATLAB, HDF5, Parquet, ROS
    bag, MCAP.

    mapping: a TOML file that says what the columns are (docs/import-export.md); said: the same by keyword,
    which count before it: columns {role: name}, units {kind: unit}, tip_radius_m, force_on ("tool",
    "object"), frame ("device", "tool"), rotation (3, 3), flange_to_tip_m (3,), mass_kg, tare_s (start,
    end), offset_s, rate_hz, thing (what [object] of the recording is to say). The recording is in m, s and N,
    forces on the tool. Raises RecordingError where something needed is missing.
    """
    import dataclasses as classes

    from palpate.importing.convert import understand
    from palpate.importing.imported import Imported
    from palpate.importing.mapping import Said, read_mapping
    from palpate.importing.tables import read_tables

    held = {} if mapping is None else read_mapping(mapping)
    for key, value in said.items():
        merged = isinstance(value, Mapping) and isinstance(held.get(key), Mapping)
        held[key] = {**held[key], **value} if merged else value
    allowed = [field.name for field in classes.fields(Said)]
    strange = sorted(set(held) - set(allowed))
    if strange:
        raise OptionError(f"pp.import_table has no option '{strange[0]}': allowed are {', '.join(allowed)}")
    if not files:
        raise OptionError("pp.import_table needs a file")
    chosen = Said(**held)
    tables = [table for file in files for table in read_tables(file)]
    understood = understand(tables, chosen, Path(files[0]).name.split(".")[0])
    return Imported(understood, chosen.thing, tuple(Path(file).name for file in files))


def read_table(*files: str | Path, mapping: str | Path | None = None, **said: Any) -> Recording:
    """The recording in other programs' files, in m, s and N; files, mapping and said are as for
    `import_table`, which also tells and draws what it understood. Raises RecordingError."""
    return import_table(*files, mapping=mapping, **said).recording
