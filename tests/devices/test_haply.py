"""The Inverse service's messages, and what happens when it is busy, stopped by its own safety, or strange."""

from __future__ import annotations

import json

import numpy as np
import pytest

from palpate.devices import mapper
from palpate.devices.codecs import haply as codec
from palpate.devices.haply import SPEC, HaplyOptions, find
from palpate.devices.haply import make as make_haply
from palpate.mechanics.errors import DeviceError

from .benches import HaplyBench, eventually
from .fake_inverse import Chain, FakeInverse

STATE = {
    "inverse3": [
        {
            "device_id": "049D",
            "state": {
                "cursor_position": {"x": 0.01, "y": -0.1, "z": 0.2},
                "cursor_velocity": {"values": {"x": 1, "y": 2, "z": 3}},
                "current_cursor_force": {"vector": {"x": 0, "y": 0, "z": 1.5}},
            },
            "status": {"calibrated": True, "power_supply": True, "ready": True},
        }
    ],
    "verse_grip": [
        {"state": {"orientation": {"w": 0, "x": 1, "y": 0, "z": 0}, "buttons": {"a": True, "c": True}}}
    ],
}


def test_command_is_the_documented_one() -> None:
    documented = (
        '{"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":{"vector":{"x":0,"y":0,"z":1.5}}}}]}'
    )
    assert json.loads(codec.force("049D", (0, 0, 1.5))) == json.loads(documented)
    older = json.loads(codec.force("049D", (0, 0, 1.5), "values"))
    assert older["inverse3"][0]["commands"]["set_cursor_force"] == {"values": {"x": 0, "y": 0, "z": 1.5}}
    assert "set_cursor_force" not in codec.probe("049D")


def test_state_with_either_spelling() -> None:
    state = codec.decode(json.dumps(STATE), "049D")
    assert state.position_m == (0.01, -0.1, 0.2)
    assert state.velocity_m_per_s == (1.0, 2.0, 3.0) and state.force_n == (0.0, 0.0, 1.5)
    assert state.quaternion == (0.0, 1.0, 0.0, 0.0) and state.buttons == 0b101
    assert codec.decode(json.dumps(STATE), "other") is None
    assert codec.decode('{"session": {}}') is None
    for broken in ("[1, 2", "[]", '{"inverse3": [{"state": {"cursor_position": {"x": "far"}}}]}'):
        with pytest.raises(DeviceError, match="cannot be read"):
            codec.decode(broken)


def test_status_faults() -> None:
    message = json.loads(json.dumps(STATE))
    message["inverse3"][0]["status"] = {"calibrated": False, "power_supply": False, "ready": True}
    state = codec.decode(json.dumps(message))
    assert not state.calibrated and "power" in state.fault


def test_events() -> None:
    def event(name: str, device: str = "049D") -> str:
        return json.dumps({"name": name, "data": {"device_id": device}})

    assert "safety" in codec.event_fault(event("device-safety-triggered"), "049D")
    assert "another program" in codec.event_fault(event("device-busy"), "049D")
    assert codec.event_fault(event("device-busy", "1111"), "049D") == ""
    assert codec.event_fault(event("device-connected"), "049D") == ""
    assert codec.event_fault("no json") == codec.event_fault("[]") == ""


@pytest.fixture
def bench() -> HaplyBench:
    made = HaplyBench()
    made.device.open()
    assert eventually(lambda: made.device.read().sequence >= 0)
    yield made
    made.close()


def test_exactly_one_state_for_each_message(bench: HaplyBench) -> None:
    """The driver never sends ahead of the answer: every message but the last has been answered."""
    assert eventually(lambda: bench.device.read().sequence > 100)
    bench.device.close()
    readings = bench.device.read().sequence + 1
    # introduction, one message a reading, a zero force at the end, at most one message unread at closing
    assert readings + 2 <= len(bench.service.messages) <= readings + 3


@pytest.mark.parametrize("event", ["device-safety-triggered", "device-busy", "device-calibration-failed"])
def test_events_switch_force_off_until_enabled_again(bench: HaplyBench, event: str) -> None:
    bench.device.enable_force()
    assert eventually(lambda: (bench.device.send_force(np.ones(3)), any(bench.service.commanded_n))[1])
    bench.service.event(event)
    assert eventually(lambda: bench.device.read().fault != "")
    with pytest.raises(DeviceError, match="fault"):
        bench.device.enable_force()
    assert eventually(lambda: bench.device.read().fault == "")
    for _ in range(50):
        bench.device.send_force(np.ones(3))
    assert not any(bench.service.force_n())
    bench.device.enable_force()
    assert eventually(lambda: (bench.device.send_force(np.ones(3)), any(bench.service.commanded_n))[1])


def test_losing_calibration_switches_force_off(bench: HaplyBench) -> None:
    bench.device.enable_force()
    bench.service.status = {**bench.service.status, "calibrated": False}
    assert eventually(lambda: not bench.device.read().calibrated)
    assert not bench.device.read().force_enabled
    with pytest.raises(DeviceError, match="calibrated"):
        bench.device.enable_force()


def test_a_service_that_falls_silent_counts_as_gone() -> None:
    bench = HaplyBench(answer_s=0.5)
    try:
        bench.device.open()
        assert eventually(lambda: bench.device.read().connected)
        bench.service.silent.set()
        assert eventually(lambda: "silent" in bench.device.read().fault)
        assert not bench.device.read().connected
        bench.service.silent.clear()
        assert eventually(lambda: bench.device.read().connected)
    finally:
        bench.close()


