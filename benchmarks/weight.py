"""What an install weighs: megabytes on the disk by library, of the environment that runs this.

Run it by the `palpate` of a fresh environment, in the clone: an editable install has other files.
"""

from __future__ import annotations

import argparse
import sys
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

from benchmarks.evidence import Figure
from benchmarks.timing import table

PARTS = {
    "MKL, OpenMP, TBB": ("mkl", "intel", "tbb", "tcmlib", "umf", "onemkl", "pypardiso"),
    "VTK and PyVista": ("vtk", "pyvista"),
    "LLVM and Numba": ("llvmlite", "numba"),
    "NumPy and SciPy": ("numpy", "scipy"),
    "Matplotlib, Pillow, fontTools": ("matplotlib", "pillow", "fonttools"),
    "Palpate": ("palpate",),
}
"""By how the names of distributions begin."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """None."""


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Weigh each library's own files, and the environment, which also holds what pip compiled."""
    parts = dict.fromkeys([*PARTS, "all others"], 0)
    for each in distributions():
        name = each.metadata["Name"].lower()
        part = next((p for p, heads in PARTS.items() if name.startswith(heads)), "all others")
        parts[part] += sum(_bytes(Path(str(each.locate_file(file)))) for file in each.files or ())
    whole = sum(_bytes(path) for path in Path(sys.prefix).rglob("*"))
    figures = [Figure(name, size / 1e6, unit="MB") for name, size in parts.items()]
    figures.append(Figure("the environment", whole / 1e6, unit="MB"))
    print(table(["part", "MB"], [[f.what, f.value] for f in figures]))
    return {"figures": figures}


def _bytes(path: Path) -> int:
    return path.stat().st_size if path.is_file() and not path.is_symlink() else 0
