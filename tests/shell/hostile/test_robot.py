"""A robot's lines that cannot be meant are answered in one, and nothing of them is kept."""

from __future__ import annotations

import json
import re
import sys

import numpy as np
import pytest


def told(**changes):
    """A robot's line of 0.6 s of rest."""
    count = 600
    said = {"segment": "trace", "t": [1e-3 * k for k in range(count)]}
    return json.dumps(said | {"position": [[0.0] * 3] * count, "force": [[0.0] * 3] * count} | changes)


ROBOT = {
    "no JSON": ("[" * 100_000, "no JSON"),
    "a list": ("[]", "holds a list"),
    "a kind that is a list": (told(segment=["trace"]), "kind is"),
    "a place of words": (told(position=[["a"] * 3] * 600), "no numbers"),
    "a time of nan": (told(t=[float("nan")] * 600), "all finite"),
    "two samples": (told(t=[0, 1e-3], position=[[0] * 3] * 2, force=[[0] * 3] * 2), "20 samples or more"),
    "a place of 1e300": (told(position=[[0.0] * 3] * 599 + [[1e300, 0, 0]]), "1e.300 m across"),
    "a force of 1e300": (told(force=[[1e300, 0, 0]] * 600), "above 1e.09 N"),
    "a clock of 1e300": (told(t=[1e-3 * k for k in range(599)] + [1e300]), "the clock runs from"),
    "another rate": (told(t=[1e-2 * k for k in range(600)]), "state the true rate"),
    "an orientation of 0": (told(quaternion=[[0.0] * 4] * 600), "unit quaternions"),
}


@pytest.mark.parametrize("name", ROBOT)
def test_a_robots_hostile_line_is_answered_in_one_and_nothing_of_it_kept(name):
    from palpate.diagnosis.explore.explorer import Explorer
    from palpate.diagnosis.explore.segments import Instrument
    from palpate.robot import serve

    line, words = ROBOT[name]
    explorer, said = Explorer(Instrument(0.005)), []
    serve(explorer, [line], said.append, lambda _: pytest.fail("there is nothing to keep"))
    assert re.search(words, json.loads(said[-1])["error"]) and not explorer.segments


def test_a_robot_that_misses_the_object_feels_its_way_to_the_nearest_place(monkeypatch):
    """With what the program itself installs: another library was asked for."""
    from palpate.robot import LaboratoryRobot
    from palpate.scenes.phantoms import phantom

    monkeypatch.setitem(sys.modules, "rtree", None)
    thing = phantom("dome")
    robot = LaboratoryRobot(thing)
    top = float(thing.vertices[:, 2].max())
    touch = robot._landed(np.array([0.5, 0.0, 0.5 * top + 0.05]), np.array([0.0, 0.0, -1.0]), 0.002)
    assert 1e3 * thing.vertices[:, 0].max() * 0.5 < touch.point[0] <= 1e3 * thing.vertices[:, 0].max() + 1e-3
    assert touch.normal[0] > 0.5
