"""What one worker makes and the others share: a folder, and kernels that are being compiled."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from .waiting import eventually


def folder_made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """The folder that `make(folder)` fills: in the first worker that asks, the others wait for it.

    It lasts as long as the session; below PALPATE_TESTS_MADE, which the stages of `.ci/run` share, as long as
    that folder does.
    """
    base = factory.getbasetemp()
    if shared := os.environ.get("PALPATE_TESTS_MADE"):
        base = Path(shared)
        base.mkdir(parents=True, exist_ok=True)
    elif "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent
    folder = base / name
    done = folder.with_suffix(".done")
    try:
        folder.mkdir()
    except FileExistsError:
        assert eventually(done.exists), f"the worker that makes '{name}' did not end"
        return folder
    try:
        make(folder)
    finally:
        done.touch()
    return folder


@contextmanager
def one_at_a_time(path: Path) -> Iterator[None]:
    """Of the workers, one is in here; path: a file that is there and that they all lock."""
    import fcntl

    with path.open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def compile_one_at_a_time() -> None:
    """Workers compile by turns: what another one has compiled meanwhile is then loaded from the cache."""
    import fcntl

    from numba import config
    from numba.core.compiler_lock import global_compiler_lock as lock

    if not config.CACHE_DIR:  # nothing that could be shared
        return
    folder = Path(config.CACHE_DIR)
    folder.mkdir(parents=True, exist_ok=True)
    file = open(folder / ".compiling", "wb")
    acquire, release, held = lock.acquire, lock.release, 0

    def acquire_both() -> None:
        nonlocal held
        acquire()
        held += 1
        if held == 1:
            fcntl.flock(file, fcntl.LOCK_EX)

    def release_both() -> None:
        nonlocal held
        held -= 1
        if held == 0:
            fcntl.flock(file, fcntl.LOCK_UN)
        release()

    lock.acquire, lock.release = acquire_both, release_both
