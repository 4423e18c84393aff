"""A table that is filled in beside the loop: felt at once, nearest to the tip first, kept when it is
closed."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from palpate.mechanics.compliance.coarse_table import first_places
from palpate.mechanics.compliance.stored_compliance import (
    fills,
    kept_places,
    load_or_condense,
    own_places,
)
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.render.options import RenderOptions
from palpate.render.registry import create
from palpate.servo.filling import FillingTable
from palpate.window.session import SessionOptions, TouchSession
from tests.render import shapes
from tests.shell.window.small import SIZE, block_model

CORNER = np.array([0.03, -0.03, SIZE[2]])


@pytest.fixture
def model(tmp_path: Path) -> Model:
    return block_model(tmp_path)


def _until(done, seconds: float = 240.0) -> None:
    end = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end, "nothing came"
        time.sleep(0.02)


@pytest.mark.slow
def test_it_solves_what_is_nearest_to_the_tip_first_and_keeps_it(model: Model) -> None:
    assert fills(model)
    table = FillingTable(model.path, RenderOptions())
    try:
        table.wait()
        first, error = table.solved, table.error_n
        assert 0.0 < first < 0.5 and 0.0 < error < 0.1 and table.depth_m == pytest.approx(0.003)
        for _ in range(3):
            table._aimed_s = 0.0
            table.aim(CORNER)
        changes = []
        _until(lambda: changes.append(table.news()) or changes[-1] is not None)
        made = create("fem", model, coarse=True)
        assert made.coarse
        finer = changes[-1].laid_on(made)
        assert np.isfinite(finer.parameters.far).all()
    finally:
        table.close()
    assert table._process.returncode is not None and not table._folder.exists()
    kept = kept_places(model)
    beyond = np.setdiff1d(np.flatnonzero(kept.is_solved), first_places(kept.own_points))
    away = np.linalg.norm(kept.own_points - CORNER, axis=1)
    assert len(beyond) >= 30
    # from when the aim came on
    assert (away[beyond] < np.quantile(away, 0.3)).mean() > 0.6
    # where this ends, the next begins: no first place is solved again
    again = FillingTable(model.path, RenderOptions())
    again.wait()
    assert again.solved > first
    again.close()


@pytest.mark.slow
def test_a_session_goes_on_from_a_coarse_table_to_the_whole_one(model: Model) -> None:
    with TouchSession(model, options=SessionOptions(pictures=False)) as session:
        session.start()
        assert session.table.state["whole"] or (
            "coarse" in session.table.words and session.table.state["error_n"] >= 0.0
        )
        ticks = session.report().ticks
        _until(lambda: session.frame() is None or (session.table.state["whole"] and session.worker.idle))
        assert session.worker.failure == "" and session.table.words == ""
        report = session.report()
        assert report.ticks > ticks and report.unsettled_ticks == 0
    assert not fills(model)
    whole = load_or_condense(read_model(model.path))
    anew = load_or_condense(model.replaced(path=None))
    assert np.array_equal(whole.own, anew.own) and np.array_equal(whole.blocks, anew.blocks)


@pytest.mark.slow
def test_a_large_object_is_felt_by_its_own_elements_until_halved_ones_are_solved(tmp_path: Path) -> None:
    made = shapes.model(shapes.block((0.1, 0.1, 0.05), (12, 12, 6)))
    model = read_model(write_model(tmp_path / "large", made))
    closed_at_once = FillingTable(model.path, RenderOptions())
    closed_at_once.wait()
    closed_at_once.close()
    table = FillingTable(model.path, RenderOptions())
    try:
        table.wait()
        own = own_places(model, kept=True)
        assert kept_places(model) is None and own.is_solved[first_places(own.own_points)].all()
        assert table.solved == 0.0 and "coarse" in table.words
        rough = create("fem", model, coarse=True)
        changes = []
        _until(lambda: changes.append(table.news()) or changes[-1] is not None)
        assert table.solved > 0.0 and table.error_n > 0.0
        finer = changes[-1].laid_on(rough).parameters.far
        assert np.isfinite(finer).all() and not np.array_equal(finer, rough.parameters.far)
    finally:
        table.close()
    assert create("fem", model, coarse=True).compliance.rough == 0.0


def test_what_ends_it_is_said(tmp_path: Path) -> None:
    table = FillingTable(tmp_path / "nothing", RenderOptions())
    try:
        with pytest.raises(PalpateError, match="nothing"):
            table.wait()
        assert "coarse" in table.words and "nothing" in table.words
    finally:
        table.close()
