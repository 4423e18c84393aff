"""Recordings that are damaged, absurd or foreign are refused in one line."""

from __future__ import annotations

import gzip
import os
import warnings
from pathlib import Path

import numpy as np
import pytest

from palpate.mechanics.disk.reading import named_in
from palpate.mechanics.errors import RecordingError, SceneError
from palpate.mechanics.recording.recording import NotRead, base_model_of, read_recording

from .inputs import DESCRIPTION, HEADER, changed, described, one_line, rows, text_of

SAMPLES = {
    "empty": (b"", "lacks the columns"),
    "header alone": (HEADER + "\n", "at least 2 samples"),
    "UTF-16": (text_of(rows()).encode("utf-16"), "no text of comma-separated numbers"),
    "binary": (bytes(range(256)) * 40, "no text of comma-separated numbers"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(100), "lacks the columns"),
    "one endless line": (b"1," * 100_000, "no text of comma-separated numbers"),
    "another delimiter": (text_of(rows()).replace(",", ";"), "lacks the columns"),
    "a column twice": (text_of(rows(), "t,x,y,z,fx,fy,x"), "lacks the columns fz"),
    "a column twice beside": (text_of(np.hstack([rows(), rows()[:, :1]]), HEADER + ",x"), "x twice"),
    "a word": (text_of(rows()).replace("0.05", "deep", 1), "not 7 decimal numbers"),
    "too few values": (text_of(rows())[:-7], "not 7 decimal numbers"),
    "an infinite value": (text_of(changed(rows(), 7, 4, np.inf)), "data row 8"),
    "a value beyond a double": (text_of(rows()).replace("0.05", "1e400", 1), "not a finite number"),
    "a force beyond any": (text_of(changed(rows(), 7, 4, 1e300)), "above 1e.09 N .first in data row 8"),
    "time standing": (text_of(changed(rows(), 7, 0, 0.006)), "t must increase strictly"),
    "time in ms": (text_of(rows(step=1.0)), "look like milliseconds"),
    "a clock ten times slow": (text_of(rows(step=0.01)), "state the true rate"),
    "a gap of a year": (text_of(changed(rows(), -1, 0, 3e7)), "longest gap 3e.07 s"),
    "a clock to 1e300": (text_of(changed(rows(), -1, 0, 1e300)), "longest gap 1e.300 s"),
    "millimetres": (text_of(rows(scale=1e3)), "look like millimetres"),
    "ten times too large": (text_of(rows(scale=20)), "1.6 m across"),
    "inches": (text_of(rows(scale=1 / 0.0254)), "look like .*inches"),
    "not packed": (b"plain", "cannot be unpacked", ".csv.gz"),
    "packed and cut off": (gzip.compress(text_of(rows()).encode())[:-30], "truncated", ".csv.gz"),
    "a gzip bomb": (gzip.compress(bytes(20 << 20), 6), "no text of comma", ".csv.gz"),
    "a bomb with a header": (
        gzip.compress(f"{HEADER}\n".encode() + b"\n" * (8 << 20), 6),
        "unpacks to more",
        ".csv.gz",
    ),
}


@pytest.mark.parametrize("name", SAMPLES)
def test_hostile_samples_are_refused_in_one_line(record, name):
    samples, words, *ending = SAMPLES[name]
    path = record(samples, ending=(ending or [".csv"])[0])
    with pytest.raises(RecordingError, match=words) as error:
        read_recording(path)
    one_line(error, path)


def test_what_is_no_file_is_told_as_what_it_is(record, tmp_path):
    path = record()
    description = tmp_path / "rec.toml"
    description.unlink()
    for make, words in (
        (lambda: None, "rec.toml' does not exist"),
        (description.mkdir, "rec.toml' is a folder"),
        (lambda: description.symlink_to("nowhere.toml"), "nowhere.toml', which does not exist"),
        (lambda: os.mkfifo(description), "rec.toml' is no ordinary file"),
    ):
        make()
        with pytest.raises(RecordingError, match=words) as error:
            read_recording(path)
        one_line(error)
        if description.is_dir():
            description.rmdir()
        description.unlink(missing_ok=True)


def test_text_of_another_encoding_beside_the_numbers_is_read(record):
    table = text_of(rows(), HEADER + ",Ort \xb5").replace("\n0", ",gr\xfcn\n0").encode("latin-1")
    assert len(read_recording(record(table.replace(b"\xb5,gr\xfcn\n", b"\xb5\n") + b"")).t) > 300


