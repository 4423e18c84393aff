"""Whatever stands in a recording, MODEL, scene or message of a device is understood or refused in one line.

`python -m tests.support fuzz` tries the same at length, with whole commands.
"""

from __future__ import annotations

import shutil
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks._servo_load import block_model
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.errors import DeviceError, ModelError, PalpateError, RecordingError, SceneError
from palpate.mechanics.model.files import SCHEMA as OF_MODEL
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.recording import recording as of_recording
from palpate.mechanics.recording.recording import read_recording
from palpate.scenes.scene import SCHEMA as OF_SCENE
from palpate.scenes.scene import load_scene

from .support.device_bytes import STATE, tried
from .support.mutations import MUTATIONS, OF_SAMPLES

VALUES = st.recursive(
    st.booleans() | st.integers() | st.floats() | st.text(max_size=6) | st.just(10**400),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)
SEEDS = st.integers(0, 1 << 32)
few = settings(max_examples=30, deadline=None, derandomize=True)
DESCRIPTION = {
    "recording": {"sample_rate_hz": 1000.0, "force_on": "tool", "boundary_phase": [0.0, 0.1]},
    "tool": {"tip_radius_m": 0.005, "mass_kg": 0.05},
    "sensor": {"force_noise_std_n": 0.01},
    "object": {"poisson_ratio": 0.49},
}
SCENE = {
    "object": {"phantom": "block", "young_modulus_pa": 1e4},
    "inclusion": [{"name": "a", "centre_m": [0.0, 0.0, 0.01], "radius_m": 0.01, "modulus_ratio": 2.0}],
    "device": {"axes": "x,y,z", "force_scale": 1.0},
}


def places(schema, before=()):
    """Paths of keys that a schema knows, its tables too."""
    for key, form in schema.items():
        yield (*before, key)
        if not isinstance(form, FileKey) and hasattr(form, "items"):
            yield from places(form, (*before, key))


def put(table, path, value):
    """The table with a value put at a path."""
    here = table = {k: dict(v) if isinstance(v, dict) else v for k, v in table.items()}
    for key in path[:-1]:
        if not isinstance(here.get(key), dict):
            here[key] = {}
        here[key] = dict(here[key])
        here = here[key]
    here[path[-1]] = value
    return table


def one_line_or_nothing(kind, read, *given):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return read(*given)
        except kind as error:
            assert isinstance(error, PalpateError) and "\n" not in str(error).strip()
            return None


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    k = np.arange(300)
    rows = np.column_stack([1e-3 * k, 0.04 * np.sin(k / 30), 0 * k, 0 * k + 0.05, 0 * k, 0 * k, 0 * k])
    np.savetxt(
        folder / "rec.csv", rows, "%.6g", ",", header=",".join(of_recording.REQUIRED_COLUMNS), comments=""
    )
    (folder / "rec.toml").write_text(tomli_w.dumps(DESCRIPTION))
    write_model(folder / "model", block_model(40))
    (folder / "scene.toml").write_text(tomli_w.dumps(SCENE))
    return folder


@few
@given(st.sampled_from(list(places(of_recording.SCHEMA))), VALUES)
def test_any_value_of_any_key_of_a_recording(place, path, value):
    file = place / "rec.toml"
    file.write_text(tomli_w.dumps(put(DESCRIPTION, path, value)), encoding="utf-8")
    one_line_or_nothing(RecordingError, read_recording, place / "rec.csv")
    file.write_text(tomli_w.dumps(DESCRIPTION))


@few
@given(st.sampled_from(list(places(OF_SCENE))), VALUES)
def test_any_value_of_any_key_of_a_scene(place, path, value):
    file = place / "scene.toml"
    file.write_text(tomli_w.dumps(put(SCENE, path, value)), encoding="utf-8")
    one_line_or_nothing(SceneError, load_scene, file)


@few
@given(st.sampled_from(list(places(OF_MODEL))), VALUES)
def test_any_value_of_any_key_of_a_model(place, path, value):
    file = place / "model" / "model.toml"
    whole = file.read_text()
    text = tomli_w.dumps(put(tomllib.loads(whole), path, value))
    file.write_text(whole.split("\n")[0] + "\n" + text, encoding="utf-8")
    try:
        model = one_line_or_nothing(ModelError, read_model, file.parent)
    finally:
        file.write_text(whole)
    assert model is None or np.isfinite(model.material.young_modulus_pa)


@few
@given(SEEDS, st.booleans())
def test_damaged_files_of_a_recording(place, tmp_path_factory, seed, samples):
    folder = Path(shutil.copytree(place, tmp_path_factory.mktemp("damaged") / "x"))
    random = np.random.default_rng(seed)
    file = folder / ("rec.csv" if samples else "rec.toml")
    by = OF_SAMPLES if samples else MUTATIONS
    file.write_bytes(by[int(random.integers(len(by)))](file.read_bytes(), random))
    found = one_line_or_nothing(RecordingError, read_recording, folder / "rec.csv")
    assert found is None or (np.isfinite(found.position).all() and np.isfinite(found.force_on_tool).all())
    shutil.rmtree(folder)


@few
@given(SEEDS)
def test_damaged_files_of_a_model(place, tmp_path_factory, seed):
    folder = Path(shutil.copytree(place / "model", tmp_path_factory.mktemp("damaged") / "x"))
    random = np.random.default_rng(seed)
    file = sorted(folder.iterdir())[int(random.integers(len(list(folder.iterdir()))))]
    file.write_bytes(MUTATIONS[int(random.integers(len(MUTATIONS)))](file.read_bytes(), random))
    one_line_or_nothing(ModelError, read_model, folder)
    shutil.rmtree(folder)


@settings(max_examples=8, deadline=None, derandomize=True)
@given(SEEDS)
def test_hostile_bytes_of_devices(seed):
    tried(seed)


@given(st.binary(max_size=200))
@settings(max_examples=300, deadline=None, derandomize=True)
def test_no_bytes_at_all_of_devices(data):
    from palpate.devices.codecs import haply, hid_descriptor, pid, spacemouse

    spacemouse.decode(data, spacemouse.Deflection())
    haply.number(data), haply.version(data), haply.spelling(data), haply.event_fault(data)
    for read in (
        haply.decode,
        lambda d: haply.config(d, "1"),
        hid_descriptor.parse,
        pid.PidLayout.from_bytes,
    ):
        one_line_or_nothing(DeviceError, read, data)


def test_a_message_nested_by_thousands_and_one_of_no_numbers():
    from palpate.devices.codecs import haply

    for data in (b"[" * 100_000, STATE.replace(b"0.03", b"NaN"), STATE.replace(b"0.03", b"1" + b"0" * 400)):
        with pytest.raises(DeviceError):
            haply.decode(data, "049D")
    assert haply.number(b"[" * 100_000) is None


def test_a_descriptor_that_declares_gigabytes():
    from palpate.devices.codecs.hid_descriptor import parse

    for data in ("0501 77ffffff7f 9501 8102", "0501 7508 97ffffff7f 8102", "87ffff0000 7508 9501 8102"):
        with pytest.raises(DeviceError, match="impossible report"):
            parse(bytes.fromhex(data))
