"""Parquet: columns of numbers and times."""

from __future__ import annotations

from pathlib import Path

from palpate.importing.tables import Table, by_length


def read(path: Path) -> list[Table]:
    """Columns of numbers and times."""
    import pyarrow.parquet as pq

    held = pq.read_table(path)
    return by_length(path.name, {n: held[n].to_numpy() for n in held.column_names})