def test_grip_turns_and_buttons(bench: HaplyBench) -> None:
    bench.service.buttons = {"a": False, "b": True, "c": False}
    assert eventually(lambda: bench.device.read().buttons == 0b10)
    assert bench.device.read().quaternion == (0.0, 1.0, 0.0, 0.0)


def test_no_event_socket_is_no_fault() -> None:
    service = FakeInverse()
    options = HaplyOptions(uri=f"ws://localhost:{service.ports[0]}", events_uri="ws://localhost:9")
    with make_haply(options) as device:
        assert eventually(lambda: device.read().connected)
    service.stop()


def test_service_without_a_device_and_no_service() -> None:
    service = FakeInverse()
    service.devices = []
    uri = f"ws://localhost:{service.ports[0]}"
    there = find(HaplyOptions(uri=uri, events_uri=""))[0]
    assert not there.present and "no Inverse3" in there.why_not
    service.devices = ["049D"]
    assert find(HaplyOptions(uri=uri, events_uri=""))[0].present
    service.stop()
    absent = find(HaplyOptions(uri=uri, events_uri=""))[0]
    assert not absent.present and "does not answer" in absent.why_not and "start it" in absent.remedy


def chained(**settings: object) -> HaplyBench:
    bench = HaplyBench(chain=Chain(**settings))
    bench.device.open()
    return bench


@pytest.mark.parametrize("envelope", [False, True])
@pytest.mark.parametrize(("scale", "most_n"), [(1.0, 10.0), (0.5, 5.0), (2.0, 10.0)])
def test_a_newton_here_is_one_at_the_hand_whatever_the_force_scale(
    scale: float, most_n: float, envelope: bool
) -> None:
    bench = chained(force_scale=scale, envelope=envelope, preset="custom", damping=3.0, basis="X-YZ")
    try:
        spec, chain = bench.device.spec, bench.service.chain
        assert spec.max_force_n == most_n and spec.max_damping_n_s_per_m == SPEC.max_damping_n_s_per_m
        assert (chain.basis, chain.preset, chain.damping) == ("XYZ", "arm_front_centered", 0.0)
        told = " ".join(spec.conditions)
        assert "3.5.0" in told and "force gate (gain 0.3)" in told
        assert ("force scale" in told) == (scale != 1.0) and "damping" not in told
        bench.service.velocity = [0.5, 0.0, 0.0]
        assert eventually(lambda: bench.device.read().sequence >= 0)
        bench.device.enable_force()
        push = np.array([0.0, 1.0, most_n - 1.0])
        assert eventually(
            lambda: (bench.device.send_force(push), np.allclose(bench.service.force_n(), push, atol=1e-9))[1]
        )
    finally:
        bench.close()


def test_what_the_service_keeps_to_itself_is_declared_and_taken_off_the_limits() -> None:
    bench = chained(stubborn=True, damping=3.0, force_scale=None)
    try:
        spec, told = bench.device.spec, " ".join(bench.device.spec.conditions)
        assert "damping filter of 3 N s/m" in told and "force scale is not reported" in told
        assert spec.max_damping_n_s_per_m == SPEC.max_damping_n_s_per_m - 3.0
    finally:
        bench.close()


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"basis": "X-YZ"}, "basis at X-YZ"),
        ({"mount_scale": 2.0}, "scales lengths"),
        ({"force_scale": 0.0}, "scales forces by 0"),
        ({"force_scale": -1.0}, "scales forces by -1"),
        ({"force_scale": float("nan")}, "scales forces by nan"),
        ({"force_scale": 1e9}, "scales forces by 1e"),
        ({"more": {"mount": {"scale": {"x": "wide"}}}}, "cannot be read"),
    ],
)
def test_what_cannot_be_undone_is_refused(settings: dict, says: str) -> None:
    bench = HaplyBench(chain=Chain(stubborn=True, **settings))
    try:
        with pytest.raises(DeviceError, match=says):
            bench.device.open()
        assert not bench.device.read().connected
    finally:
        bench.close()


@pytest.mark.parametrize(
    "more", [{"type": "inverse3_simulator"}, {"port": "virtual"}, {"simulated": True}, {}]
)
def test_a_simulated_device_of_the_service_is_recognised(more: dict) -> None:
    bench = chained(more=more)
    try:
        assert bench.device.spec.simulated == bool(more)
        assert any("simulated device" in word for word in bench.device.spec.conditions) == bool(more)
    finally:
        bench.close()


def test_an_older_service_is_driven_as_before_and_says_what_it_does_not_tell() -> None:
    bench = HaplyBench()
    try:
        bench.device.open()
        spec = bench.device.spec
        assert spec.max_force_n == SPEC.max_force_n
        assert "does not report its filters" in " ".join(spec.conditions)
        assert "configure" not in bench.service.messages[0]["inverse3"][0]
    finally:
        bench.close()


def test_another_force_scale_after_a_reconnection_is_no_silent_change() -> None:
    bench = chained(force_scale=0.5)
    try:
        assert eventually(lambda: bench.device.read().sequence >= 0)
        bench.unplug()
        assert eventually(lambda: not bench.device.read().connected)
        bench.service.chain.force_scale = 1.0
        bench.replug()
        assert eventually(lambda: "start again" in bench.device.read().fault)
        with pytest.raises(DeviceError, match="start again"):
            bench.device.enable_force()
    finally:
        bench.close()


def test_one_message_of_a_huge_place_is_no_place(bench: HaplyBench) -> None:
    bench.service.position = [1e200, 0.0, 0.0]
    assert eventually(lambda: bench.device.read().position_m[0] == 1e200)
    state, tip = mapper.step(mapper.Mapping(), mapper.start(mapper.Mapping()), bench.device.read())
    assert np.isnan(tip.position_m).all() and state.position_m is None
