"""The cache: keyed by content, checksummed, whole or absent, safe for two processes."""

from __future__ import annotations

import multiprocessing
import os

import numpy as np
import pytest

from palpate.mechanics.compliance.stored_compliance import load_or_condense
from palpate.mechanics.disk.store import content_key, load_or_build, read_arrays, write_arrays
from palpate.mechanics.errors import CacheError
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool

from ..support.waiting import PATIENCE_S

ARRAYS = {"a": np.arange(12.0).reshape(3, 4), "b": np.arange(5, dtype=np.float32), "c": np.array([7])}


def test_what_is_written_is_read_back_memory_mapped(tmp_path):
    path = tmp_path / "x.bin"
    write_arrays(path, "key", ARRAYS)
    found = read_arrays(path, "key")
    for name, array in ARRAYS.items():
        assert np.array_equal(found[name], array)
        assert found[name].dtype == array.dtype
        assert not found[name].flags.writeable
        assert not found[name].flags.owndata
    assert os.listdir(tmp_path) == ["x.bin"]


@pytest.mark.parametrize("place", [0, 9, 40, 200, -1])
def test_any_changed_byte_is_noticed(tmp_path, place):
    path = tmp_path / "x.bin"
    write_arrays(path, "key", ARRAYS)
    data = bytearray(path.read_bytes())
    data[place] ^= 0x10
    path.write_bytes(data)
    with pytest.raises(CacheError):
        read_arrays(path, "key")


@pytest.mark.parametrize("length", [0, 7, 15, 100, -1, -70])
def test_a_truncated_file_is_noticed(tmp_path, length):
    path = tmp_path / "x.bin"
    write_arrays(path, "key", ARRAYS)
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(CacheError):
        read_arrays(path, "key")


def test_damage_and_other_content_are_rebuilt(tmp_path):
    path = tmp_path / "x.bin"
    built = []

    def build():
        built.append(1)
        return ARRAYS

    load_or_build(path, "key", build)
    load_or_build(path, "key", build)
    assert len(built) == 1
    path.write_bytes(path.read_bytes()[:-3])
    load_or_build(path, "key", build)
    assert len(built) == 2
    found = load_or_build(path, "other key", build)
    assert len(built) == 3
    assert np.array_equal(found["a"], ARRAYS["a"])


def test_an_interrupted_build_leaves_nothing(tmp_path):
    def build():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        load_or_build(tmp_path / "x.bin", "key", build)
    assert os.listdir(tmp_path) == []


def test_a_folder_that_cannot_be_written_still_serves(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    found = load_or_build(blocked / "x.bin", "key", lambda: ARRAYS)
    assert np.array_equal(found["a"], ARRAYS["a"])
    assert not any(a.flags.writeable for a in found.values()), "of the type that mapped ones have"


def test_keys_tell_every_change():
    a = np.arange(6.0)
    keys = [
        content_key("v", a, 0.49),
        content_key("v", a, 0.48),
        content_key("v", a.reshape(2, 3), 0.49),
        content_key("v", a.astype(np.float32), 0.49),
        content_key("v", np.nextafter(a, 9), 0.49),
        content_key("w", a, 0.49),
    ]
    assert len(set(keys)) == len(keys)
    assert content_key("v", a.copy(), 0.49) == keys[0]


def _contend(path, value, queue):
    arrays = {"a": np.full(200_000, value)}
    for _ in range(6):
        found = load_or_build(path, f"key {value}", lambda: arrays)
        queue.put(bool((found["a"] == value).all()))


def test_two_processes_at_once_never_read_the_others_half(tmp_path):
    context = multiprocessing.get_context("spawn")
    queue = context.Queue()
    path = tmp_path / "x.bin"
    workers = [context.Process(target=_contend, args=(path, v, queue)) for v in (1, 2)]
    for worker in workers:
        worker.start()
    results = [queue.get(timeout=PATIENCE_S) for _ in range(12)]
    for worker in workers:
        worker.join(timeout=PATIENCE_S)
        assert worker.exitcode == 0
    assert all(results)
    assert os.listdir(tmp_path) == ["x.bin"]


def test_a_models_compliance_is_kept_and_follows_its_content(tmp_path, box):
    mesh = box((4, 4, 2), (0.03, 0.03, 0.02))
    model = Model(
        mesh=mesh,
        material=ObjectMaterial(20e3, 0.45),
        support=Support(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        tool=Tool(0.005),
        mesh_size_m=0.01,
    )
    write_model(tmp_path / "model", model)
    model = read_model(tmp_path / "model")
    told = []
    first = load_or_condense(model, lambda stage, share: told.append(share))
    assert told[-1] == pytest.approx(1.0)
    told.clear()
    again = load_or_condense(model.with_modulus(50e3), lambda *a: told.append(a))
    assert not told  # another modulus costs nothing
    assert np.array_equal(first.own, again.own)
    assert np.array_equal(first.blocks, again.blocks)
    ratio = np.ones(len(mesh.tetrahedra))
    ratio[0] = 1.001
    changed = load_or_condense(model.with_material(field=ratio), lambda *a: told.append(a))
    assert told
    assert not np.array_equal(first.own, changed.own)
    assert len(list((tmp_path / "model").glob("compliance-*.bin"))) == 2
