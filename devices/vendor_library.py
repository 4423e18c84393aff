"""Makers' shared libraries, loaded only when asked for: where they may lie, what to say where they do not."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from palpate.mechanics.errors import DeviceError


def candidates(stems: Sequence[str], folders: Sequence[str]) -> list[Path]:
    """Files that could be the library, in order of the folders, of which '' is none; one may be '$NAME' of an
    environment."""
    found = []
    for folder in folders:
        expanded = os.path.expandvars(os.path.expanduser(folder))
        if not expanded or expanded.startswith("$"):
            continue
        for base in (Path(expanded), Path(expanded) / "lib"):
            for stem in stems:
                for pattern in (f"lib{stem}.so*", f"lib{stem}.dylib", f"{stem}.dll"):
                    found += sorted(base.glob(pattern), key=lambda p: len(p.name))
    return found


def load(stems: Sequence[str], folders: Sequence[str], install: str) -> ctypes.CDLL:
    """The first library that loads; raises DeviceError with `install` where there is none."""
    broken = ""
    for path in candidates(stems, folders):
        try:
            return ctypes.CDLL(str(path))
        except OSError as error:
            broken = f" ({path} does not load: {error})"
    for stem in stems:
        name = ctypes.util.find_library(stem)
        if name:
            try:
                return ctypes.CDLL(name)
            except OSError as error:
                broken = f" ({name} does not load: {error})"
    raise DeviceError(f"the library {' or '.join('lib' + s for s in stems)} was not found{broken}: {install}")


Functions = Mapping[str, tuple[type | None, tuple[type, ...]]]
"""C functions by name: what each returns and takes."""


def offered(library: ctypes.CDLL, functions: Functions) -> frozenset[str]:
    """Declare those of the C functions that the library has; their names."""
    names = frozenset(name for name in functions if hasattr(library, name))
    need(library, {name: functions[name] for name in names})
    return names


def need(library: ctypes.CDLL, functions: Functions) -> None:
    """Declare C functions; raises DeviceError where the library lacks one."""
    for name, (result, arguments) in functions.items():
        try:
            function = getattr(library, name)
        except AttributeError as error:
            raise DeviceError(
                f"the library lacks {name}: install a newer version of the maker's SDK"
            ) from error
        function.restype, function.argtypes = result, arguments
