"""Where compiled kernels are kept: a folder a state of the sources.

Numba keeps a kernel on disk by the text of its own file and does not see that a kernel it calls, or a number
it took from another module, has changed. So the folder is named by a hash of every source of ours that holds
kernels and of what those import: change one, and all are compiled anew. It must be chosen before a kernel is
decorated, hence from `mechanics/__init__.py`, which every package imports first.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

from mechanics.disk.scratch import cache_folder

PACKAGES = ("mechanics", "reconstruct", "render", "devices", "diagnose", "scenes", "palpate")
_KEPT = 6  # folders, the newest; several checkouts and versions may take turns
_VARIABLE = "NUMBA_CACHE_DIR"
_DECORATORS = (b"njit", b"mechanics.kernels")  # numba's own, and where ours are
_IMPORT = re.compile(
    rb"^(?:from|import)[ \t]+((?:" + "|".join(PACKAGES).encode() + rb")\b[\w.]*)"
    rb"(?:[ \t]+import[ \t]+(\([^)]*\)|[^\n]*))?",
    re.MULTILINE,
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
        folder = parent / source_key(Path(__file__).resolve().parents[1])
        _prepare(folder)
    except OSError:
        return None
    if numba:  # the variable is left: numba would read all of its settings again, and lose those set by hand
        numba.config.CACHE_DIR = str(folder)
    else:
        os.environ[_VARIABLE] = str(folder)
    return folder


def source_key(root: Path) -> str:
    """Hash of the kernels' sources below `root`, the folder of the packages: 16 hexadecimal digits.

    Raises OSError where there are none.
    """
    digest = hashlib.sha256()
    for path, text in sorted(kernel_sources(root).items()):
        digest.update(os.path.relpath(path, root).encode() + b"\0" + text + b"\0")
    return digest.hexdigest()[:16]


def kernel_sources(root: Path) -> dict[str, bytes]:
    """Path -> text of every source of ours that holds kernels, and of what those import at their top.

    Imports count because kernels freeze the numbers that they find. Raises OSError where there are none.
    """
    folders = [os.path.join(root, package) for package in PACKAGES]
    sources = {path: _read(path) for folder in folders for path in _python_files(folder)}
    taken = {path for path, text in sources.items() if any(word in text for word in _DECORATORS)}
    if not taken:
        raise OSError(f"no kernels below '{root}'")
    for path in tuple(taken):
        taken.update(p for name in _imported(sources[path]) for p in _files_of(root, name) if p in sources)
    return {path: sources[path] for path in taken}


def _python_files(folder: str) -> list[str]:
    found = []
    for entry in os.scandir(folder) if os.path.isdir(folder) else ():
        if entry.name.endswith(".py"):
            found.append(entry.path)
        elif entry.is_dir() and entry.name != "__pycache__":
            found += _python_files(entry.path)
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


def _files_of(root: Path, name: str) -> tuple[str, str]:
    path = os.path.join(root, *name.split("."))
    return path + ".py", os.path.join(path, "__init__.py")


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
