"""The command line: help everywhere, exit codes, one line an error, options generated from dataclasses."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from palpate import cli
from palpate.mechanics.errors import OptionError
from palpate.mechanics.kernel_cache import ROOMS, sources
from palpate.mechanics.options import option
from palpate.operations._call import Call
from palpate.operations._declare import operation
from palpate.operations._list import commands
from palpate.operations._to_argparse import OneLineParser, add_operation, vector
from palpate.output import emit_json


@dataclass(frozen=True)
class SampleOptions:
    mesh_size_m: float = option(0.01, "edge length", unit="m", flag="--mesh-size")
    surface: str = option("auto", "which surface", choices=("auto", "hull"))
    threshold_n: float | None = option(None, "contact threshold", unit="N")
    holds: bool = option(True, "use holds")
    repeats: int = option(3, "how many")


@operation(json=False)
def sample(*, options: SampleOptions) -> SampleOptions:
    return options


def parse(*words: str) -> SampleOptions:
    parser = argparse.ArgumentParser()
    add_operation(parser, sample.operation)
    return sample.operation.run(vars(parser.parse_args(words)), Call())


@pytest.mark.parametrize("joint", [" ", "="])
def test_values_that_begin_with_a_minus_are_taken_as_typed(joint):
    parser = OneLineParser()
    for flag, kind in (("--at", vector), ("--up", str), ("--axes", str), ("--offset", float)):
        parser.add_argument(flag, type=kind)
    parser.add_argument("--holds", action="store_true")
    words = f"--holds --at{joint}-0.01,0,0.02 --up{joint}-z --axes{joint}-y,x,z --offset{joint}-.5".split(" ")
    found = parser.parse_args(words)
    assert found.at.tolist() == [-0.01, 0, 0.02]
    assert (found.up, found.axes, found.offset, found.holds) == ("-z", "-y,x,z", -0.5, True)
    with pytest.raises(OptionError):
        parser.parse_args(["--up", "--holds"])


def test_options_become_flags_and_come_back():
    assert parse() == SampleOptions()
    given = parse(
        "--mesh-size", "0.005", "--surface", "hull", "--threshold", "1", "--no-holds", "--repeats", "4"
    )
    assert given == SampleOptions(0.005, "hull", 1.0, False, 4)


@pytest.mark.parametrize("words", [("--surface", "cube"), ("--mesh-size", "nan"), ("--mesh-size", "wide")])
def test_bad_option_values_exit_with_2(words, capsys):
    with pytest.raises(SystemExit) as stop:
        parse(*words)
    assert stop.value.code == 2


@pytest.mark.parametrize("name", commands())
def test_every_command_is_there_or_says_so(name, capsys):
    try:
        code = cli.main([name, "--help"])
    except SystemExit as stop:
        assert stop.code == 0
        assert "--help" in capsys.readouterr().out
    else:
        assert code == 2
        assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_an_unknown_command_lists_what_is_allowed(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["reconstrct"])
    assert stop.value.code == 2
    assert "reconstruct" in capsys.readouterr().err


def test_top_level_help_is_quick_to_import():
    heavy = "{'numba', 'pyvista', 'matplotlib'} & set(sys.modules)"
    code = f"import sys, palpate.cli; sys.exit(bool({heavy}))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_json_holds_no_nan_and_is_alone_on_stdout(tmp_path, capsys):
    emit_json({"a": np.array([1.0, np.nan]), "b": np.int64(3)}, "-")
    assert json.loads(capsys.readouterr().out) == {"a": [1.0, None], "b": 3}
    emit_json({"a": 1}, str(tmp_path / "x.json"))
    assert json.loads((tmp_path / "x.json").read_text()) == {"a": 1}


def test_a_python_without_a_library_is_told_in_one_line(tmp_path):
    """Such as the system's own, beside a copy of the package: no site-packages."""
    (tmp_path / "palpate").mkdir()
    packages = {name: Path(sources()[f"palpate.{name}"]).parent for name in ROOMS}
    shell = {path.name: path for path in Path(cli.__file__).parent.iterdir() if path.name != "__pycache__"}
    for name, path in (shell | packages).items():
        (tmp_path / "palpate" / name).symlink_to(path)
    words = [sys.executable, "-S", "-m", "palpate", "check", "x.csv"]
    said = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert said.returncode == 2
    assert said.stderr.startswith("palpate: the library '") and said.stderr.count("\n") == 1


def test_a_missing_part_of_the_program_itself_is_no_matter_of_installing(monkeypatch):
    def load(argv):
        raise ModuleNotFoundError("no", name="palpate.nothing")

    monkeypatch.setattr(cli, "_loaded", load)
    with pytest.raises(ModuleNotFoundError):
        cli.main(["check", "x.csv"])


def test_a_request_to_end_waits_until_a_library_is_loaded():
    import signal

    from palpate.child import loaded_whole

    loaded = []
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), loaded_whole():
            signal.raise_signal(signal.SIGINT)
            loaded.append("whole")
    finally:
        signal.signal(signal.SIGINT, before)
    assert loaded == ["whole"]
