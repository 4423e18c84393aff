"""One addition to a set of effects by the density of held-out places (palpate bench diagnose-density)."""

from __future__ import annotations

import numpy as np
import pytest

from diagnose.forward import build_forward
from diagnose.touches import touches_of
from mechanics.effects.registry import effect
from palpate.benchmarks._density_fits import Weighing
from palpate.benchmarks._density_search import step

TRIED = ("time_delay", "tip_radius", "tool_compliance", "force_gain")


def weighed(bench, alter):
    """The step over a neo-Hookean solid."""
    recording, model = bench.record(alter)
    forward = build_forward(touches_of(bench.table(recording)), model)
    weighing = Weighing(forward, np.full(len(forward.touches), 0.03), 20e3)
    known = effect("finite_strain")
    weighing.settle(weighing.judge([known]))
    return step(weighing, weighing.judge([known]), [effect(n) for n in TRIED], known)


@pytest.mark.slow
def test_a_late_force_is_found_and_nothing_is_found_in_nothing(bench):
    late = weighed(bench, lambda t, x, f: (x, np.stack([np.interp(t - 0.01, t, c) for c in f.T], axis=1)))
    assert late.best == "time_delay" and late.p < 0.01
    assert late.standing["none"] < 0.1
    assert late.gains["time_delay"] > 10 + max(g for n, g in late.gains.items() if n != "time_delay")
    plain = weighed(bench, None)
    assert plain.p > 0.02
    assert plain.standing["none"] > 0.1
