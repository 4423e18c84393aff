"""Every driver on a test bench: an emulator that moves it, feels its force, unplugs it and makes it hang."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from palpate.devices.base import PositionSource
from palpate.devices.forcedimension import ForceDimensionOptions
from palpate.devices.forcedimension import make as make_forcedimension
from palpate.devices.haply import HaplyOptions
from palpate.devices.haply import make as make_haply
from palpate.devices.io_thread import ThreadedDevice
from palpate.devices.openhaptics import OpenHapticsOptions
from palpate.devices.openhaptics import make as make_openhaptics
from palpate.devices.pid_ffb import PidOptions
from palpate.devices.pid_ffb import make as make_pid
from palpate.devices.spacemouse import make as make_spacemouse
from palpate.devices.virtual_hand import SimulatedHand

from ..support.waiting import eventually
from .fake_hid import OTHER_IDS, FakeHid, SpaceMouseUnit, StickUnit
from .fake_inverse import Chain, FakeInverse
from .kernel.uhid import KernelUnit

STUBS = Path(__file__).parent / "vendor_stubs.c"
LONGEST_ANSWER_S = 10.0


class Bench:
    """device; `axes`: which of x, y, z carry force."""

    axes = "xyz"
    device: PositionSource

    def move(self, position_m: np.ndarray) -> None:
        """Put the handle there (a rate device: deflect it that way)."""
        raise NotImplementedError

    def felt(self) -> np.ndarray:
        """(3,) N that the hardware exerts now, device frame."""
        raise NotImplementedError

    def unplug(self) -> None:
        raise NotImplementedError

    def replug(self) -> None:
        raise NotImplementedError

    def zeroed(self) -> bool:
        """Whether the last that the driver sent was zero: commanded, not a force that lapsed by itself."""
        return not self.felt().any()

    def hang(self, on: bool) -> None:
        """The driver's blocking calls stop answering, or answer again."""

    def close(self) -> None:
        self.device.close()


class HidBench(Bench):
    """hidapi over byte-level fakes, or hidapi itself over the kernel's uhid (see test_kernel.py)."""

    def _plug(self, unit: SpaceMouseUnit | StickUnit) -> FakeHid | None:
        self.unit = unit
        self._kernel = KernelUnit(unit) if os.environ.get("PALPATE_UHID") else None
        return None if self._kernel else FakeHid(unit)

    def unplug(self) -> None:
        self.unit.unplug()

    def replug(self) -> None:
        self.unit.replug()

    def zeroed(self) -> bool:
        if self._kernel:
            self._kernel.settle()
        return super().zeroed()

    def hang(self, on: bool) -> None:
        (self.unit.hang.set if on else self.unit.hang.clear)()

    def close(self) -> None:
        super().close()
        if self._kernel:
            self._kernel.close()


class SpaceMouseBench(HidBench):
    axes = ""

    def __init__(self) -> None:
        self.device = make_spacemouse(hid=self._plug(SpaceMouseUnit()))

    def move(self, position_m: np.ndarray) -> None:
        x, y, z = (int(np.clip(v * 3500, -350, 350)) for v in position_m)
        self.unit.deflect(x, -y, -z)

    def felt(self) -> np.ndarray:
        return np.zeros(3)


class StickBench(HidBench):
    def __init__(self, **kind: object) -> None:
        hid = self._plug(StickUnit(**kind))
        self.device = make_pid(PidOptions(full_scale_n=8.0, stroke_m=0.05), hid=hid)
        self.axes = "xy"[: self.unit.axes]

    def move(self, position_m: np.ndarray) -> None:
        self.unit.move(position_m[0] / 0.05, -position_m[1] / 0.05)

    def felt(self) -> np.ndarray:
        x, y = self.unit.force_n()
        return np.array([x, -y, 0.0])


