"""From the device's frame to the scene's and back."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.devices import mapper
from palpate.devices.mapper import MapperOptions, Mapping
from palpate.mechanics.errors import OptionError
from palpate.mechanics.tip_state import TipState


def state(time_s: float, position=(0, 0, 0), velocity=(0, 0, 0), buttons: int = 0, **more) -> TipState:
    return TipState(
        time_s,
        round(time_s * 1000),
        np.array(position, float),
        np.array(velocity, float),
        buttons=buttons,
        **more,
    )


def run(mapping: Mapping, states: list[TipState]) -> list[TipState]:
    memory, tips = mapper.start(mapping), []
    for raw in states:
        memory, tip = mapper.step(mapping, memory, raw)
        tips.append(tip)
    return tips


@pytest.mark.parametrize("axes", ["x,y,z", "x,-z,y", "y,-x,z", "-x,-y,z", "z,x,y"])
def test_work_is_the_same_on_both_sides(axes: str) -> None:
    """Force times motion: with scale s and force scale 1/s the hand's work is the scene's."""
    options = MapperOptions(axes=axes, scale=2.0, force_scale=2.0)
    mapping = Mapping.from_options(options, centre_m=[0.1, 0.2, 0.3])
    a, b = run(mapping, [state(0, (0, 0, 0)), state(0.001, (0.001, -0.002, 0.003))])
    force = np.array([1.0, 2.0, -0.5])
    in_scene = force @ (b.position_m - a.position_m)
    at_hand = mapper.force_map(mapping) @ force @ np.array([0.001, -0.002, 0.003])
    assert at_hand == pytest.approx(in_scene)
    assert a.position_m == pytest.approx([0.1, 0.2, 0.3])


@pytest.mark.parametrize("axes", ["x,z,y", "x,x,z", "x,y", "a,b,c", "-x,y,z"])
def test_mirrors_and_typing_errors_are_refused(axes: str) -> None:
    with pytest.raises(OptionError, match="axes"):
        mapper.axis_matrix(axes)


def test_clutch_holds_the_tip_and_goes_on_from_there() -> None:
    mapping = Mapping.from_options(MapperOptions(clutch_button=0))
    tips = run(
        mapping,
        [
            state(0.000, (0.00, 0, 0), force_enabled=True),
            state(0.001, (0.01, 0, 0), force_enabled=True),
            state(0.002, (0.03, 0, 0), (9, 0, 0), buttons=1, force_enabled=True),
            state(0.003, (0.05, 0, 0), buttons=1, force_enabled=True),
            state(0.004, (0.05, 0, 0), force_enabled=True),
            state(0.005, (0.06, 0, 0), force_enabled=True),
        ],
    )
    assert [round(t.position_m[0], 6) for t in tips] == [0.0, 0.01, 0.01, 0.01, 0.01, 0.02]
    assert [t.force_enabled for t in tips] == [True, True, False, False, True, True]
    assert not tips[2].velocity_m_per_s.any()


def test_rate_becomes_position() -> None:
    mapping = Mapping.from_options(MapperOptions(scale=0.5), centre_m=[0, 0, 0.1], rate=True)
    tips = run(mapping, [state(k * 0.01, velocity=(0.1, 0, 0)) for k in range(101)])
    assert tips[-1].position_m == pytest.approx([0.05, 0, 0.1])
    assert tips[-1].velocity_m_per_s == pytest.approx([0.05, 0, 0])


def test_rate_never_leaps_nor_leaves_its_reach() -> None:
    mapping = Mapping.from_options(MapperOptions(reach_m=0.2), rate=True)
    tips = run(mapping, [state(0), state(10.0, velocity=(0.1, 0, 0))])
    assert tips[-1].position_m[0] <= 0.1 * mapper.LONGEST_RATE_STEP_S + 1e-12
    far = run(mapping, [state(k * 0.05, velocity=(1, 1, 0)) for k in range(100)])[-1]
    assert np.linalg.norm(far.position_m) == pytest.approx(0.2)


def test_quaternion_turns_with_the_axes() -> None:
    mapping = Mapping.from_options(MapperOptions(axes="y,-x,z"))
    tip = run(mapping, [state(0)])[0]
    w, x, y, z = tip.quaternion
    # the tool's own x axis, along the device's x, is the scene's -y
    turned = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    assert turned == pytest.approx(mapping.rotation @ [1, 0, 0])
