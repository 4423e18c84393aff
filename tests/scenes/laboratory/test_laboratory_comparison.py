"""The comparison with recordings of known shape finds where they touch, and what they differ by."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.laboratory import SHARES, Press, by_depth, cylinder_shape, recorded_presses
from palpate.scenes.laboratory.simulate import SimulateOptions, simulate
from palpate.scenes.phantoms import phantom


def test_presses_of_a_recording_begin_where_the_known_shape_is_met(springs) -> None:
    options = SimulateOptions(protocol="sparse", frame=True, force_noise_std_n=1e-6, young_modulus_pa=29e3)
    result = simulate(phantom("cylinder"), {}, options, seed=2, sizes=False)
    presses = recorded_presses(result.recording, cylinder_shape(40.0, 80.0))
    straight = [t for t in result.touches if t.kind == "press"]
    assert len(presses) >= 0.7 * len(straight)
    ratios = []
    for press in presses:
        nearest = min(straight, key=lambda t: np.linalg.norm(t.point - press.point))
        assert np.linalg.norm(nearest.point - press.point) < 1.0
        depth = -press.travel @ press.normal
        law = 1e-6 * 29e3 * 16 / 9 * np.sqrt(5.0) * depth**1.5
        ratios.append((press.force @ press.normal)[3:] / law[3:])
    assert np.median(ratios) == pytest.approx(1.0, abs=0.01)


def test_differences_are_averaged_over_presses_at_each_depth() -> None:
    rng = np.random.default_rng(0)
    normal = np.array([0.0, 0.0, 1.0])
    pairs = []
    for depth in rng.uniform(5, 7, 40):
        travel = -np.outer(SHARES * depth, normal)
        force = np.outer(0.1 * (SHARES * depth) ** 1.5, normal)
        noisy = force + 0.003 * rng.normal(size=force.shape)
        pairs.append((Press(np.zeros(3), normal, travel, noisy), 1.02 * force))
    table = by_depth(pairs)
    assert table[:, 0] == pytest.approx(6.0 * SHARES[1:], rel=0.05)
    assert np.all(np.abs(table[:, 2] - 0.02) < 3.5 * table[:, 3])
    assert table[-1, 3] < 0.002 < table[0, 3]
