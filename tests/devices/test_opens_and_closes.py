"""A device is opened and closed a thousand times: no thread, no open file and no memory stays behind.

`pytest -s -m slow` of this file prints its figures."""

from __future__ import annotations

import gc
import os
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from palpate.devices.base import ForceSink

from .benches import MAKERS, eventually

CYCLES = 300
WARM_UP = 50
MOST_BYTES = 16384
"""Of memory a cycle, the emulator's own in the same process too: no thread's stack, no buffer of messages."""


def held() -> tuple[int, int]:
    """Threads of this process, and its open files."""
    return threading.active_count(), len(os.listdir("/proc/self/fd"))


def resident() -> int:
    """Bytes of this process in memory."""
    gc.collect()
    return 4096 * int(Path("/proc/self/statm").read_text().split()[1])


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="counts open files in /proc")
@pytest.mark.parametrize("name", list(MAKERS))
def test_a_thousand_times_open_and_closed_leaves_nothing(name: str, tmp_path: Path) -> None:
    bench = MAKERS[name](tmp_path)
    device = bench.device

    def fresh(seen: int, cycle: int) -> bool:
        bench.move(np.full(3, 1e-3 * (1 + cycle % 7)))
        return device.read().sequence > seen

    def settled(kept: tuple[int, int]) -> bool:
        return eventually(lambda: held()[0] <= kept[0] and held()[1] <= kept[1])

    try:
        before, bytes_before = held(), resident()
        for cycle in range(CYCLES):
            seen = device.read().sequence
            device.open()
            if cycle % 10 == 0:
                assert eventually(lambda seen=seen, cycle=cycle: fresh(seen, cycle))
                if isinstance(device, ForceSink):
                    device.enable_force()
                    device.send_force(np.ones(3))
            device.close()
            assert not device.read().connected
            if cycle == WARM_UP:
                # what a library keeps for good, it keeps from the first time
                time.sleep(0.5)
                before, bytes_before = held(), resident()
        assert settled(before), f"{before} threads and files became {held()}"
        grown = resident() - bytes_before
        print(
            f"{name}: {CYCLES} opened and closed, threads and files {before} before, {held()} after, memory "
            f"{bytes_before / 2**20:.1f} MB, grown by {grown / 1024:.0f} kB"
        )
        assert grown < MOST_BYTES * CYCLES
        assert eventually(lambda: not bench.felt().any())
    finally:
        bench.close()
