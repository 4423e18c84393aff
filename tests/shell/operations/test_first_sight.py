"""What newcomers met with no word of how to go on, or two words for one thing."""

from __future__ import annotations

import json
import queue
import re
import shlex
from importlib import import_module
from types import SimpleNamespace

from palpate.cli import main
from palpate.mechanics.model.files import write_model
from palpate.operations._run import check_paths, parser_of
from palpate.servo.client import Servo

from ...render import shapes


def test_a_scene_that_is_given_for_a_recording_is_told_how_to_become_one(capsys):
    assert main(["compare", "bean"]) == 2
    (command,) = re.findall(r"'palpate (touch [^']*)'", capsys.readouterr().err)
    assert parser_of("touch").parse_args(shlex.split(command)[1:]).record == "bean.csv.gz"


def test_an_effect_that_the_model_has_is_in_what_a_touch_is_off_by(monkeypatch):
    """'Nothing new is missing' stood beside '33 mN off, 20 mN with what was found'."""
    found = SimpleNamespace(
        gap_before_n=0.033, gap_after_n=0.020, noise_n=0.01, gap_closed=0.6, gap_closed_ci95=(0.5, 0.7),
        effects=("finite_strain",), constant_n=None,
    )  # fmt: skip
    said, story = {}, import_module("palpate.show.diagnosis.story")
    for there in (True, False):
        monkeypatch.setattr(story, "missing", lambda _, there=there: () if there else ("finite_strain",))
        said[there] = next(iter(story._how_far(found))).text
    assert said[True].startswith("how far: a typical touch is 20 mN off; without what the model has")
    assert said[False].startswith("how far: a typical touch is 33 mN off, 20 mN with what was found")


def test_a_folder_that_gives_way_to_a_new_model_is_named(tmp_path, capsys):
    parser, folder = parser_of("model"), tmp_path / "MODEL"
    words = ["organ.stl", "-o", str(folder)]
    check_paths(parser, parser.parse_args(words))
    assert capsys.readouterr().err == ""
    write_model(folder, shapes.model(shapes.block((0.04, 0.04, 0.02), (2, 2, 1))))
    check_paths(parser, parser.parse_args(words))
    assert f"{folder} is there, and what it holds is replaced" in capsys.readouterr().err


def test_what_is_told_anew_with_every_table_is_said_once():
    """The virtual coupling's line stood eight times in a report."""
    told = [{"word": f"virtual coupling: {k} N/m", "about": "virtual coupling"} for k in range(8)]
    servo = Servo.__new__(Servo)
    servo._words, servo._answers = {}, queue.Queue()
    servo._process = SimpleNamespace(
        stdin=object(), stdout=[json.dumps(each) for each in ({"word": "no real time"}, *told)]
    )
    servo._listen()
    assert servo.words == ("no real time", "virtual coupling: 7 N/m")
