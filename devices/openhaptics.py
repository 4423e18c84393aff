"""3D Systems Touch, Touch X and Phantom through the maker's OpenHaptics HD library (ctypes).

The library calls us back 1000 times a second in a thread of its own; the callback sends the newest force,
or zero when none came for 20 ms. The driver acts on a force as well: it refuses or cuts what exceeds its
nominal greatest force, and may ramp forces in. Both are read at connecting; ramping, which would come on top
of ours, is switched off. Its units are millimetres and newtons, its frame x right, y up, z towards the
person. Tested against emulators built from published protocols; no hardware tried.
"""

from __future__ import annotations

import ctypes
import threading
import time
from ctypes import (
    CFUNCTYPE,
    POINTER,
    c_char_p,
    c_double,
    c_int,
    c_ubyte,
    c_uint,
    c_ulong,
    c_ushort,
    c_void_p,
)
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.devices.base import LONGEST_HOLD_S, Availability, Clock, DeviceSpec, host_clock
from palpate.devices.io_thread import ZERO, ForcefulDevice, Reading, found
from palpate.devices.vendor_library import load, need, offered
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.options import option

SPEC = DeviceSpec(
    name="openhaptics",
    title="3D Systems Touch (OpenHaptics)",
    actuated_axes=("x", "y", "z"),
    max_force_n=3.3,
    max_stiffness_n_per_m=400.0,
    max_damping_n_s_per_m=2.0,
    max_speed_m_per_s=1.5,
    workspace_radius_m=0.08,
    buttons=2,
)
INSTALL = (
    "install OpenHaptics and the Touch driver from 3D Systems' support site; "
    "its configuration tool must find the device"
)
FOLDERS = ("$OPENHAPTICS_DIR", "~/.local/lib", "/usr/local/lib", "/usr/lib", "/opt/OpenHaptics")
BUTTONS, POSITION, VELOCITY, TRANSFORM, FORCE, FORCE_OUTPUT = 0x2000, 0x2050, 0x2051, 0x2052, 0x2700, 0x4000
NOMINAL_MAX_FORCE, FORCE_RAMPING = 0x2603, 0x4002
CALIBRATION_OK = 0x5000
INVALID_HANDLE = 0xFFFFFFFF
CONTINUE = 1
TOP_PRIORITY = 0xFFFF
SILENT_S = 0.1
ERRORS = {
    0x0200: "its motors are too warm: let it rest",
    0x0201: "the force was too great: it switched itself off",
    0x0202: "the force changed too fast: it switched itself off",
    0x0203: "it moved too fast: it switched itself off",
    0x0300: "the device reports a fault",
    0x0302: "the connection broke: check the cable",
}
"""HD error codes in plain words; any other is shown by its number."""
TO_FRAME = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""The library's x, y, z to x right, y away from the person, z up."""


class HdError(ctypes.Structure):
    """HDErrorInfo."""

    _fields_ = [("code", c_uint), ("internal", c_int), ("handle", c_uint)]


CALLBACK = CFUNCTYPE(c_uint, c_void_p)
FUNCTIONS = {
    "hdInitDevice": (c_uint, (c_char_p,)),
    "hdDisableDevice": (None, (c_uint,)),
    "hdEnable": (None, (c_uint,)),
    "hdDisable": (None, (c_uint,)),
    "hdStartScheduler": (None, ()),
    "hdStopScheduler": (None, ()),
    "hdScheduleAsynchronous": (c_ulong, (CALLBACK, c_void_p, c_ushort)),
    "hdUnschedule": (None, (c_ulong,)),
    "hdBeginFrame": (None, (c_uint,)),
    "hdEndFrame": (None, (c_uint,)),
    "hdGetDoublev": (None, (c_uint, POINTER(c_double))),
    "hdGetIntegerv": (None, (c_uint, POINTER(c_int))),
    "hdSetDoublev": (None, (c_uint, POINTER(c_double))),
    "hdCheckCalibration": (c_uint, ()),
    "hdGetError": (HdError, ()),
}
NEWER_FUNCTIONS = {"hdIsEnabled": (c_ubyte, (c_uint,))}
"""That a library may lack."""


@dataclass(frozen=True)
class OpenHapticsOptions:
    """device_name: as the maker's tool names it; openhaptics_folder: searched first for libHD."""

    device_name: str = option(
        "", "the device's name in the maker's tool; '' for the default", flag="--touch-name"
    )
    openhaptics_folder: str = option("", "folder of the maker's libHD")


