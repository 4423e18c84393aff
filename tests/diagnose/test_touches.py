"""Which rows of a press a diagnosis weighs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.diagnosis.forward.touches import touches_of

LATE_S = 0.15


@pytest.mark.parametrize("way", [1, -1], ids=["after", "before"])
def test_what_the_tip_does_beside_the_object_is_not_of_its_press(bench, way):
    """A tool whose weight reads on in the air makes a press last; then the hand swings down another side."""
    recording, _ = bench.record()
    presses = bench.table(recording)
    plain = touches_of(presses)
    own, rows = 3, presses.parts[3]
    t, position = presses.t[rows], presses.position.copy()
    name = "end_s" if way > 0 else "onset_s"
    times = getattr(presses, name).copy()
    end = float(times[own])
    times[own] += way * LATE_S
    swing = np.clip(way * (t - end) / LATE_S, 0, 1)[:, None]
    # up and away first, then beside the block and below its top
    position[rows] += 0.012 * np.sin(np.pi * swing) * [0, 0, 1] + swing**2 * [0.05, 0.0, -0.02]
    touches = touches_of(dataclasses.replace(presses, position=position, **{name: times}))
    assert touches.deepest == pytest.approx(plain.deepest, rel=0.02)
    pressed = [x.counted & (x.press == own) & (x.travel[:, 0] > 2e-4) for x in (touches, plain)]
    assert pressed[0].sum() == pytest.approx(pressed[1].sum(), abs=3)
    assert len(touches) == len(plain)
