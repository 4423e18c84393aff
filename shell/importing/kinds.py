"""What a file is: a MODEL, a surface, a recording, a machine's curves, or a table of a robot's log; and what
`palpate open` made of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.importing.formats.registry import TEXT_SUFFIXES
from palpate.importing.machine_tests import is_chiaro, kind_of
from palpate.importing.mapping import Said, find_columns
from palpate.importing.side_by_side import side_by_side
from palpate.importing.tables import read_tables
from palpate.mechanics.disk.reading import no_file
from palpate.mechanics.disk.surface_files import is_surface_file
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.result import Result
from palpate.render.press import COLUMNS as PRESS_COLUMNS


@dataclass(frozen=True, eq=False, repr=False)
class Opened(Result):
    """kind: recording, curves, mesh or model. sources: names of the files. understood: what it was taken for,
    and as what. odds: of the least sure of it. notes: what was done to it, a line each. result: a
    Reconstruction, Material, Model, or the Checkup that found something grave. said: what was given of it, by
    name. `plot`, `show`: the result's.
    """

    kind: str
    sources: tuple[str, ...]
    understood: Mapping[str, str]
    result: Any
    notes: tuple[str, ...] = ()
    odds: float = 1e6
    said: Mapping[str, Any] = field(default_factory=dict)

    @property
    def good(self) -> bool:
        """Whether nothing grave was found and the answer predicts."""
        return bool(getattr(self.result, "predicts", True)) and not getattr(self.result, "grave", False)


_CURVES = ("depth", "height", "load")


def kind_of_file(path: Path, columns: Mapping[str, str], units: Mapping[str, str]) -> str:
    """ "model", "mesh", "recording", "curves" or "table". columns, units: what was said of a table.

    Raises RecordingError for a file that is not there or whose columns cannot be told.
    """
    if not path.exists():
        raise RecordingError(f"'{path}' {no_file(path)}: name a file that is there")
    if (path / "model.toml").is_file():
        return "model"
    if path.is_file() and is_surface_file(path):
        return "mesh"
    stem = path.name.removesuffix(".gz").rsplit(".", 1)[0]
    if path.suffix == ".toml" or (
        path.name.endswith((".csv", ".csv.gz")) and path.with_name(stem + ".toml").is_file()
    ):
        return "recording"
    if path.suffix.lower() in TEXT_SUFFIXES and (is_chiaro(path) or kind_of(path) != "indentation"):
        return "curves"
    if any(role in columns for role in _CURVES):
        return "curves"
    tables = read_tables(path)
    if not columns and tuple(tables[0].columns) == PRESS_COLUMNS:
        return "curves"
    first = [side_by_side(table)[0] for table in tables]
    found = find_columns(first, Said(columns=columns, units=units))
    sideways = [found[role] for role in ("x", "y") if found[role].table is not None]
    return "table" if sideways else "curves"
