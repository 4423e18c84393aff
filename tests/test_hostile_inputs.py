"""Every damaged, absurd or foreign input is refused in one line, and costs nobody a file: a table of them."""

from __future__ import annotations

import dataclasses
import gzip
import json
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from mechanics.box_mesh import box_mesh
from mechanics.effects.registry import NAMES, effect_keys
from mechanics.errors import (
    CacheError,
    FileError,
    ModelError,
    PalpateError,
    RecordingError,
    SceneError,
)
from mechanics.files import (
    JSON,
    Kind,
    atomic_file,
    check_room,
    check_target,
    named_in,
    sole_writer,
    sweep,
    temporary_folder,
    temporary_prefix,
)
from mechanics.material import Ball, Material, Skin
from mechanics.model import MODEL, Model, Support, Tool, read_model, write_model
from mechanics.options import check_range, option
from mechanics.recording import NotRead, base_model_of, read_recording
from mechanics.store import read_arrays, write_arrays
from palpate import cli
from scenes.scene import load_scene

resource = pytest.importorskip("resource", reason="limits and links as POSIX has them")

HEADER = "t,x,y,z,fx,fy,fz"
DESCRIPTION = """[recording]
sample_rate_hz = 1000.0
force_on = "tool"
boundary_phase = [0.0, 0.1]
[tool]
tip_radius_m = 0.005
[sensor]
force_noise_std_n = 0.01
[object]
poisson_ratio = 0.49
"""


def rows(count=400, *, step=1e-3, scale=1.0):
    """Samples of a tip that goes to and fro over 80 mm."""
    t = step * np.arange(count)
    x = scale * 0.04 * np.sin(np.arange(count) / 30)
    return np.column_stack([t, x, 0 * t, 0 * t + 0.05 * scale, 0 * t, 0 * t, 0 * t])


def text_of(table, header=HEADER):
    return header + "\n" + "\n".join(",".join(f"{v:.9g}" for v in row) for row in table) + "\n"


@pytest.fixture
def record(tmp_path):
    """Writes REC.csv and REC.toml as they are given; returns the samples' path."""

    def written(samples=None, description=DESCRIPTION, ending=".csv"):
        path = tmp_path / f"rec{ending}"
        samples = text_of(rows()) if samples is None else samples
        path.write_bytes(samples if isinstance(samples, bytes) else samples.encode())
        given = description if isinstance(description, bytes) else description.encode()
        (tmp_path / "rec.toml").write_bytes(given)
        return path

    return written


def changed(table, row, column, value):
    table = table.copy()
    table[row, column] = value
    return table


def one_line(error, *files):
    text = str(error.value)
    assert "\n" not in text and len(text) < 700
    assert all(str(file) in text for file in files)


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
    "packed and cut off": (gzip.compress(text_of(rows()).encode())[:-30], "not whole", ".csv.gz"),
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


def described(old, new):
    assert old in DESCRIPTION
    return DESCRIPTION.replace(old, new)


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


