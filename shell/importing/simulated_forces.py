"""A file of another simulator's forces: a table of time and force on the tool, under any known name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from palpate.diagnosis.other_simulator.forces import Forces, sorted_forces
from palpate.importing.mapping import Said, named_columns
from palpate.importing.tables import read_tables
from palpate.mechanics.errors import RecordingError
from palpate.words import listed

COLUMNS = ("t", "fx", "fy", "fz")


def read_forces(path: Path | str, unit: str | None = None) -> Forces:
    """`t,fx,fy,fz` (s, N), or what `palpate import` knows by other names, separators and units; four columns
    without a name are taken in that order.

    unit: the forces' as it was stated; a name's own is then left alone. Raises RecordingError for what is no
    such file.
    """
    path = Path(path)
    said = Said(units={} if unit is None else {"force": "N"})
    tables = read_tables(path)
    for table in tables:
        found = named_columns([table], COLUMNS, said)
        if len(found) == len(COLUMNS):
            values = [np.asarray(found[role].values) for role in COLUMNS]
            plain = all(found[role].name.lower() == role for role in COLUMNS)
            notes = () if plain else (f"columns: {', '.join(str(found[role]) for role in COLUMNS)}",)
            break
        if list(table.columns) == ["#1", "#2", "#3", "#4"]:
            values = list(table.columns.values())
            notes = ("columns without names were taken as t, fx, fy, fz",)
            break
    else:
        names = [name for table in tables for name in table.columns]
        lacks = [role for role in COLUMNS if role not in found]
        raise RecordingError(
            f"'{path}' has the columns {', '.join(names)}, and none that is {listed(lacks, 'or')}: needed "
            "are t, fx, fy, fz (s; N on the tool, its three components): name them so"
        )
    made = sorted_forces(values[0], np.column_stack(values[1:]), path.name)
    return replace(made, notes=(*notes, *made.notes))
