"""MATLAB: variables and the fields of structures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.importing.formats import hdf5
from palpate.importing.tables import Table, by_length


def read(path: Path) -> list[Table]:
    """Variables and the fields of structures; version 7.3 is HDF5."""
    import scipy.io

    try:
        held = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError:
        return hdf5.read(path)
    return by_length(path.name, _fields(held))


def _fields(held: Mapping[str, Any], before: str = "") -> dict[str, np.ndarray]:
    found: dict[str, np.ndarray] = {}
    for name, value in held.items():
        if name.startswith("__"):
            continue
        if hasattr(value, "_fieldnames"):
            inner = {n: getattr(value, n) for n in value._fieldnames}
            found |= _fields(inner, f"{before}{name}.")
        elif isinstance(value, np.ndarray):
            found[before + name] = value
    return found
