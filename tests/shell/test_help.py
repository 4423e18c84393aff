"""The words of every command's `--help`, in one order; and what a shell completes."""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys

import pytest

from palpate import cli
from palpate.mechanics.names import near, unknown
from palpate.operations._list import commands
from palpate.operations._run import command_operation, parser_of
from palpate.operations._to_argparse import in_order
from palpate.operations.completion import SHELLS, completion

UNITS = {"m", "n", "s", "hz", "pa", "kg", "n/m", "m/s", "mm", "deg", "rad", "n/s", "n_s/m", "m_per_s", "1"}


CONTRACT = {
    "demo": "--fast",
    "reconstruct": "-o --method --mesh-size --poisson-ratio --contact-threshold --indentation --surface",
    "replay": "-o --renderer",
    "press": "--at --direction --depth --speed -o --expect --tolerance",
    "compare": "--model",
    "diagnose": "--model --apply",
    "touch": "--device --headless --seconds --record",
    "simulate": "-o --effect --seal --truth",
    "batch": "-o --do --scheduler",
    "import": "-o",
    "export": "--to -o",
    "calibrate": "-o",
    "open": "--shape --slab --half-space --sink --poisson-ratio --rate --tip --tip-radius --tip-angle",
}
"""Flags that others were promised: help always shows them."""
RANDOM = ("reconstruct", "compare", "diagnose", "touch", "simulate", "batch", "explore", "open", "material")


@pytest.mark.parametrize("name", commands())
def test_help_shows_what_most_use_and_all_that_was_promised(name):
    parser = parser_of(name)
    short, whole = parser.format_help(), getattr(parser, "format_all_help", parser.format_help)()
    flags = {f: a for a in parser._actions for f in a.option_strings}
    shown = {a for a in flags.values() if not getattr(a, "advanced", False)}
    assert len(shown) <= 16, "ten of its own, and --help, --help-all, --json, --seed, what was promised"
    for flag in CONTRACT.get(name, "").split() + ["--seed"] * (name in RANDOM):
        assert flags[flag] in shown and flag in short
    assert all(re.search(rf"{flag}\b", whole) for flag in flags)
    hidden = [f for f, a in flags.items() if a not in shown]
    assert not [f for f in hidden if re.search(rf"(?<![\w-]){f}(?![\w-])", short.partition("options:")[2])]
    assert bool(hidden) == (f": palpate {name} --help-all" in short)
    operation, _ = command_operation(name)
    assert operation.common <= {f for f in operation.fields if f not in operation.own}


def test_help_all_ends_well(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["press", "--help-all"])
    assert not stop.value.code and "--snap-to-touches" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["tuch"], "touch"),
        (["press", "demo", "--att", "0,0,0"], "--at"),
        (["press", "demo", "--spede=1"], "--speed"),
        (["press", "demo", "--at", "0,0,0", "--renderer", "fme"], "fem"),
        (["press", "noduel", "--at", "0,0,0"], "nodule"),
        (["simulate", "block", "-o", "x.csv", "--effect", "friction-slipp=1"], "friction_slip"),
        (["diagnose", "silicone-1-cylinder", "--without", "frction"], "friction_slip"),
        (["touch", "--headless", "--device", "simulted"], "simulated"),
    ],
)
def test_an_error_suggests_the_name_that_was_meant_in_one_line(words, meant, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    try:
        code = cli.main(words)
    except SystemExit as stop:
        code = stop.code
    said = capsys.readouterr().err.strip().splitlines()
    assert code == 2 and re.search(rf"(?<![\w-]){meant}\?", said[-1]) and len(said) == 1


def test_what_is_like_nothing_is_answered_with_what_is_allowed():
    assert near("zzz", commands()) == []
    assert unknown("zzz", "command", ["a", "b"]) == "'zzz' is no command; allowed are a, b"
    assert near("MESH-SIZE-M", ["mesh_size_m"]) == ["mesh_size_m"]


@pytest.mark.parametrize("name", commands())
def test_help_says_units_before_defaults_and_nothing_that_only_python_has(name):
    parser = parser_of(name)
    text = " ".join(getattr(parser, "format_all_help", parser.format_help)().split())
    assert "(default: )" not in text and "(default: None)" not in text and "SUPPRESS" not in text
    assert not re.search(r"\bNone\b", text)
    assert not re.search(r"\(default: [^()]*\) \[", text), "a unit stands after the default"
    for action in parser._actions:
        if action.help is argparse.SUPPRESS or not action.option_strings:
            continue
        words = in_order(action.help or "")
        assert words and not words.startswith("("), f"{action.option_strings} has no words"
        shown = parser._get_formatter()._format_args(action, "VALUE")
        assert shown.lower() not in UNITS, f"{action.option_strings}: the unit belongs in brackets"
        unit = re.search(r"\[([^\]]+)\]", words)
        ending = action.option_strings[0].rsplit("-", 1)[-1]
        assert not (unit and ending == unit[1].lower() and ending in UNITS), f"{action.option_strings[0]}"


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("edge (default: 0.01) [m]", "edge [m] (default: 0.01)"),
        ("the shape's file (default: )", "the shape's file"),
        ("a place; None: as reconstructed [m] (default: None)", "a place [m] (default: as reconstructed)"),
        ("slip; default: the model's [1] (default: None)", "slip [1] (default: the model's)"),
        ("which one; '' for the first (default: )", "which one (default: the first)"),
        ("socket; '' for none (default: ws://here)", "socket; '' for none (default: ws://here)"),
        ("use holds (default: True)", "use holds (default: yes)"),
    ],
)  # fmt: skip
def test_words_are_put_in_order(said, told):
    assert in_order(said) == told


def test_a_flag_has_one_spelling_without_its_unit():
    parser = parser_of("reconstruct")
    given = parser.parse_args(["REC", "-o", "MODEL", "--least-duration", "0.1"])
    assert given.least_duration_s == 0.1
    assert not any("--least-duration-s" in action.option_strings for action in parser._actions)


def test_the_list_is_shown_as_it_stands():
    shown = cli._top_parser().format_help()
    assert all(
        re.search(rf"^  {name} +{re.escape(words)}$", shown, re.M) for name, words in commands().items()
    )


@pytest.mark.parametrize("shell", SHELLS)
def test_a_shell_is_told_to_ask_the_program(shell):
    text = completion(shell)
    assert "palpate" in text and "_ARGCOMPLETE" in text


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("palpate reco", {"reconstruct"}),
        ("palpate reconstruct --mesh-si", {"--mesh-size"}),
        ("palpate press --renderer kel", {"kelvin-voigt"}),
    ],
)
def test_what_is_typed_is_completed(line, expected, tmp_path):
    answer = tmp_path / "answer"
    environment = dict(
        os.environ,
        _ARGCOMPLETE="1",
        _ARGCOMPLETE_IFS="\n",
        _ARGCOMPLETE_STDOUT_FILENAME=str(answer),
        COMP_LINE=line,
        COMP_POINT=str(len(line)),
    )
    done = subprocess.run(
        [sys.executable, "-m", "palpate"], env=environment, capture_output=True, text=True, cwd=tmp_path
    )
    assert {word.strip() for word in answer.read_text().split()} == expected, done.stderr


@pytest.mark.skipif(not shutil.which("bash"), reason="needs bash")
def test_bash_takes_the_script():
    words = completion("bash") + "\ncomplete -p palpate"
    done = subprocess.run(["bash", "-c", words], capture_output=True, text=True, check=True)
    assert "_python_argcomplete" in done.stdout
