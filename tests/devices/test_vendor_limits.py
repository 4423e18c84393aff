"""What the makers' libraries do to a force is read at connecting, undone or declared, and never exceeded."""

from __future__ import annotations

from pathlib import Path

import pytest

from palpate.devices import forcedimension, openhaptics
from palpate.devices.pid_ffb import PidOptions, PidWire
from palpate.mechanics.errors import DeviceError

from .benches import VendorBench


def opened(bench: VendorBench) -> tuple[float, str]:
    """The greatest force once open, and the conditions in one text."""
    bench.device.open()
    try:
        return bench.device.spec.max_force_n, " ".join(bench.device.spec.conditions)
    finally:
        bench.close()


@pytest.mark.parametrize(("told", "most"), [(-1.0, 12.0), (5.0, 5.0), (50.0, 12.0)])
def test_a_force_limit_of_dhd_is_the_limit_here(tmp_path: Path, told: float, most: float) -> None:
    bench = VendorBench(tmp_path, "dhd")
    bench.limit_force(told)
    seen, words = opened(bench)
    assert seen == most and ("cuts forces at 5 N" in words) == (told == 5.0)
    assert "gravity compensation adds" in words and bench.number("gravity").value == 1


def test_dhd_that_cuts_all_forces_is_refused(tmp_path: Path) -> None:
    bench = VendorBench(tmp_path, "dhd")
    bench.limit_force(0.0)
    with pytest.raises(DeviceError, match="cuts all forces"):
        bench.device.open()
    assert not bench.number("force_on").value


def test_a_falcon_gets_a_falcons_limits(tmp_path: Path) -> None:
    bench = VendorBench(tmp_path, "dhd", name="Novint Falcon")
    seen, _ = opened(bench)
    assert seen == forcedimension.FALCON.max_force_n == 8.0
    assert bench.device.spec.workspace_radius_m == 0.04


@pytest.mark.parametrize("kind", ["dhd", "hd"])
def test_a_library_that_cannot_tell_is_declared(tmp_path: Path, kind: str) -> None:
    bench = VendorBench(tmp_path, kind, old=True)
    seen, words = opened(bench)
    assert seen == (12.0 if kind == "dhd" else 3.3)
    assert ("too old" in words) if kind == "dhd" else ("does not report" in words)


@pytest.mark.parametrize(("told", "most"), [(0.9, 0.9), (7.9, 3.3), (-1.0, 3.3)])
def test_the_nominal_greatest_force_of_a_touch_is_the_limit_here(
    tmp_path: Path, told: float, most: float
) -> None:
    bench = VendorBench(tmp_path, "hd")
    bench.limit_force(told)
    bench.number("ramping").value = 1
    seen, words = opened(bench)
    assert seen == most == min(most, openhaptics.SPEC.max_force_n)
    assert "ramp of forces is switched off" in words and bench.number("ramping").value == 0


def test_a_full_scale_that_nobody_measured_is_declared() -> None:
    assert "not measured" in PidWire(PidOptions(), lambda: 0.0).spec.conditions[0]
    assert PidWire(PidOptions(full_scale_n=5.5), lambda: 0.0).spec.conditions == ()
