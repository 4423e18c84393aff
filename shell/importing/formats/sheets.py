"""Spreadsheets: every sheet that holds a table, read as a text of its cells would be."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Any

from palpate.importing.formats.text import table_of
from palpate.importing.tables import Table


def read(path: Path) -> list[Table]:
    """A table a sheet, named by it where there are several; sheets without numbers are passed over."""
    found = []
    for name, lines in lines_of(path).items():
        made = table_of(lines, name, separators=("\t",), commas=(False,))
        found += [] if made is None else [made]
    return found if len(found) > 1 else [Table(path.name, each.columns) for each in found]


def lines_of(path: Path) -> dict[str, list[str]]:
    """Each sheet's rows, cells apart by tabs."""
    from python_calamine import CalamineWorkbook

    with path.open("rb") as file:
        book = CalamineWorkbook.from_filelike(file)
        return {
            name: ["\t".join(map(_text, row)) for row in book.get_sheet_by_name(name).to_python()]
            for name in book.sheet_names
        }


def _text(cell: Any) -> str:
    if isinstance(cell, float):
        return repr(cell)
    if isinstance(cell, datetime.timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, datetime.datetime | datetime.date | datetime.time):
        return cell.isoformat(" ") if isinstance(cell, datetime.datetime) else cell.isoformat()
    return str(cell).replace("\t", " ").replace("\n", " ")
