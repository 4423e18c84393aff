"""A small disk in memory that can be filled to the last byte (Linux, by a user who may mount)."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path


class SmallDisk:
    """A folder that becomes a tmpfs of `size_bytes`; `mounted` is False where the system allows none, and the
    folder is then an ordinary one."""

    def __init__(self, folder: Path, size_bytes: int) -> None:
        self.folder = folder
        folder.mkdir()
        command = ("mount", "-t", "tmpfs", "-o", f"size={size_bytes}", "palpate", str(folder))
        self.mounted = _succeeds(command)
        self._filler = folder / "filler"

    def fill(self) -> None:
        """Leave no room."""
        with self._filler.open("wb") as file:
            page = os.statvfs(self.folder).f_frsize
            while (free := os.statvfs(self.folder).f_bavail) > 0:
                try:
                    os.posix_fallocate(file.fileno(), os.fstat(file.fileno()).st_size, free * page)
                except OSError:  # a page was taken meanwhile
                    continue

    def empty(self) -> None:
        """Give the room back."""
        self._filler.unlink(missing_ok=True)

    def end(self) -> None:
        """Unmount it; what lay on it is gone."""
        if self.mounted:
            self.mounted = not _succeeds(("umount", "--lazy", str(self.folder)))


def _succeeds(command: tuple[str, ...]) -> bool:
    try:
        return subprocess.run(command, capture_output=True).returncode == 0
    except OSError:
        return False
