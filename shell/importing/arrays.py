"""NumPy, MATLAB, HDF5 and Parquet: named arrays, those of one length a table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.importing.tables import Table


def npz(path: Path) -> list[Table]:
    """Arrays of a NumPy archive."""
    with np.load(path, allow_pickle=False) as held:
        return _by_length(path.name, {name: held[name] for name in held.files})


def npy(path: Path) -> list[Table]:
    """A NumPy array: the fields of a structured one by name, the columns of a plain one by number ('#1')."""
    held = np.load(path, allow_pickle=False)
    if held.dtype.names:
        return _by_length(path.name, {name: held[name] for name in held.dtype.names})
    (table,) = _by_length(path.name, {"": held}) or [Table(path.name, {})]
    columns = list(table.columns.values())
    return [Table(path.name, {f"#{k + 1}": values for k, values in enumerate(columns)})]


def matlab(path: Path) -> list[Table]:
    """Variables and the fields of structures; version 7.3 is HDF5."""
    import scipy.io

    try:
        held = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError:
        return [Table(t.name, t.columns) for t in hdf5(path)]
    return _by_length(path.name, _fields(held))


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


def hdf5(path: Path) -> list[Table]:
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
    return _by_length(path.name, held)


def parquet(path: Path) -> list[Table]:
    """Columns of numbers and times."""
    import pyarrow.parquet as pq

    held = pq.read_table(path)
    return _by_length(path.name, {n: held[n].to_numpy() for n in held.column_names})


def _by_length(name: str, held: Mapping[str, np.ndarray]) -> list[Table]:
    """A table for each length: (n,) arrays, and the columns of (n, k) or (k, n) with k up to 16."""
    tables: dict[int, dict[str, np.ndarray]] = {}
    for key, value in held.items():
        value = np.asarray(value)
        if value.dtype.kind == "M":
            value = (value - value[0]).astype("timedelta64[ns]").astype(float) * 1e-9
        if value.dtype.kind not in "fiub" or value.ndim not in (1, 2) or not value.size:
            continue
        value = value[:, None] if value.ndim == 1 else value
        value = value.T if value.shape[0] < value.shape[1] else value
        if value.shape[1] > 16:
            continue
        wide = value.shape[1] > 1
        own = tables.setdefault(len(value), {})
        own.update({f"{key}[{k}]" if wide else key: value[:, k].astype(float) for k in range(value.shape[1])})
    many = len(tables) > 1
    return [Table(f"{name}:{n}" if many else name, columns) for n, columns in tables.items()]
