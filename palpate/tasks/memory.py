"""How much memory there is, and how much a process takes; None and 0 where the system does not say."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from pathlib import Path
from typing import Self

_PROC = Path("/proc/self")
_SAMPLE_S = 0.2


def available_bytes() -> int | None:
    """What processes that start now may take: free or quickly freed, and within the control group's limit."""
    found = [_in_system(), *_in_groups()]
    known = [value for value in found if value is not None]
    return min(known) if known else None


def _in_system() -> int | None:
    with contextlib.suppress(OSError, ValueError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024 * int(line.split()[1])
    with contextlib.suppress(OSError, ValueError, AttributeError):
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None


def _in_groups() -> list[int]:
    """Room under the memory limits of this process's control groups (version 2), as containers and SLURM
    set them."""
    room = []
    with contextlib.suppress(OSError, ValueError, IndexError):
        own = (_PROC / "cgroup").read_text().strip().splitlines()[-1].split("::")[1].strip("/")
        root = Path("/sys/fs/cgroup")
        for group in (root / own, *(root / own).parents):
            if not group.is_relative_to(root):
                break
            with contextlib.suppress(OSError, ValueError):
                limit = int((group / "memory.max").read_text())
                room.append(limit - int((group / "memory.current").read_text()))
    return room


class Peak:
    """Greatest memory of this process and its children while the block runs: `with Peak() as peak`."""

    bytes: int = 0

    def __enter__(self) -> Self:
        with contextlib.suppress(OSError):
            (_PROC / "clear_refs").write_text("5")  # the kernel's own high-water mark begins anew
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        return self

    def _watch(self) -> None:
        while not self._ended.wait(_SAMPLE_S):
            self.bytes = max(self.bytes, sum(map(resident_bytes, (os.getpid(), *_children()))))

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self.bytes = max(self.bytes, _high_water())


def resident_bytes(process: int) -> int:
    """Memory that a process holds now."""
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError, AttributeError):
        return 0


def _children() -> list[int]:
    found = []
    with contextlib.suppress(OSError):
        for thread in (_PROC / "task").iterdir():
            with contextlib.suppress(OSError):
                found += [int(word) for word in (thread / "children").read_text().split()]
    return found


def _high_water() -> int:
    with contextlib.suppress(OSError, ValueError):
        for line in (_PROC / "status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    with contextlib.suppress(ImportError):
        import resource

        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return most if sys.platform == "darwin" else 1024 * most
    return 0
