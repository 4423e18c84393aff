"""What a guided exploration knows so far is drawn on the scene."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import pyvista

from palpate.window.guide import BaseTracing
from palpate.window.known import KnownSoFar

from .small import SIZE, block_model


@pytest.fixture(scope="module")
def tracing(tmp_path_factory: pytest.TempPathFactory) -> BaseTracing:
    return BaseTracing(block_model(tmp_path_factory.mktemp("model")))


def test_the_part_of_the_foot_that_is_missing_is_drawn_until_it_was_gone_round(tracing):
    plotter = pyvista.Plotter(off_screen=True)
    known = KnownSoFar(plotter)
    guide = SimpleNamespace(
        foot=tracing.foot, suggestion=SimpleNamespace(kind="trace"), touched=np.zeros((0, 3))
    )
    known.show(guide)
    points = len(tracing.foot[0])
    assert known.shown["missing"] == points and not known.shown.get("traced", 0)
    along = np.linspace(-0.5, 0.5, 300)[:, None] * [SIZE[0], 0.0, 0.0] + [0.0, 0.5 * SIZE[1], 0.004]
    tracing.add(along, np.arange(300))
    guide.foot = tracing.foot
    known.show(guide)
    places, seen = guide.foot
    assert known.shown["traced"] == seen.sum() and known.shown["missing"] == (~seen).sum()
    # one side of a square was slid along: what is drawn as traced lies on that side
    assert 0.2 < seen.mean() < 0.3 and places[seen, 1].min() > 0.4 * SIZE[1]
    guide.suggestion.kind, guide.touched = "press", np.array([[0.0, 0.0, 0.04]])
    known.show(guide)
    assert known.shown["pressed"] == 1 and not known.shown["missing"]
    plotter.close()
