"""hidapi's drivers through a real kernel's uhid, hidraw and sysfs, in a machine under emulation; optional."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from .kernel.machine import ENDED, Machine, Missing

HERE = Path(__file__).resolve().parent


@pytest.mark.slow
@pytest.mark.kernel
def test_hid_drivers_through_a_real_kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The conformance suite for the SpaceMouse, the stick and the wheel, their emulators behind /dev/uhid."""
    try:
        machine = Machine(Path(os.environ.get("PALPATE_KERNEL_TOOLS", "/")).resolve())
    except Missing as missing:
        pytest.skip(f"{missing}: {HERE / 'kernel/fetch.sh'} FOLDER, then set PALPATE_KERNEL_TOOLS=FOLDER")
    monkeypatch.chdir(HERE.parents[1])
    command = [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", "--tb=short", "-k"]
    # the ramp is the safety filter's: no kernel takes part
    command += ["(spacemouse or pid) and not ramp", str(HERE / "test_conformance.py")]
    environment = {"PALPATE_UHID": "1", "HOME": "/tmp", "NUMBA_CACHE_DIR": "/tmp/numba", "TMPDIR": "/tmp"}
    printed = machine.run(command, tmp_path, environment=environment, seconds=900)
    assert f"{ENDED} 0" in printed, printed[-6000:]
    assert " passed" in printed and "skipped" not in printed, printed[-6000:]
