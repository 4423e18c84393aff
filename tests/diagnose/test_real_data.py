"""The real-data table: what held-out curves of others' instruments are predicted to, so that a change that
spoils it is seen. Limits are measured figures with some room."""

from __future__ import annotations

from argparse import Namespace

import numpy as np
import pytest

from benchmarks.diagnose_real import FOLDERS, SETS, _row, pieces_of
from palpate.mechanics.effects.registry import effect


def rows(measured_data, name: str, **options):
    given = Namespace(session="230331", pieces=16, **options)
    return [_row(name, label, made) for label, made in SETS[name](measured_data / FOLDERS[name], given)]


def never_worse(found) -> bool:
    """No verdict whose held-out closure has an interval wholly below zero."""
    return all(r["closed_ci95"] is None or r["closed_ci95"][1] >= 0 for r in found)


def test_a_session_is_found_however_its_pieces_are_named(tmp_path):
    """The second half of the sessions, which name themselves twice, were never read."""
    pieces = ["230331_FF1_2A", "230407_230407_RDG1C", "230407_230407_ff2B"]
    (tmp_path / "csv").mkdir()
    for name in (*pieces, "230407_230407_FF2_LONG", "230407_Eprouvette_moyenne", "230331_RDG2_2F_bis"):
        (tmp_path / "csv" / f"{name}.csv").touch()
    found = [[p.stem for p in pieces_of(tmp_path, session)] for session in ("230331", "230407")]
    assert found == [pieces[:1], pieces[1:]]


@pytest.mark.slow
def test_elastomers_in_tension_stay_predicted(measured_data):
    found = rows(measured_data, "elastomers")
    assert len(found) == 19
    assert never_worse(found)
    assert np.median([r["error"] for r in found]) < 0.015 < np.median([r["floor"] for r in found])


@pytest.mark.release
def test_silicones_in_compression_stay_within_3_percent(measured_data):
    found = rows(measured_data, "silicones", every=3)
    assert len(found) == 7
    assert never_worse(found)
    errors, floors = ([r[key] for r in found] for key in ("error", "floor"))
    assert np.median(errors) < 0.02 and max(errors) < 0.06 < np.median(floors)


@pytest.mark.slow
def test_beef_is_closed_and_never_made_worse(measured_data):
    (found,) = rows(measured_data, "beef")
    assert "relaxation" in {effect(name).hints.phenomenon for name in found["effects"]}
    assert never_worse([found]) and found["closed"] > BEEF_CLOSED
    assert found["holds_closed"] > HOLDS_CLOSED
    assert found["error"] < 0.5 * found["floor"]


BEEF_CLOSED, HOLDS_CLOSED = 0.45, 0.9
