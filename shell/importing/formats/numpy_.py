"""NumPy: an archive of named arrays, or one array."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.importing.tables import Table, by_length


def read(path: Path) -> list[Table]:
    """Arrays of an archive (.npz); of an array (.npy) the fields of a structured one by name, the columns of
    a plain one by number ('#1')."""
    held = np.load(path, allow_pickle=False)
    if isinstance(held, np.lib.npyio.NpzFile):
        with held:
            return by_length(path.name, {name: held[name] for name in held.files})
    if held.dtype.names:
        return by_length(path.name, {name: held[name] for name in held.dtype.names})
    (table,) = by_length(path.name, {"": held}) or [Table(path.name, {})]
    columns = list(table.columns.values())
    return [Table(path.name, {f"#{k + 1}": values for k, values in enumerate(columns)})]