def block():
    mesh = box_mesh((2, 2, 1), (0.06, 0.06, 0.03))
    return Model(
        mesh,
        Material(
            20e3,
            0.45,
            (19e3, 21e3),
            "neo-hookean",
            {"lump": Ball((0, 0, 0.015), 0.01, 6.0)},
            skin=Skin(0.003, 3.0),
        ),
        Support(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        Tool(0.005),
        0.02,
        effects={
            "friction_slip": {"mu": 0.3},
            "strain_stiffening": {"c20_over_c10": 0.35},
            "compliant_base": {"k_normal_pa_per_m": 1e7, "k_tangential_pa_per_m": 1e7},
            "unbonded_base": {"bonded_fraction": 0.5, "direction": [1.0, 0.0, 0.0]},
            "viscoelasticity": {"g": [0.3], "tau_s": [0.3]},
        },
    )


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return write_model(tmp_path_factory.mktemp("models") / "sound", block())


@pytest.fixture
def folder(sound, tmp_path):
    import shutil

    return Path(shutil.copytree(sound, tmp_path / "model"))


MODELS = {
    "a modulus of 1e-30": ("young_modulus_pa = 20000.0", "young_modulus_pa = 1e-30", "from 1 to 1e.09 Pa"),
    "a modulus of inf": ("young_modulus_pa = 20000.0", "young_modulus_pa = inf", "young_modulus_pa = inf"),
    "an interval of one": ("[19000.0, 21000.0]", "[19000.0]", "list of 2 numbers"),
    "an interval of words": ("[19000.0, 21000.0]", "['a', 'b']", "list of 2 numbers"),
    "a skin of 1e30": ("modulus_ratio = 3.0", "modulus_ratio = 1e30", "modulus_ratio = 1e.30"),
    "a tip of 1e30": ("tip_radius_m = 0.005", "tip_radius_m = 1e30", "from 0.0001 to 0.04 m"),
    "stiffening of nan": ("c20_over_c10 = 0.35", "c20_over_c10 = nan", "c20_over_c10 = nan"),
    "stiffening without its key": ("c20_over_c10 = 0.35", "", "c20_over_c10 is missing"),
    "friction without its key": ("mu = 0.3", "", "mu is missing"),
    "friction of a word": ("mu = 0.3", "mu = 'rough'", "mu = 'rough'"),
    "friction below 0": ("mu = 0.3", "mu = -1", "mu = -1"),
    "a misspelt key of friction": ("mu = 0.3", "nu = 0.3", "mu is missing"),
    "springs without a key": ("k_normal_pa_per_m = 10000000.0", "", "k_normal_pa_per_m is missing"),
    "springs of a list": ("k_normal_pa_per_m = 10000000.0", "k_normal_pa_per_m = [1]", "k_normal_pa_per_m"),
    "a base without direction": ("direction = [1.0, 0.0, 0.0]", "", "direction is missing"),
    "a direction of two": ("direction = [1.0, 0.0, 0.0]", "direction = [1.0, 0.0]", "list of 3 numbers"),
    "a bonded share of 2": ("bonded_fraction = 0.5", "bonded_fraction = 2", "from 0.001 to 1"),
    "memory of a number": ("g = [0.3]", "g = 0.3", "a list of numbers"),
    "an effect that is a number": (
        "[effects.friction_slip]\nmu = 0.3",
        "[effects]\nfriction_slip = 3",
        "must be a table",
    ),
    "a misspelt effect": (
        "[effects.friction_slip]",
        "[effects.friction_slipp]",
        "did you mean friction_slip",
    ),
    "a ball without radius": ("radius_m = 0.01", "", "radius_m is missing"),
    "a ball at nan": ("centre_m = [0.0, 0.0, 0.015]", "centre_m = [nan, 0.0, 0.0]", "centre_m"),
    "a ball that is a number": ("[material.inclusions.lump]", "[material.inclusions]\nlump = 3\n[x]", "lump"),
    "no frame": ("[frame]", "[fame]", "lacks .frame."),
    "no mesh size": ("mesh_size_m = 0.02", "", "mesh_size_m is missing"),
    "a future format": ("format = 3", "format = 4", "reads 1 to 3"),
}


@pytest.mark.parametrize("name", MODELS)
def test_hostile_models_are_refused_in_one_line(folder, name):
    old, new, words = MODELS[name]
    file = folder / "model.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(ModelError, match=words) as error:
        read_model(folder)
    one_line(error, folder)


def test_a_model_cut_off_anywhere_is_refused(folder):
    file = folder / "model.toml"
    whole = file.read_bytes()
    assert read_model(folder).effects["friction_slip"] == {"mu": 0.3}
    tables = [i for i in range(1, len(whole) - 1) if whole[i : i + 1] in (b"[", b"\n")]
    for length in sorted({*tables, *range(0, len(whole) - 1, 23)}):
        file.write_bytes(whole[:length])
        with pytest.raises(ModelError):
            read_model(folder)


def test_a_damaged_mesh_is_refused_in_one_line(folder, capfd):
    whole = (folder / "mesh.vtu").read_bytes()
    for data in (
        b"",
        b"no mesh",
        whole[: len(whole) // 2],
        whole.replace(b"fixed", b"fluid"),
        whole.replace(b"AQAAAACA", b"/////wCA", 1),  # VTK makes room for 2^32 blocks, and ends the process
        whole.replace(b'"Points"', b'"Points>', 1),
        whole.replace(b'NumberOfPoints="', b'NumberOfPoints="9', 1),
    ):
        assert data != whole
        (folder / "mesh.vtu").write_bytes(data)
        with pytest.raises(ModelError) as error:
            read_model(folder)
        one_line(error, folder)
    assert capfd.readouterr() == ("", ""), "what VTK says beside is not said"


def test_every_effect_says_which_keys_a_model_may_hold():
    assert list(effect_keys()) == list(NAMES)
    assert [name for name, keys in effect_keys().items() if keys is None] == []


SCENES = {
    "a misspelt key": ("[object]\nphantom = 'block'\nyoung_modulus = 1e4", "did you mean young_modulus_pa"),
    "a table that is a number": ("object = 3", "object. is 3"),
    "no object": ("title = 'x'", "exactly one of"),
    "an inclusion at nan": (
        "[object]\nphantom = 'block'\n[[inclusion]]\ncentre_m = [nan, 0.0, 0.0]\n"
        "radius_m = 0.01\nmodulus_ratio = 2.0",
        "centre_m",
    ),
    "an inclusion that is no list": ("[object]\nphantom = 'block'\n[inclusion]\na = 1", "list of tables"),
    "an inclusion of negative size": (
        "[object]\nphantom = 'block'\n[[inclusion]]\ncentre_m = [0.0, 0.0, 0.0]\n"
        "radius_m = -0.01\nmodulus_ratio = 2.0",
        "radius_m",
    ),
    "left-handed axes": ("[object]\nphantom = 'block'\n[device]\naxes = 'x,y,-z'", "left-handed"),
    "axes of a number": ("[object]\nphantom = 'block'\n[device]\naxes = 3", "axes = 3"),
    "a scale of 0": ("[object]\nphantom = 'block'\n[device]\nmotion_scale = 0", "motion_scale = 0"),
    "a scale of nan": ("[object]\nphantom = 'block'\n[device]\nmotion_scale = nan", "motion_scale = nan"),
    "a negative force": ("[object]\nphantom = 'block'\n[device]\nforce_scale = -1", "force_scale = -1"),
    "an infinite force": ("[object]\nphantom = 'block'\n[device]\nforce_scale = inf", "force_scale = inf"),
    "a mesh of 1e-9": ("[object]\nphantom = 'block'\nmesh_size_m = 1e-9", "mesh_size_m"),
    "a colour of ones own": ("[object]\nphantom = 'block'\n[render]\ncolour = 'pink'", "one of displacement"),
    "a path that leaves": ("[object]\nmodel = '/etc'", "outside its folder"),
    "a path up": ("[object]\nphantom = '../../x.stl'", "outside its folder"),
}


@pytest.mark.parametrize("name", SCENES)
def test_hostile_scenes_are_refused_in_one_line(tmp_path, name):
    text, words = SCENES[name]
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(SceneError, match=words) as error:
        load_scene(path)
    one_line(error, path)


def test_an_inclusion_beside_the_object_is_refused():
    from scenes.build import _check_inside

    _check_inside(block())
    far = dataclasses.replace(block().material, inclusions={"lump": Ball((9, 0, 0), 0.01, 6.0)})
    with pytest.raises(SceneError, match="lies outside the object") as error:
        _check_inside(dataclasses.replace(block(), material=far))
    one_line(error)


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
    from diagnose.explore.explorer import Explorer
    from diagnose.explore.rows import Instrument
    from palpate.robot.protocol import serve

    line, words = ROBOT[name]
    explorer, said = Explorer(Instrument(0.005)), []
    serve(explorer, [line], said.append, lambda _: pytest.fail("there is nothing to keep"))
    assert re.search(words, json.loads(said[-1])["error"]) and not explorer.segments


def test_no_bit_of_a_stored_file_changes_unnoticed(tmp_path):
    path = tmp_path / "x.bin"
    arrays = {"far": np.arange(600.0).reshape(-1, 3), "own": np.arange(50, dtype=np.float32)}
    write_arrays(path, "key", arrays)
    whole = path.read_bytes()
    header = len(whole) - sum(a.nbytes for a in arrays.values()) - 64
    rng = np.random.default_rng(1)
    places = [*range(8 * header), *rng.integers(8 * header, 8 * len(whole), 400).tolist()]
    for place in places:
        data = bytearray(whole)
        data[place // 8] ^= 1 << place % 8
        path.write_bytes(data)
        with pytest.raises(CacheError):
            read_arrays(path, "key")
    path.write_bytes(whole)
    assert np.array_equal(read_arrays(path, "key")["far"], arrays["far"])


def command(*words):
    """(exit code, what it says on stderr) of the command line."""
    import io
    from contextlib import redirect_stderr

    said = io.StringIO()
    with redirect_stderr(said):
        try:
            code = cli.main([str(w) for w in words])
        except SystemExit as stop:
            code = int(stop.code)
    return code, said.getvalue()


def refused(words, *line):
    code, said = command(*line)
    assert code == 2 and re.search(words, said) and "Traceback" not in said, said
    assert len(said.strip().splitlines()) == 1, said


def contents(folder):
    return {p: p.read_bytes() for p in Path(folder).rglob("*") if p.is_file()}


PRESS = ("press", "M", "--at", "0,0,0", "--direction", "0,0,-1", "--depth", "0.001")
REPLACED = {
    "forces over the recording": ("would replace what REC names", "replay", "M", "REC", "-o", "REC"),
    "JSON over the recording": ("--json would replace what REC names", "replay", "M", "REC", "--json", "REC"),
    "a curve over the model": (
        "-o would replace|--output would replace",
        *PRESS,
        "-o",
        "M/model.toml",
    ),
    "a curve over a text": (
        "is no curve of palpate press",
        *PRESS,
        "-o",
        "notes/thesis.txt",
    ),
    "a curve over a folder": (
        "is a folder: name a file",
        *PRESS,
        "-o",
        "notes",
    ),
    "a model over a folder of texts": ("is no MODEL folder", "reconstruct", "REC", "-o", "notes"),
    "a model over a text": ("is no folder", "reconstruct", "REC", "-o", "notes/thesis.txt"),
    "a model over the current folder": ("current folder", "reconstruct", "REC", "-o", "."),
    "a model over the model that is read": (
        "--apply would replace what --model names",
        "diagnose",
        "REC",
        "--model",
        "M",
        "--apply",
        "M",
    ),
    "a better recording over itself": (
        "--corrected would replace what REC names",
        "diagnose",
        "REC",
        "--corrected",
        "REC",
    ),
    "a report over a text": ("is no page of palpate", "compare", "REC", "-o", "notes/thesis.txt"),
    "a report under a file": (
        "a part of the path is a file",
        "compare",
        "REC",
        "-o",
        "notes/thesis.txt/r.html",
    ),
    "JSON and report as one": ("both name", "compare", "REC", "-o", "new.html", "--json", "new.html"),
    "a session over what it replays": (
        "--record would replace what --replay names",
        "touch",
        "M",
        "--headless",
        "--device",
        "replay",
        "--replay",
        "REC",
        "--record",
        "REC",
    ),
    "a recording over a text of that name": (
        "is no recording's description",
        "simulate",
        "block",
        "-o",
        "notes/other.csv",
    ),
    "JSON to a device": ("no ordinary file", "compare", "REC", "--json", "/dev/full"),
    "a name too long": ("use a shorter name", "compare", "REC", "--json", "n" * 300 + ".json"),
    "a dangling link": ("is a link to", "compare", "REC", "--json", "dangling.json"),
    "a loop of links": ("loop|circle", "compare", "REC", "--json", "loop/x.json"),
}


@pytest.mark.parametrize("name", REPLACED)
def test_an_output_replaces_no_input_and_nothing_of_another_kind(folder, record, tmp_path, monkeypatch, name):
    recording = record()
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "thesis.txt").write_text("years of work")
    (tmp_path / "notes" / "model.toml").write_text("not of this program")
    (tmp_path / "notes" / "other.toml").write_text("mine = 1")
    (tmp_path / "dangling.json").symlink_to("nowhere/at/all.json")
    (tmp_path / "loop").symlink_to("loop")
    monkeypatch.chdir(tmp_path)
    before = contents(tmp_path)
    known = {"REC": recording.name, "M": folder.name, "M/model.toml": f"{folder.name}/model.toml"}
    words, *line = REPLACED[name]
    refused(words, *(known.get(word, word) for word in line))
    assert contents(tmp_path) == before


EXPLORE = ("explore", "--phantom", "dome", "-o", "new.csv")
ABSURD = {
    "a mesh of 1e-5": ("from 0.0005 to 0.2 m", "reconstruct", "REC", "-o", "new", "--mesh-size", "1e-5"),
    "a memory of nan": ("not a finite number", "batch", "REC", "-o", "new", "--memory", "nan"),
    "a mesh of nan": ("from 0.0005 to 0.2 m", "reconstruct", "REC", "-o", "new", "--mesh-size", "nan"),
    "a negative seed": ("0 or greater", "simulate", "block", "-o", "new.csv", "--seed", "-1"),
    "a negative person": ("0 or greater", "simulate", "block", "-o", "new.csv", "--person", "-1"),
    "a seed of 40 digits": ("0 or greater", "simulate", "block", "-o", "new.csv", "--seed", "9" * 40),
    "negative presses": ("from 0", "simulate", "block", "-o", "new.csv", "--presses", "-1"),
    "no workers": ("workers is 0", "simulate", "block", "-o", "new.csv", "--workers", "0"),
    "a finest mesh of 0": ("from 0.5 to 1000 mm", "simulate", "block", "-o", "new.csv", "--finest-mm", "0"),
    "a tip of 1 m": ("from 0.0001 to 0.04 m", "simulate", "block", "-o", "new.csv", "--tip-radius", "1"),
    "a speed of 0": ("from 0.0001 to 10 m/s", "simulate", "block", "-o", "new.csv", "--slowest-m-per-s", "0"),
    "a negative noise": (
        "from 0 to 1000 N",
        "simulate",
        "block",
        "-o",
        "new.csv",
        "--force-noise-std-n",
        "-1",
    ),
    "friction of nan": (
        "friction|nan",
        *PRESS,
        "--friction",
        "nan",
    ),
    "an infinite depth": (
        "not a finite number",
        "press",
        "M",
        "--at",
        "0,0,0",
        "--direction",
        "0,0,-1",
        "--depth",
        "inf",
    ),
    "deeper than the object": ("from 0.01 to 0.9", *EXPLORE, "--deepest-share", "5"),
    "a phantom of 0 Pa": ("young_modulus_pa is 0", *EXPLORE, "--modulus", "0"),
    "a phantom of nan Pa": ("young_modulus_pa is nan", *EXPLORE, "--modulus", "nan"),
    "a phantom of 1e30 Pa": ("young_modulus_pa is 1e.30", *EXPLORE, "--modulus", "1e30"),
    "an object of nu 0.5": ("from 0 to 0.4999", *EXPLORE, "--poisson-ratio", "0.5"),
    "a touch of no force": ("from 0.01 to", *EXPLORE, "--strongest", "0"),
    "a recording that is none": ("must end in .csv", "explore", "--phantom", "dome", "-o", "new.txt"),
    "a laboratory's recording that is none": ("must end in .csv", "simulate", "block", "-o", "new.mat"),
    "a place of 1e200": ("beyond any quantity", "press", "M", "--at", "1e200,0,0", "--direction", "0,0,-1"),
    "a direction of 1e200": (
        "beyond any quantity",
        "press",
        "M",
        "--at",
        "0,0,0",
        "--direction",
        "0,0,-1e200",
    ),
    "nu of -0.99": ("from 0 to 0.4999", "reconstruct", "REC", "-o", "new", "--poisson-ratio", "-0.99"),
}


@pytest.mark.parametrize("name", ABSURD)
def test_absurd_options_are_refused_before_any_work(folder, record, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    recording = record()
    known = {"REC": recording.name, "M": folder.name}
    words, *line = ABSURD[name]
    refused(words, *(known.get(word, word) for word in line))
    assert not list(tmp_path.glob("new*"))


def curve(t=1.0, z=1.0, fz=1.0, rows=400):
    """A sphere's indentation of 2 mm into 20 kPa, its columns times anything."""
    time = np.linspace(0.0, 2.0, rows)
    depth = 0.002 * (1 - np.abs(time - 1))
    table = np.column_stack([t * time, -z * depth, fz * 1.9e4 * np.sqrt(0.005) * depth**1.5])
    return text_of(table, "t,z,fz")


def relaxation(t=1.0, value=1.0, rows=400):
    time = np.linspace(0.0, 2.0, rows)
    return text_of(np.column_stack([t * time, value * (1 + np.exp(-time))]), "time,relaxation modulus")


TIP = ("--tip-radius", "0.005")
CURVES = {
    "travel of kilometres": ("travels 1995 m.*--units position", curve(z=1e6), *TIP),
    "a load beyond any": ("load above 1e\\+09 N.*--units force", curve(fz=1e300), *TIP),
    "a few rows": ("3 rows in order of time: 8", curve(rows=3), *TIP),
    "time backwards": ("1 rows in order of time: 8", curve(t=-1.0), *TIP),
    "a layer thinner than the dent": ("into a layer of 1e-09 m", curve(), *TIP, "--layer", "1e-9"),
    "nu of 2": ("between -1 and 0.5", curve(), *TIP, "--poisson-ratio", "2"),
    "nu of -3": ("between -1 and 0.5", curve(), *TIP, "--poisson-ratio", "-3"),
    "a relaxation of two rows": ("2 rows in order of time: 8", relaxation(rows=2)),
    "a relaxation beyond any": ("above 1e\\+15", relaxation(t=1e300)),
    "a modulus beyond any": ("above 1e\\+15", relaxation(value=1e300)),
}


def test_rows_without_a_number_are_told_of_and_most_of_them_refused(tmp_path, capsys):
    lines = curve().splitlines()
    some = [",".join([*line.split(",")[:2], "nan"]) if k % 10 == 5 else line for k, line in enumerate(lines)]
    (tmp_path / "dent.csv").write_text("\n".join(some) + "\n")
    assert cli.main(["material", str(tmp_path / "dent.csv"), "--fast", *TIP]) == 0
    assert "40 of 400 rows lack a number and are left out, the first is row 5" in capsys.readouterr().err
    most = [",".join([*line.split(",")[:2], "nan"]) if k % 10 > 3 else line for k, line in enumerate(lines)]
    (tmp_path / "dent.csv").write_text("\n".join(most) + "\n")
    refused("240 of 400 rows lack a number", "material", str(tmp_path / "dent.csv"), "--fast", *TIP)


@pytest.mark.parametrize("name", CURVES)
def test_hostile_curves_of_a_machine_are_refused_in_one_line(tmp_path, name, recwarn):
    words, text, *line = CURVES[name]
    (tmp_path / "dent.csv").write_text(text)
    refused(words, "material", str(tmp_path / "dent.csv"), "--fast", *line)
    assert not list(recwarn)


def test_a_robot_that_misses_the_object_feels_its_way_to_the_nearest_place(monkeypatch):
    """With what the program itself installs: another library was asked for."""
    from palpate.robot.laboratory import LaboratoryRobot
    from scenes.phantoms import phantom

    monkeypatch.setitem(sys.modules, "rtree", None)
    thing = phantom("dome")
    robot = LaboratoryRobot(thing)
    top = float(thing.vertices[:, 2].max())
    touch = robot._landed(np.array([0.5, 0.0, 0.5 * top + 0.05]), np.array([0.0, 0.0, -1.0]), 0.002)
    assert 1e3 * thing.vertices[:, 0].max() * 0.5 < touch.point[0] <= 1e3 * thing.vertices[:, 0].max() + 1e-3
    assert touch.normal[0] > 0.5


def test_every_default_is_within_its_range():
    from devices.registry import DEVICES, options_of
    from palpate.keywords import FUNCTIONS, kinds
    from palpate.servo import SafetyOptions, ServoOptions

    everything = {kind for name in FUNCTIONS for kind in kinds(name)} | {options_of(name) for name in DEVICES}
    for kind in everything | {SafetyOptions, ServoOptions}:
        for field in dataclasses.fields(kind):
            if "help" in field.metadata:
                check_range(field, field.default, f"{kind.__name__}.{field.name}")


def test_infinite_friction_is_an_option_as_documented():
    from render.options import RenderOptions

    field = RenderOptions.__dataclass_fields__["friction"]
    check_range(field, float("inf"))
    with pytest.raises(PalpateError, match="allowed are numbers from 1 to 2 m"):
        check_range(_Named("x", option(1.0, "words", unit="m", low=1, high=2)), 3.0)


class _Named:
    def __init__(self, name, field):
        self.name, self.metadata = name, field.metadata


def test_a_press_deeper_than_the_object_or_without_end_is_refused(monkeypatch):
    from render.press import press

    class Scene:
        model = block()

    monkeypatch.setattr("render.press.scene_of", lambda touched: touched)
    up = np.array([0.0, 0.0, 1.0])
    monkeypatch.setattr("render.press.first_touch", lambda *_: (0.035 * up, up))
    for words, keywords in (
        ("the object is 0.03 m high", {"depth_m": 4.0}),
        ("tip's radius is 1e.30", {"tip_radius_m": 1e30}),
        ("would last", {"speed_m_per_s": 1e-12}),
        ("would last", {"hold_s": 1e9}),
    ):
        given = {"depth_m": 1e-3, "speed_m_per_s": 0.01, **keywords}
        with pytest.raises(PalpateError, match=words):
            press(Scene(), np.zeros(3), -up, **given)


def test_an_object_that_would_take_millions_of_tetrahedra_is_refused():
    from mechanics.errors import MeshError
    from reconstruct.steps.s5_mesh.tetwild import check_count

    mesh = block().mesh
    check_count(mesh.points, mesh.surface[:, :3], 0.005)
    with pytest.raises(MeshError, match="check that the positions are in metres") as error:
        check_count(10 * mesh.points, mesh.surface[:, :3], 0.005)
    one_line(error)


@contextmanager
def full_disk(most=100):
    """Files cannot grow beyond `most` bytes, which the system says as it says that a disk is full."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)


def test_a_write_that_fails_leaves_what_was_there(folder, record, tmp_path):
    from mechanics.recording import write_recording
    from palpate.report.page import Page
    from render.replay import write_forces

    recording = read_recording(record())
    before = contents(tmp_path)
    page = Page("x" * 200)
    for write in (
        lambda: write_model(folder, block()),
        lambda: write_model(tmp_path / "new", block()),
        lambda: write_recording(tmp_path / "rec.csv", recording),
        lambda: write_recording(tmp_path / "other.csv.gz", recording),
        lambda: write_forces(tmp_path / "forces.csv", recording.t, recording.force_on_tool),
        lambda: page.write(tmp_path / "page.html"),
    ):
        with full_disk(), pytest.raises(FileError, match="cannot be written .*: write to a place") as error:
            write()
        one_line(error)
        assert contents(tmp_path) == before
        assert not [p for p in tmp_path.iterdir() if p.name.startswith(".palpate")]


def test_a_folder_that_is_replaced_keeps_what_others_put_into_it(folder):
    (folder / "notes.txt").write_text("mine")
    (folder / "pictures").mkdir()
    (folder / "pictures" / "a.png").write_bytes(b"mine too")
    (folder / "compliance-0.bin").write_bytes(b"of the old mesh")
    write_model(folder, block())
    assert (folder / "notes.txt").read_text() == "mine"
    assert (folder / "pictures" / "a.png").read_bytes() == b"mine too"
    assert not (folder / "compliance-0.bin").exists()
    assert read_model(folder).effects == block().effects


def test_room_and_permission_are_seen_before_the_work(tmp_path):
    check_target(tmp_path / "deep" / "er" / "x.json", JSON)
    assert not (tmp_path / "deep").exists()
    huge = Kind("a giant", (b"x",), likely_bytes=1 << 62)
    with pytest.raises(FileError, match="MB free: free some space"):
        check_target(tmp_path / "x", huge)
    with full_disk(10), pytest.raises(FileError, match="cannot be written"):
        check_target(tmp_path / "x.json", JSON)
    with pytest.raises(FileError, match="exists and is no MODEL folder"):
        (tmp_path / "a").mkdir()
        (tmp_path / "a" / "b").touch()
        check_target(tmp_path / "a", MODEL)


def test_a_full_disk_of_scratch_or_cache_is_seen_before_the_work(monkeypatch, tmp_path):
    import shutil

    full = shutil.disk_usage("/")._replace(free=1000)
    monkeypatch.setattr("mechanics.files.shutil.disk_usage", lambda _: full)
    with pytest.raises(FileError, match="set PALPATE_CACHE to a folder on another disk"):
        check_room(tmp_path / "deep" / "laboratory", 1 << 20)
    assert not list(tmp_path.iterdir()), "an empty folder is left"
    with pytest.raises(FileError, match="set TMPDIR to a folder on another disk") as error:
        with temporary_folder("x-"):
            pytest.fail("nothing can be written there")
    one_line(error)


def test_a_process_that_follows_its_parent_ends_with_it():
    code = "import time; from palpate.child import end_with_parent; end_with_parent(); time.sleep(60)"
    child = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE)
    child.stdin.close()
    assert child.wait(20) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere it ends by itself, after its time")
def test_the_mesher_ends_when_its_parent_is_killed(tmp_path):
    """One that would mesh for an hour, as fTetWild does on some surfaces."""
    from reconstruct.steps.s5_mesh import tetwild

    (tmp_path / "pytetwild.py").write_text("import time; open('begun', 'w'); time.sleep(3600)")
    words = f"[sys.executable, '-c', {tetwild._CHILD!r}, str(os.getpid()), '60']"
    code = f"import os, subprocess, sys; subprocess.run({words})"
    parent = subprocess.Popen([sys.executable, "-S", "-c", code], cwd=tmp_path)
    begun = tmp_path / "begun"
    assert _within(20.0, begun.exists)
    [child] = Path(f"/proc/{parent.pid}/task/{parent.pid}/children").read_text().split()
    parent.kill()
    parent.wait()
    assert _within(5.0, lambda: not Path(f"/proc/{child}/cmdline").exists())


def _within(seconds, happened):
    end = time.monotonic() + seconds
    while not happened() and time.monotonic() < end:
        time.sleep(0.02)
    return happened()


def test_a_worker_of_the_laboratory_ends_when_its_parent_is_killed(tmp_path):
    code = (
        "import os, signal\n"
        "from scenes.laboratory.curves import workers_of_ours\n"
        "if __name__ == '__main__':\n"
        "    with workers_of_ours(1) as pool:\n"
        "        print(pool.submit(os.getpid).result(), flush=True)\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    path = tmp_path / "main.py"
    path.write_text(code)
    # its pipes close, and this returns, when the last process that holds them is gone
    done = subprocess.run([sys.executable, path], capture_output=True, text=True, timeout=30)
    assert done.returncode == -signal.SIGKILL and int(done.stdout) > 0


def test_two_writers_of_one_folder_do_not_mix(tmp_path):
    with sole_writer(tmp_path / "demo"):
        with pytest.raises(FileError, match="another palpate is writing to"), sole_writer(tmp_path / "demo"):
            pass
    with sole_writer(tmp_path / "demo"):
        pass
    assert not list((tmp_path / "demo").iterdir())


def test_what_killed_processes_left_is_swept(tmp_path, monkeypatch):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    ours = temporary_prefix().replace(str(os.getpid()), str(gone.pid))
    (tmp_path / f"{ours}half.csv").write_text("half")
    (tmp_path / f"{ours}folder").mkdir()
    (tmp_path / f"{ours}old-x").mkdir()
    (tmp_path / f"{ours}old-x" / "model").mkdir()
    (tmp_path / f"{ours}old-x" / "model" / "kept").touch()
    (tmp_path / f"{temporary_prefix()}alive").touch()
    sweep(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([f"{temporary_prefix()}alive", "model"])
    assert (tmp_path / "model" / "kept").exists(), "what was being replaced goes back"
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("mechanics.files._swept", set())
    (tmp_path / f"{ours}mesh-x").mkdir()
    command("press", "nothing", "--at", "0,0,0", "--direction", "0,0,-1", "--depth", "0.001")
    assert not list(tmp_path.glob("*mesh-x")), "whatever command is next sweeps the scratch files"
    with temporary_folder("x-") as scratch:
        (scratch / "a").touch()
    assert not scratch.exists()


def test_a_damaged_mesh_of_the_laboratory_is_not_taken(tmp_path):
    from scenes.laboratory.mesh import _kept

    mesh = block().mesh
    path = tmp_path / "mesh.npz"
    np.savez(path, points=mesh.points, tetrahedra=mesh.tetrahedra[:, :4])
    whole = path.read_bytes()
    assert len(_kept(path)[0]) == len(mesh.points)
    for data in (b"", whole[:100], whole[: len(whole) // 2], b"PK" + whole[2:40]):
        path.write_bytes(data)
        assert _kept(path) is None
    np.savez(path, points=mesh.points, tetrahedra=mesh.tetrahedra[:, :4] + 10_000)
    assert _kept(path) is None


def test_an_interrupt_while_loading_leaves_without_a_traceback(tmp_path):
    code = (
        "import os, signal, sys, threading; import palpate.cli\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background job ignores it
        "threading.Timer(0.15, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "sys.exit(palpate.cli.main(['touch', '--headless']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 130 and "Traceback" not in done.stderr, done.stderr
    assert "interrupted" in done.stderr


def test_errors_of_the_system_anywhere_in_a_command_become_one_line(monkeypatch, tmp_path):
    from palpate.commands import devices

    for error, words in (
        (OSError(28, "No space left on device", "/x/y"), "'/x/y' cannot be used (No space left on device)"),
        (MemoryError(), "not enough memory"),
        (KeyboardInterrupt(), "interrupted"),
    ):

        def fail(_, error=error):
            raise error

        monkeypatch.setattr(devices, "run", fail)
        code, said = command("devices")
        assert code == (130 if isinstance(error, KeyboardInterrupt) else 2)
        assert words in said and len(said.strip().splitlines()) == 1


def test_nothing_unpickles_what_a_stranger_may_have_written():
    root = Path(cli.__file__).parent.parent
    for package in ("mechanics", "reconstruct", "render", "devices", "diagnose", "scenes", "palpate"):
        for file in (root / package).rglob("*.py"):
            text = file.read_text(encoding="utf-8")
            assert "allow_pickle=True" not in text, file
            # the servo and the workers of a batch read what their own parent sends through a pipe
            if "pickle.load" in text:
                assert file.parent.name in ("servo", "tasks"), file


def test_atomic_writes_follow_links_and_leave_them(tmp_path):
    (tmp_path / "real.json").write_text("{}")
    (tmp_path / "link.json").symlink_to("real.json")
    with atomic_file(tmp_path / "link.json", JSON) as temporary:
        temporary.write_text("[1]")
    assert (tmp_path / "link.json").is_symlink() and (tmp_path / "real.json").read_text() == "[1]"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not [p for p in tmp_path.iterdir() if p.name.startswith(".palpate")]
