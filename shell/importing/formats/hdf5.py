"""HDF5: data sets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from palpate.importing.tables import Table, by_length


def read(path: Path) -> list[Table]:
    """Data sets by their full name; the fields of compound ones."""
    import h5py

    held: dict[str, np.ndarray] = {}

    def take(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.ndim in (1, 2) and not name.startswith("#refs#"):
            if item.dtype.names:
                held.update({f"{name}.{n}": item[n] for n in item.dtype.names})
            else:
                held[name] = item[()]

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return by_length(path.name, held)