DESCRIPTIONS = {
    "no TOML": ("recording = [", "no valid TOML"),
    "not UTF-8": ("[recording]\nname = 'gr\xfcn'".encode("latin-1"), "no UTF-8 text"),
    "nested deep": ("a = " + "[" * 5000 + "]" * 5000, "no valid TOML|nested"),
    "nested by dots": ("a" + ".a" * 3000 + " = 1", "nested more than"),
    "a table that is a number": ("recording = 3", "recording. is 3; it must be a table"),
    "a table that is a text": (
        described("[sensor]\nforce_noise_std_n = 0.01", "").replace(
            "[recording]", "sensor = 'x'\n[recording]"
        ),
        "sensor. is 'x'; it must be a table",
    ),
    "an object that is a number": (
        described("[object]\npoisson_ratio = 0.49", "").replace("[recording]", "object = 1\n[recording]"),
        "object. is 1",
    ),
    "a phase that is a table": (described("[0.0, 0.1]", "{a = 1}"), "boundary_phase = .*list of 2 numbers"),
    "a phase of one": (described("[0.0, 0.1]", "[1.0]"), "boundary_phase = .1.0.; .*list of 2 numbers"),
    "a phase of nan": (described("[0.0, 0.1]", "[nan, 1.0]"), "boundary_phase"),
    "a rate of 1": (described("1000.0", "1"), "from 60 to 100000 Hz"),
    "a rate of 1e300": (described("1000.0", "1e300"), "from 60 to 100000 Hz"),
    "a rate of inf": (described("1000.0", "inf"), "from 60 to 100000 Hz"),
    "a rate of true": (described("1000.0", "true"), "sample_rate_hz = True"),
    "a rate ten times wrong": (described("1000.0", "10000.0"), "state the true rate"),
    "no force_on": (described('force_on = "tool"', ""), "force_on is missing"),
    "another force_on": (described('"tool"', '"hand"'), "one of tool, object"),
    "a misspelt force_on": (described("force_on", "forces_on"), "is 'forces_on' meant"),
    "no tip": (described("tip_radius_m = 0.005", ""), "tip_radius_m is missing"),
    "a tip of 50 mm": (described("0.005", "0.05"), "from 0.0001 to 0.04 m"),
    "a tip of 1 um": (described("0.005", "1e-6"), "from 0.0001 to 0.04 m"),
    "a tip of nan": (described("0.005", "nan"), "tip_radius_m = nan"),
    "a tip of 1 with 400 zeros": (described("0.005", "1" + "0" * 400), "tip_radius_m"),
    "a tool of -1 kg": (described("0.005", "0.005\nmass_kg = -1"), "mass_kg = -1"),
    "a tool of 1e9 kg": (described("0.005", "0.005\nmass_kg = 1e9"), "mass_kg"),
    "a tool of inf": (described("0.005", "0.005\nmass_kg = inf"), "mass_kg"),
    "negative noise": (described("= 0.01", "= -0.01"), "force_noise_std_n = -0.01"),
    "noise of nan": (described("= 0.01", "= nan"), "force_noise_std_n = nan"),
    "negative resolution": (
        described("= 0.01", "= 0.01\nposition_resolution_m = -1"),
        "position_resolution_m",
    ),
    "nu of -0.99": (described("0.49", "-0.99"), "poisson_ratio = -0.99"),
    "nu of 0.5": (described("0.49", "0.5"), "poisson_ratio = 0.5"),
    "a model that is a number": (described("0.49", "0.49\nmodel = 3"), "model = 3"),
}


@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_hostile_descriptions_are_refused_in_one_line(record, name):
    description, words = DESCRIPTIONS[name]
    path = record(description=description)
    with pytest.raises(RecordingError, match=words) as error:
        read_recording(path)
    one_line(error)


def test_a_misspelt_key_is_told_and_a_key_of_ones_own_is_not(record):
    path = record(
        description=described("boundary_phase", "boundry_phase") + "colour = 'red'\n[mine]\na = 1\n"
    )
    with pytest.warns(NotRead, match="boundry_phase is no key: did you mean boundary_phase") as told:
        assert read_recording(path).boundary_phase is None
    assert len(told) == 1


def test_a_segment_of_another_time_is_told_and_one_within_is_not(record):
    within = '[[segment]]\nkind = "press"\nstart_s = 0.1\nend_s = 0.2\n'
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(read_recording(record(description=DESCRIPTION + within)).segments) == 1
    later = within.replace("0.1", "1e6").replace("0.2", "1e7")
    with pytest.warns(NotRead, match="1 segments lie outside the recording, from 0 to 0.399 s"):
        read_recording(record(description=DESCRIPTION + within + later))


def test_a_slow_clock_is_taken_for_milliseconds_only_where_it_may_be_one(record):
    unstated = described("sample_rate_hz = 1000.0", "")
    for step, like in ((1.0, True), (0.02, False)):
        with pytest.raises(RecordingError, match="from 60 to 100000 Hz") as error:
            read_recording(record(text_of(rows(step=step)), unstated))
        assert ("look like milliseconds" in str(error.value)) == like


def test_a_path_in_a_description_stays_in_its_folder(record, tmp_path, monkeypatch):
    monkeypatch.setenv("PALPATE_CACHE", str(tmp_path / "cache"))
    recording = read_recording(record(description=DESCRIPTION + 'model = "../../etc"\n'))
    with pytest.raises(
        RecordingError, match="outside its folder: copy it there, or set PALPATE_FOLLOW_PATHS"
    ):
        base_model_of(recording)
    inside = read_recording(record(description=DESCRIPTION + 'model = "below"\n'))
    assert base_model_of(inside) == Path(os.path.realpath(tmp_path)) / "below"
    (tmp_path / "out").symlink_to("/etc")
    with pytest.raises(SceneError, match="outside its folder"):
        named_in(tmp_path / "a.toml", "out/passwd", SceneError)
    monkeypatch.setenv("PALPATE_FOLLOW_PATHS", "1")
    assert base_model_of(recording).name == "etc"
