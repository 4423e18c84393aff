"""One log: what libraries say is in it, and no logger, warning or stream is off for others."""

from __future__ import annotations

import logging
import sys
import threading
import warnings

import pytest

from palpate.cli import main
from palpate.logs import LOG, on_stderr
from palpate.mechanics.disk.overheard import overheard
from palpate.mechanics.disk.surface_files import read_surface
from palpate.mechanics.disk.vtk_files import read_vtk
from palpate.mechanics.errors import ModelError, PalpateWarning, SurfaceError


@pytest.fixture
def damaged(tmp_path):
    import pyvista

    path = tmp_path / "damaged.vtu"
    pyvista.ImageData(dimensions=(4, 4, 4)).cast_to_unstructured_grid().save(path)
    path.write_bytes(path.read_bytes().replace(b"Cells>", b"Cellz>"))
    return path


@pytest.mark.parametrize(("reader", "error"), [(lambda p: read_vtk(p, ModelError), ModelError),
                                               (read_surface, SurfaceError)])  # fmt: skip
def test_reading_a_damaged_file_leaves_logging_as_it_is(damaged, reader, error, caplog, capfd, monkeypatch):
    root, handlers = logging.getLogger(), list(logging.getLogger().handlers)
    disabled: list[int] = []
    monkeypatch.setattr(logging, "disable", disabled.append)
    with caplog.at_level(logging.INFO, "palpate"), pytest.raises(error):
        reader(damaged)
    assert not any(disabled)
    assert {r.name for r in caplog.records} == {"palpate.mechanics.disk.vtk_files"}
    assert capfd.readouterr() == ("", "")
    assert root.handlers == handlers and not root.filters


def test_what_another_thread_logs_meanwhile_is_left_alone(caplog):
    with overheard(LOG.getChild("here")):
        thread = threading.Thread(target=lambda: logging.error("elsewhere"))
        thread.start()
        thread.join()
        logging.error("here")
    assert [(r.name, r.message) for r in caplog.records if r.levelno >= logging.ERROR] == [
        ("root", "elsewhere")
    ]


def test_libraries_are_heard_and_our_own_warnings_come_through(caplog):
    with caplog.at_level(logging.INFO, "palpate"), pytest.warns(PalpateWarning, match="ours"):
        with overheard(LOG):
            warnings.warn("theirs", RuntimeWarning, stacklevel=1)
            print("printed", file=sys.stderr)
            warnings.warn("ours", PalpateWarning, stacklevel=1)
    assert [r.message for r in caplog.records] == ["RuntimeWarning: theirs", "printed"]


def test_a_command_writes_the_log_from_a_level_on(capsys):
    with on_stderr("palpate x"):
        warnings.warn("ours", PalpateWarning, stacklevel=1)
        warnings.warn("theirs", RuntimeWarning, stacklevel=1)
        LOG.getChild("a.b").info("unsaid")
    first, second = capsys.readouterr().err.splitlines()
    assert first == "palpate x: warning: ours" and "RuntimeWarning: theirs" in second
    with on_stderr("palpate x", "info"):
        LOG.getChild("a.b").info("said\ntwice")
    assert capsys.readouterr().err == "palpate x: info: a.b: said twice\n"
    assert not LOG.handlers and LOG.level == logging.NOTSET


def test_a_command_takes_its_level(tmp_path, capsys):
    words = ["check", "silicone-1-cylinder", "--json", str(tmp_path / "check.json")]
    assert main([*words, "--log-level", "debug"]) == 0
    loud = capsys.readouterr().err
    assert f"debug: mechanics.disk.writing: written: {tmp_path / 'check.json'}" in loud
    assert main(words) == 0
    assert capsys.readouterr().err == ""
    assert main([*words, "--log-level", "loud"]) == 2