class HaplyBench(Bench):
    def __init__(
        self, key: str = "vector", chain: Chain | None = None, answer_s: float = LONGEST_ANSWER_S
    ) -> None:
        self.key = key
        self.service = FakeInverse(key, chain=chain)
        state, events = self.ports = self.service.ports
        # the emulator shares this process and a machine with noisy neighbours: it may well pause for seconds,
        # and a link lost to that needs a new enable_force, as it should
        options = HaplyOptions(
            uri=f"ws://localhost:{state}", events_uri=f"ws://localhost:{events}", answer_s=answer_s
        )
        self.device = make_haply(options)
        self.running = True

    def move(self, position_m: np.ndarray) -> None:
        self.service.position = [float(v) for v in position_m]

    def felt(self) -> np.ndarray:
        return np.array(self.service.force_n())

    def unplug(self) -> None:
        self.service.stop()
        self.running = False

    def replug(self) -> None:
        self.service = FakeInverse(self.key, *self.ports, chain=self.service.chain)
        self.running = True

    def zeroed(self) -> bool:
        # over a socket, which delivers what was sent before it was closed
        return eventually(lambda: not any(self.service.commanded_n))

    def hang(self, on: bool) -> None:
        (self.service.silent.set if on else self.service.silent.clear)()

    def close(self) -> None:
        self.service.silent.clear()
        self.device.close()
        if self.running:
            self.service.stop()


class VendorBench(Bench):
    """A vendor library compiled from the stubs."""

    def __init__(self, folder: Path, kind: str, name: str = "omega.3", old: bool = False) -> None:
        compiler = shutil.which("cc")
        if compiler is None:
            pytest.skip("no C compiler to build the stand-in for the vendor's library")
        stem = {"dhd": "dhd", "hd": "HD"}[kind]
        library = folder / f"lib{stem}.so"
        defines = ["-DSTUB_DHD", f'-DSTUB_NAME="{name}"'] if kind == "dhd" else []
        defines += ["-DSTUB_OLD"] if old else []
        command = [compiler, "-shared", "-fPIC", "-pthread", *defines, "-o", str(library), str(STUBS)]
        subprocess.run(command, check=True)
        self.library = ctypes.CDLL(str(library))
        self.kind = kind
        if kind == "dhd":
            self.device = make_forcedimension(ForceDimensionOptions(forcedimension_folder=str(folder)))
        else:
            self.device = make_openhaptics(OpenHapticsOptions(openhaptics_folder=str(folder)))

    def number(self, name: str) -> ctypes.c_int:
        return ctypes.c_int.in_dll(self.library, f"stub_{name}")

    def limit_force(self, most_n: float) -> None:
        """What the library says that it allows; negative: no limit, or not told."""
        ctypes.c_double.in_dll(self.library, "stub_most_n").value = most_n

    def vector(self, name: str) -> ctypes.Array:
        return (ctypes.c_double * 3).in_dll(self.library, f"stub_{name}")

    def move(self, position_m: np.ndarray) -> None:
        x, y, z = position_m
        own = (-y, x, z) if self.kind == "dhd" else (1e3 * x, 1e3 * z, -1e3 * y)
        self.vector("position")[:] = own

    def felt(self) -> np.ndarray:
        f = np.array(self.vector("force")[:])
        on = self.number("force_on").value and self.number("plugged").value
        own = np.array([f[1], -f[0], f[2]]) if self.kind == "dhd" else np.array([f[0], -f[2], f[1]])
        return own if on else np.zeros(3)

    def unplug(self) -> None:
        self.number("plugged").value = 0

    def replug(self) -> None:
        self.number("plugged").value = 1

    def hang(self, on: bool) -> None:
        self.number("stalled").value = int(on)


MAKERS: dict[str, Callable[[Path], Bench]] = {
    "spacemouse": lambda folder: SpaceMouseBench(),
    "pid-ffb": lambda folder: StickBench(),
    "pid-ffb-wheel": lambda folder: StickBench(ids=OTHER_IDS, axes=1, control_bits=False),
    "haply": lambda folder: HaplyBench("vector"),
    "haply-3.5": lambda folder: HaplyBench(chain=Chain(force_scale=0.5, damping=2.0, basis="X-YZ")),
    "haply-older": lambda folder: HaplyBench("values"),
    "forcedimension": lambda folder: VendorBench(folder, "dhd"),
    "openhaptics": lambda folder: VendorBench(folder, "hd"),
}
FORCELESS = ("spacemouse",)
FORCEFUL = [name for name in MAKERS if name not in FORCELESS]

__all__ = ["FORCEFUL", "MAKERS", "Bench", "SimulatedHand", "ThreadedDevice", "eventually"]
