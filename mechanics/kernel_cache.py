"""Where compiled kernels are kept: a folder of the user's cache that is named after their sources.

Numba's own cache notices a change in the file of a kernel, but not in one that it calls elsewhere, and it
leaves compiled files beside the sources, where a later installation finds them. With a folder for every state
of the sources neither can happen.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
from pathlib import Path

ROOMS = ("mechanics", "reconstruct", "render", "devices", "diagnose", "scenes", "palpate", "benchmarks")
_KEPT = 6  # folders of other states that may stay


def cache_root() -> Path:
    """The folder that holds one folder a state of the sources."""
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "palpate" / "kernels"


def kernel_sources(packages: Path) -> list[Path]:
    """The files with kernels in the rooms that lie in `packages`, and those that they import from.

    Numba freezes a global into the compiled kernel, so a file that lends a number counts as well.
    """
    found: set[Path] = set()
    for room in ROOMS:
        for path in (packages / room).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            if "numba" in text:
                found.add(path)
                modules = re.findall(rf"^from ((?:{'|'.join(ROOMS)})[\w.]*) import", text, re.MULTILINE)
                found |= {packages / (module.replace(".", "/") + ".py") for module in modules}
    return sorted(path for path in found if path.is_file())


def sources_key(packages: Path) -> str:
    """Hexadecimal digest of the names and contents of `kernel_sources`."""
    digest = hashlib.sha256()
    for path in kernel_sources(packages):
        digest.update(path.relative_to(packages).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def use_own_folder() -> None:
    """Tell numba the folder; a NUMBA_CACHE_DIR that the user has set stands, and so do unreadable homes."""
    try:
        root = cache_root()
        chosen = os.environ.get("NUMBA_CACHE_DIR", "")
        if chosen and root not in Path(chosen).parents:
            return
        folder = root / sources_key(Path(__file__).resolve().parents[1])
        fresh = not folder.is_dir()
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
    except (OSError, RuntimeError):
        return
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    if fresh:
        others = sorted((p for p in root.iterdir() if p != folder), key=lambda p: p.stat().st_mtime)
        for path in others[:-_KEPT]:
            shutil.rmtree(path, ignore_errors=True)
