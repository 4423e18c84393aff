"""Force Dimension omega, sigma, delta, and the Novint Falcon, through the maker's DHD library (ctypes).

The device's own watchdog is set: without a new force for 20 ms its firmware lets go, whatever becomes of this
program. Its velocity threshold is left as the maker set it. DHD itself acts on a commanded force: it cuts it
at a limit (dhdSetMaxForce) and adds what carries the arm's weight (gravity compensation, computed by the
library, so only while forces are sent). The limit is read, compensation switched on, both declared.

Source: Force Dimension SDK documentation (DHD). DHD's frame is x towards the person, y right, z up. Tested
against emulators built from published protocols; no hardware tried.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from ctypes import POINTER, byref, c_byte, c_char_p, c_double, c_int, c_ubyte, c_uint
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.devices.base import Availability, Clock, DeviceSpec, host_clock
from palpate.devices.io_thread import ForcefulDevice, Reading, found
from palpate.devices.vendor_library import load, need, offered
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.options import option

SPEC = DeviceSpec(
    name="forcedimension",
    title="Force Dimension (omega, sigma, delta) or Novint Falcon",
    actuated_axes=("x", "y", "z"),
    max_force_n=12.0,
    max_stiffness_n_per_m=5000.0,
    max_damping_n_s_per_m=20.0,
    max_speed_m_per_s=2.0,
    workspace_radius_m=0.08,
    buttons=4,
)
FALCON = replace(SPEC, max_force_n=8.0, max_stiffness_n_per_m=3000.0, workspace_radius_m=0.04)
INSTALL = (
    "install the Force Dimension SDK (forcedimension.com, software) and set FDSDK to its folder, or put "
    "libdhd into ~/.local/lib"
)
FOLDERS = ("$FDSDK", "$FORCEDIM_SDK", "~/.local/lib", "/usr/local/lib", "/usr/lib")
WATCHDOG_TICKS = 160
"""Of 125 us: 20 ms."""
STATUS_RESET, STATUS_POWER = 3, 0
STATUS_LENGTH = 64
PERIOD_S = 0.0005
_P = POINTER(c_double)
FUNCTIONS = {
    "dhdOpen": (c_int, ()),
    "dhdClose": (c_int, (c_byte,)),
    "dhdGetSystemName": (c_char_p, (c_byte,)),
    "dhdEnableForce": (c_int, (c_ubyte, c_byte)),
    "dhdSetWatchdog": (c_int, (c_ubyte, c_byte)),
    "dhdGetPosition": (c_int, (_P, _P, _P, c_byte)),
    "dhdGetLinearVelocity": (c_int, (_P, _P, _P, c_byte)),
    "dhdSetForce": (c_int, (c_double, c_double, c_double, c_byte)),
    "dhdGetButtonMask": (c_uint, (c_byte,)),
    "dhdGetStatus": (c_int, (POINTER(c_int), c_byte)),
    "dhdErrorGetLastStr": (c_char_p, ()),
}
NEWER_FUNCTIONS = {
    "dhdGetMaxForce": (c_double, (c_byte,)),
    "dhdSetGravityCompensation": (c_int, (c_int, c_byte)),
}
"""That older libraries may lack."""


@dataclass(frozen=True)
class ForceDimensionOptions:
    """forcedimension_folder: where libdhd lies, searched before the usual places."""

    forcedimension_folder: str = option("", "folder of the maker's libdhd")


class ForceDimensionWire:
    """The blocking side: DHD calls, each of which answers within a device's own 0.25 ms turn."""

    def __init__(self, options: ForceDimensionOptions) -> None:
        self.options = options
        self.spec = SPEC
        self._id: int | None = None
        self._forcing = False

    @cached_property
    def _library(self) -> ctypes.CDLL:
        """The maker's library, loaded when first asked for; raises DeviceError where there is none."""
        library = load(
            ("dhd", "drd", "dhd64", "drd64"), (self.options.forcedimension_folder, *FOLDERS), INSTALL
        )
        need(library, FUNCTIONS)
        return library

    def connect(self) -> None:
        """Load the library, open the first device, set its watchdog; force stays off."""
        number = self._library.dhdOpen()
        if number < 0:
            raise DeviceError(
                f"no Force Dimension device opens ({self._why()}): connect and power it, close other "
                "programs; on Linux install the SDK's udev rules"
            )
        self._id = number
        try:
            self._prepare(number)
        except (DeviceError, OSError):
            self.disconnect()
            raise

    def _prepare(self, number: int) -> None:
        name = (self._library.dhdGetSystemName(number) or b"").decode(errors="replace")
        limits = FALCON if "falcon" in name.lower() else SPEC
        self.spec = self._limited(replace(limits, title=name or SPEC.title), number)
        self._check(self._library.dhdSetWatchdog(WATCHDOG_TICKS, number), "set its watchdog")
        self._check(self._library.dhdEnableForce(0, number), "switch force off")
        self._forcing = False

    def _limited(self, spec: DeviceSpec, number: int) -> DeviceSpec:
        """The specification with what the library does to a force."""
        words, most, newer = [], spec.max_force_n, offered(self._library, NEWER_FUNCTIONS)
        if "dhdGetMaxForce" not in newer:
            words.append("the library is too old to report its force limit")
        else:
            limit_n = float(self._library.dhdGetMaxForce(number))
            # negative: no limit is set
            if limit_n == 0.0:
                raise DeviceError("the library cuts all forces to 0: lift its limit (dhdSetMaxForce)")
            if 0.0 < limit_n < most:
                most = limit_n
                words.append(f"the library cuts forces at {limit_n:g} N")
        if "dhdSetGravityCompensation" not in newer:
            words.append("the library is too old for gravity compensation to be set")
        elif self._library.dhdSetGravityCompensation(1, number) < 0:
            words.append("without gravity compensation: the arm's weight is felt")
        else:
            words.append("gravity compensation adds the arm's weight to every force")
        return replace(spec, max_force_n=most, conditions=tuple(words))

    def _why(self) -> str:
        return (self._library.dhdErrorGetLastStr() or b"no reason given").decode(errors="replace")

    def _check(self, result: int, what: str) -> None:
        if result < 0:
            raise OSError(f"the device did not {what}: {self._why()}")

    def exchange(self, force_on_tool_n: np.ndarray | None, timeout_s: float) -> Reading | None:
        """Force out, position in; the library itself keeps the device's turn."""
        library, number = self._library, self._id
        started = time.perf_counter()
        if force_on_tool_n is None:
            if self._forcing:
                self._check(library.dhdEnableForce(0, number), "switch force off")
                self._forcing = False
        else:
            if not self._forcing:
                self._check(library.dhdEnableForce(1, number), "switch force on")
                self._forcing = True
            x, y, z = (float(v) for v in force_on_tool_n)
            self._check(library.dhdSetForce(-y, x, z, number), "take a force")
        p, v = (c_double * 3)(), (c_double * 3)()
        self._read(library.dhdGetPosition, p, "report its position")
        self._read(library.dhdGetLinearVelocity, v, "report its velocity")
        status = (c_int * STATUS_LENGTH)()
        self._check(library.dhdGetStatus(status, number), "report its status")
        # without forces nothing paces the library: do not spin
        time.sleep(max(0.0, PERIOD_S - (time.perf_counter() - started)))
        return Reading(
            np.array([p[1], -p[0], p[2]]),
            np.array([v[1], -v[0], v[2]]),
            buttons=int(library.dhdGetButtonMask(number)),
            calibrated=bool(status[STATUS_RESET]),
            fault="" if status[STATUS_POWER] else "the device has no power",
        )

    def _read(self, function: Callable[..., int], into: ctypes.Array, what: str) -> None:
        pointers = (ctypes.cast(byref(into, 8 * i), _P) for i in range(3))
        self._check(function(*pointers, self._id), what)

    def disconnect(self) -> None:
        """Zero, force off, close."""
        if self._id is not None:
            self._library.dhdSetForce(0.0, 0.0, 0.0, self._id)
            self._library.dhdEnableForce(0, self._id)
            self._library.dhdClose(self._id)
            self._id, self._forcing = None, False


def make(options: ForceDimensionOptions | None = None, *, clock: Clock = host_clock) -> ForcefulDevice:
    """A device, not yet open."""
    return ForcefulDevice(ForceDimensionWire(options or ForceDimensionOptions()), clock=clock)


def find(options: ForceDimensionOptions | None = None) -> list[Availability]:
    """Whether the library is there and a device opens."""
    wire = ForceDimensionWire(options or ForceDimensionOptions())
    return found(wire, lambda: "USB")
