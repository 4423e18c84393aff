"""Nothing is half written, mixed or taken damaged from a disk that is full, shared or faulty."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import warnings

import numpy as np
import pytest

from palpate.mechanics.disk.scratch import remove_left, sweep, temporary_prefix
from palpate.mechanics.disk.store import read_arrays, write_arrays
from palpate.mechanics.disk.writing import (
    JSON,
    Kind,
    atomic_file,
    check_room,
    check_target,
    sole_writer,
    temporary_folder,
)
from palpate.mechanics.errors import CacheError, FileError
from palpate.mechanics.model.files import MODEL, read_model, write_model
from palpate.mechanics.recording.recording import read_recording

from .inputs import block, command, contents, full_disk, one_line


def test_no_bit_of_a_stored_file_changes_unnoticed(tmp_path):
    """Of the header every seventh bit, so that no byte is left out."""
    path = tmp_path / "x.bin"
    arrays = {"far": np.arange(600.0).reshape(-1, 3), "own": np.arange(50, dtype=np.float32)}
    write_arrays(path, "key", arrays)
    whole = path.read_bytes()
    header = len(whole) - sum(a.nbytes for a in arrays.values()) - 64
    rng = np.random.default_rng(1)
    places = [*range(0, 8 * header, 7), *rng.integers(8 * header, 8 * len(whole), 200).tolist()]
    for place in places:
        data = bytearray(whole)
        data[place // 8] ^= 1 << place % 8
        path.write_bytes(data)
        with pytest.raises(CacheError):
            read_arrays(path, "key")
    path.write_bytes(whole)
    assert np.array_equal(read_arrays(path, "key")["far"], arrays["far"])


def test_a_write_that_fails_leaves_what_was_there(folder, record, tmp_path):
    from palpate.mechanics.recording.recording import write_recording
    from palpate.render.replay import write_forces
    from palpate.show.page import Page

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
    full = shutil.disk_usage("/")._replace(free=1000)
    monkeypatch.setattr("palpate.mechanics.disk.writing.shutil.disk_usage", lambda _: full)
    with pytest.raises(FileError, match="set PALPATE_CACHE to a folder on another disk"):
        check_room(tmp_path / "deep" / "laboratory", 1 << 20)
    assert not list(tmp_path.iterdir()), "an empty folder is left"
    with pytest.raises(FileError, match="set TMPDIR to a folder on another disk") as error:
        with temporary_folder("x-"):
            pytest.fail("nothing can be written there")
    one_line(error)


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
    monkeypatch.setattr("palpate.mechanics.disk.scratch._swept", set())
    (tmp_path / f"{ours}mesh-x").mkdir()
    command("press", "nothing", "--at", "0,0,0", "--direction", "0,0,-1", "--depth", "0.001")
    assert not list(tmp_path.glob("*mesh-x")), "whatever command is next sweeps the scratch files"
    with temporary_folder("x-") as scratch:
        (scratch / "a").touch()
    assert not scratch.exists()


def test_atomic_writes_follow_links_and_leave_them(tmp_path):
    (tmp_path / "real.json").write_text("{}")
    (tmp_path / "link.json").symlink_to("real.json")
    with atomic_file(tmp_path / "link.json", JSON) as temporary:
        temporary.write_text("[1]")
    assert (tmp_path / "link.json").is_symlink() and (tmp_path / "real.json").read_text() == "[1]"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not [p for p in tmp_path.iterdir() if p.name.startswith(".palpate")]


def test_what_an_ended_process_was_writing_is_removed_and_nothing_else(tmp_path):
    ended, other = (tmp_path / (temporary_prefix(process=pid) + "table.bin") for pid in (41, 412))
    for path in (ended, other, tmp_path / "model.toml"):
        path.write_text("")
    remove_left(tmp_path, 41)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([other.name, "model.toml"])
