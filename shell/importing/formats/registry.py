"""The table formats: which files each reads, and the libraries that it needs beyond the program's own.

To add one: a file in this folder with `read(path) -> list[Table]`, and its line here.
"""

from __future__ import annotations

from typing import NamedTuple


class TableFormat(NamedTuple):
    """module: whose `read(path)` returns the tables of a file. suffixes: of its files. needs: libraries."""

    module: str
    suffixes: tuple[str, ...]
    needs: str = ""


TEXT_SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".asc")
SHEET_SUFFIXES = (".xlsx", ".xlsm", ".xls", ".xlsb", ".ods")
_HERE = "palpate.importing.formats"
FORMATS = {
    "text": TableFormat(f"{_HERE}.text", (*TEXT_SUFFIXES, ".gz")),
    "sheets": TableFormat(f"{_HERE}.sheets", SHEET_SUFFIXES, "python-calamine"),
    "numpy": TableFormat(f"{_HERE}.numpy_", (".npz", ".npy")),
    "matlab": TableFormat(f"{_HERE}.matlab", (".mat",), "h5py"),
    "hdf5": TableFormat(f"{_HERE}.hdf5", (".h5", ".hdf5", ".hdf"), "h5py"),
    "parquet": TableFormat(f"{_HERE}.parquet", (".parquet",), "pyarrow"),
    "ros bag": TableFormat(f"{_HERE}.ros_bag", (".bag", ".db3"), "rosbags"),
    "mcap": TableFormat(f"{_HERE}.mcap", (".mcap",), "mcap, rosbags"),
}


def by_suffix() -> dict[str, TableFormat]:
    """The format of each suffix."""
    return {suffix: each for each in FORMATS.values() for suffix in each.suffixes}
