"""Temporary files and folders, named by host and process, so that what a killed process left is swept; and
where what can be made again is kept."""

from __future__ import annotations

import os
import shutil
import socket
import tempfile
import zlib
from contextlib import suppress
from pathlib import Path

OLD = "old-"
"""Label of a folder that holds what is being replaced."""
_swept: set[Path] = set()


def temporary_prefix(label: str = "", process: int | None = None) -> str:
    """How the name of every temporary file or folder of a process begins, by default of this one."""
    host = zlib.crc32(socket.gethostname().encode(errors="replace")) & 0xFFFF
    return f".palpate-{host:04x}-{os.getpid() if process is None else process}-{label}"


def remove_left(folder: Path, process: int) -> None:
    """Remove the temporary files that a process, which has ended, left in `folder` while it wrote."""
    with suppress(OSError):
        for left in folder.glob(temporary_prefix(process=process) + "*"):
            left.unlink(missing_ok=True)


def memory_folder() -> Path | None:
    """Where files cost no disk, swept; None where the system has no such place."""
    shared = Path("/dev/shm")
    if not os.access(shared, os.W_OK):
        return None
    sweep(shared)
    return shared


def sweep_scratch() -> None:
    """Sweep where scratch files and shared memory go."""
    sweep(Path(tempfile.gettempdir()))
    memory_folder()


def sweep(folder: Path) -> None:
    """Remove what processes of this host that are gone left in `folder`; a folder that was being replaced
    goes back to its place. Once a process and folder."""
    if folder in _swept or os.name == "nt":
        return
    _swept.add(folder)
    ours = temporary_prefix().rsplit("-", 2)[0] + "-"
    with suppress(OSError):
        for left in list(folder.iterdir()):
            process, _, label = left.name.removeprefix(ours).partition("-")
            if not left.name.startswith(ours) or not process.isdigit() or _alive(int(process)):
                continue
            with suppress(OSError):
                if label.startswith(OLD):
                    for kept in left.iterdir():
                        if not (folder / kept.name).exists():
                            os.replace(kept, folder / kept.name)
                if left.is_dir() and not left.is_symlink():
                    shutil.rmtree(left, ignore_errors=True)
                else:
                    left.unlink()


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True


def cache_folder() -> Path:
    """Where what can be made again is kept: $PALPATE_CACHE, or the system's folder for caches."""
    named = os.environ.get("PALPATE_CACHE")
    if named:
        return Path(named)
    from platformdirs import user_cache_path

    return user_cache_path("palpate", appauthor=False)
