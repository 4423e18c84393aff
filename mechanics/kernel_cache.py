"""Where compiled kernels are kept: a folder a state of the sources.

Numba keeps a kernel on disk by the text of its own file and does not see that a kernel it calls, or a number
it took from another module, has changed. So the folder is named by a hash of every source of ours that holds
kernels and of what those import: change one, and all are compiled anew. It must be chosen before a kernel is
decorated, hence from `palpate.mechanics`, which every room imports first.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from palpate.mechanics.disk.scratch import cache_folder

ROOMS = ("mechanics", "reconstruction", "render", "devices", "diagnosis", "scenes")
"""The subpackages of `palpate` that stand in folders of their own in a clone."""
_KEPT = 6  # folders, the newest; several checkouts and versions may take turns
_VARIABLE = "NUMBA_CACHE_DIR"
_DECORATORS = (b"njit", b"palpate.mechanics.kernels")  # numba's own, and where ours are
_IMPORT = re.compile(
    rb"^(?:from|import)[ \t]+(palpate\b[\w.]*)(?:[ \t]+import[ \t]+(\([^)]*\)|[^\n]*))?", re.MULTILINE
)


def choose_folder() -> Path | None:
    """Have numba keep our kernels in the folder of this state of the sources; returns it.

    None, and numba's own default stays, where the user named a folder (NUMBA_CACHE_DIR or
    `numba.config.CACHE_DIR`), where the sources cannot be read (a zip) or the folder cannot be written.
    """
    parent = cache_folder() / "kernels"
    numba = sys.modules.get("numba")
    named = numba.config.CACHE_DIR if numba else os.environ.get(_VARIABLE)
    # what a parent process of ours has set is not the user's: this one may run other sources
    if named and Path(named).parent != parent:
        return None
    try:
        folder = parent / source_key(sources())
        _prepare(folder)
    except OSError:
        return None
    if numba:  # the variable is left: numba would read all of its settings again, and lose those set by hand
        numba.config.CACHE_DIR = str(folder)
    else:
        os.environ[_VARIABLE] = str(folder)
    return folder


def sources() -> dict[str, str]:
    """Dotted name -> path of every module of ours; a package's name stands for its `__init__`.

    Each package is asked where it stands: in site-packages all lie in one folder, in an editable installation
    each lies in a folder of the clone.
    """
    found: dict[str, str] = {}
    for name in ("palpate", *(f"palpate.{room}" for room in ROOMS)):
        spec = importlib.util.find_spec(name)
        for folder in (spec and spec.submodule_search_locations) or ():
            found |= _modules(folder, name)
    return found


def source_key(modules: Mapping[str, str]) -> str:
    """Hash of the kernels' sources among `modules` (dotted name -> path): 16 hexadecimal digits.

    Raises OSError where there are none.
    """
    digest = hashlib.sha256()
    for name, text in sorted(kernel_sources(modules).items()):
        digest.update(name.encode() + b"\0" + text + b"\0")
    return digest.hexdigest()[:16]


def kernel_sources(modules: Mapping[str, str]) -> dict[str, bytes]:
    """Dotted name -> text of every module that holds kernels, and of those that they import at their top.

    Imports count because kernels freeze the numbers that they find. Raises OSError where there are none.
    """
    texts = {name: _read(path) for name, path in modules.items()}
    taken = {name for name, text in texts.items() if any(word in text for word in _DECORATORS)}
    if not taken:
        raise OSError(f"no kernels among {len(modules)} modules")
    for name in tuple(taken):
        taken |= _imported(texts[name]) & texts.keys()
    return {name: texts[name] for name in taken}


def _modules(folder: str, package: str) -> dict[str, str]:
    found = {}
    for entry in os.scandir(folder):
        stem, ending = os.path.splitext(entry.name)
        if ending == ".py":
            found[package if stem == "__init__" else f"{package}.{stem}"] = entry.path
        elif entry.is_dir() and stem.isidentifier() and stem != "__pycache__":
            found |= _modules(entry.path, f"{package}.{stem}")
    return found


def _read(path: str) -> bytes:
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))
    try:
        return os.read(handle, os.fstat(handle).st_size)
    finally:
        os.close(handle)


def _imported(text: bytes) -> set[str]:
    """Dotted names of ours that a module imports at its top: modules, and what is taken out of them."""
    names = set()
    for module, words in _IMPORT.findall(text):
        base = module.decode()
        names.add(base)
        names |= {f"{base}.{word.decode()}" for word in re.findall(rb"\w+", words)}
    return names


def _prepare(folder: Path) -> None:
    """Make the folder, or mark it as used now; where it is new the oldest of its neighbours go.

    Raises OSError where it cannot be written.
    """
    if folder.is_dir():
        tempfile.TemporaryFile(dir=folder).close()
        os.utime(folder)
        return
    folder.mkdir(parents=True)
    neighbours = sorted((p for p in folder.parent.iterdir() if p.is_dir()), key=lambda p: p.stat().st_mtime)
    for old in neighbours[:-_KEPT]:
        shutil.rmtree(old, ignore_errors=True)  # a process that still runs from it makes it again
