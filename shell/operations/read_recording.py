"""Recordings, by file, by embedded name, or from what already holds one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.mechanics.errors import OptionError, RecordingError
from palpate.operations._declare import operation, option
from palpate.words import typed_word

if TYPE_CHECKING:
    from palpate.mechanics.recording.recording import Recording
    from palpate.operations._shared import RecordingLike


@operation(progress=False)
def read_recording(
    source: Annotated[RecordingLike, option("NAME.csv, NAME.csv.gz, NAME.toml, or an embedded name")],
) -> Recording:
    """Read a recording: NAME.csv, NAME.csv.gz or NAME.toml, or an embedded one by its name.

    Times s, positions of the tip's centre m, forces on the tool N, device frame.
    Raises RecordingError for what is missing or impossible.
    """
    from palpate.mechanics.recording.files import check_plausible
    from palpate.mechanics.recording.recording import Recording as Plain
    from palpate.mechanics.recording.recording import read_recording as read
    from palpate.scenes.embedded import embedded_names, embedded_recording
    from palpate.scenes.scene import scene_names

    held = source if isinstance(source, Plain) else getattr(source, "recording", None)
    if isinstance(held, Plain):
        try:
            check_plausible(
                held.t, held.sample_rate_hz, held.position, held.force_on_tool
            )  # arrays get what files get
        except RecordingError as error:
            words = "pp.recording(t, position, force, tip_radius=..., units=...) takes arrays in other units"
            raise RecordingError(f"{error}; {words}") from error
        return held
    if str(source) in embedded_names():
        return read(embedded_recording(str(source)))
    if not isinstance(source, str | Path):
        raise OptionError(f"a {type(source).__name__} is no recording: give one, or the path of its file")
    try:
        return read(source)
    except RecordingError as error:
        if Path(source).exists() and not _described(Path(source)):
            file = typed_word(source)
            raise RecordingError(
                f"{error}; another program's file is brought in by 'palpate import {file} -o REC', or by "
                f"'palpate open {file}'"
            ) from error
        if isinstance(error.__cause__, RecordingError) and error.__cause__.said:
            from palpate.operations._written import open_words

            words = open_words({"files": (source,)}, error.__cause__.said)
            raise RecordingError(f"{error}; so it is read by '{words}'") from error
        if Path(source).exists() or "." in Path(source).name:
            raise
        if str(source) in scene_names():
            record = f"palpate touch {source} --headless --record {source}.csv.gz"
            raise RecordingError(f"{error}; '{source}' is a scene: '{record}' makes one of it") from error
        raise RecordingError(f"{error}; embedded are {', '.join(embedded_names())}") from error


def _described(path: Path) -> bool:
    """Whether a description lies beside a recording's samples."""
    stem = path.name.removesuffix(".gz").rsplit(".", 1)[0]
    return path.with_name(stem + ".toml").exists()


@operation(progress=False)
def recording(
    t: Annotated[Any, option("times, (n,)", unit="s")],
    position: Annotated[Any, option("position of the tip's centre, (n, 3)", unit="m")],
    force: Annotated[Any, option("(n, 3)", unit="N")],
    *,
    tip_radius_m: Annotated[
        float | None, option("radius of the tool's spherical tip; also given as tip_radius", unit="m")
    ] = None,
    tip_radius: Annotated[float | None, option("the same", unit="m")] = None,
    force_on: Annotated[
        str | None,
        option(
            "body on which the force acts; None: by the sign that a solid gives", choices=("tool", "object")
        ),
    ] = None,
    units: Annotated[Any, option("of the arrays, where they are in others: {'position': 'mm'}")] = None,
    thing: Annotated[Any, option("what [object] of a recording says: {'slab_m': 0.03}")] = None,
) -> Recording:
    """Arrays as a recording, with the checks that files get: units (s, m, N), sizes, whose force it is.

    Raises RecordingError where shapes disagree, a unit is doubtful or something needed is missing.
    """
    import numpy as np

    from palpate.importing.convert import understand
    from palpate.importing.mapping import Said
    from palpate.importing.tables import Table

    t, position, force = (np.asarray(v, dtype=float) for v in (t, position, force))
    if t.ndim != 1 or position.shape != (len(t), 3) or force.shape != (len(t), 3):
        raise RecordingError(
            f"t is {t.shape}, position {position.shape}, force {force.shape}; allowed are (n,), (n, 3) "
            "and (n, 3)"
        )
    names = ("t", "x", "y", "z", "fx", "fy", "fz")
    columns = dict(zip(names, np.column_stack([t, position, force]).T, strict=True))
    said = Said(
        tip_radius_m=tip_radius_m if tip_radius is None else tip_radius,
        force_on=force_on, units=units or {}, thing=thing or {}, tip="sphere",
    )  # fmt: skip
    return understand([Table("arrays", columns)], said, "arrays").recording
