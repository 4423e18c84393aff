"""`palpate bench` finds the benchmarks of the clone that it is run in, and nothing outside of one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.evidence import Figure, read
from palpate import cli
from palpate.operations.bench import clone, names

CLONE = Path(__file__).resolve().parents[2]


def test_outside_of_a_clone_it_says_so_in_a_line(tmp_path):
    words = [sys.executable, "-P", "-m", "palpate", "bench", "contacts"]
    ended = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 2, ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1
    assert "clone" in ended.stderr and not ended.stdout


def test_inside_a_folder_of_the_clone_it_is_found(monkeypatch):
    monkeypatch.chdir(CLONE / "docs" / "decisions")
    assert clone() == CLONE
    promised = {"contacts", "one-d", "modulus", "compliance", "servo", "diagnose"}
    assert promised <= set(names()) and not {"timing", "evidence"} & set(names())


def test_an_unknown_name_lists_what_is_allowed(monkeypatch, capsys):
    monkeypatch.chdir(CLONE)
    assert cli.main(["bench", "nothing"]) == 2
    assert "allowed are batch, calibrate" in capsys.readouterr().err


def test_evidence_is_kept_where_it_is_wanted(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(CLONE)
    path = tmp_path / "one-d.json"
    assert cli.main(["bench", "one-d", "--repeats", "1", "--evidence", str(path)]) == 0
    kept = read(path)
    assert kept.command == "palpate bench one-d --repeats 1"
    assert any("bounded, robust" in figure.what for figure in kept.figures)


def test_the_command_that_is_kept_holds_no_place_of_a_machine(monkeypatch, tmp_path):
    monkeypatch.chdir(CLONE)
    monkeypatch.setattr("benchmarks.diagnose_real.run", lambda _: {"figures": [Figure("ratio", 0.5)]})
    path, data = tmp_path / "real.json", str(tmp_path)
    words = ["bench", "diagnose-real", "--data", data, "--sets", "fish", f"--evidence={path}"]
    assert cli.main(words) == 0
    assert read(path).command == "palpate bench diagnose-real --sets fish"


def test_every_benchmark_has_help(monkeypatch, capsys):
    monkeypatch.chdir(CLONE)
    for name in names():
        with pytest.raises(SystemExit) as end:
            cli.main(["bench", name, "--help"])
        assert end.value.code == 0
        assert "--evidence" in capsys.readouterr().out, name


def test_a_process_of_its_own_finds_the_benchmarks_too(monkeypatch, tmp_path):
    monkeypatch.chdir(CLONE)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    seen = tmp_path / "seen"

    def run(_):
        words = [sys.executable, "-P", "-c", "import benchmarks.evidence as e; print(e.__file__)"]
        seen.write_text(subprocess.run(words, cwd=tmp_path, capture_output=True, text=True).stdout)
        return {"figures": []}

    monkeypatch.setattr("benchmarks.contacts.run", run)
    assert cli.main(["bench", "contacts"]) == 0
    assert seen.read_text().startswith(str(CLONE))
