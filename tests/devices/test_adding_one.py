"""A new device is one file and its line in the registry: found, listed, made with its own options."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np
import pytest

from palpate.cli import main
from palpate.devices import virtual_hand as simulated
from palpate.devices.base import Availability
from palpate.devices.registry import DEVICES, DeviceChoice, find_devices, options_of, spec_of
from palpate.devices.virtual_hand import SimulatedHand
from palpate.mechanics.options import option


@dataclass(frozen=True)
class PlungerOptions:
    rise_m: float = option(0.02, "how high it stands", unit="m", flag="--plunger-rise", high=0.1)


def _module() -> ModuleType:
    """What `devices/plunger.py` would hold."""
    module = ModuleType("palpate.devices.plunger")
    module.SPEC = replace(simulated.SPEC, name="plunger", title="plunger on a desk")

    class Plunger(SimulatedHand):
        def __init__(self, options: PlungerOptions | None = None, **more):
            super().__init__(**more)
            self.rise_m = (options or PlungerOptions()).rise_m

        def read(self):
            return replace(super().read(), position_m=np.array([0.0, 0.0, self.rise_m]))

    module.Plunger, module.PlungerOptions = Plunger, PlungerOptions
    module.find = lambda options=None: [Availability(module.SPEC, where="on the desk")]
    return module


def test_a_device_is_added_in_one_file_and_one_line(monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.setitem(sys.modules, "palpate.devices.plunger", _module())
    monkeypatch.setitem(DEVICES, "plunger", ("palpate.devices.plunger", "Plunger", "PlungerOptions"))
    assert spec_of("plunger").title == "plunger on a desk" and options_of("plunger") is PlungerOptions
    assert [found.where for found in find_devices(["plunger"])] == ["on the desk"]
    device = DeviceChoice("plunger", {"options": PlungerOptions(rise_m=0.03)}).make()
    device.open()
    try:
        assert device.read().position_m[2] == 0.03
    finally:
        device.close()
    assert main(["devices", "plunger"]) == 0
    assert "plunger on a desk" in capsys.readouterr().out
