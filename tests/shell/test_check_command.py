"""`palpate check`: exit codes, JSON and a page with a picture of the offending stretch."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import palpate as pp
from palpate import cli
from palpate.mechanics.recording.recording import write_recording

from ..reconstruct.exploration_of_cylinder import explore_cylinder
from ..reconstruct.flat_ground import raster


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("sound") / "cylinder.csv", explore_cylinder()[0])


def test_a_sound_recording_passes(sound, capsys):
    assert cli.main(["check", str(sound)]) == 0
    assert "GRAVE" not in capsys.readouterr().out


def test_presses_are_counted_of_a_whole_object_and_of_a_flat_one():
    """One learnt how many were found after minutes, from the reconstruction."""
    recording, onsets = explore_cylinder()
    assert pp.check(recording, progress=False).presses == len(onsets)
    flat = replace(raster((4, 4)), description={"object": {"half_space": True}})
    assert pp.check(flat, progress=False).presses == 16


def test_a_mirrored_one_fails_with_a_page_and_json(tmp_path, capsys):
    recording = pp.read_recording(explore_cylinder()[0])
    mirrored = write_recording(
        tmp_path / "mirrored.csv",
        pp.Recording(**{**vars_of(recording), "position": recording.position * np.array([1, -1, 1])}),
    )
    page, figures = tmp_path / "page.html", tmp_path / "found.json"
    assert cli.main(["check", str(mirrored), "--report", str(page), "--json", str(figures)]) == 1
    assert "GRAVE: mirrored" in capsys.readouterr().out
    found = json.loads(figures.read_text())
    assert found["grave"] == 1 and found["findings"][0]["name"] == "mirrored"
    assert "y or of fy" in found["findings"][0]["todo"]
    text = page.read_text()
    assert text.count("data:image/png") == 2 and "push the wrong way" in text
    assert (tmp_path / "page" / "finding-1.png").stat().st_size > 10_000
    assert cli.main(["reconstruct", str(mirrored), "-o", str(tmp_path / "MODEL")]) == 2
    assert "mirrored" in capsys.readouterr().err and not (tmp_path / "MODEL").exists()


def vars_of(recording):
    from dataclasses import fields

    return {f.name: getattr(recording, f.name) for f in fields(recording)}