class OpenHapticsWire:
    """The blocking side hands forces to the library's callback and waits for its readings."""

    def __init__(self, options: OpenHapticsOptions) -> None:
        self.options = options
        self.spec = SPEC
        self._handle: int | None = None
        self._arrived = threading.Event()
        self._reading: Reading | None = None
        self._error = 0
        self._order: tuple[float, np.ndarray | None] = (float("-inf"), None)
        self._callback = CALLBACK(self._turn)

    @cached_property
    def _library(self) -> ctypes.CDLL:
        """The maker's library, loaded when first asked for; raises DeviceError where there is none."""
        library = load(("HD", "hd"), (self.options.openhaptics_folder, *FOLDERS), INSTALL)
        need(library, FUNCTIONS)
        return library

    def connect(self) -> None:
        """Load the library, initialise the device, start its scheduler; forces are zero."""
        library = self._library
        handle = library.hdInitDevice(self.options.device_name.encode() or None)
        error = library.hdGetError().code
        if handle == INVALID_HANDLE or error:
            raise DeviceError(
                f"no Touch device opens ({_words(error)}): connect and power it, run the maker's "
                "configuration tool, close other programs"
            )
        self._handle, self._error = handle, 0
        self._order = (float("-inf"), None)
        self._arrived.clear()
        self._last_s = time.perf_counter()
        self.spec = self._limited()
        library.hdEnable(FORCE_OUTPUT)
        self._schedule = library.hdScheduleAsynchronous(self._callback, None, TOP_PRIORITY)
        library.hdStartScheduler()

    def _limited(self) -> DeviceSpec:
        """The specification with what the driver does to a force."""
        library, words, most = self._library, [], SPEC.max_force_n
        values = (c_double * 16)()
        library.hdGetDoublev(NOMINAL_MAX_FORCE, values)
        if library.hdGetError().code or not 0.0 < values[0] < 1e3:
            words.append(f"the driver does not report its greatest force; {most:g} N is taken")
        elif values[0] < most:
            most = float(values[0])
            words.append(f"the driver allows at most {most:g} N")
        if "hdIsEnabled" in offered(library, NEWER_FUNCTIONS) and library.hdIsEnabled(FORCE_RAMPING):
            library.hdDisable(FORCE_RAMPING)
            words.append("the driver's own ramp of forces is switched off")
        library.hdGetError()
        return replace(SPEC, max_force_n=most, conditions=tuple(words))

    def _turn(self, _: object) -> int:
        """The library's 1 kHz callback. It must never raise: ctypes swallows that, the force stays."""
        library, handle = self._library, self._handle
        values = (c_double * 16)()
        buttons = c_int()
        library.hdBeginFrame(handle)
        when, force = self._order
        fresh = force is not None and time.perf_counter() - when <= LONGEST_HOLD_S
        out = (c_double * 3)(*(TO_FRAME.T @ force if fresh else ZERO))
        library.hdSetDoublev(FORCE, out)
        library.hdGetDoublev(POSITION, values)
        position = TO_FRAME @ np.array(values[:3]) * 1e-3
        library.hdGetDoublev(VELOCITY, values)
        velocity = TO_FRAME @ np.array(values[:3]) * 1e-3
        library.hdGetDoublev(TRANSFORM, values)
        rotation = np.array(values[:]).reshape(4, 4).T[:3, :3]
        library.hdGetIntegerv(BUTTONS, ctypes.byref(buttons))
        calibrated = library.hdCheckCalibration() == CALIBRATION_OK
        library.hdEndFrame(handle)
        error = library.hdGetError().code
        self._error = error
        fault = _words(error) if error else ""
        self._reading = Reading(position, velocity, _quaternion(rotation), buttons.value, calibrated, fault)
        self._arrived.set()
        return CONTINUE

    def exchange(self, force_on_tool_n: np.ndarray | None, timeout_s: float) -> Reading | None:
        """Leave the force for the callback, take the reading that it left."""
        now = time.perf_counter()
        self._order = (now, force_on_tool_n)
        if not self._arrived.wait(timeout=2.0 * timeout_s):
            if time.perf_counter() - self._last_s > SILENT_S:
                raise OSError("the library's 1 kHz scheduler has stopped")
            return None
        self._arrived.clear()
        self._last_s = time.perf_counter()
        if self._error == 0x0302:
            raise OSError(_words(self._error))
        return self._reading

    def disconnect(self) -> None:
        """Zero through one more turn, stop the scheduler, release the device."""
        if self._handle is None:
            return
        self._order = (float("-inf"), None)
        self._arrived.clear()
        self._arrived.wait(timeout=0.01)
        library = self._library
        library.hdStopScheduler()
        library.hdUnschedule(self._schedule)
        library.hdDisable(FORCE_OUTPUT)
        library.hdDisableDevice(self._handle)
        self._handle = None


def _words(code: int) -> str:
    return ERRORS.get(code, f"HD error 0x{code:04x}")


def _quaternion(rotation: np.ndarray) -> tuple[float, float, float, float]:
    """(w, x, y, z) of tool to device frame; identity where the library gives no rotation."""
    if abs(np.linalg.det(rotation) - 1.0) > 1e-3:
        return (1.0, 0.0, 0.0, 0.0)
    x, y, z, w = Rotation.from_matrix(TO_FRAME @ rotation).as_quat()
    return (float(w), float(x), float(y), float(z))


def make(options: OpenHapticsOptions | None = None, *, clock: Clock = host_clock) -> ForcefulDevice:
    """A Touch, not yet open."""
    return ForcefulDevice(OpenHapticsWire(options or OpenHapticsOptions()), clock=clock)


def find(options: OpenHapticsOptions | None = None) -> list[Availability]:
    """Whether the library is there and a device opens."""
    wire = OpenHapticsWire(options or OpenHapticsOptions())
    return found(wire, lambda: wire.options.device_name or "the default device")
