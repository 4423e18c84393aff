"""What the laboratory's tests share."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.scenes.laboratory import session as module
from palpate.scenes.laboratory.paths import Leg, TouchForce


@pytest.fixture
def springs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Touches answered by a half space instead of the solver: what is tested here comes after the solid."""

    def quick(thing, specimen, touches, solving):
        forces = []
        for touch in touches:
            s = np.linspace(0, touch.depth, 12)
            normal = 16 / 9 * np.sqrt(specimen.tip_radius) * s**1.5
            stiffness = -2 * np.sqrt(specimen.tip_radius * s)[:, None, None] * np.eye(3)
            leg = Leg(s, normal[:, None] * touch.normal, stiffness, from_touch=True)
            side = Leg(
                np.array([0.0, 9.0]), np.repeat(normal[-1] * touch.normal[None], 2, 0), stiffness[-2:], False
            )
            forces.append(TouchForce((leg, side, leg)))
        return forces

    monkeypatch.setattr(module, "touch_forces", quick)
